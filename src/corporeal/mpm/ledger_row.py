"""One frame's row of the ledger: what the engine measured, and distances taken from positions."""

from dataclasses import fields

import numpy as np

from corporeal.mpm.gaps import pair_gaps, plane_depth
from corporeal.mpm.problem import Measure, Problem, Snapshot, Steps


def ledger_row(
    problem: Problem, now: Snapshot, measure: Measure, steps: Steps
) -> dict[str, np.ndarray]:
    """Everything the audit needs of one instant; B bodies, W planes.

    All of ``Measure`` under its own names (``lost`` as a number of particles), and ``flow`` Σ m|v|
    per body [kg m/s], ``rms_speed`` per body [m/s], ``gap`` and ``overlap`` (B, B) [m],
    ``plane_depth`` (W, B) [m], ``steps`` [-], ``dt_min`` and ``dt_max`` [s], ``nan`` [-].
    """
    row: dict[str, np.ndarray] = {
        f.name: np.asarray(getattr(measure, f.name)) for f in fields(Measure)
    }
    row["lost"] = np.array(np.count_nonzero(measure.lost))
    ends = np.cumsum([len(b.position) for b in problem.bodies])[:-1]
    position = np.split(now.position, ends)
    speed = np.split(np.linalg.norm(now.velocity, axis=1), ends)
    mass = [b.volume * b.density for b in problem.bodies]
    row["flow"] = np.array([m @ v for m, v in zip(mass, speed, strict=True)])
    row["rms_speed"] = np.array(
        [np.sqrt(m @ v**2 / m.sum()) for m, v in zip(mass, speed, strict=True)]
    )
    row["gap"], row["overlap"] = pair_gaps(position, problem.cell)
    row["plane_depth"] = plane_depths(problem, now)
    row["steps"] = np.array(steps.count)
    row["dt_min"], row["dt_max"] = np.array(steps.smallest), np.array(steps.largest)
    finite = np.isfinite(now.position).all(axis=1) & np.isfinite(now.motion).all(axis=(1, 2))
    row["nan"] = np.array(np.count_nonzero(~finite))
    return row


def plane_depths(problem: Problem, now: Snapshot) -> np.ndarray:
    """How deep each body reaches into each plane (W, B) [m]; rigid ones by their surfaces."""
    depths = np.zeros((len(problem.planes), len(problem.bodies)))
    start = 0
    for b, body in enumerate(problem.bodies):
        mine = slice(start, start := start + len(body.position))
        points, stretch = now.position[mine], now.motion[mine]
        if body.rigid:
            stretch = now.deformation[mine]
        if body.rigid and len(body.surface):
            points, stretch = carried(body.surface, body.position, points, stretch[0]), None
        for w, plane in enumerate(problem.planes):
            depths[w, b] = plane_depth(points, plane, stretch, problem.cell)
    return depths


def carried(
    points: np.ndarray, start: np.ndarray, now: np.ndarray, rotation: np.ndarray
) -> np.ndarray:
    """Points that turn with a rigid body whose particles went from ``start`` to ``now`` [m]."""
    return (points - start.mean(axis=0)) @ rotation.T + now.mean(axis=0)
