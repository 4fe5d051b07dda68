"""Learning through gsplat, of which a plain stand-in with the same signature takes the place.

No test needs a card: what is held is that every number reaches gsplat in the form that it asks for,
and that what comes back means the same as what ``raster`` says.
"""

import sys
from types import ModuleType

import numpy as np
import pytest
from splat_scenes import around, blobs

from corporeal.core.errors import UserError
from corporeal.core.types import Views
from corporeal.reconstruction.gaussians import rasteriser_numba
from corporeal.reconstruction.gaussians.gaussian_parameters import parameters_of_gaussians
from corporeal.reconstruction.gaussians.rasteriser_numba import pinhole_of_camera
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.train_gaussians import train_gaussians
from corporeal.reconstruction.gaussians.training_schedule import TrainConfig


def rasterization(
    means,
    quats,
    scales,
    opacities,
    colors,
    viewmats,
    Ks,
    width,
    height,
    near_plane=0.01,
    far_plane=1e10,
    radius_clip=0.0,
    eps2d=0.3,
    sh_degree=None,
    packed=True,
    tile_size=16,
    backgrounds=None,
    render_mode="RGB",
    rasterize_mode="classic",
):
    """Draw every Gaussian at every pixel; harmonics of degree 0."""
    import torch

    n = len(means)
    assert means.shape == scales.shape == (n, 3) and quats.shape == (n, 4)
    assert opacities.shape == (n,) and colors.shape == (n, (sh_degree + 1) ** 2, 3)
    assert viewmats.shape == (1, 4, 4) and Ks.shape == (1, 3, 3) and backgrounds.shape == (1, 3)
    assert rasterize_mode == "antialiased" and render_mode == "RGB+D" and not packed
    view, K = viewmats[0], Ks[0]
    p = means @ view[:3, :3].T + view[:3, 3]
    w, x, y, z = (quats / quats.norm(dim=1, keepdim=True)).T
    R = torch.stack(
        [
            *(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            *(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            *(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        ],
        dim=1,
    ).reshape(n, 3, 3)
    u, v, one = p[:, 0] / p[:, 2], p[:, 1] / p[:, 2], torch.zeros(n)
    f = K[0, 0] / p[:, 2], K[1, 1] / p[:, 2]
    J = torch.stack([f[0], one, -f[0] * u, one, f[1], -f[1] * v], dim=1).reshape(n, 2, 3)
    M = J @ view[:3, :3] @ R * scales[:, None, :]
    flat = M @ M.transpose(1, 2)
    wide = flat + eps2d * torch.eye(2)
    o = opacities * torch.sqrt(torch.det(flat) / torch.det(wide))
    at = torch.stack([K[0, 0] * u + K[0, 2], K[1, 1] * v + K[1, 2]], dim=1)
    rows, columns = torch.meshgrid(torch.arange(height), torch.arange(width), indexing="ij")
    d = torch.stack([columns, rows], dim=-1) + 0.5 - at[:, None, None]
    s = 0.5 * torch.einsum("nhwi,nij,nhwj->nhw", d, torch.inverse(wide), d)
    alpha = (o[:, None, None] * torch.exp(-s)).clamp(max=0.99)
    alpha = torch.where((alpha >= 1 / 255) & (p[:, 2] >= near_plane)[:, None, None], alpha, 0.0)
    order = torch.argsort(p[:, 2])
    alpha = alpha[order]
    before = torch.cumprod(torch.cat([torch.ones(1, height, width), 1 - alpha]), dim=0)
    rgb = torch.clamp_min(0.28209479177387814 * colors[:, 0] + 0.5, 0)
    values = torch.cat([rgb, p[:, 2:]], dim=1)[order]
    made = torch.einsum("nhw,nc->hwc", before[:-1] * alpha, values)
    behind = torch.cat([backgrounds[0], torch.zeros(1)])
    made = made + before[-1][..., None] * behind
    return made[None], 1 - before[-1][None, ..., None], {"radii": torch.ones(1, n, 2).int()}


@pytest.fixture
def stand_in(monkeypatch):
    torch = pytest.importorskip("torch")
    gsplat = ModuleType("gsplat")
    gsplat.rasterization = rasterization
    monkeypatch.setitem(sys.modules, "gsplat", gsplat)
    monkeypatch.delitem(sys.modules, "corporeal.reconstruction.gaussians.rasteriser_gsplat", raising=False)
    monkeypatch.setattr(torch.Tensor, "cuda", lambda tensor: tensor)
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    return torch


@pytest.mark.slow
def test_drawings_and_gradients_are_those_of_the_processor(stand_in):
    from corporeal.reconstruction.gaussians import rasteriser_gsplat

    theta, camera = parameters_of_gaussians(blobs(30)), pinhole_of_camera(around(1)[0], near=0.5)
    background = np.array([0.2, 0.5, 0.9], np.float32)
    slope = np.random.default_rng(0).normal(size=(4, 40, 48)).astype(np.float32)
    with ThreadPool(1) as pool:
        ours, theirs = (room.draw(theta, camera, background, pool) for room in (rasteriser_numba, rasteriser_gsplat))
        np.testing.assert_allclose(theirs.planes, ours.planes, atol=2e-3)
        exact = rasteriser_numba.back(ours, slope, pool)
        found = rasteriser_gsplat.back(theirs, slope, pool)
    for columns in (slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 11), slice(11, 14)):
        size = np.abs(exact[:, columns]).max()
        np.testing.assert_allclose(found[:, columns], exact[:, columns], atol=0.02 * size)
    assert (theirs.spans[:, 1] > theirs.spans[:, 0]).all()


def test_a_training_runs_through_it(stand_in):
    cameras = around(4, size=(24, 20), focal=25.0)
    shades = np.random.default_rng(0).integers(0, 255, (4, 20, 24, 3)).astype(np.uint8)
    masks = np.ones((4, 20, 24), np.bool_)
    config = TrainConfig("draft", gaussians=50, steps=4, threads=1, rasteriser="gsplat")
    from corporeal.reconstruction.gaussians.gaussian_initialisation import StartPoints

    points = StartPoints(blobs(50).mean, np.full((50, 3), 0.5))
    # Of degree 1: the stand-in leaves what depends on direction without a gradient.
    out = train_gaussians(Views(shades, cameras), masks, points, config)
    assert out.gaussians.count == 50 and np.isfinite(out.gaussians.mean).all()
    assert not out.gaussians.sh[:, 1:].any()


def test_without_a_card_it_says_so(stand_in, monkeypatch):
    from corporeal.reconstruction.gaussians import rasteriser_gsplat

    monkeypatch.setattr(stand_in.cuda, "is_available", lambda: False)
    with ThreadPool(1) as pool, pytest.raises(UserError, match="CUDA, and torch finds none"):
        rasteriser_gsplat.draw(parameters_of_gaussians(blobs(3)), pinhole_of_camera(around(1)[0]), np.zeros(3), pool)


def test_without_gsplat_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "gsplat", None)
    monkeypatch.setitem(sys.modules, "torch", None)
    monkeypatch.delitem(sys.modules, "corporeal.reconstruction.gaussians.rasteriser_gsplat", raising=False)
    cameras = around(4)
    views = Views(np.zeros((4, 40, 48, 3), np.uint8), cameras)
    with pytest.raises(UserError, match="'gsplat' needs 'torch'"):
        train_gaussians(views, config=TrainConfig("draft", rasteriser="gsplat"))
