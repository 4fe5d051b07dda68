import numpy as np
import pytest
import trimesh

from corporeal.discretization.mesh_kind import MeshKind
from corporeal.discretization.mesh_measures import measure_object


def examined(*meshes, rng):
    whole = trimesh.util.concatenate(list(meshes))
    part = np.repeat(np.arange(len(meshes)), [len(m.faces) for m in meshes])
    return measure_object(np.asarray(whole.vertices), np.asarray(whole.faces), part, rng)


def lathe(outline):
    return trimesh.creation.revolve(np.array(outline), sections=48)


def vase():
    outside = [(0, 0), (0.04, 0), (0.06, 0.1), (0.05, 0.2), (0.03, 0.25)]
    inside = [(0.027, 0.25), (0.047, 0.2), (0.057, 0.1), (0.037, 0.003), (0, 0.003)]
    return lathe(outside + inside)


def test_a_vase_with_both_faces_is_a_wall_of_its_own_thickness(rng):
    member = examined(vase(), rng=rng).members[0]
    assert member.build is MeshKind.WALL
    assert 2 * member.volume / member.body_area == pytest.approx(0.003, rel=0.1)


def test_a_ball_a_box_and_a_table_are_bodies(rng):
    top = trimesh.creation.box((1, 0.6, 0.05))
    legs = [trimesh.creation.box((0.06, 0.06, 0.7)) for _ in range(4)]
    for leg, (x, y) in zip(legs, [(1, 1), (1, -1), (-1, 1), (-1, -1)], strict=True):
        leg.apply_translation((0.45 * x, 0.25 * y, -0.375))
    table = trimesh.util.concatenate([top, *legs])
    for mesh in (trimesh.creation.icosphere(3), trimesh.creation.box((1, 2, 3)), table):
        assert examined(mesh, rng=rng).members[0].build is MeshKind.BODY


def test_an_open_bowl_of_one_face_is_a_sheet_but_a_statue_without_a_base_is_not(rng):
    ball = trimesh.creation.icosphere(4)
    height = ball.triangles_center[:, 2]
    bowl = ball.submesh([np.flatnonzero(height < 0)], append=True)
    statue = ball.submesh([np.flatnonzero(height > -0.9)], append=True)
    assert examined(bowl, rng=rng).members[0].build is MeshKind.SHEET
    member = examined(statue, rng=rng).members[0]
    assert member.build is MeshKind.BODY
    assert member.volume == pytest.approx(ball.volume, rel=0.03)


@pytest.mark.parametrize("harm", ["holes", "flips", "inside out", "doubled skin", "split"])
def test_a_damaged_ball_has_the_volume_of_a_whole_one(harm, rng):
    ball = trimesh.creation.icosphere(4)
    mesh = ball.copy()
    if harm == "holes":
        middle = ball.triangles_center
        centres = middle[rng.integers(0, len(middle), 12)]
        near = np.linalg.norm(middle[:, None] - centres, axis=2).min(axis=1) < 0.15
        mesh = ball.submesh([np.flatnonzero(~near)], append=True)
    elif harm == "flips":
        turn = rng.uniform(size=len(ball.faces)) < 0.15
        mesh.faces[turn] = mesh.faces[turn][:, ::-1]
    elif harm == "inside out":
        mesh.invert()
    elif harm == "doubled skin":
        smaller = ball.copy()
        smaller.apply_scale(0.97)
        mesh = trimesh.util.concatenate([ball, smaller])
    else:
        soup = np.asarray(ball.triangles).reshape(-1, 3)
        mesh = trimesh.Trimesh(soup, np.arange(len(soup)).reshape(-1, 3), process=False)
    anatomy = examined(mesh, rng=rng)
    assert anatomy.members[0].volume == pytest.approx(ball.volume, rel=0.02)
    radius = np.linalg.norm(anatomy.probes, axis=1)
    outside = (radius > 1.0).mean()
    missing = 1 - (radius < 1.0).sum() / len(anatomy.probes)
    assert outside < 0.02
    assert missing < 0.02


def test_the_stone_of_a_fruit_is_its_own_part(rng):
    flesh, stone = trimesh.creation.icosphere(4, 0.05), trimesh.creation.icosphere(3, 0.02)
    anatomy = examined(flesh, stone, rng=rng)
    points = rng.uniform(-0.03, 0.03, (500, 3))
    inner = np.linalg.norm(points, axis=1)
    label = anatomy.label(points)
    assert (label[inner < 0.0195] == 1).all()
    assert (label[inner > 0.0205] == 0).all()
    assert anatomy.members[1].volume == pytest.approx(stone.volume, rel=0.01)
    assert anatomy.members[0].volume == pytest.approx(flesh.volume - stone.volume, rel=0.01)


def test_parts_that_close_only_together_share_the_volume_between_them(rng):
    box = trimesh.creation.box((1, 1, 1))
    top = box.triangles_center[:, 2] > 0.4
    lid = box.submesh([np.flatnonzero(top)], append=True)
    rest = box.submesh([np.flatnonzero(~top)], append=True)
    anatomy = examined(lid, rest, rng=rng)
    volumes = [m.volume for m in anatomy.members]
    assert sum(volumes) == pytest.approx(1, rel=0.01)
    assert volumes[0] == pytest.approx(1 / 6, rel=0.05)  # a place belongs to the nearest face
    assert all(m.encloses and not m.closed for m in anatomy.members)


def test_a_small_part_that_overlaps_itself_or_holds_another_is_not_counted_twice(rng):
    """Few of the object's probes hit it, or none: 4, 24 and 3 of 20 000 here."""
    at = [trimesh.transformations.translation_matrix((0.8, y, 0)) for y in (-0.3, 0.0, 0.3)]
    box = trimesh.creation.box
    crossed = trimesh.util.concatenate([box((0.03, 0.03, 0.1), at[0]), box((0.03, 0.1, 0.03), at[0])])
    twice = trimesh.util.concatenate([box((0.1, 0.1, 0.1), at[1]), box((0.08, 0.08, 0.08), at[1])])
    shell, core = box((0.1, 0.1, 0.1), at[2]), box((0.09, 0.09, 0.09), at[2])
    anatomy = examined(box((1, 1, 1)), crossed, twice, shell, core, rng=rng)
    exact = [1.0, 2 * 0.03**2 * 0.1 - 0.03**3, 0.1**3, 0.1**3 - 0.09**3, 0.09**3]
    for member, volume in zip(anatomy.members, exact, strict=True):
        assert member.volume == pytest.approx(volume, rel=0.05)
    assert np.bincount(anatomy.part_of_probe, minlength=5)[1:].max() < 100


def test_of_the_shade_of_a_lamp_only_the_outside_counts(rng):
    """Read as one thing, as it is where parts were found on one surface, the lamp is a body."""
    lift = trimesh.transformations.translation_matrix
    drum = trimesh.creation.annulus(0.195, 0.2, 0.4, transform=lift((0, 0, 0.9)), sections=96)
    pole = trimesh.creation.cylinder(0.006, 1.1, transform=lift((0, 0, 0.55)))
    lamp = trimesh.util.concatenate([drum, pole])
    label = (lamp.triangles_center[:, 2] > 0.7).astype(int)
    shade = measure_object(np.asarray(lamp.vertices), np.asarray(lamp.faces), label, rng).members[1]
    assert shade.build is MeshKind.BODY
    assert not shade.encloses
    outer = 2 * np.pi * 0.2 * 0.4
    assert shade.body_area > 1.97 * outer
    assert outer < shade.face_area < 1.1 * outer  # at the rims the inside sees the open, too


def test_both_sides_of_a_flat_box_are_its_outside(rng):
    box = examined(trimesh.creation.box((0.4, 0.3, 0.02)), rng=rng).members[0]
    assert box.face_area == box.body_area
