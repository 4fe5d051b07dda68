"""Bundle adjustment with anisotropic image noise.

pycolmap's adjustment takes all points for equally exact in all directions. Levenberg and Marquardt's method, the points
eliminated (Triggs et al., "Bundle adjustment, a modern synthesis", 2000).
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import bsr_array, csr_array
from scipy.spatial.transform import Rotation

MAX_LM_ITERATIONS = 30
MIN_COST_GAIN_FRACTION = 1e-6
"""Share of the cost that a step must gain, or it is the last."""
INITIAL_DAMPING, DAMPING_DECREASE, DAMPING_INCREASE, MAX_DAMPING = 1e-4, 0.2, 5.0, 1e6
"""Of the steps: at first, after one that gained and one that did not, and when to give up."""
MIN_POINT_DEPTH, BEHIND_CAMERA_ERROR_PX = 1e-6, 1e3
"""Depth below which a point is not before its camera; the error that it then has [px]."""
DAMPING_FLOOR = 1e-9
"""Keeps apart from zero what the frame and size of the whole, which are free, leave there."""
POSE_PARAMETERS, LENS_PARAMETERS = 6, 2
"""Numbers of a pose; of a lens: focal length and bend."""


@dataclass(frozen=True)
class Bundle:
    """V pictures by C lenses, P points, and S sightings of them."""

    rotation: Float[np.ndarray, "V 3 3"]
    """Of the world into each camera's frame."""
    shift: Float[np.ndarray, "V 3"]
    lens: Float[np.ndarray, "C 4"]
    """Focal length [px], middle [px], k1."""
    points: Float[np.ndarray, "P 3"]
    lens_of: Int[np.ndarray, " V"]
    view: Int[np.ndarray, " S"]
    point: Int[np.ndarray, " S"]
    seen: Float[np.ndarray, "S 2"]
    """Where each point was seen [px]."""
    white: Float[np.ndarray, "S 2 2"]
    """What makes its errors alike in all directions."""


def solve_bundle(bundle: Bundle, exact: float) -> Bundle:
    """Adjust poses, points, focal lengths and bends; middles stay.

    Args:
        bundle: Where it begins.
        exact: Error [px] from which on a sighting counts for less (Cauchy's loss).
    """
    error, slopes = _whitened_errors(bundle), _jacobian(bundle)
    cost, damping = _robust_cost(error, exact), INITIAL_DAMPING
    for _ in range(MAX_LM_ITERATIONS):
        normal = _NormalEquations(bundle, error, slopes, exact)
        while True:
            made = normal.step(damping)
            tried = _whitened_errors(made)
            gain = cost - _robust_cost(tried, exact)
            if gain > 0 or damping > MAX_DAMPING:
                break
            damping *= DAMPING_INCREASE
        if gain <= 0:
            break
        bundle, error, cost, damping = made, tried, cost - gain, damping * DAMPING_DECREASE
        if gain < MIN_COST_GAIN_FRACTION * cost:
            break
        slopes = _jacobian(bundle)
    return bundle


def _robust_cost(error: Float[np.ndarray, "S 2"], exact: float) -> float:
    return float(np.log1p(np.square(error).sum(axis=1) / exact**2).sum())


def _points_in_cameras(bundle: Bundle) -> tuple[Float[np.ndarray, "S 3"], Float[np.ndarray, "S 3"]]:
    """Return points about their cameras, and turned like these."""
    turned = np.einsum("sij,sj->si", bundle.rotation[bundle.view], bundle.points[bundle.point])
    return turned + bundle.shift[bundle.view], turned


def _whitened_errors(bundle: Bundle) -> Float[np.ndarray, "S 2"]:
    """Return how far points are from where they were seen, whitened [px]."""
    local, _ = _points_in_cameras(bundle)
    behind = local[:, 2] < MIN_POINT_DEPTH
    flat = local[:, :2] / np.where(behind, 1.0, local[:, 2])[:, None]
    focal, *_, bend = bundle.lens[bundle.lens_of[bundle.view]].T
    middle = bundle.lens[bundle.lens_of[bundle.view], 1:3]
    bent = focal * (1 + bend * np.square(flat).sum(axis=1))
    off = bent[:, None] * flat + middle - bundle.seen
    off[behind] = BEHIND_CAMERA_ERROR_PX
    return np.einsum("sij,sj->si", bundle.white, off)


@dataclass(frozen=True)
class _Jacobian:
    """Of each error: by the pose and lens that it depends on, and by its point."""

    camera: Float[np.ndarray, "S 2 8"]
    point: Float[np.ndarray, "S 2 3"]


def _jacobian(bundle: Bundle) -> _Jacobian:
    local, turned = _points_in_cameras(bundle)
    behind = local[:, 2] < MIN_POINT_DEPTH
    depth = np.where(behind, 1.0, local[:, 2])
    flat = local[:, :2] / depth[:, None]
    square = np.square(flat).sum(axis=1)
    focal, *_, bend = bundle.lens[bundle.lens_of[bundle.view]].T
    bent = 1 + bend * square
    by_flat = bent[:, None, None] * np.eye(2) + 2 * bend[:, None, None] * (flat[:, :, None] * flat[:, None])
    by_local = np.zeros((len(depth), 2, 3))
    by_local[:, 0, 0] = by_local[:, 1, 1] = 1 / depth
    by_local[:, :, 2] = -flat / depth[:, None]
    shift = (focal[:, None, None] * by_flat) @ by_local
    shift[behind] = 0
    shift = bundle.white @ shift
    x, y, z = turned.T
    nothing = np.zeros_like(x)
    turn = np.array([[nothing, z, -y], [-z, nothing, x], [y, -x, nothing]]).transpose(2, 0, 1)
    lens = np.stack([bent[:, None] * flat, (focal * square)[:, None] * flat], axis=2)
    lens[behind] = 0
    camera = np.concatenate([shift @ turn, shift, bundle.white @ lens], axis=2)
    return _Jacobian(camera, shift @ bundle.rotation[bundle.view])


class _NormalEquations:
    """Normal equations about where a bundle is, each sighting weighted by what it counts."""

    def __init__(self, bundle: Bundle, error: Float[np.ndarray, "S 2"], slopes: _Jacobian, exact: float) -> None:
        self.bundle = bundle
        self.views, count, total = len(bundle.rotation), len(bundle.points), len(error)
        size = POSE_PARAMETERS * self.views + LENS_PARAMETERS * len(bundle.lens)
        root = 1 / np.sqrt(1 + np.square(error).sum(axis=1) / exact**2)
        error = error * root[:, None]
        camera, point = slopes.camera * root[:, None, None], slopes.point * root[:, None, None]
        own = bundle.lens_of[bundle.view]
        pose = POSE_PARAMETERS * bundle.view[:, None] + np.arange(POSE_PARAMETERS)
        lens = POSE_PARAMETERS * self.views + LENS_PARAMETERS * own[:, None] + np.arange(LENS_PARAMETERS)
        by_camera = _sparse_rows(camera, np.concatenate([pose, lens], axis=1), size)
        by_point = _sparse_rows(point, 3 * bundle.point[:, None] + np.arange(3), 3 * count)
        self.cameras = (by_camera.T @ by_camera).toarray()
        self.between = csr_array(by_camera.T @ by_point)
        self.points = np.zeros((count, 3, 3))
        np.add.at(self.points, bundle.point, point.transpose(0, 2, 1) @ point)
        self.pull = -(by_camera.T @ error.reshape(2 * total))
        self.pulls = -(by_point.T @ error.reshape(2 * total))

    def step(self, damping: float) -> Bundle:
        """Return the bundle a step further."""
        count, size = len(self.points), len(self.cameras)
        inverse = np.linalg.inv(self.points * (1 + damping * np.eye(3)) + DAMPING_FLOOR**2 * np.eye(3))
        blocks = bsr_array((inverse, np.arange(count), np.arange(count + 1)))
        reduced = self.between @ blocks
        whole = self.cameras + damping * np.diag(np.diag(self.cameras) + DAMPING_FLOOR)
        whole = whole - (reduced @ self.between.T).toarray()
        whole += DAMPING_FLOOR * np.trace(whole) / size * np.eye(size)
        cameras = np.linalg.solve(whole, self.pull - reduced @ self.pulls)
        points = blocks @ (self.pulls - self.between.T @ cameras)
        pose = cameras[: POSE_PARAMETERS * self.views].reshape(-1, POSE_PARAMETERS)
        lens = self.bundle.lens.copy()
        lens[:, [0, 3]] += cameras[POSE_PARAMETERS * self.views :].reshape(-1, LENS_PARAMETERS)
        turn = Rotation.from_rotvec(pose[:, :3]).as_matrix()
        return replace(
            self.bundle,
            rotation=turn @ self.bundle.rotation,
            shift=self.bundle.shift + pose[:, 3:],
            lens=lens,
            points=self.bundle.points + points.reshape(-1, 3),
        )


def _sparse_rows(slopes: Float[np.ndarray, "S 2 K"], columns: Int[np.ndarray, "S K"], size: int) -> csr_array:
    """Return a matrix with two rows for each sighting."""
    total, _, each = slopes.shape
    where = np.broadcast_to(columns[:, None], slopes.shape).ravel()
    starts = np.arange(0, 2 * total * each + 1, each)
    return csr_array((slopes.ravel(), where, starts), shape=(2 * total, size))
