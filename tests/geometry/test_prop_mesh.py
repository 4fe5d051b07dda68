import numpy as np
import pytest
import trimesh

from corporeal.discretization.mesh_measures import oriented_box_size
from corporeal.geometry.mesh import (
    Mesh,
    inward_area_loss_rate,
    open_edge_ratio,
    orient_outward,
    signed_volume,
    weld_mesh,
)


def welded(mesh):
    return weld_mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))[0]


def test_split_vertices_and_two_sided_faces_do_not_matter():
    box = trimesh.creation.box((1, 2, 3))
    soup = np.asarray(box.triangles).reshape(-1, 3)
    faces = np.arange(len(soup)).reshape(-1, 3)
    twice = np.concatenate([faces, faces[:, ::-1]])
    mesh, kept = weld_mesh(soup, twice)
    assert len(mesh.vertices) == 8
    assert len(kept) == 12
    assert open_edge_ratio(mesh) == 0
    assert abs(signed_volume(mesh)) == pytest.approx(6)


def test_welding_is_the_same_anywhere_in_the_world():
    ball = trimesh.creation.icosphere(2)
    soup = np.asarray(ball.triangles).reshape(-1, 3)
    faces = np.arange(len(soup)).reshape(-1, 3)
    here, there = weld_mesh(soup, faces)[0], weld_mesh(soup + 1000.0, faces)[0]
    assert len(here.vertices) == len(there.vertices) == len(ball.vertices)


def test_a_surface_loses_area_as_it_moves_inward():
    """A ball by 4πR, a box by four times the sum of its sides; what is hollow gains as much."""
    ball = welded(trimesh.creation.icosphere(4, 0.5))
    assert inward_area_loss_rate(ball) == pytest.approx(2 * np.pi, rel=2e-3)
    hollow = Mesh(ball.vertices, ball.triangles[:, ::-1])
    assert inward_area_loss_rate(hollow) == pytest.approx(-2 * np.pi, rel=2e-3)
    assert inward_area_loss_rate(welded(trimesh.creation.box((1, 2, 3)))) == pytest.approx(4 * 6)
    rod = welded(trimesh.creation.cylinder(0.5, 200, 64))
    assert inward_area_loss_rate(rod) == pytest.approx(np.pi * 200, rel=0.02)


def test_triangles_without_area_are_dropped():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], float)
    mesh, kept = weld_mesh(vertices, np.array([[0, 1, 2], [0, 1, 1], [0, 1, 3]]))
    assert len(mesh.triangles) == 1
    assert list(kept) == [0]


@pytest.mark.parametrize("share", [0.15, 1.0])
def test_flipped_triangles_are_turned_back(share, rng):
    ball = welded(trimesh.creation.icosphere(3))
    turn = rng.uniform(size=len(ball.triangles)) < share
    faces = np.where(turn[:, None], ball.triangles[:, ::-1], ball.triangles)
    assert signed_volume(orient_outward(Mesh(ball.vertices, faces))) == pytest.approx(signed_volume(ball))


def test_a_cavity_stays_and_a_mirrored_leg_is_turned():
    outer, inner = trimesh.creation.icosphere(3), trimesh.creation.icosphere(3, 0.5)
    inner.invert()
    leg = trimesh.creation.box((0.2, 0.2, 1))
    leg.apply_translation((3, 0, 0))
    whole = outer.volume + inner.volume + leg.volume
    leg.invert()
    mesh = orient_outward(welded(trimesh.util.concatenate([outer, inner, leg])))
    assert signed_volume(mesh) == pytest.approx(whole)


def test_the_smallest_box_of_a_tilted_plate_is_the_plate():
    plate = trimesh.creation.box((0.1, 1.0, 3.0))
    plate.apply_transform(trimesh.transformations.rotation_matrix(0.7, (1, 2, 3)))
    assert oriented_box_size(np.asarray(plate.vertices)) == pytest.approx((0.1, 1.0, 3.0))


def test_parts_welded_to_one_another_keep_their_own_winding():
    """A stem stands on a foot: their common ring of edges once turned the stem inside out."""
    foot, stem = trimesh.creation.cylinder(0.1, 0.1), trimesh.creation.cylinder(0.1, 1.0)
    stem.apply_translation((0, 0, 0.55))
    part = np.repeat([0, 1], [len(foot.faces), len(stem.faces)])
    both = trimesh.util.concatenate([foot, stem])
    mesh, kept = weld_mesh(np.asarray(both.vertices), np.asarray(both.faces), part)
    assert len(kept) == len(both.faces)
    turned = orient_outward(mesh)
    for k, own in enumerate((foot, stem)):
        assert signed_volume(turned.only(part[kept] == k)) == pytest.approx(own.volume)
