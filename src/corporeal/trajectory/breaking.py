"""Breaking, simulated: what is struck with ten times the energy that it bears becomes pieces.

The run is taken back to just before the two touch, what the wall bears until it breaks is taken
from the blow, and the thing becomes rigid pieces that move on as it did (decision 39). The momentum
of the pieces is that of the whole.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from corporeal.geometry.broken import broken_field, broken_particles, broken_scene, shares
from corporeal.geometry.fragments import cells, cut, seeds
from corporeal.geometry.mesh import joined
from corporeal.geometry.spread import sample_surface
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.physics import rigid
from corporeal.mpm.problem import Snapshot
from corporeal.mpm.splitting import Heirs, Split, can_split, split_problem
from corporeal.trajectory.breakage import Blow, blows, encloses, pieces_of
from corporeal.trajectory.fracture import WOULD
from corporeal.trajectory.frames import (
    Layout,
    gather,
    read_frame,
    read_ledger,
    write_frame,
    write_layout,
)
from corporeal.treatment.problem_from_scene import Posed
from corporeal.types import Break, Frame, Ledger, MaterialField, Particles, Scene, Surface

BEFORE = 2.0
"""Steps before the first touch in which the pieces are made."""
POINTS = 1200
"""Contact points on all pieces together, beside their corners."""


@dataclass(frozen=True)
class Stage:
    """What is simulated now, with the pieces of what has broken."""

    scene: Scene
    particles: Particles
    field: MaterialField
    posed: Posed
    turned: Float[np.ndarray, "B 3 3"]
    """Rotation of each body when the problem's positions are those of its particles."""


@dataclass(frozen=True)
class Broken:
    """A thing that has just broken."""

    stage: Stage
    engine: CpuEngine
    breaks: tuple[Break, ...]
    heirs: Heirs


def stage_at_start(scene: Scene, particles: Particles, field: MaterialField, posed: Posed) -> Stage:
    """Return a stage on which nothing has broken."""
    turned = np.broadcast_to(np.eye(3), (len(posed.problem.bodies), 3, 3))
    return Stage(scene, particles, field, posed, turned)


def next_blow(
    stage: Stage,
    breaks: Sequence[Break],
    whole: set[int],
    folder: Path,
    number: int,
    since: float,
) -> Blow | None:
    """Return the first blow since a time [s] under which something breaks; None: there is none.

    Args:
        stage: What is simulated.
        breaks: What has broken, which breaks no more.
        whole: Objects that cannot be cut.
        folder: Where the frames are.
        number: Of the last one.
        since: [s]

    """
    now = read_ledger(folder, number).first_contact
    if not np.any(now > since):
        return None
    trajectory = gather(folder, number + 1)
    spared = pieces_of(breaks, len(stage.scene.objects)) | whole
    found = [
        blow
        for blow in blows(stage.scene, stage.particles, stage.field, trajectory)
        if blow.found.time > since and blow.found.ratio > WOULD and blow.object not in spared
    ]
    return min(found, key=lambda blow: blow.found.time, default=None)


def break_up(
    stage: Stage, engine: CpuEngine, blow: Blow, breaks: tuple[Break, ...]
) -> Broken | None:
    """Make pieces of what a blow is about to strike; None: it cannot be cut, and stays whole.

    Args:
        stage: What is simulated.
        engine: At an instant before the blow; goes on to just before it.
        blow: Which.
        breaks: What broke before.

    """
    owner = stage.posed.object_of_body
    (bodies,) = np.nonzero(owner == blow.object)
    parts = np.unique(stage.particles.part[stage.particles.object == blow.object])
    if len(bodies) != 1 or len(parts) != 1 or not can_split(engine.problem, int(bodies[0])):
        return None
    body = int(bodies[0])
    before = blow.found.time - BEFORE * engine.steps.largest
    if before > engine.time:
        engine.advance(before)
    now = engine.snapshot()
    pieces = _pieces(stage, blow, body, now)
    if pieces is None:
        return None
    _take_energy(engine, stage, blow)
    one = _break(blow, pieces)
    split = _split(stage, engine, body, one)
    heirs, problem = Heirs.of(engine.problem, split), split_problem(engine.problem, split)
    after = CpuEngine(problem, engine.threads)
    after.inherit(engine.save(), heirs)
    return Broken(_next(stage, one, split, after, now), after, (*breaks, one), heirs)


# ---------------------------------------------------------------- the pieces


@dataclass(frozen=True)
class _Cut:
    """Pieces of a thing, where it was at the start."""

    of_particle: np.ndarray
    surfaces: tuple[Surface, ...]


def _pieces(stage: Stage, blow: Blow, body: int, now: Snapshot) -> _Cut | None:
    """Cut a thing into cells around the blow; None: its surface is not closed."""
    scene, particles = stage.scene, stage.particles
    own = [s for s in scene.surfaces if s.object == blow.object]
    if len({s.finish for s in own}) != 1:
        return None
    start = particles.position[particles.object == blow.object].astype(float)
    mine = _rows(stage, body)
    place = now.position[mine].mean(axis=0)
    struck = (blow.point - place) @ now.motion[mine][0] + start.mean(axis=0)
    rng = np.random.default_rng([blow.object, 11])
    seed = seeds(start, struck, rng)
    outside = own[0] if len(own) == 1 else _one(own)
    wall = max(particles.walls[blow.part]) if particles.walls else 0.0
    wall = wall if encloses(scene, blow.object) else 0.0
    found = cut(outside, wall, seed) if len(seed) > 1 else None
    return None if found is None else _Cut(cells(start, seed), found)


def _one(surfaces: Sequence[Surface]) -> Surface:
    mesh = joined(surfaces)
    plain = replace(surfaces[0], uv=None, colours=None, normals=None)
    return replace(plain, vertices=mesh.vertices, triangles=mesh.triangles)


def _break(blow: Blow, pieces: _Cut) -> Break:
    said = blow.found
    return Break(
        object=blow.object,
        part=blow.part,
        time=said.time,
        energy=said.energy / said.ratio,
        ratio=said.ratio,
        by=said.by,
        speed=said.speed,
        blow=said.energy,
        piece=pieces.of_particle,
        surfaces=pieces.surfaces,
    )


def _take_energy(engine: CpuEngine, stage: Stage, blow: Blow) -> None:
    """Slow the blow down by what the wall bears until it breaks; a body it strikes is pushed back.

    J = m v (1 - √(1 - E₅₀/E)) with E = ½ m v².
    """
    said = blow.found
    mass = 2.0 * said.energy / said.speed**2
    impulse = mass * said.speed * (1.0 - np.sqrt(1.0 - 1.0 / said.ratio)) * blow.away
    x, y, z = blow.point.tolist()
    for number, sign in ((blow.object, 1.0), (blow.other, -1.0)):
        if number is not None and stage.scene.objects[number].path is None:
            body = int(np.flatnonzero(stage.posed.object_of_body == number)[0])
            a, b, c = (sign * impulse).tolist()
            engine.apply_impulse(body, (x, y, z), (a, b, c))


def _split(stage: Stage, engine: CpuEngine, body: int, one: Break) -> Split:
    """Say where the pieces are and how they move."""
    now, mine = engine.snapshot(), _rows(stage, body)
    start = stage.particles.position[stage.particles.object == one.object].astype(float)
    turn, place = now.motion[mine][0], now.position[mine].mean(axis=0)
    rng = np.random.default_rng([one.object, 13])
    meshes = [joined([surface]) for surface in one.surfaces]
    area = np.array([mesh.areas.sum() for mesh in meshes])
    points = []
    for mesh, count in zip(meshes, np.ceil(POINTS * area / area.sum()), strict=True):
        spread = np.concatenate([mesh.vertices, sample_surface(mesh, int(count), rng)[0]])
        points.append((spread - start.mean(axis=0)) @ turn.T + place)
    return Split(body, one.piece, now.position[mine], now.velocity[mine], tuple(points))


def _rows(stage: Stage, body: int) -> slice:
    """Where a body's particles are in the problem's order."""
    counts = [len(b.position) for b in stage.posed.problem.bodies]
    first = sum(counts[:body])
    return slice(first, first + counts[body])


def _next(stage: Stage, one: Break, split: Split, engine: CpuEngine, now: Snapshot) -> Stage:
    """Return the stage with the pieces as objects."""
    posed, body, more = stage.posed, split.body, split.count - 1
    count = len(stage.scene.objects)
    mine = _rows(stage, body)
    number = posed.order[mine]
    order = np.concatenate(
        [
            posed.order[: mine.start],
            number[one.piece == 0],
            posed.order[mine.stop :],
            *(number[one.piece == k] for k in range(1, split.count)),
        ]
    )
    turned = np.concatenate([stage.turned, np.empty((more, 3, 3))])
    turned[[body, *range(len(stage.turned), len(turned))]] = (
        now.motion[mine][0] @ stage.turned[body]
    )
    after = Posed(
        problem=engine.problem,
        order=order,
        rigid=np.append(posed.rigid, np.ones(more, dtype=bool)),
        object_of_body=np.append(posed.object_of_body, count + np.arange(more)),
    )
    return Stage(
        scene=broken_scene(stage.scene, one, shares(one, stage.particles)),
        particles=broken_particles(stage.particles, one, count),
        field=broken_field(stage.field, one),
        posed=after,
        turned=turned,
    )


# ---------------------------------------------------------------- what was before


def retell(folder: Path, count: int, before: Stage, after: Stage, one: Break) -> None:
    """Write the first ``count`` frames again, with the pieces as objects that move as one."""
    old, new = layout(before.posed), layout(after.posed)
    for number in range(count):
        frame, row = read_frame(folder, number, old), read_ledger(folder, number)
        write_frame(folder, number, frame, new, _shared_out(row, frame, before, one))
    write_layout(folder, new)


def layout(posed: Posed) -> Layout:
    """Say which particle belongs to which body."""
    bodies, place = posed.problem.bodies, np.empty_like(posed.order)
    place[posed.order] = np.arange(len(posed.order))
    owner = np.repeat(np.arange(len(bodies)), [len(b.position) for b in bodies])
    return Layout(object=owner[place], rigid=posed.rigid)


def _shared_out(row: Ledger, frame: Frame, before: Stage, one: Break) -> Ledger:
    """Give each piece its share of what the ledger has of the whole, as it moved within it."""
    share, objects, k = shares(one, before.particles), len(row.mass), one.object
    numbers = np.array([k, *range(objects, objects + len(share) - 1)])
    heirs = Heirs(
        np.append(np.arange(objects), np.full(len(share) - 1, k)),
        np.concatenate([np.where(np.arange(objects) == k, share[0], 1.0), share[1:]]),
    )
    book = {f.name: np.asarray(getattr(row, f.name)) for f in fields(Ledger)}
    found = book | heirs.inherited(book)
    # Sums go by mass; places and distances are those of the whole, and pieces touch one another.
    for name in ("mass", "kinetic", "elastic", "potential", "flow"):
        found[name] = book[name][heirs.parent] * heirs.share
    for name in ("momentum", "angular_momentum"):
        found[name] = book[name][heirs.parent] * heirs.share[:, None]
    for name in ("centre", "rms_speed"):
        found[name] = book[name][heirs.parent]
    found["plane_depth"] = book["plane_depth"][:, heirs.parent]
    square = np.ix_(heirs.parent, heirs.parent)
    found["gap"], found["overlap"] = book["gap"][square], book["overlap"][square]
    apart = np.where(np.eye(len(numbers), dtype=bool), np.inf, 0.0)
    found["gap"][np.ix_(numbers, numbers)] = apart
    # Every piece moves about the common centre: what that adds to each adds up to nothing.
    moves = _moves_within(row, frame, before, one)
    for name in ("momentum", "angular_momentum", "kinetic"):
        each = np.array([getattr(m, name) for m in moves])
        left = book[name][k] - each.sum(axis=0)
        found[name][numbers] = each + np.multiply.outer(share, left)
    found["centre"][numbers] = [m.centre for m in moves]
    height = (found["centre"][numbers] - book["centre"][k]) @ np.array(before.scene.gravity)
    found["potential"][numbers] -= found["mass"][numbers] * height
    return Ledger(**found)


def _moves_within(row: Ledger, frame: Frame, before: Stage, one: Break) -> list["_Moves"]:
    """Say how each piece moves as long as the thing is whole."""
    particles, k = before.particles, one.object
    mine = np.flatnonzero(particles.object == k)
    weight, volume = particles.mass[mine], particles.volume[mine]
    place = frame.position[mine].astype(float)
    whole = rigid.mass_of(place, weight, volume)
    speed = row.momentum[k] / row.mass[k]
    about = row.angular_momentum[k] - row.mass[k] * np.cross(row.centre[k], speed)
    spin = np.linalg.lstsq(whole.inertia, about, rcond=None)[0]
    moves = []
    for n in range(len(one.surfaces)):
        own = one.piece == n
        mass = rigid.mass_of(place[own], weight[own], volume[own])
        moves.append(_Moves.of(mass, speed + np.cross(spin, mass.centre - whole.centre), spin))
    return moves


@dataclass(frozen=True)
class _Moves:
    """How one piece moves."""

    centre: Float[np.ndarray, "3"]
    momentum: Float[np.ndarray, "3"]
    angular_momentum: Float[np.ndarray, "3"]
    """About the origin [kg m²/s]."""
    kinetic: float

    @classmethod
    def of(cls, mass: rigid.Mass, speed: np.ndarray, spin: np.ndarray) -> "_Moves":
        momentum, own = mass.total * speed, mass.inertia @ spin
        return cls(
            mass.centre,
            momentum,
            np.cross(mass.centre, momentum) + own,
            0.5 * float(momentum @ speed + own @ spin),
        )
