"""Solids made of Gaussians are the things that the Gaussians show."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from splat_scenes import clad, eyes, together

from corporeal.core.errors import UserError
from corporeal.core.types import Gaussians, Views
from corporeal.geometry.mesh import Mesh, signed_volume
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.reconstruction.surface.closed_surface import _remove_specks, build_closed_surfaces
from corporeal.reconstruction.surface.surface_config import ClosedSurfaceConfig

PIXEL = 3.5 / 168
"""Of the pictures, at the things [m]."""
SMALL = ClosedSurfaceConfig(object_grid_cells=60_000, survey_grid_cells=20_000, threads=1)


def shape(solid):
    return QueryMesh(Mesh(solid.vertices, solid.triangles))


def fits(solid, mesh):
    """Whether the surface lies within 0.35 pixels of the true one in the mean, by volume."""
    return abs(solid.volume - mesh.volume) < 0.35 * PIXEL * mesh.area


def masks(cameras, *meshes):
    """Pixels that show any of the meshes."""
    whole, out = trimesh.util.concatenate(meshes), []
    for c in cameras:
        y, x = np.mgrid[: c.height, : c.width] + 0.5
        ray = np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3) @ np.linalg.inv(c.K).T
        ray = ray @ c.world_from_camera[:3, :3].T
        eye = np.tile(c.world_from_camera[:3, 3], (len(ray), 1))
        out.append(whole.ray.intersects_any(eye, ray).reshape(c.height, c.width))
    return np.stack(out)


def box(low, high):
    return trimesh.creation.box(bounds=[low, high])


@pytest.mark.slow
def test_a_ball_on_the_floor_becomes_a_closed_ball():
    ball = trimesh.creation.icosphere(4, 0.5).apply_translation([0, 0, 0.5])
    gaussians, owner = together(clad(ball))
    (solid,) = build_closed_surfaces(gaussians, owner, eyes(), masks(eyes(), ball), config=SMALL)
    assert shape(solid).closed and not solid.warnings
    away = np.abs(np.linalg.norm(solid.vertices - [0, 0, 0.5], axis=1) - 0.5)
    assert np.mean(away) < 0.5 * PIXEL
    assert fits(solid, ball)
    np.testing.assert_allclose(solid.colours, np.tile([0.8, 0.3, 0.1], (len(away), 1)), atol=0.03)
    near = np.linalg.norm(gaussians.mean[solid.gaussian_of_vertex] - solid.vertices, axis=1)
    assert near.max() < 0.12


def test_an_object_is_as_large_as_its_outlines_though_gaussians_are_wide():
    """Learned ones have their means inside by a deviation; what is met first is too far out."""
    sides, wide = np.array([0.8, 0.5, 0.6]), 1.5 * PIXEL
    ball, inner = (
        trimesh.creation.icosphere(4, 0.5).apply_scale(s).apply_translation([0, 0, 0.3])
        for s in (sides, sides - 2 * wide)
    )
    gaussians, owner = together(clad(inner, 2000))
    blobs = replace(gaussians, scale=np.full_like(gaussians.scale, wide))
    (solid,) = build_closed_surfaces(blobs, owner, eyes(), masks(eyes(), ball), config=SMALL)
    upper = solid.vertices[solid.vertices[:, 2] > 0.3] - [0, 0, 0.3]
    size = np.linalg.norm(upper / (sides / 2), axis=1)
    assert np.median(size) == pytest.approx(1, abs=0.01)
    assert solid.vertices[:, 2].max() == pytest.approx(0.6, abs=0.009)


def test_what_stands_on_the_floor_is_closed_by_it():
    cube = box([-0.4, -0.4, 0], [0.4, 0.4, 0.8])
    gaussians, owner = together(clad(cube))
    bare = gaussians.mean[:, 2] > 0.01  # nobody ever saw it from below
    kept = {n: getattr(gaussians, n)[bare] for n in ("mean", "rotation", "scale", "opacity", "sh")}
    (solid,) = build_closed_surfaces(Gaussians(**kept), owner[bare], eyes(), masks(eyes(), cube), config=SMALL)
    assert solid.vertices[:, 2].min() > -1e-9
    low = (solid.vertices[:, 2] < 0.1 * solid.cell) & (np.abs(solid.vertices[:, :2]).max(axis=1) < 0.35)
    np.testing.assert_allclose(solid.vertices[low, 2], 0, atol=1e-9)
    assert low.sum() > 100
    assert fits(solid, cube)
    assert shape(solid).closed


def test_a_bowl_stays_open():
    outer = trimesh.creation.icosphere(4, 0.6).apply_translation([0, 0, 0.6])
    inner = trimesh.creation.icosphere(4, 0.45).apply_translation([0, 0, 0.6])
    bowl = trimesh.boolean.difference([outer, inner, box([-1, -1, 0.6], [1, 1, 2])], engine="manifold")
    gaussians, owner = together(clad(bowl, 6000))
    (solid,) = build_closed_surfaces(gaussians, owner, eyes(20), masks(eyes(20), bowl), config=SMALL)
    inside = shape(solid).inside(np.array([[0, 0, 0.5], [0, 0, 0.3], [0, 0, 0.07], [0.525, 0, 0.5]]))
    assert inside.tolist() == [False, False, True, True]
    assert fits(solid, bowl)
    assert shape(solid).closed


@pytest.mark.slow
def test_what_a_mirror_shows_deep_inside_takes_nothing_that_outlines_need(monkeypatch):
    """A mirror image lies behind the face, and photographs agree on where."""

    def mirrored(rendering, *_):
        return replace(rendering, depth=rendering.depth + np.float32(0.2))

    monkeypatch.setattr("corporeal.reconstruction.surface.closed_surface.refine_depth", mirrored)
    ball = trimesh.creation.icosphere(4, 0.5).apply_translation([0, 0, 0.5])
    gaussians, owner = together(clad(ball))
    mine = masks(eyes(), ball)
    views = Views(np.zeros((*mine.shape, 3), np.uint8), eyes())
    (solid,) = build_closed_surfaces(gaussians, owner, eyes(), mine, views, config=SMALL)
    assert solid.volume == pytest.approx(ball.volume, rel=0.05)


def test_what_stands_on_legs_is_hollow_below():
    legs = [box([x - 0.04, y - 0.04, 0], [x + 0.04, y + 0.04, 0.6]) for x, y in LEGS]
    table = trimesh.boolean.union([box([-0.5, -0.5, 0.6], [0.5, 0.5, 0.7]), *legs])
    gaussians, owner = together(clad(table, 8000))
    (solid,) = build_closed_surfaces(gaussians, owner, eyes(20), masks(eyes(20), table), config=SMALL)
    points = np.array([[x, y, z] for x, y in LEGS for z in (0.1, 0.3, 0.5)])
    assert shape(solid).inside(points).all()
    assert not shape(solid).inside(np.array([[0, 0, 0.1], [0, 0, 0.3], [0.2, 0, 0.4]])).any()
    assert shape(solid).closed and not solid.warnings
    assert solid.cell == pytest.approx(PIXEL, rel=0.1)  # a ball's are half as wide again
    assert fits(solid, table)


LEGS = [(x, y) for x in (-0.44, 0.44) for y in (-0.44, 0.44)]


@pytest.mark.slow
def test_every_place_in_touching_objects_belongs_to_one_of_them():
    below, above = (box([-0.5, -0.5, 0], [0.5, 0.5, 0.4]), box([-0.25, -0.25, 0.4], [0.25, 0.25, 0.9]))
    gaussians, owner = together(clad(below, 5000), clad(above, 3000))
    hidden = (np.abs(gaussians.mean[:, 2] - 0.4) < 1e-3) & (np.abs(gaussians.mean[:, :2]).max(axis=1) < 0.25)
    names = ("mean", "rotation", "scale", "opacity", "sh")
    kept = {n: getattr(gaussians, n)[~hidden] for n in names}
    shown = masks(eyes(20), below, above)
    one, two = build_closed_surfaces(Gaussians(**kept), owner[~hidden], eyes(20), shown, config=SMALL)
    places = np.random.default_rng(0).uniform([-0.5, -0.5, 0], [0.5, 0.5, 0.9], (40000, 3))
    in_one, in_two = shape(one).inside(places), shape(two).inside(places)
    assert not (in_one & in_two).any()
    assert fits(one, below)
    assert fits(two, above)


@pytest.mark.slow
def test_floor_and_background_are_no_objects_but_hide_what_is_behind():
    ball = trimesh.creation.icosphere(4, 0.4).apply_translation([0, 0, 0.4])
    ground = box([-1.5, -1.5, -0.05], [1.5, 1.5, 0.0])
    gaussians, owner = together(clad(ball), clad(ground, 6000))
    owner = np.where(owner == 1, -1, owner)
    (solid,) = build_closed_surfaces(gaussians, owner, eyes(), masks(eyes(), ball), config=SMALL)
    assert fits(solid, ball)
    assert np.abs(solid.vertices[:, :2]).max() < 0.4 + PIXEL


def test_specks_in_the_air_are_left_out():
    ball = trimesh.creation.icosphere(4, 0.4).apply_translation([0, 0, 0.4])
    speck = trimesh.creation.icosphere(2, 0.05).apply_translation([0.5, 0.3, 0.9])
    gaussians, owner = together(clad(ball), clad(speck, 200))
    (solid,) = build_closed_surfaces(gaussians, 0 * owner, eyes(), config=SMALL)
    assert solid.vertices[:, 2].max() < 0.82 and not solid.warnings


def test_hollows_that_no_camera_sees_and_crumbs_are_no_surface():
    whole = trimesh.creation.box((1, 1, 1))
    hollow = trimesh.creation.box((0.1, 0.1, 0.1))
    hollow.invert()
    crumb, beside = (trimesh.creation.box((side,) * 3) for side in (0.1, 0.5))
    crumb.apply_translation((2, 0, 0))
    beside.apply_translation((0, 2, 0))
    parts = trimesh.util.concatenate([hollow, whole, crumb, beside])
    kept = _remove_specks(Mesh(np.asarray(parts.vertices), np.asarray(parts.faces)))
    assert len(kept.vertices) == 16 and len(kept.triangles) == 24
    assert signed_volume(kept) == pytest.approx(1.125)


@pytest.mark.slow
def test_the_number_of_threads_changes_nothing():
    gaussians, owner = together(clad(trimesh.creation.icosphere(3, 0.5).apply_translation([0, 0, 0.5])))
    (one,), (two,) = (
        build_closed_surfaces(gaussians, owner, eyes(8), config=replace(SMALL, threads=n)) for n in (1, 3)
    )
    np.testing.assert_array_equal(one.vertices, two.vertices)
    np.testing.assert_array_equal(one.colours, two.colours)


def test_an_object_without_gaussians_is_named():
    gaussians, owner = together(clad(trimesh.creation.icosphere(2, 0.5), 200))
    with pytest.raises(UserError, match="object 0"):
        build_closed_surfaces(gaussians, owner + 1, eyes(8), config=SMALL)
    with pytest.raises(UserError, match="no object"):
        build_closed_surfaces(gaussians, owner - 1, eyes(8), config=SMALL)


def test_an_object_that_is_only_haze_is_named():
    ball = trimesh.creation.icosphere(2, 0.3)
    solid = clad(ball.copy().apply_translation([0, 0, 0.3]), 800)
    haze = clad(ball.copy().apply_translation([0.8, 0, 0.3]), 800)
    haze = replace(haze, opacity=np.full(haze.count, 1e-4))
    gaussians, owner = together(solid, haze)
    with pytest.raises(UserError, match="object 2"):
        build_closed_surfaces(gaussians, owner, eyes(8), config=SMALL)


def test_an_unseen_surface_is_coloured_without_patches():
    cube = box([-0.4, -0.4, 0], [0.4, 0.4, 0.8])
    whole, owner = together(clad(cube))
    red = whole.mean[:, :1] < 0
    sh = (np.where(red, (0.8, 0.1, 0.1), (0.1, 0.1, 0.8)) - 0.5)[:, None] / SH_DC_COEFFICIENT
    (solid,) = build_closed_surfaces(replace(whole, sh=sh), owner, eyes(), masks(eyes(), cube), config=SMALL)
    x, y, z = solid.vertices.T
    below = (z < 0.5 * solid.cell) & (np.maximum(abs(x), abs(y)) < 0.25)
    edges = np.concatenate([solid.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    edges = edges[below[edges].all(axis=1)]
    assert len(edges) > 100
    steps = np.abs(solid.colours[edges[:, 0]] - solid.colours[edges[:, 1]]).max(axis=1)
    assert steps.max() < 0.2, "from red to blue at once"
    assert solid.colours[below & (x < -0.15), 0].mean() > solid.colours[below & (x > 0.15), 0].mean() + 0.15
