"""What cameras see of Gaussians: the surface that each pixel's ray meets, not a mean of depths."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int
from scipy.spatial.transform import Rotation

from corporeal.splats.crew import Crew
from corporeal.splats.kernels_carve import meet
from corporeal.splats.kernels_project import DILATION, Pinhole
from corporeal.splats.parameters import parameters
from corporeal.splats.raster import dealt, draw, picture_of, pinhole
from corporeal.splats.start import clearance
from corporeal.types import Camera, Gaussians

REACH = 3.0
"""Nothing of a Gaussian is met farther from its mean, in standard deviations along the view."""


@dataclass(frozen=True)
class Sight:
    """What some cameras see; V views."""

    rgb: Float32[np.ndarray, "V H W 3"]
    """sRGB."""
    depth: Float32[np.ndarray, "V H W"]
    """Along the camera's z, to where the first surface begins [m]; inf where there is nothing."""
    met: Int[np.ndarray, "V H W"]
    """Which Gaussian takes the middle of the light; -1: none."""
    rows: Float[np.ndarray, "V 18"]
    """Cameras as kernels read them: camera from world (3 × 4), fx, fy, cx, cy, width, height."""


def looked(gaussians: Gaussians, cameras: tuple[Camera, ...], crew: Crew) -> Sight:
    """Look at Gaussians with every camera."""
    theta, clear = parameters(gaussians), clearance(cameras)
    eyes = [pinhole(c, near=near) for c, near in zip(cameras, clear, strict=True)]
    shape = len(eyes), max(e.height for e in eyes), max(e.width for e in eyes)
    rgb = np.zeros((*shape, 3), np.float32)
    depth = np.full(shape, np.inf, np.float32)
    met = np.full(shape, -1, np.int32)
    spread = covariances(gaussians)
    for k, eye in enumerate(eyes):
        drawing = draw(theta, eye, np.zeros(3), crew)
        picture = picture_of(drawing)
        own = k, slice(eye.height), slice(eye.width)
        rgb[own] = np.clip(picture.rgb / np.maximum(picture.alpha, 1e-3)[..., None], 0, 1)
        slope = slopes(gaussians.mean, spread, eye)
        rest = drawing.first, drawing.ids, drawing.ellipses, slope, depth[own], met[own]
        crew.each(meet, [(t, *rest) for t in dealt(drawing.first, crew)])
    return Sight(rgb, depth, met, np.stack([_row(eye) for eye in eyes]))


def covariances(gaussians: Gaussians) -> Float[np.ndarray, "N 3 3"]:
    """Return Σ = R diag(scale²) R^T [m²]."""
    turn = Rotation.from_quat(gaussians.rotation, scalar_first=True).as_matrix()
    half = turn * gaussians.scale[:, None, :]
    return half @ half.transpose(0, 2, 1)


def slopes(
    mean: Float[np.ndarray, "N 3"], spread: Float[np.ndarray, "N 3 3"], eye: Pinhole
) -> Float32[np.ndarray, "N 4"]:
    """Return how the depth of each Gaussian's densest point changes with the pixel, along u and v.

    In the affine approximation of the projection (u, v, z) is Gaussian, and z given (u, v) has the
    mean z_0 + Σ_z,uv Σ_uv^-1 (u - u_0, v - v_0). Also how far from z_0 that may be, and how far
    before it the Gaussian begins: one standard deviation of z given (u, v).
    """
    p = mean.astype(np.float64) @ eye.turn.T + eye.shift
    z = np.maximum(p[:, 2], eye.near)
    J = np.zeros((len(p), 3, 3))
    J[:, 0, 0], J[:, 0, 2] = eye.fx / z, -eye.fx * p[:, 0] / z**2
    J[:, 1, 1], J[:, 1, 2] = eye.fy / z, -eye.fy * p[:, 1] / z**2
    J[:, 2, 2] = 1
    T = J @ eye.turn
    S = T @ spread @ T.transpose(0, 2, 1)
    a, b, c = S[:, 0, 0] + DILATION, S[:, 0, 1], S[:, 1, 1] + DILATION
    det = a * c - b * b
    along_u = (c * S[:, 0, 2] - b * S[:, 1, 2]) / det
    along_v = (a * S[:, 1, 2] - b * S[:, 0, 2]) / det
    # The dilation of pictures makes nothing thicker.
    left = np.linalg.det(S) / np.maximum(S[:, 0, 0] * S[:, 1, 1] - S[:, 0, 1] ** 2, 1e-30)
    columns = [along_u, along_v, REACH * np.sqrt(S[:, 2, 2]), np.sqrt(np.maximum(left, 0))]
    return np.stack(columns, axis=1).astype(np.float32)


def _row(eye: Pinhole) -> Float[np.ndarray, "18"]:
    pose = np.concatenate([eye.turn, eye.shift[:, None]], axis=1)
    return np.array([*pose.ravel(), eye.fx, eye.fy, eye.cx, eye.cy, eye.width, eye.height])
