"""Depth of Gaussians: of the surface that each pixel's ray meets first, not a mean of depths."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from scipy.spatial.transform import Rotation

from corporeal.core.types import Camera, Gaussians
from corporeal.reconstruction.gaussians.gaussian_initialisation import free_depths
from corporeal.reconstruction.gaussians.gaussian_parameters import parameters_of_gaussians
from corporeal.reconstruction.gaussians.kernels_project import PinholeCamera
from corporeal.reconstruction.gaussians.kernels_space_carving import depth_slopes, meet_surfaces
from corporeal.reconstruction.gaussians.rasteriser_numba import deal_tiles, draw, picture_of_drawing, pinhole_of_camera
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool


@dataclass(frozen=True)
class DepthRendering:
    """What some cameras see; V views."""

    rgb: Float32[np.ndarray, "V H W 3"]
    """sRGB."""
    depth: Float32[np.ndarray, "V H W"]
    """Along the camera's z, to where the first surface begins [m]; inf where there is nothing."""
    far: Float32[np.ndarray, "V H W"]
    """The same, to the far side of the Gaussian at which half of the light is lost [m]."""
    met: Int[np.ndarray, "V H W"]
    """Which Gaussian takes the middle of the light; -1: none."""
    rows: Float[np.ndarray, "V 18"]
    """Cameras as kernels read them: camera from world (3 × 4), fx, fy, cx, cy, width, height."""


def render_depth(gaussians: Gaussians, cameras: tuple[Camera, ...], pool: ThreadPool) -> DepthRendering:
    """Render Gaussians, and their depth, from every camera."""
    theta, clear = parameters_of_gaussians(gaussians), free_depths(cameras)
    eyes = [pinhole_of_camera(c, near=near) for c, near in zip(cameras, clear, strict=True)]
    shape = len(eyes), max(e.height for e in eyes), max(e.width for e in eyes)
    rgb = np.zeros((*shape, 3), np.float32)
    depth, far = (np.full(shape, np.inf, np.float32) for _ in range(2))
    met = np.full(shape, -1, np.int32)
    spread = covariances(gaussians)
    for k, eye in enumerate(eyes):
        # Colours, and which Gaussians each tile meets.
        drawing = draw(theta, eye, np.zeros(3), pool)
        picture = picture_of_drawing(drawing)
        own = k, slice(eye.height), slice(eye.width)
        rgb[own] = np.clip(picture.rgb / np.maximum(picture.alpha, 1e-3)[..., None], 0, 1)
        # How depth varies across each Gaussian; then the surface that each ray meets first.
        slope = np.empty((gaussians.count, 4), np.float32)
        seen = gaussians.mean, spread, drawing.ellipses, eye, slope
        pool.each(depth_slopes, [(*span, *seen) for span in pool.spans(gaussians.count)])
        found = depth[own], far[own], met[own]
        rest = drawing.first, drawing.ids, drawing.ellipses, slope, *found
        pool.each(meet_surfaces, [(t, *rest) for t in deal_tiles(drawing.first, pool)])
    return DepthRendering(rgb, depth, far, met, np.stack([_row(eye) for eye in eyes]))


def restrict_depth_to_objects(
    rendering: DepthRendering, of_object: Bool[np.ndarray, " N"], masks: Bool[np.ndarray, "V H W"] | None
) -> DepthRendering:
    """Let only what is of objects be met; where masks have none, nothing is there.

    Args:
        rendering: Of N Gaussians.
        of_object: Which of them are objects'; the others hide these.
        masks: Pixels that show objects; None: unknown.
    """
    met = np.where(of_object[rendering.met], rendering.met, -1)
    spilt = np.zeros(met.shape, bool) if masks is None else (met >= 0) & ~masks
    depth = np.where(spilt, np.float32(np.inf), rendering.depth)
    return replace(rendering, depth=depth, met=np.where(spilt, -1, met))


def covariances(gaussians: Gaussians) -> Float[np.ndarray, "N 3 3"]:
    """Return Σ = R diag(scale²) R^T [m²]."""
    turn = Rotation.from_quat(gaussians.rotation, scalar_first=True).as_matrix()
    half = turn * gaussians.scale[:, None, :]
    return half @ half.transpose(0, 2, 1)


def _row(eye: PinholeCamera) -> Float[np.ndarray, "18"]:
    pose = np.concatenate([eye.turn, eye.shift[:, None]], axis=1)
    return np.array([*pose.ravel(), eye.fx, eye.fy, eye.cx, eye.cy, eye.width, eye.height])
