"""Rasteriser of Gaussians with gradients on a GPU, by gsplat 1.5 (Ye et al. 2025) on CUDA.

The same two functions as ``raster``. What is drawn differs a little: an alpha may be 0.999 instead of 0.99, and a
Gaussian ends at three standard deviations.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch  # pyright: ignore[reportMissingImports]
from gsplat import rasterization  # pyright: ignore[reportMissingImports]

from corporeal.core.errors import UserError
from corporeal.reconstruction.gaussians.gaussian_parameters import (
    PARAM_COLOUR,
    PARAM_MEAN,
    PARAM_OPACITY,
    PARAM_ROTATION,
    PARAM_SCALE,
    ParameterMatrix,
)
from corporeal.reconstruction.gaussians.kernels_project import DILATION_PX2, ELLIPSE_COLUMNS, PinholeCamera
from corporeal.reconstruction.gaussians.rasteriser_numba import Drawing
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool


@dataclass(frozen=True)
class GsplatDrawing(Drawing):
    """A drawing that torch can go back through; it has no ellipses and no entries of its own."""

    leaf: Any
    """The Gaussians, as a tensor that wants a gradient."""
    made: Any
    """Red, green, blue and transmittance (4, H, W)."""


def require_cuda() -> None:
    """Raise UserError where there is no GPU."""
    if not torch.cuda.is_available():
        raise UserError(
            "The rasteriser 'gsplat' needs a GPU with CUDA, and torch finds none. Choose the rasteriser 'numba'."
        )


def draw(theta: ParameterMatrix, camera: PinholeCamera, background: np.ndarray, pool: ThreadPool) -> GsplatDrawing:
    """Draw Gaussians before a background; the GPU shares the work itself.

    Raises:
        UserError: There is no CUDA.
    """
    require_cuda()
    leaf = torch.from_numpy(np.ascontiguousarray(theta)).cuda().requires_grad_()
    behind = torch.from_numpy(background.astype(np.float32)).cuda()
    view, K = (torch.from_numpy(m).cuda() for m in matrices(camera))
    coefficients = (theta.shape[1] - PARAM_COLOUR) // 3
    colours, alphas, info = rasterization(
        means=leaf[:, PARAM_MEAN:PARAM_ROTATION],
        quats=leaf[:, PARAM_ROTATION:PARAM_SCALE],
        scales=torch.exp(leaf[:, PARAM_SCALE:PARAM_OPACITY]),
        opacities=torch.sigmoid(leaf[:, PARAM_OPACITY]),
        colors=leaf[:, PARAM_COLOUR:].reshape(len(theta), coefficients, 3),
        viewmats=view[None],
        Ks=K[None],
        width=camera.width,
        height=camera.height,
        near_plane=camera.near,
        eps2d=DILATION_PX2,
        sh_degree=round(coefficients**0.5) - 1,
        packed=False,
        backgrounds=behind[None],
        render_mode="RGB+D",
        rasterize_mode="antialiased",
    )
    through = 1 - alphas[0, ..., 0]
    made = torch.cat([colours[0, ..., :3].permute(2, 0, 1), through[None]])
    planes = torch.cat([made, colours[0, ..., 3][None]]).detach().cpu().numpy()
    seen = (info["radii"].reshape(len(theta), -1) > 0).all(dim=1).cpu().numpy()
    return GsplatDrawing(
        theta,
        camera,
        np.zeros((len(theta), ELLIPSE_COLUMNS), np.float32),
        np.zeros(1, np.int64),
        np.zeros(0, np.int32),
        np.zeros(0, np.int32),
        np.stack([np.zeros(len(theta), np.int64), seen.astype(np.int64)], axis=1),
        np.ascontiguousarray(planes, dtype=np.float32),
        leaf,
        made,
    )


def back(drawing: GsplatDrawing, slope: np.ndarray, pool: ThreadPool) -> ParameterMatrix:
    """Return dL/dθ from the slope, dL/d(red, green, blue, transmittance) of every pixel."""
    drawing.made.backward(torch.from_numpy(slope).to(drawing.made.device))
    return drawing.leaf.grad.cpu().numpy()


def matrices(camera: PinholeCamera) -> tuple[np.ndarray, np.ndarray]:
    """Return camera from world (4, 4) and K (3, 3), in single precision."""
    view = np.eye(4, dtype=np.float32)
    view[:3, :3], view[:3, 3] = camera.turn, camera.shift
    K = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]], np.float32)
    return view, K
