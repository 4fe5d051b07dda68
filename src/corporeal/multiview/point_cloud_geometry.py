"""Normals and thickness of surfaces given as points."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

SIGMA_PER_MEDIAN_DEVIATION = 1.4826
"""Standard deviation over the median distance from the median, where errors are normal:
1/Φ⁻¹(3/4) (Hampel 1974)."""


MIN_BALL_TOUCH_ANGLE_RAD = np.radians(60.0)
"""A ball whose two touching points stand less than this apart, seen from its middle, touches noise or a blunt edge, not
another side (Peters, "Geographical point cloud modelling with the 3D medial axis transform", 2018, takes 20° to 32°).
It is twice the tilt from the one point to the other."""
MAX_FITTED_BALLS = 8000
"""Points at which balls are fitted; others take the nearest one's. From the middle of what is round all points are
equally near, and each search visits them all."""
KDTREE_LEAF_SIZE = 128
"""Points that such a search looks at one by one, quicker than it would sort them out."""
MAX_BALL_ITERATIONS = 30
"""Balls shrink a handful of times; points that are still shrinking then are as thin as noise."""


def nearest_neighbours(position: Float[np.ndarray, "N 3"], count: int) -> Int[np.ndarray, "N k"]:
    """Return the nearest points of every point, itself first; all where there are fewer."""
    near = min(count, len(position))
    _, found = KDTree(position).query(position, k=near)
    return np.asarray(found, np.int64).reshape(-1, near)


def point_normals(
    position: Float[np.ndarray, "N 3"], near: Int[np.ndarray, "N k"], towards: Float[np.ndarray, "N 3"]
) -> Float[np.ndarray, "N 3"]:
    """Return unit normals: the direction of least spread among neighbours (Hoppe et al. 1992).

    Args:
        position: World [m].
        near: Neighbours of every point.
        towards: Roughly where the outside is, of any length.
    """
    made = np.empty((len(position), 3))
    for start in range(0, len(position), 1 << 16):
        rows = slice(start, start + (1 << 16))
        local = position[near[rows]]
        local = local - local.mean(axis=1, keepdims=True)
        _, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", local, local))
        made[rows] = axes[:, :, 0]
    inward = np.sum(made * towards, axis=1) < 0
    made[inward] *= -1
    return made


def medial_ball_thickness(
    position: Float[np.ndarray, "N 3"], normal: Float[np.ndarray, "N 3"]
) -> Float[np.ndarray, " N"]:
    """Return the diameter of the largest ball inside that touches the surface here [m].

    Balls shrink until they hold no point (Ma, Bae and Choi, "3D medial axis point approximation using nearest neighbors
    and the normal field", 2012). Nothing is thicker than the points' box is
    long: where the other side was not seen, that is the answer.

    Args:
        position: World [m].
        normal: Unit, outward.
    """
    tree = KDTree(position, leafsize=KDTREE_LEAF_SIZE)
    every = np.linspace(0, len(position) - 1, min(MAX_FITTED_BALLS, len(position))).astype(np.int64)
    rows = np.asarray(tree.indices)[every]
    radius = _medial_ball_radii(tree, position, rows, normal[rows])
    _, who = KDTree(position[rows]).query(position)
    return 2 * radius[who]


def _medial_ball_radii(tree: KDTree, position: np.ndarray, rows: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the radius of the ball at some of the points."""
    radius = np.full(len(rows), np.linalg.norm(np.ptp(position, axis=0)) / 2)
    active = np.arange(len(rows))
    for _ in range(MAX_BALL_ITERATIONS):
        if not len(active):
            break
        p, n, r = position[rows[active]], normal[active], radius[active]
        distance, who = tree.query(p - r[:, None] * n)
        to = p - position[who]
        depth = 2 * np.sum(n * to, axis=1)
        apart = np.sum(to**2, axis=1)
        inside = (distance < r * (1 - 1e-6)) & (depth > 0) & (apart > 0)
        smaller = apart / np.where(inside, depth, 1)
        half = np.sqrt(apart) / (2 * np.maximum(smaller, 1e-300))
        inside &= (smaller < r) & (2 * np.arcsin(np.minimum(half, 1)) > MIN_BALL_TOUCH_ANGLE_RAD)
        radius[active[inside]] = smaller[inside]
        active = active[inside]
    return radius
