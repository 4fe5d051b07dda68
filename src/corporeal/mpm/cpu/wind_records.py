"""What the native piece of the loads reads: one record for every body in the wind."""

import numpy as np

from corporeal.mpm.cpu.contact_memory import point
from corporeal.mpm.cpu.layout import BLOW
from corporeal.mpm.physics import wind
from corporeal.mpm.problem import Body, Problem

SIGNAL = np.stack([wind.GUST_SHARE, wind.GUST_FREQUENCY, wind.GUST_PHASE])
"""Of the gusts: share, frequency [Hz] and phase [rad] of every part."""


class Blows:
    """Records of the bodies in the wind, and the arrays that they point to."""

    def __init__(
        self,
        problem: Problem,
        first: list[int],
        impulse: np.ndarray,
        rigid: dict[int, np.ndarray],
        points: dict[int, np.ndarray],
    ) -> None:
        """Lay out memory.

        Args:
            problem: What to simulate.
            first: Number of each body's first particle.
            impulse: The ledger's external impulses, which the native piece adds to.
            rigid: States of the rigid bodies.
            points: Particles of the rigid bodies in their own frames.

        """
        blown = [b for b, body in enumerate(problem.bodies) if body.wind and len(body.faces.area)]
        self.body = blown
        self.record = np.zeros(len(blown), BLOW.dtype)
        self.kept: list[np.ndarray] = [np.ascontiguousarray(SIGNAL)]
        single = problem.contact == "single"
        for row, b in zip(range(len(blown)), blown, strict=True):
            record = self.record[row : row + 1]
            self._face(record, problem.bodies[b])
            point(record, impulse=impulse[b], signal=self.kept[0])
            record["field"], record["first"] = 0 if single else b, first[b]
            if b in rigid:
                self.kept.append(np.ascontiguousarray(points[b]))
                point(record, rigid=rigid[b], point=self.kept[-1])
                record["free"] = not single

    def _face(self, record: np.ndarray, body: Body) -> None:
        assert body.wind is not None
        count = len(body.position)
        order = np.argsort(body.faces.particle, kind="stable")
        area = np.ascontiguousarray(body.faces.area[order], np.float64)
        owned = np.bincount(body.faces.particle, minlength=count)
        face = np.concatenate([[0], np.cumsum(owned)]).astype(np.int32)
        self.kept += [area, face]
        point(record, area=area, face=face)
        record["count"], record["wind"] = count, body.wind.velocity
        record["gust"] = body.wind.gust
        record["start"], record["end"] = body.wind.start, body.wind.end
        record["half_rho_c"] = wind.HALF_RHO_C

    def blow(self, problem: Problem) -> None:
        """Take the winds of a problem that differs in nothing else."""
        for row, b in enumerate(self.body):
            moving = problem.bodies[b].wind
            assert moving is not None
            self.record["wind"][row], self.record["gust"][row] = moving.velocity, moving.gust
            self.record["start"][row], self.record["end"][row] = moving.start, moving.end

    def take_work(self) -> float:
        """Work done since it was last taken [J]."""
        total = float(self.record["work"].sum())
        self.record["work"] = 0.0
        return total
