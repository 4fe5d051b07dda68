"""Fitting a surface to outlines never turns it inside out."""

import numpy as np
import pytest
import trimesh
from splat_scenes import around

from corporeal.geometry.mesh import Mesh, signed_volume
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.reconstruction.gaussians.depth_rendering import DepthRendering
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.surface.outline_fitting import find_object_outlines, fit_to_outlines

SIDE, FOCAL, AWAY = 96, 84.0, 3.5
PIXEL = AWAY / FOCAL
FLOOR = -2.0


def eyes(count=16):
    return around(count, (SIDE, SIDE), AWAY, FOCAL, np.zeros(3))


def masks(mesh):
    """Pixels that show a mesh, in every view."""
    out = []
    for c in eyes():
        y, x = np.mgrid[:SIDE, :SIDE] + 0.5
        ray = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3) @ np.linalg.inv(c.K).T
        ray = ray @ c.world_from_camera[:3, :3].T
        eye = np.tile(c.world_from_camera[:3, 3], (len(ray), 1))
        out.append(mesh.ray.intersects_any(eye, ray).reshape(SIDE, SIDE))
    return np.stack(out)


def rendering(shown):
    """All that is shown is as far away as the middle."""
    depth = np.where(shown, AWAY, np.inf).astype(np.float32)
    rows = []
    for c in eyes():
        turn, eye = c.world_from_camera[:3, :3].T, c.world_from_camera[:3, 3]
        pose = np.concatenate([turn, -(turn @ eye)[:, None]], axis=1)
        K = c.K
        rows.append([*pose.ravel(), K[0, 0], K[1, 1], K[0, 2], K[1, 2], SIDE, SIDE])
    rgb = np.zeros((*shown.shape, 3), np.float32)
    return DepthRendering(rgb, depth, depth, np.where(shown, 0, -1), np.array(rows))


def fit(body, shown):
    """Fit a body's surface to what masks show."""
    mesh = Mesh(np.asarray(body.vertices), np.asarray(body.triangles))
    with ThreadPool(1) as pool:
        lines = find_object_outlines(shown, rendering(shown), 0.2 * PIXEL, pool)
        seen, still = np.ones(len(mesh.vertices), bool), np.zeros(len(mesh.vertices), bool)
        return fit_to_outlines(mesh, lines, seen, still, FLOOR, pool)


def plate(width, thickness):
    """A plate in fine triangles, as marching cubes make them."""
    box = trimesh.creation.box([width, thickness, width])
    for _ in range(5):
        box = box.subdivide()
    return Mesh(np.asarray(box.vertices), np.asarray(box.faces))


@pytest.mark.parametrize("pixels", [1.0, 2.0])
def test_a_thin_plate_with_outlines_that_are_too_small_stays_a_plate(pixels):
    """Masks that are two pixels too small all around: more than the plate's half thickness."""
    thick = 2 * PIXEL
    begun = plate(1.2, thick)
    small = trimesh.creation.box([1.2 - 2 * pixels * PIXEL, 0.3 * thick, 1.2 - 2 * pixels * PIXEL])
    made = fit(begun, masks(small))
    assert 0.1 * signed_volume(begun) < signed_volume(made) < signed_volume(begun)
    inside = np.array([[0, 0, 0], [0.3, 0, 0.3], [-0.4, 0, 0.2]], float)
    np.testing.assert_allclose(QueryMesh(made).winding(inside), 1, atol=0.02)


def test_a_ball_gets_the_size_that_masks_show():
    ball = trimesh.creation.icosphere(4, 0.6)
    begun = Mesh(np.asarray(ball.vertices), np.asarray(ball.faces))
    made = fit(begun, masks(trimesh.creation.icosphere(4, 0.6 - 1.5 * PIXEL)))
    radius = np.linalg.norm(made.vertices, axis=1)
    assert radius.mean() == pytest.approx(0.6 - 1.5 * PIXEL, abs=0.25 * PIXEL)


HOLLOW = 0.6 - 2 * PIXEL
"""Radius of a bowl's inside [m]."""


def bowl():
    """Half a shell two pixels thick, in fine triangles."""
    angle = np.linspace(-np.pi / 2, 0, 40)
    arc = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    outer, inner = 0.6 * arc, HOLLOW * arc[::-1]
    profile = np.concatenate([outer, np.linspace(outer[-1], inner[0], 4)[1:-1], inner])
    profile[[0, -1], 0] = 0
    return trimesh.creation.revolve(profile, sections=96)


def test_the_inside_of_a_bowl_stays_though_its_outlines_are_too_small():
    begun = bowl()
    made = fit(Mesh(np.asarray(begun.vertices), np.asarray(begun.faces)), masks(larger(begun)))
    inner = np.linalg.norm(begun.vertices, axis=1) < HOLLOW + 0.01 * PIXEL
    deep = inner & (begun.vertices[:, 2] < -8 * PIXEL)
    outer = np.linalg.norm(made.vertices[~inner], axis=1)
    assert np.median(outer) == pytest.approx(0.6 + 1.5 * PIXEL, abs=0.3 * PIXEL)
    assert np.linalg.norm(made.vertices[deep], axis=1).min() > HOLLOW - 0.1 * PIXEL


def larger(body):
    return body.copy().apply_scale(1 + 1.5 * PIXEL / 0.6)
