"""Native clock: its data on bodies, and its time slice between returns to Python."""

import time

import numpy as np

from corporeal.mpm.constants import TINY
from corporeal.mpm.cpu.layout import BODY_LOAD_RECORD
from corporeal.mpm.physics.prescribed_motion import PathFollower
from corporeal.mpm.problem import Problem


def body_loads(
    problem: Problem, rigid: dict[int, np.ndarray], rows: dict[int, np.ndarray], paths: dict[int, PathFollower]
) -> np.ndarray:
    """Record of every body its mass, push, path, rigid state, and where its materials stand.

    Args:
        problem: What to simulate.
        rigid: States of rigid bodies.
        rows: Body of every row of each field's table of materials, in order.
        paths: Of bodies with prescribed motion; they must stay alive.
    """
    records = np.zeros(len(problem.bodies), BODY_LOAD_RECORD.dtype)
    for b, body in enumerate(problem.bodies):
        record, field = records[b], 0 if problem.contact == "single" else b
        # Not ``@``, whose last digits hang on how many threads BLAS has.
        record["mass"] = np.einsum("p,p->", body.volume, body.density)
        if body.push is not None:
            record["push"] = body.push.acceleration
            record["start"], record["end"] = body.push.start, body.push.end
        if b in rigid:
            record["rigid"] = rigid[b].ctypes.data
        if b in paths:
            record["path"], record["paths"] = paths[b].rows.ctypes.data, len(paths[b].rows)
            record["arm"] = paths[b].arm
        if field in rows:
            record["field"] = field
            record["first"], record["last"] = np.searchsorted(rows[field], [b, b + 1])
    return records


class StepBatch:
    """Chooses how many steps to take at once, so that they last about as long as asked."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.steps = 16

    def __enter__(self) -> None:
        """Look at the clock."""
        self.start = time.monotonic()

    def __exit__(self, *_: object) -> None:
        """Look again."""
        took = max(time.monotonic() - self.start, TINY)
        self.steps = int(np.clip(self.steps * min(4.0, self.seconds / took), 1, 10**6))
