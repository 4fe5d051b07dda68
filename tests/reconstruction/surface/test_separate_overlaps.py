"""Surfaces of things that touch share a face; what touches nothing stays as it is."""

from functools import cache

import manifold3d
import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from corporeal.geometry.mesh import Mesh, signed_volume
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.reconstruction.surface.separate_overlaps import separate_overlaps

CELL = 0.06
"""As long as edges of the surfaces are, about [m]."""


def welded(mesh):
    mesh = trimesh.Trimesh(*trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, CELL))
    mesh.merge_vertices()
    return Mesh(np.array(mesh.vertices), np.array(mesh.faces))


def box(low, high):
    return welded(trimesh.creation.box(bounds=[low, high]))


def ball(radius, at):
    made = trimesh.creation.icosphere(3, radius).apply_translation(at)
    return Mesh(np.array(made.vertices), np.array(made.faces))


def parted(*meshes):
    return separate_overlaps(meshes, [CELL] * len(meshes), 0.0)


def common(one, two):
    """Volume inside both."""
    both = [manifold3d.Manifold(manifold3d.Mesh64(m.vertices, m.triangles)) for m in (one, two)]
    return (both[0] ^ both[1]).volume()


def crosses_itself(mesh):
    """Whether any edge goes through a triangle that it has no end in common with."""
    v, f = mesh.vertices, mesh.triangles
    edges = np.unique(np.sort(f[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    middles, reach = v[f].mean(axis=1), np.linalg.norm(v[f[:, 0]] - v[f[:, 1]], axis=1).max()
    near = KDTree(middles).query_ball_point(v[edges].mean(axis=1), 1.5 * reach)
    edge = np.repeat(np.arange(len(edges)), [len(n) for n in near])
    triangle = np.concatenate([np.array(n, dtype=int) for n in near])
    apart = ~(f[triangle][:, :, None] == edges[edge][:, None]).any(axis=(1, 2))
    p, q = v[edges[edge[apart]]].swapaxes(0, 1)
    corners = v[f[triangle[apart]]].swapaxes(0, 1)

    def side(a, b, c, d):
        volume = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
        return np.where(np.abs(volume) < 1e-9 * CELL**3, 0, np.sign(volume))

    ends = side(*corners, p) * side(*corners, q) < 0
    around = sum(side(p, q, corners[k], corners[(k + 1) % 3]) for k in range(3))
    return bool((ends & (np.abs(around) == 3)).any())


PAIRS = {
    "balls": (ball(0.4, [0, 0, 0.4]), ball(0.4, [0.7, 0.05, 0.45])),
    "box on box": (box([-0.3, -0.3, 0], [0.3, 0.3, 0.3]), box([-0.2, -0.2, 0.26], [0.2, 0.2, 0.5])),
    "edge": (box([-0.3, -0.08, 0], [0.3, 0.08, 0.3]), box([-0.4, -0.2, 0.26], [0.4, 0.2, 0.4])),
    "beside": (box([-0.3, -0.3, 0], [0.02, 0.3, 0.3]), box([-0.02, -0.2, 0], [0.3, 0.2, 0.35])),
}


@cache
def made_of(name):
    return parted(*PAIRS[name])


@pytest.mark.parametrize("name", PAIRS)
def test_what_overlapped_only_touches(name):
    pair, made = PAIRS[name], made_of(name)
    overlap = common(*pair)
    assert overlap > 5 * CELL**3
    assert common(*made) < 1e-3 * overlap
    lost = [signed_volume(old) - signed_volume(new) for old, new in zip(pair, made, strict=True)]
    assert min(lost) > 0 and sum(lost) == pytest.approx(overlap, rel=0.2)
    for old, new in zip(pair, made, strict=True):
        np.testing.assert_array_equal(new.triangles, old.triangles)
        assert QueryMesh(new).closed and not crosses_itself(new)
    for k, j in ((0, 1), (1, 0)):
        clear = ~QueryMesh(pair[j]).inside(pair[k].vertices)
        clear &= QueryMesh(pair[j]).closest(pair[k].vertices)[0] > CELL
        assert clear.any()
        np.testing.assert_array_equal(made[k].vertices[clear], pair[k].vertices[clear])


def test_equal_objects_give_way_alike():
    one, two = PAIRS["balls"]
    overlap = common(one, two)
    for old, new in zip((one, two), made_of("balls"), strict=True):
        lost = signed_volume(old) - signed_volume(new)
        assert lost == pytest.approx(overlap / 2, rel=0.1)


def test_a_face_is_half_way_between_both():
    for new in made_of("box on box"):
        v = new.vertices[np.abs(new.vertices[:, :2]).max(axis=1) < 0.1]
        face = v[(v[:, 2] > 0.2) & (v[:, 2] < 0.4)]
        assert len(face) > 10
        np.testing.assert_allclose(face[:, 2], 0.28, atol=1e-2 * CELL)


def test_what_stands_on_the_floor_stays_flat_on_it():
    for old, new, at in zip(PAIRS["beside"], made_of("beside"), (0.02, -0.02), strict=True):
        lay = old.vertices[:, 2] == 0
        assert (new.vertices[lay, 2] == 0).all() and (new.vertices[~lay, 2] > 0).all()
        wall = np.isclose(old.vertices[:, 0], at) & (np.abs(old.vertices[:, 1]) < 0.1)
        wall &= old.vertices[:, 2] < 0.2
        assert (wall & lay).any()
        np.testing.assert_allclose(new.vertices[wall, 0], 0, atol=1e-2 * CELL)


def test_the_order_of_objects_changes_nothing():
    one, two = PAIRS["edge"]
    for a, b in zip(made_of("edge"), parted(two, one)[::-1], strict=True):
        np.testing.assert_array_equal(a.vertices, b.vertices)


def test_what_touches_nothing_stays_as_it_is():
    far = ball(0.3, [2, 0, 0.3])
    assert parted(*PAIRS["balls"], far)[2] is far
    below, above = box([-0.3, -0.3, 0], [0.3, 0.3, 0.3]), box([-0.2, -0.2, 0.3], [0.2, 0.2, 0.5])
    assert parted(below, above) == (below, above)


def test_three_that_meet_are_apart_two_by_two():
    turn = 2 * np.pi * np.arange(3) / 3
    balls = [ball(0.4, [0.42 * np.cos(a), 0.42 * np.sin(a), 0.4]) for a in turn]
    made = parted(*balls)
    for k, j in ((0, 1), (1, 2), (2, 0)):
        assert common(balls[k], balls[j]) > 10 * CELL**3
        assert common(made[k], made[j]) < 1e-3 * common(balls[k], balls[j])


def test_what_goes_through_another_or_is_within_it_stays_and_is_left_to_a_warning():
    leg = box([-0.06, -0.06, 0], [0.06, 0.06, 0.4])
    plate, block = box([-0.3, -0.3, 0.2], [0.3, 0.3, 0.3]), box([-0.5, -0.5, 0], [0.5, 0.5, 0.9])
    for other in (plate, block):
        for old, new in zip((leg, other), parted(leg, other), strict=True):
            np.testing.assert_array_equal(new.vertices, old.vertices)
