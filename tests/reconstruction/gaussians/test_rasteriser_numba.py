"""The rasteriser draws what the plain reference says, and knows how every number changes it."""

import numpy as np
import pytest
from rasteriser_reference import render_reference

from corporeal.core.errors import UserError
from corporeal.core.types import Camera
from corporeal.geometry.spherical_harmonics import sh_basis
from corporeal.reconstruction.gaussians import kernels_harmonics
from corporeal.reconstruction.gaussians.gaussian_parameters import gaussians_of_parameters, parameters_of_gaussians
from corporeal.reconstruction.gaussians.rasteriser_numba import back, draw, gaussian_weights, pinhole_of_camera, render
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

GROUPS = {
    "mean": slice(0, 3),
    "rotation": slice(3, 7),
    "scale": slice(7, 10),
    "opacity": slice(10, 11),
    "colour": slice(11, None),
}
BACKGROUND = np.array([0.2, 0.3, 0.4])


def cloud(count, degree, seed=0, spread=0.5, scale=(0.02, 0.17)):
    """Gaussians at random about the origin, as a matrix."""
    rng = np.random.default_rng(seed)
    parts = [
        spread * rng.normal(size=(count, 3)),
        rng.normal(size=(count, 4)),
        np.log(rng.uniform(*scale, (count, 3))),
        rng.normal(size=(count, 1)),
        0.3 * rng.normal(size=(count, 3 * (degree + 1) ** 2)),
    ]
    return np.concatenate(parts, axis=1).astype(np.float32)


def camera(width=37, height=29, focal=40.0, distance=2.5):
    """Stand aside, look at the origin, off the lens's middle."""
    pose = np.eye(4)
    turn = np.radians(25)
    pose[:3, :3] = [[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]
    pose[:3, 3] = -distance * pose[:3, 2]
    K = np.array([[focal, 0, 0.45 * width], [0, 1.1 * focal, 0.55 * height], [0, 0, 1]])
    return Camera(K, pose, width, height)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_a_picture_equals_the_reference(degree):
    theta, eye = cloud(40, degree), pinhole_of_camera(camera())
    with ThreadPool(2) as pool:
        planes = draw(theta, eye, BACKGROUND, pool).planes
    truth = render_reference(theta.astype(float), eye, BACKGROUND)
    assert np.abs(truth[3]).min() < 0.2, "hardly anything is in the picture"
    np.testing.assert_allclose(planes, truth, atol=3e-6)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_gradients_equal_those_of_the_reference(degree):
    """A complex step through the dense reference is exact: no difference is taken."""
    theta, eye = cloud(5, degree, seed=degree), pinhole_of_camera(camera(18, 16, 22.0))
    slope = np.random.default_rng(1).normal(size=(4, 16, 18)).astype(np.float32)
    with ThreadPool(2) as pool:
        gradient = back(draw(theta, eye, BACKGROUND, pool), slope, pool)
    exact = np.empty(theta.shape)
    for i, j in np.ndindex(theta.shape):
        moved = theta.astype(complex)
        moved[i, j] += 1e-30j
        exact[i, j] = (slope * render_reference(moved, eye, BACKGROUND)[:4].imag).sum() / 1e-30
    for name, columns in GROUPS.items():
        error = np.linalg.norm(gradient[:, columns] - exact[:, columns])
        assert error < 1e-5 * np.linalg.norm(exact[:, columns]), name


def test_gradients_equal_dense_autograd():
    torch = pytest.importorskip("torch", reason="torch is not installed: pip install torch")
    theta, eye = cloud(60, 1), pinhole_of_camera(camera(48, 40, 50.0))
    slope = np.random.default_rng(1).normal(size=(4, 40, 48)).astype(np.float32)
    with ThreadPool(2) as pool:
        drawing = draw(theta, eye, BACKGROUND, pool)
        gradient = back(drawing, slope, pool)
    x = torch.tensor(theta.astype(float), requires_grad=True)
    picture = dense(torch, x, eye)
    (picture * torch.tensor(slope)).sum().backward()
    np.testing.assert_allclose(drawing.planes[:4], picture.detach().numpy(), atol=3e-6)
    for name, columns in GROUPS.items():
        exact = x.grad.numpy()[:, columns]
        error = np.linalg.norm(gradient[:, columns] - exact)
        assert error < 1e-5 * np.linalg.norm(exact), name


def dense(torch, x, eye):
    """Draw Gaussians of degree 1 with tensors, every one at every pixel."""
    turn, shift = torch.tensor(eye.turn), torch.tensor(eye.shift)
    p = x[:, :3] @ turn.T + shift
    ratio = p[:, :2] / p[:, 2:]
    focal = torch.tensor([eye.fx, eye.fy], dtype=x.dtype)
    centre = torch.tensor([eye.cx, eye.cy], dtype=x.dtype)
    size = torch.tensor([eye.width, eye.height], dtype=x.dtype)
    held = torch.minimum(torch.maximum(ratio, -(centre + 0.15 * size) / focal),
                         (1.15 * size - centre) / focal)  # fmt: skip
    J = torch.zeros(len(x), 2, 3, dtype=x.dtype)
    J[:, 0, 0], J[:, 1, 1] = focal[0] / p[:, 2], focal[1] / p[:, 2]
    J = torch.cat([J[:, :, :2], -(focal * held / p[:, 2:])[:, :, None]], dim=2)
    w, a, b, c = torch.nn.functional.normalize(x[:, 3:7], dim=1).unbind(1)
    R = torch.stack([
        1 - 2 * (b * b + c * c), 2 * (a * b - w * c), 2 * (a * c + w * b),
        2 * (a * b + w * c), 1 - 2 * (a * a + c * c), 2 * (b * c - w * a),
        2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b),
    ], dim=1).view(-1, 3, 3)  # fmt: skip
    P = J @ turn @ R * x[:, None, 7:10].exp()
    thin = P @ P.transpose(1, 2)
    wide = thin + 0.3 * torch.eye(2, dtype=x.dtype)
    share = (torch.linalg.det(thin) / torch.linalg.det(wide)).clamp_min(2.5e-5)
    o = torch.sigmoid(x[:, 10]) * torch.sqrt(share)
    inverse, middle = torch.linalg.inv(wide), ratio * focal + centre
    d = torch.nn.functional.normalize(x[:, :3] - torch.tensor(eye.eye), dim=1)
    Y = torch.stack([0.28209479177387814 + 0 * d[:, 0], -0.4886025119029199 * d[:, 1],
                     0.4886025119029199 * d[:, 2], -0.4886025119029199 * d[:, 0]], 1)  # fmt: skip
    colour = (0.5 + torch.einsum("nk,nkc->nc", Y, x[:, 11:].view(-1, 4, 3))).clamp_min(0)
    v, u = torch.meshgrid(
        torch.arange(eye.height).double() + 0.5, torch.arange(eye.width).double() + 0.5, indexing="ij"
    )
    T, rgb = torch.ones_like(u), 0
    for i in torch.argsort(p[:, 2].detach()):
        e = torch.stack([u - middle[i, 0], v - middle[i, 1]], -1)
        alpha = (o[i] * torch.exp(-(e @ inverse[i] * e).sum(-1) / 2)).clamp(max=0.99)
        alpha = torch.where((alpha >= 1 / 255) & (T > 1e-4), alpha, 0.0)
        rgb = rgb + (T * alpha)[None] * colour[i, :, None, None]
        T = T * (1 - alpha)
    return torch.cat([rgb + T * torch.tensor(BACKGROUND)[:, None, None], T[None]])


def test_the_number_of_threads_changes_nothing():
    theta, eye = cloud(300, 1), pinhole_of_camera(camera(100, 70, 90.0))
    slope = np.random.default_rng(1).normal(size=(4, 70, 100)).astype(np.float32)
    results = []
    for threads in (1, 2, 3):
        with ThreadPool(threads) as pool:
            drawing = draw(theta, eye, BACKGROUND, pool)
            results.append((drawing.planes, back(drawing, slope, pool)))
    for planes, gradient in results[1:]:
        np.testing.assert_array_equal(planes, results[0][0])
        np.testing.assert_array_equal(gradient, results[0][1])


def test_what_cannot_be_drawn_is_left_out():
    good, eye = cloud(30, 1), pinhole_of_camera(camera())
    bad = np.repeat(cloud(1, 1), 9, axis=0)
    bad[0, 0], bad[1, 4], bad[2, 8], bad[3, 10] = np.nan, np.nan, np.nan, np.nan
    bad[4, :3] = camera().world_from_camera[:3, 3]  # in the eye
    bad[5, 7:10], bad[6, 7:10], bad[7, 0], bad[8, 10] = 300, np.inf, np.inf, -50
    slope = np.ones((4, eye.height, eye.width), np.float32)
    with ThreadPool(1) as pool:
        alone = draw(good, eye, BACKGROUND, pool)
        mixed = draw(np.concatenate([good, bad]), eye, BACKGROUND, pool)
        gradient = back(mixed, slope, pool)
        np.testing.assert_array_equal(mixed.planes, alone.planes)
        np.testing.assert_array_equal(gradient[:30], back(alone, slope, pool))
    assert not gradient[30:].any()


def test_nothing_at_all_is_the_background():
    gaussians = gaussians_of_parameters(cloud(0, 0))
    picture = render(gaussians, camera(), tuple(BACKGROUND))
    np.testing.assert_allclose(picture.rgb, np.broadcast_to(BACKGROUND, picture.rgb.shape))
    assert not picture.alpha.any() and np.isinf(picture.depth).all()


def test_what_is_too_near_is_not_drawn():
    theta, eye = cloud(40, 1), camera()
    z = pinhole_of_camera(eye).turn[2] @ theta[:, :3].T + pinhole_of_camera(eye).shift[2]
    near = float(np.median(z))
    some, far = render(gaussians_of_parameters(theta), eye, near=near), theta[z >= near]
    np.testing.assert_array_equal(some.rgb, render(gaussians_of_parameters(far), eye).rgb)
    assert np.abs(some.rgb - render(gaussians_of_parameters(theta), eye).rgb).max() > 0.1


def test_depth_is_that_of_a_wall():
    """A dense flat sheet across the view, 2.5 m away."""
    theta = cloud(4000, 0, scale=(0.06, 0.08))
    eye = camera()
    plane = np.random.default_rng(0).uniform(-3, 3, (4000, 2))
    theta[:, :3] = plane @ eye.world_from_camera[:3, :2].T
    theta[:, 10] = 3
    picture = render(gaussians_of_parameters(theta), eye)
    covered = picture.alpha > 0.9
    assert covered.mean() > 0.3
    np.testing.assert_allclose(picture.depth[covered], 2.5, atol=1e-5)


def test_parameters_come_back():
    theta = cloud(20, 3)
    again = parameters_of_gaussians(gaussians_of_parameters(theta))
    theta[:, 3:7] /= np.linalg.norm(theta[:, 3:7], axis=1, keepdims=True)
    np.testing.assert_allclose(again, theta, atol=1e-6, rtol=1e-6)


@pytest.mark.parametrize("coefficients", [1, 4, 9, 16])
def test_harmonics_and_slopes_equal_those_of_the_geometry(coefficients):
    degree = int(np.sqrt(coefficients)) - 1
    d = np.random.default_rng(0).normal(size=3)
    d /= np.linalg.norm(d)
    Y, S = np.empty(16), np.empty((16, 3))
    kernels_harmonics.harmonics(*d, coefficients, Y)
    kernels_harmonics.harmonics_gradient(*d, coefficients, S)
    np.testing.assert_allclose(Y[:coefficients], sh_basis(d[None], degree)[0], atol=1e-14)
    steps = d + 1e-30j * np.eye(3)
    np.testing.assert_allclose(S[:coefficients], sh_basis(steps, degree).imag.T / 1e-30, atol=1e-13, rtol=0)


@pytest.mark.parametrize("cell", [1, 4, 16])
def test_weights_add_up_to_what_is_covered(cell):
    eye = camera(40, 36)
    gaussians = gaussians_of_parameters(cloud(200, 1))
    share = gaussian_weights(gaussians, eye, cell)
    alpha = render(gaussians, eye).alpha
    rows, columns = -(-36 // cell), -(-40 // cell)
    padded = np.zeros((rows * cell, columns * cell))
    padded[:36, :40] = alpha
    cells = padded.reshape(rows, cell, columns, cell).sum(axis=(1, 3))
    np.testing.assert_allclose(share.sum(axis=0).reshape(rows, columns), cells, atol=1e-3)


def test_weights_with_colours_make_the_picture():
    theta, eye = cloud(200, 0), camera()
    theta[:, 11:] = np.abs(theta[:, 11:])
    gaussians = gaussians_of_parameters(theta)
    colour = 0.5 + 0.28209479177387814 * theta[:, 11:]
    rgb = (gaussian_weights(gaussians, eye).T @ colour).reshape(eye.height, eye.width, 3)
    np.testing.assert_allclose(rgb, render(gaussians, eye).rgb, atol=1e-5)


def test_a_skewed_camera_is_refused():
    skewed = camera()
    skewed.K[0, 1] = 3.0
    with pytest.raises(UserError, match="skewed"):
        render(gaussians_of_parameters(cloud(1, 0)), skewed)


def test_a_cell_that_does_not_divide_a_tile_is_refused():
    with pytest.raises(UserError, match="1, 2, 4, 8 or 16"):
        gaussian_weights(gaussians_of_parameters(cloud(1, 0)), camera(), 3)
