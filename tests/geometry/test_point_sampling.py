import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from corporeal.discretization.point_filling import fill_body, fill_wall, match_moments
from corporeal.geometry.mesh import Mesh, weld_mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.point_sampling import (
    poisson_disk_subset,
    repulsion,
    sample_surface,
    scatter_points,
    scatter_points_by_slab,
)

TILT = trimesh.transformations.rotation_matrix(0.4, (1, 2, 3))


def shaped(mesh):
    return QueryMesh(weld_mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))[0])


def all_through(points):
    return np.full(len(points), np.inf)


def neighbour(points):
    return KDTree(points).query(points, 2)[0][:, 1]


@pytest.fixture(scope="module")
def tilted_cube():
    cube = trimesh.creation.box((1, 1, 1))
    cube.apply_transform(TILT)
    shape = shaped(cube)
    return shape, fill_body(shape, shape, 0.05, all_through, np.random.default_rng(0)).points


def test_as_many_points_as_the_volume_holds(rng):
    ball = shaped(trimesh.creation.icosphere(4))
    assert len(scatter_points(ball, 0.06, rng)) * 0.06**3 == pytest.approx(4.18, rel=0.01)


def test_what_fills_a_pot_to_its_walls_has_its_whole_volume(rng):
    """Faces of pot and soil lie upon each other; rays that miss the second took the soil away."""
    outer, inner = trimesh.creation.box((2, 2, 2)), trimesh.creation.box((1.6, 1.6, 1.6))
    for body in (outer, inner):
        body.apply_transform(TILT)
    n = len(outer.vertices)
    cavity, soil = inner.faces[:, ::-1] + n, inner.faces + n
    both, _ = weld_mesh(
        np.concatenate([outer.vertices, inner.vertices]),
        np.concatenate([outer.faces, cavity, soil]),
        np.repeat([0, 0, 1], 12),
    )
    assert len(both.triangles) == 36
    assert len(scatter_points(QueryMesh(both), 0.06, rng)) * 0.06**3 == pytest.approx(8.0, rel=0.01)


@pytest.mark.parametrize("missing", [1, 6])
def test_a_small_hole_leaves_out_only_what_is_outside(missing):
    """Near the hole as far from it: what the winding number says, of the whole ball's points."""
    ball = trimesh.creation.icosphere(4)
    ball.apply_transform(TILT)
    whole = shaped(ball)
    torn = QueryMesh(Mesh(whole.mesh.vertices, whole.mesh.triangles[missing:]))
    assert not torn.closed
    points, expected = (
        np.concatenate(list(scatter_points_by_slab(shape, 0.03, np.random.default_rng(3)))) for shape in (torn, whole)
    )
    expected = expected[torn.inside(expected)]
    assert len(points) > 100_000
    assert np.array_equal(points[np.lexsort(points.T)], expected[np.lexsort(expected.T)])


def test_points_lie_evenly(tilted_cube):
    near = neighbour(tilted_cube[1]) / 0.05
    assert near.min() > 0.5
    assert np.std(near) < 0.08
    assert 0.9 < np.median(near) < 1.1


def test_a_tilted_face_has_no_teeth(tilted_cube):
    """The outermost layer lies about half a spacing below the face, everywhere."""
    shape, points = tilted_cube
    depth = shape.closest(points)[0] / 0.05
    first = depth[depth < 0.8]
    assert first.min() > 0.35
    assert np.percentile(first, 97) < 0.55
    assert len(first) == pytest.approx(6 * (1 / 0.05 - 1) ** 2, rel=0.2)


def test_points_deep_inside_follow_no_lattice(tilted_cube):
    """No direction in which the points stand in planes: their structure factor has no peak."""
    shape, points = tilted_cube
    deep = points[shape.closest(points)[0] > 0.15]
    rng = np.random.default_rng(1)
    wave = rng.normal(size=(3000, 3))
    wave *= (2 * np.pi / 0.05 * rng.uniform(0.9, 1.3, (3000, 1))) / np.linalg.norm(wave, axis=1, keepdims=True)
    peak = np.abs(np.exp(1j * deep @ wave.T).sum(axis=0)) ** 2 / len(deep)
    assert peak.max() < 0.05 * len(deep)


def test_the_same_seed_gives_the_same_points():
    ball = shaped(trimesh.creation.icosphere(3))
    first, again, other = (fill_body(ball, ball, 0.15, all_through, np.random.default_rng(s)).points for s in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first[:50], other[:50])


def test_a_plate_thinner_than_the_spacing_becomes_one_even_layer(rng):
    plate = trimesh.creation.box((1, 1, 0.01))
    plate.apply_transform(TILT)
    shape = shaped(plate)
    filling = fill_body(shape, shape, 0.05, all_through, rng)
    height = trimesh.transform_points(filling.points, np.linalg.inv(TILT))[:, 2]
    assert np.percentile(np.abs(height), 98) < 1e-6
    assert len(filling.points) == pytest.approx(400, rel=0.25)
    gap, _ = KDTree(filling.points).query(sample_surface(shape.mesh, 2000, rng)[0])
    assert gap.max() < 1.1 * 0.05


def test_a_wall_has_layers_at_equal_depths_and_no_gap_at_its_edges(rng):
    ball = shaped(trimesh.creation.box((1, 1, 1)))
    filling = fill_wall(ball.mesh, 0.05, 0.2, rng)
    depth = ball.closest(filling.points)[0]
    layers = np.array([0.025, 0.075, 0.125, 0.175])
    away = np.abs(depth[:, None] - layers)
    assert (away.min(axis=1) < 0.031 * layers[away.argmin(axis=1)]).all()
    for layer, size in zip(layers, 1 - 2 * layers, strict=True):
        edge = np.array([[size / 2, size / 2, z] for z in np.linspace(-size / 2, size / 2, 9)])
        assert KDTree(filling.points).query(edge)[0].max() < 0.06, layer
    assert filling.volumes.sum() == pytest.approx(6 * 0.2)


def test_dart_throwing_keeps_its_distance_and_leaves_no_room(rng):
    points = rng.uniform(size=(20_000, 2))
    points = np.column_stack([points, np.zeros(len(points))])
    chosen = points[poisson_disk_subset(points, 0.05)]
    assert neighbour(chosen).min() >= 0.05
    assert KDTree(chosen).query(points)[0].max() < 0.05


def test_repulsion_is_equal_and_opposite_and_ends_at_its_reach():
    pair = np.array([[0.0, 0, 0], [0.08, 0, 0], [5, 5, 5]])
    assert np.allclose(repulsion(pair, 0.1), [[-0.004, 0, 0], [0.004, 0, 0], [0, 0, 0]])
    assert not repulsion(pair, 0.07).any()


def test_matched_moments_are_those_of_the_reference(rng):
    reference = rng.normal(size=(5000, 3)) * (1, 2, 3)
    points = reference[:400] + 0.1
    masses = match_moments(points, np.ones(400), reference, np.full(5000, 0.002))
    assert masses.sum() == pytest.approx(10)
    assert np.allclose(masses @ points, reference.sum(axis=0) * 0.002)
    assert np.allclose((masses[:, None] * points).T @ points, reference.T @ reference * 0.002)
    assert masses.min() > 0


def test_moments_that_some_points_would_pay_for_with_negative_mass_are_matched_by_the_others(rng):
    reference = rng.uniform(0, 1, (5000, 3)) * (1, 1, 3) + (0, 0, 1.0)
    points = rng.uniform(0, 1, (400, 3)) * (1, 1, 4)
    given = np.full(5000, 0.002)
    masses = match_moments(points, np.ones(400), reference, given)
    assert np.allclose(masses @ points, given @ reference)
    assert np.allclose((masses[:, None] * points).T @ points, reference.T @ reference * 0.002)
    assert masses.min() >= 0.1 * 10 / 400 - 1e-12


def test_points_too_few_for_an_inertia_have_the_right_centre(rng):
    points, reference = rng.normal(size=(20, 3)), rng.normal((0.2, 0, 0), 1, (5000, 3))
    masses = match_moments(points, np.ones(20), reference, np.full(5000, 0.002))
    assert np.allclose(masses @ points, reference.sum(axis=0) * 0.002)


def test_a_point_is_inside_whichever_way_the_surface_faces(rng):
    ball = shaped(trimesh.creation.icosphere(3))
    turned = QueryMesh(Mesh(ball.mesh.vertices, np.ascontiguousarray(ball.mesh.triangles[:, ::-1])))
    points = rng.uniform(-1, 1, (500, 3))
    radius = np.linalg.norm(points, axis=1)
    for shape in (ball, turned):
        assert shape.inside(points[radius < 0.97]).all()
        assert not shape.inside(points[radius > 1.0]).any()


def test_a_reference_that_is_a_point_gives_its_mass_and_no_shape():
    points = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    masses = match_moments(points, np.ones(50), np.zeros((4, 3)), np.full(4, 0.5))
    assert masses == pytest.approx(np.full(50, 0.04))
