"""Balls, boxes and cylinders of matter, and their surfaces; SI."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from corporeal.core.types import CURVATURE_COLUMNS, Law
from corporeal.discretization.surface_curvature import is_surrounded, point_reach
from corporeal.mpm.problem import Body, Plane, Problem

Points = Float[np.ndarray, "N 3"]
Distance = Callable[[np.ndarray], np.ndarray]
"""Signed distance [m] of points from a surface; negative inside."""
G = 9.81
DOWN = (0.0, 0.0, -G)


@dataclass(frozen=True)
class Stuff:
    """A material; soft rubber unless said otherwise."""

    law: Law = Law.NEO_HOOKEAN
    young_pa: float = 1e5
    poisson: float = 0.3
    density: float = 1000.0
    yield_stress: float = 1e3
    hardening: float = 0.0
    friction_angle: float = 0.5
    cohesion: float = 0.0
    loss: float = 0.0
    """Loss factor at the body's slowest vibration [-]."""
    consistency: float = 0.0
    """K_c of a liquid [Pa sⁿ]."""
    flow_index: float = 1.0

    @property
    def p_wave_modulus(self) -> float:
        """λ + 2μ [Pa]."""
        nu = self.poisson
        return self.young_pa * (1 - nu) / ((1 + nu) * (1 - 2 * nu))


RUBBER = Stuff()


def body(
    points: Points,
    volume: float,
    stuff: Stuff = RUBBER,
    velocity: tuple = (0.0, 0.0, 0.0),
    spin: tuple = (0.0, 0.0, 0.0),
    **more,
) -> Body:
    """Give points equal shares of a volume [m³], one material and a rigid motion.

    Args:
        points: Where they are [m].
        volume: Of all of them [m³].
        stuff: The material.
        velocity: Of the centre [m/s].
        spin: About the centre [rad/s].
        more: ``rigid``, ``surface``, ``push`` and ``name`` of the ``Body``.

    """
    n = len(points)
    numbers = {
        name: np.full(n, float(getattr(stuff, name)))
        for name in (
            "density",
            "young_pa",
            "poisson",
            "yield_stress",
            "hardening",
            "friction_angle",
            "cohesion",
            "loss",
        )
    }
    shear = stuff.young_pa / (2 * (1 + stuff.poisson))
    extent = max(float(np.ptp(points, axis=0).max()), 1e-30)
    numbers["vibration"] = np.full(n, np.pi * np.sqrt(shear / stuff.density) / extent)
    if stuff.law is Law.FLUID:
        more["consistency"] = np.full(n, stuff.consistency)
        more["flow_index"] = np.full(n, stuff.flow_index)
    arm = points - points.mean(axis=0)
    if more.get("surface") is None:
        more["surface"] = np.zeros((0, 3))
    return Body(
        position=np.asarray(points, np.float64),
        velocity=np.array(velocity) + np.cross(np.array(spin), arm),
        volume=np.full(n, volume / n),
        law=np.full(n, stuff.law.value),
        **{"name": "body"} | numbers | more,
    )


def problem(
    *bodies: Body,
    cell: float,
    friction: float | np.ndarray = 0.0,
    restitution: float = 0.0,
    planes: tuple | list = (),
    **more,
) -> Problem:
    """Put bodies together with one coefficient for all pairs; weightless unless told."""
    n = len(bodies) + len(planes)
    more.setdefault("gravity", (0.0, 0.0, 0.0))
    return Problem(
        bodies=tuple(bodies),
        cell=cell,
        friction=np.broadcast_to(np.asarray(friction, np.float64), (n, n)).copy(),
        restitution=np.full((n, n), float(restitution)),
        planes=tuple(planes),
        **more,
    )


# ---------------------------------------------------------------- surfaces and fills


def box_sdf(centre: tuple, size: tuple, turn: np.ndarray | None = None) -> Distance:
    """Distance from a box whose axes are the columns of ``turn``."""
    turn, half = np.eye(3) if turn is None else turn, np.array(size) / 2

    def distance(p: np.ndarray) -> np.ndarray:
        q = np.abs((p - np.array(centre)) @ turn) - half
        return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)

    return distance


def ball_sdf(centre: tuple, radius: float) -> Distance:
    """Distance from a ball."""
    return lambda p: np.linalg.norm(p - np.array(centre), axis=1) - radius


def cylinder_sdf(centre: tuple, radius: float, height: float, axis: int = 2) -> Distance:
    """Distance from a cylinder along a coordinate axis."""
    across = [k for k in range(3) if k != axis]

    def distance(p: np.ndarray) -> np.ndarray:
        q = p - np.array(centre)
        a = np.hypot(*q[:, across].T) - radius
        b = np.abs(q[:, axis]) - height / 2
        return np.minimum(np.maximum(a, b), 0) + np.hypot(np.maximum(a, 0), np.maximum(b, 0))

    return distance


def lattice(sdf: Distance, centre: tuple, reach: float, spacing: float) -> Points:
    """Points of a lattice centred on a body, inside its surface."""
    half = int(np.ceil(reach / spacing)) + 1
    axis = (np.arange(-half, half) + 0.5) * spacing
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points = np.array(centre) + grid
    return points[sdf(points) < -1e-9]


def blue_noise(sdf: Distance, centre: tuple, reach: float, spacing: float) -> Points:
    """Evenly random points, each at least half a spacing below the surface."""
    rng = np.random.default_rng(1)
    points = lattice(sdf, centre, reach, spacing)
    points = points + rng.uniform(-0.3, 0.3, points.shape) * spacing
    for _ in range(40):
        points = _below_surface(points, sdf, spacing)
        ij = cKDTree(points).query_pairs(1.2 * spacing, output_type="ndarray")
        apart = points[ij[:, 0]] - points[ij[:, 1]]
        distance = np.linalg.norm(apart, axis=1) + 1e-12
        move = apart * (0.2 * (1.2 * spacing - distance) / distance)[:, None]
        np.add.at(points, ij[:, 0], move)
        np.add.at(points, ij[:, 1], -move)
    return _below_surface(_below_surface(points, sdf, spacing), sdf, spacing)


def _below_surface(points: Points, sdf: Distance, spacing: float) -> Points:
    over = sdf(points) + 0.5 * spacing
    out = np.flatnonzero(over > 0)
    if len(out):
        step = 1e-4 * spacing * np.eye(3)
        slope = np.stack([sdf(points[out] + s) - sdf(points[out] - s) for s in step], axis=1)
        slope /= np.maximum(np.linalg.norm(slope, axis=1), 1e-12)[:, None]
        points[out] -= over[out][:, None] * slope
    return points


def bricks(centre: tuple, size: tuple, spacing: float, turn: np.ndarray | None = None) -> Points:
    """Points in the middles of equal bricks that fill a box exactly."""
    counts = [max(1, round(s / spacing)) for s in size]
    axes = [((np.arange(n) + 0.5) / n - 0.5) * s for n, s in zip(counts, size, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.array(centre) + grid @ (np.eye(3) if turn is None else turn).T


# ---------------------------------------------------------------- bodies


def box(
    centre: tuple, size: tuple, spacing: float, fill: str = "bricks", turn: np.ndarray | None = None, **more
) -> Body:
    """Fill a box with bricks in its own frame, or with a ``lattice`` of the world, or ``blue``."""
    if fill == "bricks":
        points = bricks(centre, size, spacing, turn)
    else:
        reach = float(np.linalg.norm(size)) / 2
        points = _filled(fill, box_sdf(centre, size, turn), centre, reach, spacing)
    return body(points, float(np.prod(size)), **more)


def ball(centre: tuple, radius: float, spacing: float, fill: str = "lattice", **more) -> Body:
    """Fill a ball."""
    points = _filled(fill, ball_sdf(centre, radius), centre, radius, spacing)
    return body(points, 4 / 3 * np.pi * radius**3, **more)


def cylinder(centre: tuple, radius: float, height: float, spacing: float, fill: str = "lattice", **more) -> Body:
    """Fill an upright cylinder."""
    reach = float(np.hypot(radius, height / 2))
    points = _filled(fill, cylinder_sdf(centre, radius, height), centre, reach, spacing)
    return body(points, np.pi * radius**2 * height, **more)


def disc(centre: tuple, radius: float, thickness: float, spacing: float, **more) -> Body:
    """Fill a flat cylinder along y, whose layers share its thickness exactly."""
    half = int(np.ceil(radius / spacing)) + 1
    axis = (np.arange(-half, half) + 0.5) * spacing
    flat = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    flat = flat[np.hypot(*flat.T) < radius]
    count = max(1, round(thickness / spacing))
    layers = ((np.arange(count) + 0.5) / count - 0.5) * thickness
    sheet = np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]]) + np.array(centre)
    points = np.concatenate([sheet + np.array([0.0, y, 0.0]) for y in layers])
    return body(points, np.pi * radius**2 * thickness, **more)


def _filled(fill: str, sdf: Distance, centre: tuple, reach: float, spacing: float) -> Points:
    fills = {"lattice": lattice, "blue": blue_noise}
    return fills[fill](sdf, centre, reach, spacing)


# ---------------------------------------------------------------- surface points and planes


def ball_surface(centre: tuple, radius: float, count: int) -> Points:
    """Spread points evenly on a sphere (Fibonacci)."""
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    r = np.sqrt(1 - z * z)
    return np.array(centre) + radius * np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


def round_rows(normal: Points, along: Points, ball: float, arc: float, surface: Points) -> Float[np.ndarray, "N 12"]:
    """Say how a surface curves at points on it: see ``types.ROUNDING``."""
    rows = np.zeros((len(surface), CURVATURE_COLUMNS))
    rows[:, :3], rows[:, 3:6], rows[:, 6:8], rows[:, 8] = (normal, along, (ball, arc), point_reach(surface))
    rows[:, 9] = is_surrounded(rows, surface)
    rows[:, 10] = 1.0 / (ball + arc)
    rows[:, 11] = 1.0 / ball if ball > 0.0 else 0.0
    return rows


def ball_rounding(centre: tuple, radius: float, surface: Points) -> Float[np.ndarray, "N 12"]:
    """Say that points on a ball's surface stand for a ball."""
    normal = (surface - np.array(centre)) / radius
    along = np.cross(normal, [0.0, 0.0, 1.0])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return round_rows(normal, along, radius, 0.0, surface)


def box_surface(centre: tuple, size: tuple, count: int = 9, turn: np.ndarray | None = None) -> Points:
    """Spread points evenly on the faces of a box."""
    axis = np.linspace(-0.5, 0.5, count)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    skin = grid[np.abs(grid).max(axis=1) > 0.499] * np.array(size)
    return np.array(centre) + skin @ (np.eye(3) if turn is None else turn).T


def floor(height: float = 0.0) -> Plane:
    """Return a level floor."""
    return Plane((0.0, 0.0, 1.0), height)


def walls(axis: int, low: float, high: float) -> list[Plane]:
    """Two walls that face each other: what lies between them keeps its width if they are smooth."""
    normal = np.eye(3)[axis]
    return [Plane(tuple(normal), low), Plane(tuple(-normal), -high)]


def turn_about_y(angle: float) -> np.ndarray:
    """Rotation that lifts +x towards +z by ``angle`` [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
