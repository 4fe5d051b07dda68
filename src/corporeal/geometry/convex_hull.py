"""Convex hulls and their resting poses."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import ConvexHull, HalfspaceIntersection, KDTree, QhullError

from corporeal.core.errors import UserError

ROLL_STEPS = 800
FIRST_ROLL_STEP_RAD = np.radians(1.5)
"""Of the first step; the last is 0."""
MIN_NEAR_NEIGHBOURS = 8
"""Neighbours that a point must have nearby, or it is astray."""
OUTLIER_DISTANCE_MEDIANS = 3.0
"""Mean distance to them from which on it is, in medians of all points."""
MAX_RESTING_POINTS = 20_000
"""Points that are looked at."""


@dataclass(frozen=True)
class RestingPose:
    """The nearest pose at rest."""

    up: Float[np.ndarray, "3"]
    """What is up then, in the points' frame: unit."""
    tilt: float
    """How far the object rolled [rad]."""


def find_resting_pose(points: Float[np.ndarray, "N 3"], up: Float[np.ndarray, "3"]) -> RestingPose | None:
    """Return how a rigid object would lie after rolling slowly down from where it was put.

    The height of the centre of mass over the lowest point, c · u − min_i v_i · u, falls along its steepest slope to the
    nearest minimum over directions u: there the lowest points support it. The points weigh all the same. None: they
    span no body.
    """
    body = points[:: max(1, len(points) // MAX_RESTING_POINTS)]
    centre = body.mean(axis=0)
    try:
        corners = body[ConvexHull(body).vertices]
    except QhullError:
        return None
    start = up / np.linalg.norm(up)
    here = best = start
    least = np.inf
    for k in range(ROLL_STEPS):
        heights = corners @ here
        lowest = np.argmin(heights)
        rise = centre @ here - heights[lowest]
        if rise < least:
            least, best = rise, here
        slope = centre - corners[lowest]
        slope = slope - (slope @ here) * here
        steep = np.linalg.norm(slope)
        if steep < 1e-12:
            break
        here = here - FIRST_ROLL_STEP_RAD * (1 - k / ROLL_STEPS) * slope / steep
        here = here / np.linalg.norm(here)
    return RestingPose(best, float(np.arccos(np.clip(best @ start, -1, 1))))


def remove_outliers(points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "M 3"]:
    """Return the points without those that are astray: far from all others."""
    if len(points) <= MIN_NEAR_NEIGHBOURS:
        return points
    apart = KDTree(points).query(points, k=MIN_NEAR_NEIGHBOURS + 1)[0][:, 1:].mean(axis=1)
    return points[apart <= OUTLIER_DISTANCE_MEDIANS * np.median(apart)]


WEIGHT_BEARING_HEIGHT_FRACTION = 2e-3
"""Of the largest side: what is no higher than this above the lowest point carries weight."""
MAX_UNDERSIDE_FACES = 16
"""Faces of a hull that are tried as undersides, largest first."""
UPRIGHT_LEAN_RAD, TOP_LEAN_RAD = 0.17, 0.1
"""How far a face may be from the horizontal: of a body that is upright, and of its top [rad]."""


@dataclass(frozen=True)
class ConvexPiece:
    """A convex body."""

    vertices: Float[np.ndarray, "V 3"]
    """[m]"""
    triangles: Int[np.ndarray, "T 3"]
    """Anticlockwise seen from outside."""

    @property
    def volume(self) -> float:
        """How much it holds [m³]."""
        return float(self._tetrahedra.sum())

    @property
    def centre(self) -> Float[np.ndarray, "3"]:
        """Centre of mass [m]."""
        middle = self.vertices.mean(axis=0)
        corners = self.vertices[self.triangles]
        weight = self._tetrahedra
        return (corners.sum(axis=1) + middle).T @ weight / (4 * weight.sum())

    @property
    def _tetrahedra(self) -> Float[np.ndarray, " T"]:
        """Volume between each triangle and the middle [m³]."""
        a, b, c = np.swapaxes(self.vertices[self.triangles] - self.vertices.mean(axis=0), 0, 1)
        return np.einsum("ij,ij->i", a, np.cross(b, c)) / 6


def convex_hull_of(points: Float[np.ndarray, "N 3"], thinnest: float) -> ConvexPiece:
    """Enclose points; what is flatter than ``thinnest`` [m] becomes a plate of that thickness.

    Raises:
        UserError: The points lie on a line or are fewer than three.
    """
    points = np.unique(points, axis=0)
    points = points if len(points) < 3 else _thickened_points(points, thinnest)
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError) as error:
        raise UserError("it has no surface: its points are fewer than three, or on a line") from (error)
    triangles = hull.simplices
    a, b, c = np.swapaxes(points[triangles], 0, 1)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    triangles = np.where(inward[:, None], triangles[:, ::-1], triangles)
    used, number = np.unique(triangles, return_inverse=True)
    return ConvexPiece(points[used], number.reshape(-1, 3).astype(np.int64))


def _thickened_points(points: np.ndarray, thinnest: float) -> np.ndarray:
    """Move points apart along the direction in which there is least of them."""
    _, spread, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    if spread[1] <= 1e-6 * spread[0]:
        return points
    lacking = thinnest - float(np.ptp(points @ axes[2]))
    if lacking <= 0:
        return points
    shift = 0.5 * lacking * axes[2]
    return np.concatenate([points - shift, points + shift])


def tip_angle(hull: ConvexPiece, centre: Float[np.ndarray, "3"], down: Float[np.ndarray, "3"]) -> float:
    """How far a body must be tilted before it falls over [rad]; 0 where it does not stand at all.

    The least angle, over the edges of the polygon it stands on, by which its centre of mass must turn to be above the
    edge.

    Args:
        hull: The body's.
        centre: Its centre of mass [m].
        down: Unit, in the body's frame: where the floor is.
    """
    below = (hull.vertices - centre) @ down
    side = float(np.ptp(hull.vertices, axis=0).max())
    foot = hull.vertices[below > below.max() - WEIGHT_BEARING_HEIGHT_FRACTION * side] - centre
    across = np.linalg.svd(down[None])[2][1:]
    try:
        edges = ConvexHull(foot @ across.T).equations
    except (QhullError, ValueError):
        return 0.0
    margin = float(-edges[:, 2].max())
    return float(np.arctan2(margin, below.max())) if margin > 0 else 0.0


@dataclass(frozen=True)
class StandingStance:
    """One way for a body to stand."""

    down: Float[np.ndarray, "3"]
    """Unit, in the body's frame: where the floor is."""
    tip: float
    """How far it must be tilted before it falls over [rad]."""
    top: float
    """Area of what is level at its top [m²]: what other objects can stand on."""


def standing_stances(hull: ConvexPiece, centre: Float[np.ndarray, "3"]) -> tuple[StandingStance, StandingStance]:
    """Return how a body stands upright, and how it stands best of all.

    Feet are seldom even: upright is any face of the hull that looks down to within ``UPRIGHT_LEAN_RAD``.
    """
    a, b, c = np.swapaxes(hull.vertices[hull.triangles], 0, 1)
    vector = 0.5 * np.cross(b - a, c - a)
    area = np.linalg.norm(vector, axis=1)
    normal = vector / np.maximum(area, 1e-300)[:, None]
    below = np.where(normal[:, 2] < -np.cos(UPRIGHT_LEAN_RAD), area, 0.0)

    def stance(down: np.ndarray) -> StandingStance:
        level = normal @ down < -np.cos(TOP_LEAN_RAD)
        return StandingStance(down, tip_angle(hull, centre, down), float(area[level].sum()))

    straight = stance(np.array([0.0, 0.0, -1.0]))
    leaning = [stance(d) for d in _largest_face_normals(normal, below, 0.01)]
    upright = max([straight, *leaning], key=lambda s: s.tip)
    any_way = [stance(d) for d in _largest_face_normals(normal, area, TOP_LEAN_RAD)]
    return upright, max([upright, *any_way], key=lambda s: s.tip)


def _largest_face_normals(normal: np.ndarray, area: np.ndarray, alike: float) -> list[np.ndarray]:
    """Return the normals of the largest faces, no two within ``alike`` [rad]."""
    found: list[np.ndarray] = []
    area = area.copy()
    while len(found) < MAX_UNDERSIDE_FACES and area.max() > 0:
        best = normal[np.argmax(area)]
        found.append(best)
        area[normal @ best > np.cos(alike)] = 0.0
    return found


SAME_PLANE_TOLERANCE = 1e-6
"""Of the largest side: planes, and corners, nearer than this are one."""


def simplify_convex(hull: ConvexPiece, most: int) -> ConvexPiece:
    """Enclose a convex body in one of at most so many corners.

    The body stays inside: what is left of it is cut from its upright box by planes of its own faces, always the one
    that the farthest corner is most beyond. So it stands on the same floor and against the same walls, and large flat
    faces stay exactly where they were.

    Args:
        hull: What.
        most: Number of corners, at least 8.
    """
    if len(hull.vertices) <= most:
        return hull
    middle = hull.vertices.mean(axis=0)
    points = hull.vertices - middle
    size = float(np.ptp(points, axis=0).max())
    faces = _distinct_planes(ConvexHull(points).equations, size)
    cut = _box_planes(points)
    corners = _plane_corners(cut, size)
    while True:
        beyond = corners @ faces[:, :3].T + faces[:, 3]
        worst = int(beyond[int(beyond.max(axis=1).argmax())].argmax())
        if beyond.max() < SAME_PLANE_TOLERANCE * size:
            break
        further = np.concatenate([cut, faces[worst : worst + 1]])
        found = _plane_corners(further, size)
        if len(found) > most:
            break
        cut, corners = further, found
    return _piece_of_corners(corners + middle)


def _box_planes(points: Float[np.ndarray, "V 3"]) -> Float[np.ndarray, "6 4"]:
    """Return the planes of the upright box about points: n · x + d ≤ 0 inside."""
    normals = np.concatenate([np.eye(3), -np.eye(3)])
    return np.column_stack([normals, -(points @ normals.T).max(axis=0)])


def _distinct_planes(equations: np.ndarray, size: float) -> np.ndarray:
    """Keep each plane once; triangles of one flat face have the same."""
    step = SAME_PLANE_TOLERANCE * np.array([1.0, 1.0, 1.0, size])
    _, first = np.unique(np.round(equations / step), axis=0, return_index=True)
    return equations[np.sort(first)]


def _plane_corners(planes: np.ndarray, size: float) -> np.ndarray:
    found = HalfspaceIntersection(planes, np.zeros(3)).intersections
    _, first = np.unique(np.round(found / (SAME_PLANE_TOLERANCE * size)), axis=0, return_index=True)
    return found[np.sort(first)]


def _piece_of_corners(corners: np.ndarray) -> ConvexPiece:
    hull = ConvexHull(corners)
    triangles = hull.simplices.copy()
    a, b, c = np.swapaxes(corners[triangles], 0, 1)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    used, number = np.unique(triangles, return_inverse=True)
    return ConvexPiece(corners[used], number.reshape(-1, 3).astype(np.int64))
