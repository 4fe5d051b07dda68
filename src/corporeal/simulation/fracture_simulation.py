"""Simulated fracture: objects struck with ten times the energy they withstand become fragments.

The run is taken back to just before the two touch, what the wall bears until it breaks is taken from the impact, and
the object becomes rigid pieces that move on as it did (decision fracture-pieces). The momentum of the pieces is that of
the whole.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from corporeal.core.types import FractureEvent, Surface
from corporeal.geometry.mesh import join_meshes
from corporeal.geometry.point_sampling import sample_surface
from corporeal.geometry.voronoi_fragments import cut_fragments, fragment_cells, fragment_seeds
from corporeal.mpm.engines import require
from corporeal.mpm.problem import BodySplit, BodySplittingEngine, Engine, InteractiveEngine, Snapshot
from corporeal.mpm.split_body import can_split
from corporeal.simulation.fracture_prediction import BrittleImpact, encloses_cavity, first_impacts, piece_objects
from corporeal.simulation.fracture_state import FractureState
from corporeal.simulation.impact_fracture import CERTAIN_BREAK_ENERGY_RATIO
from corporeal.simulation.trajectory_files import gather_ledgers, read_ledger

STEPS_BEFORE_IMPACT = 2.0
"""Steps before the first touch in which the pieces are made."""
PIECE_CONTACT_POINTS = 1200
"""Contact points on all pieces together, beside their corners."""


@dataclass(frozen=True)
class FracturedRun:
    """A run with one more fractured object."""

    stage: FractureState
    engine: Engine
    breaks: tuple[FractureEvent, ...]


def next_breaking_impact(
    stage: FractureState, breaks: Sequence[FractureEvent], whole: set[int], folder: Path, number: int, since: float
) -> BrittleImpact | None:
    """Return the first fracturing impact since a time [s], if any.

    Args:
        stage: What is simulated.
        breaks: Earlier fractures; fragments don't break again.
        whole: Objects that cannot be cut.
        folder: Where the frames are.
        number: Of the last one.
        since: [s]
    """
    now = read_ledger(folder, number).first_contact
    if not np.any(now > since):
        return None
    trajectory = gather_ledgers(folder, number + 1)
    spared = piece_objects(breaks, len(stage.scene.objects)) | whole
    found = [
        impact
        for impact in first_impacts(stage.scene, stage.particles, stage.field, trajectory)
        if impact.found.time > since and impact.found.ratio > CERTAIN_BREAK_ENERGY_RATIO and impact.object not in spared
    ]
    return min(found, key=lambda impact: impact.found.time, default=None)


def fracture_body(
    stage: FractureState, engine: Engine, impact: BrittleImpact, breaks: tuple[FractureEvent, ...]
) -> FracturedRun | None:
    """Replace the struck object by fragments just before the impact; None: it cannot be cut.

    Args:
        stage: What is simulated.
        engine: At an instant before the impact; goes on to just before it.
        impact: The impact.
        breaks: Earlier fractures.

    Raises:
        UserError: The engine cannot break bodies.
    """
    owner = stage.posed.object_of_body
    (bodies,) = np.nonzero(owner == impact.object)
    parts = np.unique(stage.particles.part[stage.particles.object == impact.object])
    if len(bodies) != 1 or len(parts) != 1 or not can_split(engine.problem, int(bodies[0])):
        return None
    body = int(bodies[0])
    before = impact.found.time - STEPS_BEFORE_IMPACT * engine.steps.largest
    if before > engine.time:
        engine.advance(before)
    now = engine.snapshot()
    pieces = _pieces(stage, impact, body, now)
    if pieces is None:
        return None
    _take_energy(engine, stage, impact)
    one = _break(impact, pieces)
    split = _split(stage, engine, body, one)
    after = require(engine, BodySplittingEngine).with_split_body(split)
    return FracturedRun(stage.with_pieces(one, split, after.problem, now), after, (*breaks, one))


@dataclass(frozen=True)
class _CutPieces:
    """Pieces of an object, where it was at the start."""

    of_particle: np.ndarray
    surfaces: tuple[Surface, ...]


def _pieces(stage: FractureState, impact: BrittleImpact, body: int, now: Snapshot) -> _CutPieces | None:
    """Cut an object into Voronoi cells around the impact; None: its surface is not closed."""
    scene, particles = stage.scene, stage.particles
    own = [s for s in scene.surfaces if s.object == impact.object]
    if len({s.finish for s in own}) != 1:
        return None
    start = particles.position[particles.object == impact.object].astype(float)
    mine = stage.rows(body)
    place = now.position[mine].mean(axis=0)
    struck = (impact.point - place) @ now.motion[mine][0] + start.mean(axis=0)
    rng = np.random.default_rng([impact.object, 11])
    seed = fragment_seeds(start, struck, rng)
    outside = own[0] if len(own) == 1 else _as_one_surface(own)
    wall = max(particles.walls[impact.part]) if particles.walls else 0.0
    wall = wall if encloses_cavity(scene, impact.object) else 0.0
    found = cut_fragments(outside, wall, seed) if len(seed) > 1 else None
    return None if found is None else _CutPieces(fragment_cells(start, seed), found)


def _as_one_surface(surfaces: Sequence[Surface]) -> Surface:
    mesh = join_meshes(surfaces)
    plain = replace(surfaces[0], uv=None, colours=None, normals=None)
    return replace(plain, vertices=mesh.vertices, triangles=mesh.triangles)


def _break(impact: BrittleImpact, pieces: _CutPieces) -> FractureEvent:
    said = impact.found
    return FractureEvent(
        object=impact.object,
        part=impact.part,
        time=said.time,
        energy=said.energy / said.ratio,
        ratio=said.ratio,
        by=said.by,
        speed=said.speed,
        impact_energy=said.energy,
        piece=pieces.of_particle,
        surfaces=pieces.surfaces,
    )


def _take_energy(engine: Engine, stage: FractureState, impact: BrittleImpact) -> None:
    """Subtract the fracture energy from the impact; the struck body recoils.

    J = m v (1 - √(1 - E₅₀/E)) with E = ½ m v².
    """
    said = impact.found
    mass = 2.0 * said.energy / said.speed**2
    impulse = mass * said.speed * (1.0 - np.sqrt(1.0 - 1.0 / said.ratio)) * impact.away
    x, y, z = impact.point.tolist()
    for number, sign in ((impact.object, 1.0), (impact.other, -1.0)):
        if number is not None and stage.scene.objects[number].path is None:
            body = int(np.flatnonzero(stage.posed.object_of_body == number)[0])
            a, b, c = (sign * impulse).tolist()
            require(engine, InteractiveEngine).apply_impulse(body, (x, y, z), (a, b, c))


def _split(stage: FractureState, engine: Engine, body: int, one: FractureEvent) -> BodySplit:
    """Return positions and motions of the fragments."""
    now, mine = engine.snapshot(), stage.rows(body)
    start = stage.particles.position[stage.particles.object == one.object].astype(float)
    turn, place = now.motion[mine][0], now.position[mine].mean(axis=0)
    rng = np.random.default_rng([one.object, 13])
    meshes = [join_meshes([surface]) for surface in one.surfaces]
    area = np.array([mesh.areas.sum() for mesh in meshes])
    points = []
    for mesh, count in zip(meshes, np.ceil(PIECE_CONTACT_POINTS * area / area.sum()), strict=True):
        spread = np.concatenate([mesh.vertices, sample_surface(mesh, int(count), rng)[0]])
        points.append((spread - start.mean(axis=0)) @ turn.T + place)
    return BodySplit(body, one.piece, now.position[mine], now.velocity[mine], tuple(points))
