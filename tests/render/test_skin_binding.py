import numpy as np
import pytest
import trimesh

from corporeal.core.types import Frame, Part, Particles, Parts, Scene, SceneObject, Surface
from corporeal.render.packed_scene import vertex_positions
from corporeal.render.skin_binding import FacetNormals, bind_vertices, limit_stretch


def grid_of(low, high, step):
    axes = [np.arange(a + step / 2, b, step) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def cloud(points, part=None, thing=None):
    zero = np.zeros(len(points), dtype=np.int64)
    part = zero if part is None else part
    return Particles(
        points, np.zeros_like(points), zero + 1e-6, zero + 1e3, zero if thing is None else thing,
        part, 0.1, (), np.zeros((0, 3)), np.zeros(0, dtype=np.int64), (1.0,),
    )  # fmt: skip


def box(low, high, k=0, refine=2):
    m = trimesh.creation.box(bounds=[low, high])
    for _ in range(refine):
        m = m.subdivide()
    v, f = np.asarray(m.vertices), np.asarray(m.faces)
    split = v[f.reshape(-1)]  # every triangle has its own vertices, as along texture seams
    return Surface(f"box_{k}", k, 0, split, np.arange(len(split)).reshape(-1, 3))


def scene_of(surfaces):
    names = range(max(s.object for s in surfaces) + 1)
    things = tuple(SceneObject(f"thing_{k}", "thing", 1.0) for k in names)
    return Scene("test", "", things, tuple(surfaces), ())


def parts_of(scene, part_of_surface):
    counts = [len(s.triangles) for s in scene.surfaces]
    part = np.repeat(part_of_surface, counts)
    thing = np.repeat([s.object for s in scene.surfaces], counts)
    names = tuple(Part(str(k), 0, "node") for k in range(max(part_of_surface) + 1))
    return Parts(thing, part, np.ones(len(part)), names)


def rotation(seed=0):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def moved(points, F, shift=(0, 0, 0)):
    return Frame(0.1, points @ F.T + shift, np.broadcast_to(F, (len(points), 3, 3)).copy())


@pytest.fixture
def block():
    s = scene_of([box((0, 0, 0), (1, 1, 1))])
    points = grid_of((0, 0, 0), (1, 1, 1), 0.1)
    return s, points, bind_vertices(s, parts_of(s, [0]), cloud(points), np.array([False]))


def test_a_rigid_object_moves_exactly(block):
    s, points, skin = block
    R = rotation()
    place, normals = skin.pose(moved(points, R, (1, 2, 3)))
    assert np.abs(place - (vertex_positions(s) @ R.T + [1, 2, 3])).max() < 1e-12
    assert np.abs(normals - skin.normals @ R.T).max() < 1e-12


def test_at_the_start_nothing_has_moved(block):
    s, points, skin = block
    place, _ = skin.pose(moved(points, np.eye(3)))
    assert np.abs(place - vertex_positions(s)).max() < 1e-12


def test_a_homogeneous_stretch_is_followed_exactly_and_normals_stay_normal(block):
    s, points, skin = block
    F = np.array([[1.2, 0.3, 0], [0, 0.8, 0.1], [0, 0, 1.1]])
    place, normals = skin.pose(moved(points, F))
    assert np.abs(place - vertex_positions(s) @ F.T).max() < 1e-12
    slope = np.linalg.inv(F).T
    expected = skin.normals @ slope.T
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.abs(normals - expected).max() < 1e-9


def test_seams_do_not_open_in_any_motion(block):
    s, points, skin = block
    rng = np.random.default_rng(1)
    wild = Frame(0.1, points + 0.1 * rng.normal(size=points.shape), rng.normal(size=(1000, 3, 3)))
    place, _ = skin.pose(wild)
    _, group = np.unique(vertex_positions(s), axis=0, return_inverse=True)
    group = group.reshape(-1)
    first = np.zeros((group.max() + 1, 3))
    first[group] = place
    assert np.array_equal(first[group], place)


def test_a_surface_follows_smoothly_without_jumps_between_neighbours():
    """A bend of the matter bends the mesh: error of second order in the particles' spacing."""
    errors = []
    for step in (0.1, 0.05):
        s = scene_of([box((0, 0, 0), (1, 1, 1), refine=3)])
        points = grid_of((0, 0, 0), (1, 1, 1), step)
        skin = bind_vertices(s, parts_of(s, [0]), cloud(points), np.array([False]))

        def bend(x):
            return x + 0.2 * np.column_stack([0 * x[:, 0], 0 * x[:, 0], np.sin(3 * x[:, 0])])

        F = np.broadcast_to(np.eye(3), (len(points), 3, 3)).copy()
        F[:, 2, 0] = 0.6 * np.cos(3 * points[:, 0])
        place, _ = skin.pose(Frame(0.1, bend(points), F))
        errors.append(np.abs(place - bend(vertex_positions(s))).max())
    assert errors[0] < 0.01
    assert errors[1] < errors[0] / 2.5


def test_a_part_does_not_follow_its_neighbour():
    s = scene_of([box((0, 0, 0), (1, 1, 1)), box((0, 0, 1), (1, 1, 2), k=1)])
    low, high = grid_of((0, 0, 0), (1, 1, 1), 0.2), grid_of((0, 0, 1), (1, 1, 2), 0.2)
    points = np.vstack([low, high])
    owner = np.repeat([0, 1], [len(low), len(high)])
    skin = bind_vertices(s, parts_of(s, [0, 1]), cloud(points, owner, owner), np.array([False, False]))
    frame = moved(points, np.eye(3))
    frame.position[owner == 1, 2] += 0.5
    place, _ = skin.pose(frame)
    half = len(place) // 2
    assert place[:half, 2].max() < 1 + 1e-9
    assert place[half:, 2].min() > 1.5 - 1e-9


def test_a_part_without_particles_follows_its_object_and_a_lonely_object_stays():
    near, far = box((0, 0, 0), (1, 1, 1)), box((5, 0, 0), (6, 1, 1), k=1)
    trim = box((0.4, 0.4, 1), (0.6, 0.6, 1.1))
    s = scene_of([near, trim, far])
    points = grid_of((0, 0, 0), (1, 1, 1), 0.2)
    skin = bind_vertices(s, parts_of(s, [0, 1, 2]), cloud(points), np.array([False] * 3))
    place, _ = skin.pose(moved(points, np.eye(3), (0, 0, 1)))
    n = len(near.vertices) + len(trim.vertices)
    assert np.allclose(place[:n], vertex_positions(s)[:n] + np.array([0, 0, 1]))
    assert np.array_equal(place[n:], vertex_positions(s)[n:])


def test_the_picture_of_a_stretch_is_bounded_and_never_mirrored():
    rng = np.random.default_rng(0)
    F = rng.normal(size=(500, 3, 3)) * 10 ** rng.uniform(-3, 3, (500, 1, 1))
    F[3], F[4] = np.nan, 0
    shown = limit_stretch(F, (0.4, 2.5))
    stretch = np.linalg.svd(shown, compute_uv=False)
    assert stretch.min() > 0.4 - 1e-9 and stretch.max() < 2.5 + 1e-9
    assert (np.linalg.det(shown) > 0).all()
    mild = np.eye(3) + 0.1 * rng.normal(size=(50, 3, 3))
    assert np.abs(limit_stretch(mild, (0.4, 2.5)) - mild).max() < 1e-12, "mild stretch is shown as it is"


@pytest.mark.parametrize("limits", [(0.3, 3.0), (0.7, 1.4)])
def test_the_shortcut_lets_nothing_past_the_limits(limits):
    rng = np.random.default_rng(9)
    F = np.eye(3) + rng.normal(size=(20_000, 3, 3)) * rng.uniform(0, 1, (20_000, 1, 1))
    shown = limit_stretch(F, limits)
    stretch = np.linalg.svd(shown, compute_uv=False)
    assert limits[0] - 1e-9 < stretch.min() and stretch.max() < limits[1] + 1e-9
    assert (np.linalg.det(shown) > 0).all()


def test_one_lost_particle_leaves_no_hole_in_the_picture(block):
    _, points, skin = block
    frame = moved(points, np.eye(3))
    frame.position[7] = np.nan
    frame.deformation[7] = np.nan
    place, normals = skin.pose(frame)
    assert np.isfinite(place).all() and np.isfinite(normals).all()


def test_normals_of_a_fluid_are_those_of_the_surface_that_is_shown():
    """A wall that leans over looks upward, however its file winds it; F of a fluid says nothing."""
    wall = np.array([[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]], dtype=float)
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    leaning = wall - wall[:, 2:] * [1.0, 0.0, 0.0]
    expected = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
    for wound, side in ((triangles, 1.0), (triangles[:, ::-1], -1.0)):
        facets = FacetNormals(wound, np.arange(4), np.full(4, side))
        assert np.allclose(facets.normals(wall), [1.0, 0.0, 0.0])
        assert np.allclose(facets.normals(leaning), expected)


def test_a_vertex_without_a_triangle_gets_no_normal_of_facets():
    facets = FacetNormals(np.array([[0, 1, 2]]), np.arange(4), np.array([1.0, 1.0, 1.0, 0.0]))
    assert not facets.normals(np.eye(4, 3)).any(axis=1)[3]
