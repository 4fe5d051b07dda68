"""One frame's row of the ledger: measurements of the engine, and distances of positions."""

from dataclasses import fields

import numpy as np

from corporeal.core.types import Ledger
from corporeal.mpm.physics.body_distance import pair_gaps, plane_depth
from corporeal.mpm.problem import Diagnostics, Problem, Snapshot, StepStatistics


def ledger_row(problem: Problem, now: Snapshot, measure: Diagnostics, steps: StepStatistics) -> Ledger:
    """Return the ledger's row of one instant.

    The bodies of one object, its soft material and the frames bonded to it, are added up.
    """
    # What is known of each body: what the engine measured, speeds, depths in planes.
    ends = np.cumsum([len(b.position) for b in problem.bodies])[:-1]
    position = np.split(now.position, ends)
    speed = np.split(np.linalg.norm(now.velocity, axis=1), ends)
    mass = [b.volume * b.density for b in problem.bodies]
    found = {f.name: np.asarray(getattr(measure, f.name)) for f in fields(Diagnostics)}
    found["lost"] = np.array(np.count_nonzero(measure.lost))
    # Not ``@``: that is a sum of as many parts as BLAS has threads, which spin while they wait.
    carried_on = [np.einsum("p,p->", m, v) for m, v in zip(mass, speed, strict=True)]
    squares = [np.einsum("p,p->", m, v**2) for m, v in zip(mass, speed, strict=True)]
    found["flow"] = np.array(carried_on)
    found["rms_speed"] = np.sqrt(np.array(squares) / [m.sum() for m in mass])
    found["plane_depth"] = plane_depths(problem, now)
    # What has a prescribed motion may reach into walls, and into others that do.
    prescribed = np.array([body.path is not None for body in problem.bodies])
    found["plane_depth"][:, prescribed] = 0.0
    # The bodies of one object become one.
    group = object_of_body(problem)
    squeezed = np.split(volume_shares(now), ends)
    if problem.bonds or problem.excluded_pairs:
        found |= sum_by_object(found, group)
        one = [np.flatnonzero(group == k) for k in range(group.max() + 1)]
        position = [np.concatenate([position[b] for b in bodies]) for bodies in one]
        squeezed = [np.concatenate([squeezed[b] for b in bodies]) for bodies in one]
    # Distances between objects, and how time was cut.
    gap, overlap = pair_gaps(position, problem.cell, squeezed)
    if prescribed.any():
        moved = np.isin(np.arange(len(gap)), group[prescribed])
        overlap = np.where(moved[:, None] & moved, 0.0, overlap)
    finite = np.isfinite(now.position).all(axis=1) & np.isfinite(now.motion).all(axis=(1, 2))
    return Ledger(
        **found,
        gap=gap,
        overlap=overlap,
        steps=np.array(steps.count),
        dt_min=np.array(steps.smallest),
        dt_max=np.array(steps.largest),
        nan=np.array(np.count_nonzero(~finite)),
    )


def volume_shares(now: Snapshot) -> np.ndarray:
    """Volume of every particle over its volume at rest (P,), at most 1.

    Lost or inverted particles have 1, so that failures don't hide overlaps.
    """
    share = np.linalg.det(now.motion)
    return np.where(share > 0.0, np.minimum(share, 1.0), 1.0)


def plane_depths(problem: Problem, now: Snapshot) -> np.ndarray:
    """Penetration of each body into each plane (W, B) [m]; rigid ones by their surfaces."""
    depths = np.zeros((len(problem.planes), len(problem.bodies)))
    start = 0
    for b, body in enumerate(problem.bodies):
        mine = slice(start, start := start + len(body.position))
        points, stretch = now.position[mine], now.motion[mine]
        if body.rigid:
            stretch = now.deformation[mine]
        if body.rigid and len(body.surface):
            points, stretch = (rotate_with_body(body.surface, body.position, points, stretch[0]), None)
        for w, plane in enumerate(problem.planes):
            depths[w, b] = plane_depth(points, plane, stretch, problem.cell)
    return depths


def rotate_with_body(points: np.ndarray, start: np.ndarray, now: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Points that turn with a rigid body whose particles went from ``start`` to ``now`` [m]."""
    return (points - start.mean(axis=0)) @ rotation.T + now.mean(axis=0)


def object_of_body(problem: Problem) -> np.ndarray:
    """Return which object each body is of (B,): bodies held together or kept apart are of one."""
    first = {max(pair): min(pair) for pair in (*problem.bonds, *problem.excluded_pairs)}
    group: list[int] = []
    for b in range(len(problem.bodies)):
        group.append(group[first[b]] if b in first else max(group, default=-1) + 1)
    return np.array(group)


def sum_by_object(row: dict[str, np.ndarray], group: np.ndarray) -> dict[str, np.ndarray]:
    """Return sums over bodies with one entry per object, by the names of ``Ledger``."""
    share = (group == np.arange(group.max() + 1)[:, None]).astype(float)
    mass = share @ row["mass"]
    found = {name: share @ row[name] for name in SUMMED_QUANTITIES}
    found["centre"] = (share * row["mass"]) @ row["centre"] / mass[:, None]
    found["rms_speed"] = np.sqrt((share * row["mass"]) @ row["rms_speed"] ** 2 / mass)
    found["plane_impulse"] = np.einsum("ob,wbk->wok", share, row["plane_impulse"])
    deepest = [row["plane_depth"][:, group == k].max(axis=1) for k in range(len(share))]
    found["plane_depth"] = np.stack(deepest, axis=1)
    found["pair_impulse"] = sum_by_object_pair(row["pair_impulse"], group)
    planes = len(row["first_contact"]) - len(group)
    names = np.concatenate([group, group.max() + 1 + np.arange(planes)])
    found["impact_of_pair"] = sum_by_object_pair(row["impact_of_pair"], names)
    return found | object_contact_times(row, names)


def sum_by_object_pair(table: np.ndarray, name: np.ndarray) -> np.ndarray:
    """Add up what pairs of bodies have by pairs of objects; within one object it is 0."""
    share = (name == np.arange(name.max() + 1)[:, None]).astype(float)
    between = share @ table @ share.T
    return between - np.diag(np.diag(between))


SUMMED_QUANTITIES = "mass momentum angular_momentum kinetic elastic potential external_impulse flow".split()


def object_contact_times(row: dict[str, np.ndarray], name: np.ndarray) -> dict[str, np.ndarray]:
    """First and last contact of every pair of objects, of which some are several bodies."""
    count = name.max() + 1
    first, last = np.full((2, count, count), np.nan)
    point = np.full((count, count, 3), np.nan)
    for i, j in np.argwhere(np.isfinite(row["first_contact"])):
        a, c = name[i], name[j]
        if a == c:
            continue
        if not row["first_contact"][i, j] >= first[a, c]:
            first[a, c], point[a, c] = row["first_contact"][i, j], row["contact_point"][i, j]
        last[a, c] = np.fmax(last[a, c], row["last_contact"][i, j])
    return {"first_contact": first, "last_contact": last, "contact_point": point}
