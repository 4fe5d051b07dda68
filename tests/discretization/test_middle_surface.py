"""Middle surfaces of thin parts: areas, volumes, thickness, junctions and the triangles themselves."""

import numpy as np
import pytest
import trimesh

from corporeal.core.errors import UserError
from corporeal.discretization.middle_surface import middle_surface
from corporeal.geometry.mesh import Mesh, signed_volume
from corporeal.geometry.remeshing import unique_edges

NO_STATED_THICKNESS = None


def drawn(mesh):
    return Mesh(np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int64))


def joined(*meshes):
    return drawn(trimesh.util.concatenate(meshes))


def board(extents, centre=(0, 0, 0)):
    return trimesh.creation.box(extents, trimesh.transformations.translation_matrix(centre))


def turned(mesh):
    return mesh.copy().apply_transform(trimesh.transformations.euler_matrix(0.3, 0.5, 1.1))


def surface_of(shell):
    return Mesh(shell.vertices, shell.triangles)


def area_of(shell):
    return float(surface_of(shell).areas.sum())


def matter_of(shell):
    """Volume of the wall [m³]."""
    return float(surface_of(shell).areas @ shell.thickness)


def edge_counts(shell):
    """How many edges have one, two, three ... triangles."""
    return np.bincount(unique_edges(shell.triangles)[2], minlength=4)[1:]


def pieces_count(shell):
    return trimesh.graph.connected_component_labels(
        unique_edges(shell.triangles)[0], node_count=len(shell.vertices)
    ).max(initial=-1) + 1  # fmt: skip


def check_triangles(shell, spacing, shortest=0.4):
    corners = surface_of(shell).corners
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    assert shortest * spacing < sides.min() and sides.max() < 1.6 * spacing
    assert np.mean(sides < 0.5 * spacing) < 0.01
    a, b, c = np.sort(sides, axis=1).T
    assert np.degrees(np.arccos((a**2 + b**2 - c**2) / (2 * a * b))).max() < 140
    assert (c * (a + b + c) / (4 * np.sqrt(3) * surface_of(shell).areas)).max() < 4
    assert (shell.thickness > 0).all() and len(np.unique(shell.triangles)) == len(shell.vertices)


def test_a_ball_is_a_sphere_half_a_wall_inside():
    radius, wall, spacing = 0.1, 4e-3, 0.02
    shell = middle_surface(drawn(trimesh.creation.icosphere(5, radius)), wall, spacing)
    check_triangles(shell, spacing)
    assert edge_counts(shell)[[0, 2]].sum() == 0
    assert area_of(shell) == pytest.approx(4 * np.pi * (radius - wall / 2) ** 2, rel=0.01)
    assert signed_volume(surface_of(shell)) == pytest.approx(4 / 3 * np.pi * (radius - wall / 2) ** 3, rel=0.01)
    assert matter_of(shell) == pytest.approx(4 / 3 * np.pi * (radius**3 - (radius - wall) ** 3), rel=0.01)
    assert (shell.thickness == wall).all()


def test_a_closed_box_keeps_its_edges():
    shell = middle_surface(drawn(board((0.3, 0.2, 0.1))), 4e-3, 0.02)
    check_triangles(shell, 0.02)
    assert np.ptp(shell.vertices, axis=0) == pytest.approx([0.296, 0.196, 0.096], rel=1e-9)
    assert area_of(shell) == pytest.approx(2 * (0.296 * 0.196 + 0.296 * 0.096 + 0.196 * 0.096), rel=1e-9)
    assert matter_of(shell) == pytest.approx(0.3 * 0.2 * 0.1 - 0.292 * 0.192 * 0.092, rel=1e-3)


def test_a_can_keeps_its_lids():
    radius, height, wall = 0.033, 0.115, 2e-4
    can = trimesh.creation.cylinder(radius, height, sections=64)
    shell = middle_surface(drawn(can), wall, 8e-3)
    check_triangles(shell, 8e-3)
    assert area_of(shell) == pytest.approx(can.area, rel=0.01)
    assert signed_volume(surface_of(shell)) == pytest.approx(can.volume, rel=0.015)
    lid = surface_of(shell).normals[:, 2] > 0.999
    assert surface_of(shell).areas[lid].sum() == pytest.approx(np.pi * (radius - wall / 2) ** 2, rel=0.01)


def test_walls_of_a_skin_share_what_room_there_is():
    """Two walls of 8 mm do not fit in 10 mm: each takes half, and they do not go through one another."""
    shell = middle_surface(drawn(trimesh.creation.icosphere(4, 5e-3)), 8e-3, 2e-3)
    assert shell.thickness.max() < 5.01e-3
    assert np.linalg.norm(shell.vertices, axis=1) == pytest.approx(np.full(len(shell.vertices), 2.5e-3), rel=0.05)


@pytest.mark.parametrize("stated", [NO_STATED_THICKNESS, 6e-3])
def test_a_board_is_its_middle_with_its_measured_thickness(stated):
    shell = middle_surface(drawn(turned(board((0.8, 0.3, 6e-3)))), stated, 0.03)
    check_triangles(shell, 0.03)
    assert area_of(shell) == pytest.approx(0.8 * 0.3, rel=1e-6)
    assert shell.thickness == pytest.approx(np.full(len(shell.triangles), 6e-3), rel=0.01)
    normal = turned(board((1, 1, 1))).face_normals
    across = normal[np.abs(normal @ surface_of(shell).normals[0]).argmax()]
    assert np.abs(shell.vertices @ across).max() < 1e-6


def test_a_bent_board_is_bent():
    flat = board((0.8, 0.3, 6e-3))
    for _ in range(6):
        flat = flat.subdivide()
    x, y, z = np.asarray(flat.vertices).T
    bent = np.column_stack([(0.3 + z) * np.sin(x / 0.3), y, (0.3 + z) * np.cos(x / 0.3)])
    shell = middle_surface(Mesh(bent, np.asarray(flat.faces)), NO_STATED_THICKNESS, 0.03)
    assert area_of(shell) == pytest.approx(0.8 * 0.3, rel=0.01)
    assert matter_of(shell) == pytest.approx(0.8 * 0.3 * 6e-3, rel=0.01)
    assert np.hypot(shell.vertices[:, 0], shell.vertices[:, 2]) == pytest.approx(
        np.full(len(shell.vertices), 0.3), rel=3e-3
    )


def test_a_cup_is_one_face_in_the_middle_of_its_wall():
    radius, height, wall = 0.04, 0.1, 3e-3
    line = [(0, 0), (radius, 0), (radius, height), (radius - wall, height), (radius - wall, wall), (0, wall)]
    cup = trimesh.creation.revolve(line, sections=64)
    shell = middle_surface(drawn(cup), NO_STATED_THICKNESS, 8e-3)
    check_triangles(shell, 8e-3, shortest=0.3)
    middle = radius - wall / 2
    assert area_of(shell) == pytest.approx(2 * np.pi * middle * (height - wall / 2) + np.pi * middle**2, rel=0.01)
    assert matter_of(shell) == pytest.approx(cup.volume, rel=0.01)
    assert shell.thickness == pytest.approx(np.full(len(shell.triangles), wall), rel=0.01)
    assert shell.vertices[:, 2].min() == pytest.approx(wall / 2, rel=5e-3)
    assert shell.vertices[:, 2].max() == pytest.approx(height, rel=1e-3)


def test_a_hollow_box_with_a_cavity_is_one_shell():
    inside = board((0.29, 0.19, 0.09))
    inside.invert()
    shell = middle_surface(joined(board((0.3, 0.2, 0.1)), inside), NO_STATED_THICKNESS, 0.02)
    assert pieces_count(shell) == 1
    assert np.ptp(shell.vertices, axis=0) == pytest.approx([0.295, 0.195, 0.095], rel=1e-4)
    assert matter_of(shell) == pytest.approx(0.3 * 0.2 * 0.1 - 0.29 * 0.19 * 0.09, rel=0.01)


def test_a_quadrilateral_is_a_sheet():
    corners = np.array([[0, 0, 0], [0.3, 0, 0], [0.3, 0.2, 0], [0, 0.2, 0]])
    shell = middle_surface(Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), 1e-4, 0.01)
    check_triangles(shell, 0.01)
    assert area_of(shell) == pytest.approx(0.06, rel=1e-9)
    assert (shell.thickness == 1e-4).all()
    for corner in corners:
        assert np.linalg.norm(shell.vertices - corner, axis=1).min() < 1e-12


def shelf(thickness, overlap):
    """Return two sides and three shelves between them, 0.8 x 0.3 x 1 m."""
    between = 0.8 - 2 * thickness + 2 * overlap
    return [
        board((thickness, 0.3, 1.0), (side * (0.4 - thickness / 2), 0, 0.5)) for side in (-1, 1)
    ] + [board((between, 0.3, thickness), (0, 0, z)) for z in (0.1, 0.5, 1.0 - thickness / 2)]  # fmt: skip


@pytest.mark.parametrize("thickness", [6e-3, 18e-3])
@pytest.mark.parametrize("overlap", [0.0, 0.5])
def test_five_boards_of_a_shelf_hold_together(thickness, overlap):
    boards = [turned(b) for b in shelf(thickness, overlap * thickness)]
    shell = middle_surface(joined(*boards), NO_STATED_THICKNESS, 0.04)
    assert pieces_count(shell) == 1
    assert matter_of(shell) == pytest.approx(sum(b.volume for b in boards), rel=0.03)
    check_triangles(shell, 0.04, shortest=0.3)
    # Two shelves end at two faces each, along 0.3 m, and all of these edges have three triangles.
    edges, _, count = unique_edges(shell.triangles)
    assert set(count) == {1, 2, 3}
    ends = shell.vertices[edges[count == 3]]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() == pytest.approx(4 * 0.3, rel=0.01)


def test_a_shelf_that_is_one_solid_is_the_same():
    one = trimesh.boolean.union(shelf(18e-3, 0.0), engine="manifold")
    shell = middle_surface(drawn(one), NO_STATED_THICKNESS, 0.04)
    assert pieces_count(shell) == 1
    assert matter_of(shell) == pytest.approx(one.volume, rel=0.03)
    assert shell.thickness == pytest.approx(np.full(len(shell.triangles), 18e-3), rel=0.01)


def test_boards_that_go_through_one_another_are_joined():
    shell = middle_surface(joined(board((0.4, 0.3, 0.01)), board((0.01, 0.3, 0.4))), NO_STATED_THICKNESS, 0.03)
    assert pieces_count(shell) == 1
    assert area_of(shell) == pytest.approx(2 * 0.4 * 0.3, rel=1e-3)


def test_boards_side_by_side_are_joined():
    planks = [board((0.1, 0.6, 0.02), (0.1 * k, 0, 0)) for k in range(4)]
    shell = middle_surface(joined(*planks), NO_STATED_THICKNESS, 0.03)
    assert pieces_count(shell) == 1
    assert area_of(shell) == pytest.approx(4 * 0.1 * 0.6, rel=1e-3)


def test_boards_that_lie_on_one_another_are_not_joined():
    stack = [board((0.3, 0.2, 6e-3), (0, 0, 6e-3 * k)) for k in range(2)]
    shell = middle_surface(joined(*stack), NO_STATED_THICKNESS, 0.03)
    assert pieces_count(shell) == 2
    assert matter_of(shell) == pytest.approx(2 * 0.3 * 0.2 * 6e-3, rel=1e-3)


def test_a_noisy_scan_is_smooth():
    ball = trimesh.creation.icosphere(6, 0.1)
    noise = np.random.default_rng(0).normal(size=(len(ball.vertices), 1))
    shell = middle_surface(Mesh(np.asarray(ball.vertices) * (1 + 4e-3 * noise), np.asarray(ball.faces)), 2e-3, 0.01)
    check_triangles(shell, 0.01, shortest=0.3)
    assert area_of(shell) == pytest.approx(4 * np.pi * 0.099**2, rel=0.01)
    assert signed_volume(surface_of(shell)) == pytest.approx(4 / 3 * np.pi * 0.099**3, rel=0.01)


def test_the_same_mesh_gives_the_same_shell():
    mesh = joined(*shelf(18e-3, 0.0))
    one, other = (middle_surface(mesh, NO_STATED_THICKNESS, 0.06) for _ in range(2))
    assert (one.vertices == other.vertices).all() and (one.triangles == other.triangles).all()


def test_a_self_intersecting_mesh_gives_a_shell():
    ball = trimesh.creation.icosphere(4, 0.1)
    vertices = np.array(ball.vertices)
    vertices[:, 0] *= np.sin(40 * vertices[:, 1]) + 0.2
    shell = middle_surface(Mesh(vertices, np.asarray(ball.faces)), 2e-3, 0.015)
    assert np.isfinite(shell.vertices).all() and (surface_of(shell).areas > 0).all()


def test_loose_triangles_give_a_shell():
    rng = np.random.default_rng(0)
    soup = Mesh(rng.normal(size=(90, 3)), np.arange(90).reshape(-1, 3))
    shell = middle_surface(soup, 0.01, 0.4)
    assert np.isfinite(shell.vertices).all() and len(shell.triangles)


@pytest.mark.parametrize(
    ("mesh", "thickness", "words"),
    [
        (drawn(board((1, 1, 1))), 0.0, "thickness"),
        (drawn(board((1, 1, 1))), np.nan, "thickness"),
        (drawn(board((1, 1, 1))), None, "thickness"),
        (Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)), 1e-3, "no triangles"),
        (Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]])), 1e-3, "no triangle"),
        (Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, np.inf, 0]]), np.array([[0, 1, 2]])), 1e-3, "finite"),
    ],
)
def test_what_is_no_shell_is_refused_in_a_sentence(mesh, thickness, words):
    with pytest.raises(UserError, match=words):
        middle_surface(mesh, thickness, 0.1)
