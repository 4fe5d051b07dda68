"""Where bodies start: near each other, upright where they can stand, and nowhere touching.

A body comes from outside along a straight line and stops short of what is there. By conservative
advancement (Mirtich 1996) it moves, again and again, as far as it is away from everything: no
step can jump over anything, and whatever stops it early leaves it free of all others.
"""

from collections.abc import Sequence
from typing import Literal, get_args

import fcl
import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from corporeal.core.errors import UnknownChoiceError
from corporeal.geometry.convex_hull import Piece, Stance
from corporeal.geometry.mesh import joined
from corporeal.geometry.shape import random_rotation
from corporeal.scene.body import Body, Pose, unit_of

Arrangement = Literal["scatter", "stack", "onto", "row"]

GAP = 0.01
"""Free height before a body falls, of the scene's unit."""
STANDS = 0.1
"""A body starts upright where it takes at least this tilt to make it fall over [rad]."""
STANDS_IN_A_STACK = 0.35
"""The same under and on other bodies [rad]."""
LOW = 0.25
"""What is lower than this share of the tallest is passed over: it comes last in a row."""
STEPS = 40
NEAR = 0.1
"""What comes stops when it could go on by less than this share of the gap."""


def arrange(
    bodies: Sequence[Body], arrangement: Arrangement, rng: np.random.Generator
) -> list[Pose]:
    """Place bodies above the floor z = 0, free of each other.

    Args:
        bodies: At least one.
        arrangement: ``scatter``: side by side; ``stack``: one above the other, below what carries
            most; ``onto``: all above that one; ``row``: in a line along +x, heavy ones first
        and flat ones last, broadside on.
        rng: Source of what is left to chance.

    """
    ways = {"scatter": _scatter, "stack": _stack, "onto": _onto, "row": _row}
    if arrangement not in ways:
        raise UnknownChoiceError("arrangement", arrangement, list(get_args(Arrangement)))
    return ways[arrangement](bodies, rng)


def standing_alone(body: Body) -> Pose:
    """Return how a body stands on the floor, upright where it can, its centre above the origin."""
    return _on_floor(body, _down(_standing(body).down), 0.0)


def _gap(body: Body, bodies: Sequence[Body]) -> float:
    return min(GAP * unit_of(bodies), 0.25 * body.extent)


def _scatter(bodies: Sequence[Body], rng: np.random.Generator) -> list[Pose]:
    room = _Room()
    for k in map(int, rng.permutation(len(bodies))):
        body = bodies[k]
        pose = _on_floor(body, _turned(body, rng), _gap(body, bodies))
        bearing = rng.uniform(0, 2 * np.pi)
        inward = -np.array([np.cos(bearing), np.sin(bearing), 0.0])
        room.bring(k, body.hull, pose, inward, rng.uniform(0.05, 0.3) * body.extent)
    return room.poses()


def _stack(bodies: Sequence[Body], rng: np.random.Generator) -> list[Pose]:
    return _piled(bodies, _carriers(bodies, rng), rng, 0.6 * rng.uniform() ** 3)


def _onto(bodies: Sequence[Body], rng: np.random.Generator) -> list[Pose]:
    first, *rest = _carriers(bodies, rng)
    return _piled(bodies, [first, *map(int, rng.permutation(rest))], rng, rng.uniform(0.2, 0.8))


def _carriers(bodies: Sequence[Body], rng: np.random.Generator) -> list[int]:
    """Order bodies by the room on top, what offers most first; near equals by chance."""
    room = [_steady(b).top * np.exp(0.5 * rng.normal()) for b in bodies]
    return [int(k) for k in np.argsort(-np.array(room), kind="stable")]


def _piled(
    bodies: Sequence[Body], order: list[int], rng: np.random.Generator, aside: float
) -> list[Pose]:
    """Lower one after the other over the first one's middle, ``aside`` of its width at most."""
    room, down = _Room(), np.array([0.0, 0.0, -1.0])
    first = bodies[order[0]].hull.vertices
    for k in order:
        body, gap = bodies[k], _gap(bodies[k], bodies)
        pose = _on_floor(body, _stood(_steady(body), rng), gap)
        if room.standing:
            width = np.ptp(room.standing[order[0]].world(first)[:, :2], axis=0)
            pose = pose.moved([*(aside * rng.uniform(-0.5, 0.5, 2) * width), 0.0])
        room.bring(k, _whole(body), pose, down, gap)
    return room.poses()


def _row(bodies: Sequence[Body], rng: np.random.Generator) -> list[Pose]:
    heights = [float(np.ptp(b.hull.vertices @ _standing(b).down)) for b in bodies]
    low = [h < LOW * max(heights) for h in heights]
    order = sorted(range(len(bodies)), key=lambda k: (low[k], -bodies[k].mass))
    room, back = _Room(), np.array([-1.0, 0.0, 0.0])
    for k in order:
        body = bodies[k]
        pose = _on_floor(body, _broadside(body, _standing(body), rng), _gap(body, bodies))
        room.bring(k, body.hull, pose, back, rng.uniform(0.1, 0.2) * body.extent)
    return room.poses()


# ---------------------------------------------------------------- how one body stands


def _turned(body: Body, rng: np.random.Generator) -> np.ndarray:
    """Upright where that is stable, else tumbled."""
    return _stood(body.upright, rng) if body.upright.tip >= STANDS else random_rotation(rng)


def _standing(body: Body) -> Stance:
    return body.upright if body.upright.tip >= STANDS else body.steadiest


def _steady(body: Body) -> Stance:
    return body.upright if body.upright.tip >= STANDS_IN_A_STACK else body.steadiest


def _stood(stance: Stance, rng: np.random.Generator) -> np.ndarray:
    """With a random yaw."""
    return _yaw(rng) @ _down(stance.down)


def _broadside(body: Body, stance: Stance, rng: np.random.Generator) -> np.ndarray:
    """With its narrowest width along x, turned about by chance: like a domino.

    Flat sides then face each other, a blow goes through the middle, and what is tall topples on.
    """
    rotation = _down(stance.down)
    outline = (body.hull.vertices @ rotation.T)[:, :2]
    normal = ConvexHull(outline).equations[:, :2]
    narrow = normal[np.argmin(np.ptp(outline @ normal.T, axis=0))]
    return _turn(np.pi * int(rng.integers(2)) - np.arctan2(narrow[1], narrow[0])) @ rotation


def _yaw(rng: np.random.Generator) -> np.ndarray:
    return _turn(rng.uniform(0, 2 * np.pi))


def _turn(angle: float) -> np.ndarray:
    """Return a rotation about the vertical."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _down(direction: np.ndarray) -> np.ndarray:
    """Return a rotation that takes ``direction`` to -z."""
    axis = np.cross(direction, [0.0, 0.0, -1.0])
    sine, cosine = float(np.linalg.norm(axis)), -float(direction[2])
    if sine < 1e-9:
        return np.diag([1.0, 1.0, 1.0]) if cosine > 0 else np.diag([1.0, -1.0, -1.0])
    return Rotation.from_rotvec(axis / sine * np.arctan2(sine, cosine)).as_matrix()


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
    whole = joined(body.pieces)
    return Piece(whole.vertices, whole.triangles)


class _Room:
    """Bodies that stand already."""

    def __init__(self) -> None:
        self.standing: dict[int, Pose] = {}
        self._solids: list[fcl.CollisionObject] = []
        self._corners: list[np.ndarray] = []

    def poses(self) -> list[Pose]:
        """Where they stand, in the order of their numbers."""
        return [self.standing[k] for k in range(len(self.standing))]

    def bring(
        self, number: int, surface: Piece, pose: Pose, direction: np.ndarray, gap: float
    ) -> None:
        """Let a body come along ``direction`` [unit] to ``pose``, or until ``gap`` [m] is left."""
        corners = pose.world(surface.vertices)
        if self.standing:
            solid = _solid(surface, pose)
            reach = self._reach(corners, direction) + gap
            left = self._advance(solid, np.array(pose.position), direction, reach, gap)
            pose = pose.moved(-left * direction)
            corners = corners - left * direction
        self.standing[number] = pose
        self._solids.append(_solid(surface, pose))
        self._corners.append(corners)

    def _reach(self, corners: np.ndarray, direction: np.ndarray) -> float:
        """From how far away it has to come to start free of all [m]."""
        nearest = min(float((c @ direction).min()) for c in self._corners)
        return max(0.0, float((corners @ direction).max()) - nearest)

    def _advance(
        self,
        solid: fcl.CollisionObject,
        goal: np.ndarray,
        direction: np.ndarray,
        reach: float,
        gap: float,
    ) -> float:
        """Return how far from its goal it stops [m]."""
        left = reach
        for _ in range(STEPS):
            solid.setTranslation(goal - left * direction)
            free = self._distance(solid) - gap
            if free < NEAR * gap or left <= 0:
                break
            left = max(0.0, left - free)
        return left

    def _distance(self, solid: fcl.CollisionObject) -> float:
        request = fcl.DistanceRequest()
        return min(fcl.distance(solid, o, request, fcl.DistanceResult()) for o in self._solids)


def _solid(surface: Piece, pose: Pose) -> fcl.CollisionObject:
    model = fcl.BVHModel()
    model.beginModel(len(surface.vertices), len(surface.triangles))
    model.addSubModel(surface.vertices, surface.triangles)
    model.endModel()
    return fcl.CollisionObject(model, fcl.Transform(pose.rotation, np.array(pose.position)))
