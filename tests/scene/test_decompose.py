"""Convex pieces cover a body and leave its hollows open."""

from functools import lru_cache

import numpy as np
import pytest
import trimesh
from bodies import body, bowl, table

from corporeal.core.errors import UserError
from corporeal.geometry import convex_decomposition as room
from corporeal.geometry.convex_decomposition import cells_hull_volume, cut_by_plane, decompose_convex


def ring():
    return trimesh.creation.annulus(0.4, 0.5, 0.3, sections=6)


@lru_cache
def ring_body():
    return body(ring(), density=1000.0)


def held(pieces, points):
    """Whether each point is in any piece."""
    found = np.zeros(len(points), dtype=bool)
    for piece in pieces:
        a, b, c = np.swapaxes(piece.vertices[piece.triangles], 0, 1)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        found |= (points @ normal.T - (a * normal).sum(axis=1) < 1e-6).all(axis=1)
    return found


def test_a_convex_body_is_one_piece():
    (piece,) = body(trimesh.creation.box((0.3, 0.2, 0.1))).pieces
    assert piece.volume == pytest.approx(0.006, rel=1e-5)
    assert piece.centre == pytest.approx([0, 0, 0], abs=1e-6)


@pytest.mark.parametrize("make", [pytest.param(bowl, marks=pytest.mark.slow), table])
def test_pieces_cover_the_mesh(make):
    thing = make()
    mesh = trimesh.Trimesh(thing.vertices, thing.triangles)
    points, _ = trimesh.sample.sample_surface(mesh, 5000, seed=1)
    assert held(thing.pieces, points).all()


@pytest.mark.slow
def test_a_bowl_keeps_its_hollow():
    thing = bowl(radius=0.25, wall=0.01)
    rng = np.random.default_rng(0)
    points = rng.normal(size=(3000, 3))
    points *= 0.22 / np.linalg.norm(points, axis=1)[:, None]
    points *= rng.uniform(0, 1, (3000, 1)) ** (1 / 3)
    points[:, 2] = -np.abs(points[:, 2])
    assert held(thing.pieces, points + np.array([0, 0, 0.25])).mean() < 0.04
    assert 1.0 < thing.volume / trimesh.Trimesh(thing.vertices, thing.triangles).volume < 2.0


def test_a_table_has_its_volume_and_room_below():
    thing = table()
    volume = 0.5 * 0.5 * 0.03 + 4 * 0.04 * 0.04 * 0.37
    assert thing.volume == pytest.approx(volume, rel=0.12)
    below = np.random.default_rng(0).uniform([-0.2, -0.2, 0], [0.2, 0.2, 0.36], (2000, 3))
    assert not held(thing.pieces, below).any()


def test_an_open_sheet_gets_a_thickness():
    v = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    (piece,) = decompose_convex(np.array(v, float), np.array([[0, 1, 2], [0, 2, 3]]))
    assert piece.volume == pytest.approx(room.SHEET_THICKNESS_FRACTION, rel=1e-3)


def test_size_and_place_do_not_matter():
    mesh = ring()
    near = ring_body().pieces
    far = decompose_convex(mesh.vertices * 1000 + [5, 6, 7], mesh.faces)
    assert len(near) == len(far) > 5
    for a, b in zip(near, far, strict=True):
        assert np.allclose(a.vertices * 1000 + [5, 6, 7], b.vertices, atol=1e-6)


def test_kept_pieces_are_the_same_bits(tmp_path, monkeypatch):
    mesh = ring()
    cold = decompose_convex(mesh.vertices, mesh.faces, tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
    never = ring_body().pieces
    monkeypatch.setattr(room, "_cut_convex", lambda *_: pytest.fail("pieces were not kept"))
    warm = decompose_convex(mesh.vertices * 2, mesh.faces, tmp_path)
    for a, b, c in zip(cold, warm, never, strict=True):
        assert np.array_equal(2 * a.vertices, b.vertices)
        assert np.array_equal(a.vertices, c.vertices)
        assert np.array_equal(a.triangles, b.triangles)


def test_damaged_keepings_are_made_anew(tmp_path):
    mesh = trimesh.creation.box()
    decompose_convex(mesh.vertices, mesh.faces, tmp_path)
    (path,) = tmp_path.iterdir()
    path.write_bytes(b"half a file")
    assert len(decompose_convex(mesh.vertices, mesh.faces, tmp_path)) == 1


@pytest.mark.parametrize(
    ("vertices", "triangles", "words"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), int), "no triangles"),
        (np.zeros((3, 3)), np.array([[0, 1, 2]]), "no size"),
        (np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]]), np.array([[0, 1, 2]]), "no surface"),
        (np.array([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]]), np.array([[0, 1, 2]]), "not finite"),
    ],
)
def test_what_has_no_surface_is_refused(vertices, triangles, words):
    with pytest.raises(UserError, match=words):
        decompose_convex(vertices, triangles)


@pytest.mark.slow
def test_soup_is_cut_too():
    rng = np.random.default_rng(0)
    corners = rng.uniform(size=(20, 1, 3)) + 0.1 * rng.normal(size=(20, 3, 3))
    pieces = decompose_convex(corners.reshape(-1, 3), np.arange(60).reshape(-1, 3))
    assert held(pieces, corners.mean(axis=1)).all()


def test_cutting_triangles_keeps_their_area():
    sphere = trimesh.creation.icosphere(2)
    below, above = cut_by_plane(sphere.triangles, 1, 0.3)
    area = [0.5 * np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum() for t in (below, above)]
    assert sum(area) == pytest.approx(sphere.area, rel=1e-12)
    assert below[:, :, 1].max() <= 0.3 <= above[:, :, 1].min()


def test_the_volume_of_a_hull_of_cells_is_exact():
    cells = np.zeros((5, 4, 3), dtype=bool)
    cells[0, 0, 0] = cells[4, 0, 0] = True
    assert cells_hull_volume(cells) == pytest.approx(5, rel=1e-12)
    cells[0, 3, 2] = True
    corners = [p + np.array(c) for p in np.argwhere(cells) for c in np.ndindex(2, 2, 2)]
    assert cells_hull_volume(cells) == pytest.approx(trimesh.PointCloud(corners).convex_hull.volume)


def test_a_pieced_body_weighs_what_it_holds():
    thing = ring_body()
    assert thing.centre == pytest.approx([0, 0, 0], abs=2e-3)
    assert thing.mass == pytest.approx(1000 * ring().volume, rel=0.12)
