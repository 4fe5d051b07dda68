"""Points that stand for the space around them."""

import numpy as np
import pytest
import trimesh

from corporeal.discretization import point_filling
from corporeal.discretization.point_filling import PointFilling, fill_body
from corporeal.geometry.mesh import weld_mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.quadrature import centroidal_points
from corporeal.mpm.physics.contact import half_space_mean

SPACING, CELL = 0.05, 0.1
TILT = trimesh.transformations.rotation_matrix(0.4, (1, 2, 3))


def shaped(mesh):
    return QueryMesh(weld_mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))[0])


def filled(shape, seed=0):
    rng = np.random.default_rng(seed)
    return fill_body(shape, shape, SPACING, lambda p: np.full(len(p), np.inf), rng)


def equal(points, *_):
    return points, np.full(len(points), SPACING**3)


@pytest.fixture
def alike(monkeypatch):
    """Fill as if every point stood for spacing³: the control."""

    def fill(shape, seed=0):
        with monkeypatch.context() as patch:
            patch.setattr(point_filling, "centroidal_points", equal)
            return filled(shape, seed)

    return fill


def centre(made: PointFilling):
    return np.average(made.points, axis=0, weights=made.volumes)


def test_a_ball_has_its_volume_and_its_mass_in_the_middle(alike):
    sphere = trimesh.creation.icosphere(4, 0.4)
    ball, volume, inertia = shaped(sphere), sphere.volume, 0.4 * sphere.volume * 0.4**2
    far, off = [], []
    for seed in range(4):
        made = filled(ball, seed)
        assert made.volumes.sum() == pytest.approx(volume, rel=2e-3)
        about = made.volumes @ (made.points[:, :2] ** 2).sum(axis=1)
        assert about == pytest.approx(inertia, rel=0.02)
        far.append(np.linalg.norm(centre(made)))
        off.append(np.linalg.norm(centre(alike(ball, seed))))
    assert np.mean(far) < 0.01 * SPACING
    assert np.mean(off) > 3 * np.mean(far)


def face_as_nodes_see_it(made: PointFilling, above: float):
    """Mean offset of a tilted cube's matter from nodes near its top face, and its share [dx]."""
    rng, offset, share = np.random.default_rng(3), [], []
    for across in rng.uniform(-0.3, 0.3, (200, 2)):
        node = TILT[:3, :3] @ [*across, 0.5 + above * CELL]
        away = np.abs(made.points - node) / CELL
        weight = np.where(away < 0.5, 0.75 - away**2, 0.5 * np.maximum(1.5 - away, 0) ** 2)
        weight = made.volumes * weight.prod(axis=1)
        offset.append(weight @ ((made.points - node) @ TILT[:3, 2]) / weight.sum() / CELL)
        share.append(weight.sum() / CELL**3)
    return np.array(offset), np.array(share)


@pytest.mark.slow
@pytest.mark.parametrize(("above", "half"), [(-0.5, 0.8438), (0.0, 0.5), (0.5, 0.1562)])
def test_a_tilted_face_is_plain_and_where_it_is(alike, above, half):
    """Contact reads where a face is from mean offsets on nodes: they must not depend on chance."""
    cube = trimesh.creation.box((1, 1, 1))
    cube.apply_transform(TILT)
    shape = shaped(cube)
    offset, share = face_as_nodes_see_it(filled(shape), above)
    control, _ = face_as_nodes_see_it(alike(shape), above)
    assert offset.std() < 0.004
    assert control.std() > 2 * offset.std()
    assert share.mean() == pytest.approx(half, abs=0.003)  # what a half space takes of a node
    exact = float(half_space_mean(np.array([-above]))[0])
    assert abs(offset.mean() - exact) < abs(control.mean() - exact)


def test_points_whose_centroid_is_in_the_open_stay():
    """Of long cells in a bent wall they lie beside it."""
    wall = trimesh.creation.annulus(0.98, 1.0, 0.3, sections=256)
    ring = shaped(wall)
    turn = np.linspace(0, 2 * np.pi, 6, endpoint=False)
    points = 0.99 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    moved, volumes = centroidal_points(points, ring, 0.1, np.zeros(6, bool))
    assert ring.inside(moved).all()
    assert volumes.sum() == pytest.approx(wall.volume, rel=0.03)


def test_nothing_is_divided_among_no_points():
    ball = shaped(trimesh.creation.icosphere(1))
    points, volumes = centroidal_points(np.zeros((0, 3)), ball, 0.1, np.zeros(0, bool))
    assert points.shape == (0, 3) and volumes.shape == (0,)


def test_what_belongs_to_another_part_is_not_divided_among_these_points():
    """Leaves of a tree stand for themselves: its twigs do not weigh as much as they do."""
    bar = shaped(trimesh.creation.box((0.1, 0.1, 1.0)))
    rng = np.random.default_rng(0)
    below = fill_body(bar, bar, SPACING, lambda p: np.where(p[:, 2] < 0, np.inf, 0.0), rng)
    assert below.points[:, 2].max() < 0
    assert below.volumes.sum() == pytest.approx(0.1 * 0.1 * 0.5, rel=0.01)
    assert centre(below)[2] == pytest.approx(-0.25, rel=0.01)


def test_a_thin_twig_stands_for_less_than_a_thick_one():
    """Both are thinner than the spacing, so that each is one row of points."""
    thick = trimesh.creation.cylinder(0.02, 1.0)
    thin = trimesh.creation.cylinder(0.005, 1.0).apply_translation((0, 0, 1.1))
    made = filled(shaped(thick + thin))
    upper = made.points[:, 2] > 0.55
    assert 10 < upper.sum() < 40
    assert made.volumes[upper].sum() / made.volumes.sum() == pytest.approx(1 / 17, abs=0.02)
