"""Initial arrangement of bodies: close, upright where possible, without contact.

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
from corporeal.geometry.convex_hull import ConvexPiece, StandingStance
from corporeal.geometry.mesh import join_meshes
from corporeal.geometry.mesh_queries import random_rotation
from corporeal.scene.settling_body import BodyPose, SettlingBody, scene_unit_of

BodyArrangement = Literal["scatter", "stack", "onto", "row"]

FREE_HEIGHT_UNITS = 0.01
"""Free height before a body falls, of the scene's unit."""
MIN_TIP_ANGLE_RAD = 0.1
"""A body starts upright where it takes at least this tilt to make it fall over [rad]."""
MIN_STACKED_TIP_ANGLE_RAD = 0.35
"""The same under and on other bodies [rad]."""
LOW_BODY_HEIGHT_FRACTION = 0.25
"""What is lower than this share of the tallest is passed over: it comes last in a row."""
MAX_ADVANCE_STEPS = 40
ARRIVED_GAP_FRACTION = 0.1
"""What comes stops when it could go on by less than this share of the gap."""


def arrange_bodies(
    bodies: Sequence[SettlingBody], arrangement: BodyArrangement, rng: np.random.Generator
) -> list[BodyPose]:
    """Place bodies above the floor z = 0, free of each other.

    Args:
        bodies: At least one.
        arrangement: ``scatter``: side by side; ``stack``: one above the other, below what carries most; ``onto``: all
            above that one; ``row``: in a line along +x, heavy ones first
        and flat ones last, broadside on.
        rng: Source of random numbers.
    """
    ways = {"scatter": _scatter_poses, "stack": _stack_poses, "onto": _onto_poses, "row": _row_poses}
    if arrangement not in ways:
        raise UnknownChoiceError("arrangement", arrangement, list(get_args(BodyArrangement)))
    return ways[arrangement](bodies, rng)


def pose_standing_alone(body: SettlingBody) -> BodyPose:
    """Return how a body stands on the floor, upright where it can, its centre above the origin."""
    return _pose_on_floor(body, _rotation_to_down(_standing_stance(body).down), 0.0)


def _free_height(body: SettlingBody, bodies: Sequence[SettlingBody]) -> float:
    return min(FREE_HEIGHT_UNITS * scene_unit_of(bodies), 0.25 * body.extent)


def _scatter_poses(bodies: Sequence[SettlingBody], rng: np.random.Generator) -> list[BodyPose]:
    room = _PlacedBodies()
    for k in map(int, rng.permutation(len(bodies))):
        body = bodies[k]
        pose = _pose_on_floor(body, _random_rotation(body, rng), _free_height(body, bodies))
        bearing = rng.uniform(0, 2 * np.pi)
        inward = -np.array([np.cos(bearing), np.sin(bearing), 0.0])
        room.bring(k, body.hull, pose, inward, rng.uniform(0.05, 0.3) * body.extent)
    return room.poses()


def _stack_poses(bodies: Sequence[SettlingBody], rng: np.random.Generator) -> list[BodyPose]:
    return _pile_poses(bodies, _order_by_top_room(bodies, rng), rng, 0.6 * rng.uniform() ** 3)


def _onto_poses(bodies: Sequence[SettlingBody], rng: np.random.Generator) -> list[BodyPose]:
    first, *rest = _order_by_top_room(bodies, rng)
    return _pile_poses(bodies, [first, *map(int, rng.permutation(rest))], rng, rng.uniform(0.2, 0.8))


def _order_by_top_room(bodies: Sequence[SettlingBody], rng: np.random.Generator) -> list[int]:
    """Order bodies by the room on top, what offers most first; near equals by chance."""
    room = [_steady_stance(b).top * np.exp(0.5 * rng.normal()) for b in bodies]
    return [int(k) for k in np.argsort(-np.array(room), kind="stable")]


def _pile_poses(
    bodies: Sequence[SettlingBody], order: list[int], rng: np.random.Generator, aside: float
) -> list[BodyPose]:
    """Lower one after the other over the first one's middle, ``aside`` of its width at most."""
    room, down = _PlacedBodies(), np.array([0.0, 0.0, -1.0])
    first = bodies[order[0]].hull.vertices
    for k in order:
        body, gap = bodies[k], _free_height(bodies[k], bodies)
        pose = _pose_on_floor(body, _stance_with_yaw(_steady_stance(body), rng), gap)
        if room.standing:
            width = np.ptp(room.standing[order[0]].world(first)[:, :2], axis=0)
            pose = pose.moved([*(aside * rng.uniform(-0.5, 0.5, 2) * width), 0.0])
        room.bring(k, _whole_surface(body), pose, down, gap)
    return room.poses()


def _row_poses(bodies: Sequence[SettlingBody], rng: np.random.Generator) -> list[BodyPose]:
    heights = [float(np.ptp(b.hull.vertices @ _standing_stance(b).down)) for b in bodies]
    low = [h < LOW_BODY_HEIGHT_FRACTION * max(heights) for h in heights]
    order = sorted(range(len(bodies)), key=lambda k: (low[k], -bodies[k].mass))
    room, back = _PlacedBodies(), np.array([-1.0, 0.0, 0.0])
    for k in order:
        body = bodies[k]
        pose = _pose_on_floor(body, _broadside(body, _standing_stance(body), rng), _free_height(body, bodies))
        room.bring(k, body.hull, pose, back, rng.uniform(0.1, 0.2) * body.extent)
    return room.poses()


def _random_rotation(body: SettlingBody, rng: np.random.Generator) -> np.ndarray:
    """Upright where that is stable, else tumbled."""
    return _stance_with_yaw(body.upright, rng) if body.upright.tip >= MIN_TIP_ANGLE_RAD else random_rotation(rng)


def _standing_stance(body: SettlingBody) -> StandingStance:
    return body.upright if body.upright.tip >= MIN_TIP_ANGLE_RAD else body.steadiest


def _steady_stance(body: SettlingBody) -> StandingStance:
    return body.upright if body.upright.tip >= MIN_STACKED_TIP_ANGLE_RAD else body.steadiest


def _stance_with_yaw(stance: StandingStance, rng: np.random.Generator) -> np.ndarray:
    """With a random yaw."""
    return _random_yaw(rng) @ _rotation_to_down(stance.down)


def _broadside(body: SettlingBody, stance: StandingStance, rng: np.random.Generator) -> np.ndarray:
    """With its narrowest width along x, turned about by chance: like a domino.

    Flat sides then face each other, an impact goes through the middle, and what is tall topples on.
    """
    rotation = _rotation_to_down(stance.down)
    outline = (body.hull.vertices @ rotation.T)[:, :2]
    normal = ConvexHull(outline).equations[:, :2]
    narrow = normal[np.argmin(np.ptp(outline @ normal.T, axis=0))]
    return _rotation_about_z(np.pi * int(rng.integers(2)) - np.arctan2(narrow[1], narrow[0])) @ rotation


def _random_yaw(rng: np.random.Generator) -> np.ndarray:
    return _rotation_about_z(rng.uniform(0, 2 * np.pi))


def _rotation_about_z(angle: float) -> np.ndarray:
    """Return a rotation about the vertical."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _rotation_to_down(direction: np.ndarray) -> np.ndarray:
    """Return a rotation that takes ``direction`` to -z."""
    axis = np.cross(direction, [0.0, 0.0, -1.0])
    sine, cosine = float(np.linalg.norm(axis)), -float(direction[2])
    if sine < 1e-9:
        return np.diag([1.0, 1.0, 1.0]) if cosine > 0 else np.diag([1.0, -1.0, -1.0])
    return Rotation.from_rotvec(axis / sine * np.arctan2(sine, cosine)).as_matrix()


def _pose_on_floor(body: SettlingBody, rotation: np.ndarray, gap: float) -> BodyPose:
    """With the centre of mass above the origin and ``gap`` below the lowest point."""
    centre = rotation @ body.centre
    lowest = float((body.hull.vertices @ rotation.T)[:, 2].min())
    return BodyPose((float(-centre[0]), float(-centre[1]), gap - lowest), quaternion_tuple_of(rotation))


def quaternion_tuple_of(rotation: np.ndarray) -> tuple[float, float, float, float]:
    """(w, x, y, z) of a rotation matrix, w ≥ 0."""
    x, y, z, w = (float(c) for c in Rotation.from_matrix(rotation).as_quat(canonical=True))
    return (w, x, y, z)


def _whole_surface(body: SettlingBody) -> ConvexPiece:
    """All pieces as one surface."""
    whole = join_meshes(body.pieces)
    return ConvexPiece(whole.vertices, whole.triangles)


class _PlacedBodies:
    """Bodies that stand already."""

    def __init__(self) -> None:
        self.standing: dict[int, BodyPose] = {}
        self._solids: list[fcl.CollisionObject] = []
        self._corners: list[np.ndarray] = []

    def poses(self) -> list[BodyPose]:
        """Where they stand, in the order of their numbers."""
        return [self.standing[k] for k in range(len(self.standing))]

    def bring(self, number: int, surface: ConvexPiece, pose: BodyPose, direction: np.ndarray, gap: float) -> None:
        """Let a body come along ``direction`` [unit] to ``pose``, or until ``gap`` [m] is left."""
        corners = pose.world(surface.vertices)
        if self.standing:
            solid = _collision_solid(surface, pose)
            reach = self._reach(corners, direction) + gap
            left = self._advance(solid, np.array(pose.position), direction, reach, gap)
            pose = pose.moved(-left * direction)
            corners = corners - left * direction
        self.standing[number] = pose
        self._solids.append(_collision_solid(surface, pose))
        self._corners.append(corners)

    def _reach(self, corners: np.ndarray, direction: np.ndarray) -> float:
        """From how far away it has to come to start free of all [m]."""
        nearest = min(float((c @ direction).min()) for c in self._corners)
        return max(0.0, float((corners @ direction).max()) - nearest)

    def _advance(
        self, solid: fcl.CollisionObject, goal: np.ndarray, direction: np.ndarray, reach: float, gap: float
    ) -> float:
        """Return how far from its goal it stops [m]."""
        left = reach
        for _ in range(MAX_ADVANCE_STEPS):
            solid.setTranslation(goal - left * direction)
            free = self._distance(solid) - gap
            if free < ARRIVED_GAP_FRACTION * gap or left <= 0:
                break
            left = max(0.0, left - free)
        return left

    def _distance(self, solid: fcl.CollisionObject) -> float:
        request = fcl.DistanceRequest()
        return min(fcl.distance(solid, o, request, fcl.DistanceResult()) for o in self._solids)


def _collision_solid(surface: ConvexPiece, pose: BodyPose) -> fcl.CollisionObject:
    model = fcl.BVHModel()
    model.beginModel(len(surface.vertices), len(surface.triangles))
    model.addSubModel(surface.vertices, surface.triangles)
    model.endModel()
    return fcl.CollisionObject(model, fcl.Transform(pose.rotation, np.array(pose.position)))
