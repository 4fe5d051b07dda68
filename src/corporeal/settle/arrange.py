"""Where bodies start: near each other, upright where they can stand, and nowhere touching.

A body comes from outside along a straight line and stops short of what is there. By conservative
advancement (Mirtich 1996) it moves, again and again, as far as it is away from everything: no
step can jump over anything, and whatever stops it early leaves it free of all others.
"""

from collections.abc import Sequence
from typing import Literal, get_args

import fcl
import numpy as np
from scipy.spatial.transform import Rotation

from corporeal.errors import UnknownChoiceError
from corporeal.geometry.shape import random_rotation
from corporeal.settle.body import Body, Pose, unit_of
from corporeal.settle.hull import Piece, steadiest, tip_angle

Arrangement = Literal["scatter", "stack", "onto", "row"]

GAP = 0.02
"""Free height before a body falls, of the scene's unit."""
STANDS = 0.12
"""A body starts upright where it takes at least this tilt to make it fall over [rad]."""
STANDS_IN_A_STACK = 0.35
"""The same under and on other bodies [rad]."""
STEPS = 60


def arrange(
    bodies: Sequence[Body], arrangement: Arrangement, rng: np.random.Generator
) -> list[Pose]:
    """Place bodies above the floor z = 0, free of each other.

    Args:
        bodies: At least one.
        arrangement: ``scatter``: side by side; ``stack``: one above the other, large ones below;
            ``onto``: all above the largest; ``row``: in a line along +x, heavy ones first.
        rng: Source of what is left to chance.

    """
    ways = {"scatter": _scatter, "stack": _stack, "onto": _onto, "row": _row}
    if arrangement not in ways:
        raise UnknownChoiceError("arrangement", arrangement, list(get_args(Arrangement)))
    return ways[arrangement](bodies, rng)


def _gap(body: Body, bodies: Sequence[Body]) -> float:
    return min(GAP * unit_of(bodies), 0.25 * body.extent)


def _scatter(bodies: Sequence[Body], rng: np.random.Generator) -> list[Pose]:
    room = _Room()
    poses: dict[int, Pose] = {}
    reach = 2 * unit_of(bodies) * len(bodies)
    for k in map(int, rng.permutation(len(bodies))):
        body = bodies[k]
        pose = _on_floor(body, _turned(body, rng, STANDS), _gap(body, bodies))
        bearing = rng.uniform(0, 2 * np.pi)
        outward = np.array([np.cos(bearing), np.sin(bearing), 0.0])
        between = rng.uniform(0.05, 0.3) * body.extent
        if poses:
            pose = room.approach(body.hull, pose.moved(reach * outward), -outward, reach, between)
        room.add(body.hull, pose)
        poses[k] = pose
    return [poses[k] for k in range(len(bodies))]


def _stack(bodies: Sequence[Body], rng: np.random.Generator) -> list[Pose]:
    order = sorted(range(len(bodies)), key=lambda k: -bodies[k].hull.volume)
    return _piled(bodies, order, rng, 0.05)


def _onto(bodies: Sequence[Body], rng: np.random.Generator) -> list[Pose]:
    largest = max(range(len(bodies)), key=lambda k: bodies[k].hull.volume)
    rest = [int(k) for k in rng.permutation(len(bodies)) if k != largest]
    return _piled(bodies, [largest, *rest], rng, 0.3)


def _piled(
    bodies: Sequence[Body], order: list[int], rng: np.random.Generator, aside: float
) -> list[Pose]:
    """Lower one after the other over the first one's middle, ``aside`` of its width at most."""
    room = _Room()
    poses: dict[int, Pose] = {}
    height = 2 * unit_of(bodies) * len(bodies)
    first = bodies[order[0]]
    for k in order:
        body = bodies[k]
        gap = _gap(body, bodies)
        pose = _on_floor(body, _turned(body, rng, STANDS_IN_A_STACK), gap)
        if poses:
            width = np.ptp(poses[order[0]].world(first.hull.vertices)[:, :2], axis=0)
            shift = np.array([*(aside * rng.uniform(-0.5, 0.5, 2) * width), height])
            down = np.array([0.0, 0.0, -1.0])
            pose = room.approach(_whole(body), pose.moved(shift), down, height, gap)
        room.add(_whole(body), pose)
        poses[k] = pose
    return [poses[k] for k in range(len(bodies))]


def _row(bodies: Sequence[Body], rng: np.random.Generator) -> list[Pose]:
    order = sorted(range(len(bodies)), key=lambda k: -bodies[k].volume * bodies[k].density)
    room = _Room()
    poses: dict[int, Pose] = {}
    reach = 2 * unit_of(bodies) * len(bodies)
    ahead = np.array([1.0, 0.0, 0.0])
    for k in order:
        body = bodies[k]
        pose = _on_floor(body, _standing(body, rng), _gap(body, bodies))
        between = rng.uniform(0.1, 0.2) * body.extent
        if poses:
            pose = room.approach(body.hull, pose.moved(reach * ahead), -ahead, reach, between)
        room.add(body.hull, pose)
        poses[k] = pose
    return [poses[k] for k in range(len(bodies))]


# ---------------------------------------------------------------- how one body stands


def _turned(body: Body, rng: np.random.Generator, stands: float) -> np.ndarray:
    """Upright with a random yaw where that is stable, else tumbled."""
    if tip_angle(body.hull, body.centre, np.array([0.0, 0.0, -1.0])) >= stands:
        return _yaw(rng)
    if stands > STANDS:
        return _yaw(rng) @ _down(steadiest(body.hull, body.centre))
    return random_rotation(rng)


def _standing(body: Body, rng: np.random.Generator) -> np.ndarray:
    if tip_angle(body.hull, body.centre, np.array([0.0, 0.0, -1.0])) >= STANDS:
        return _yaw(rng)
    return _yaw(rng) @ _down(steadiest(body.hull, body.centre))


def _yaw(rng: np.random.Generator) -> np.ndarray:
    angle = rng.uniform(0, 2 * np.pi)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _down(direction: np.ndarray) -> np.ndarray:
    """Return a rotation that takes ``direction`` to -z."""
    u, _, vt = np.linalg.svd(np.outer([0.0, 0.0, -1.0], direction))
    return u @ np.diag([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)]) @ vt


def _on_floor(body: Body, rotation: np.ndarray, gap: float) -> Pose:
    """With the centre of mass above the origin and ``gap`` below the lowest point."""
    centre = rotation @ body.centre
    lowest = float((body.hull.vertices @ rotation.T)[:, 2].min())
    return Pose((float(-centre[0]), float(-centre[1]), gap - lowest), quaternion_of(rotation))


def quaternion_of(rotation: np.ndarray) -> tuple[float, float, float, float]:
    """(w, x, y, z) of a rotation matrix, w ≥ 0."""
    x, y, z, w = (float(c) for c in Rotation.from_matrix(rotation).as_quat(canonical=True))
    return (w, x, y, z)


# ---------------------------------------------------------------- what is in the way


def _whole(body: Body) -> Piece:
    """All pieces as one surface."""
    first = np.cumsum([0, *(len(p.vertices) for p in body.pieces[:-1])])
    triangles = [p.triangles + k for p, k in zip(body.pieces, first, strict=True)]
    return Piece(np.concatenate([p.vertices for p in body.pieces]), np.concatenate(triangles))


class _Room:
    """Bodies that stand already."""

    def __init__(self) -> None:
        self.taken: list[fcl.CollisionObject] = []

    def add(self, surface: Piece, pose: Pose) -> None:
        self.taken.append(_solid(surface, pose))

    def approach(
        self, surface: Piece, pose: Pose, direction: np.ndarray, reach: float, gap: float
    ) -> Pose:
        """Move along ``direction`` [unit] by ``reach`` [m] at most, until ``gap`` [m] is left."""
        solid, travelled = _solid(surface, pose), 0.0
        start = np.array(pose.position)
        for _ in range(STEPS):
            free = self._distance(solid) - gap
            if free < 0.02 * gap or travelled >= reach:
                break
            travelled = min(travelled + free, reach)
            solid.setTranslation(start + travelled * direction)
        return pose.moved(travelled * direction)

    def _distance(self, solid: fcl.CollisionObject) -> float:
        return min(
            fcl.distance(solid, other, fcl.DistanceRequest(), fcl.DistanceResult())
            for other in self.taken
        )


def _solid(surface: Piece, pose: Pose) -> fcl.CollisionObject:
    model = fcl.BVHModel()
    model.beginModel(len(surface.vertices), len(surface.triangles))
    model.addSubModel(surface.vertices, surface.triangles)
    model.endModel()
    return fcl.CollisionObject(model, fcl.Transform(pose.rotation, np.array(pose.position)))
