"""Other methods' fields come to our parts, whatever their frame; bad files are refused."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from corporeal.core.errors import BadFileError, UserError
from corporeal.core.types import Law
from corporeal.fields.field_registration import axis_turns, register_points
from corporeal.fields.field_specification import parse_field_specification, read_vomp
from corporeal.fields.impose_field import impose_field, nearest_samples, sum_up_per_part
from corporeal.fields.sampled_field import check_field
from corporeal.pipeline.settings import GroundConfig, validate_ground
from corporeal.pipeline.stages.ground import ground, grounding_warnings
from fields import synthetic_fields

WRITERS = {"vomp": (synthetic_fields.write_vomp, "npz"), "pixie": (synthetic_fields.write_pixie, "ply")}


@cache
def thing(name):
    return synthetic_fields.thing(name)


@cache
def ours(name):
    it = thing(name)
    return ground(it.scene, it.parts, it.inventory)


def written(folder, whose, name, frame="z-up", **more):
    write, suffix = WRITERS[whose]
    it = thing(name)
    path = folder / f"field.{suffix}"
    write(path, synthetic_fields.placed(it.voxel, frame), it.young_pa, **more)
    return path


def test_there_are_24_ways_to_turn_axes_into_axes():
    assert len({turn.tobytes() for turn in axis_turns()}) == 24


@pytest.mark.slow
@pytest.mark.parametrize("frame", synthetic_fields.FRAMES)
@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("name", ["armchair", "rubber_duck", "potted_ficus", "floor_lamp"])
def test_a_field_finds_its_parts_in_any_frame(name, kind, frame, tmp_path):
    it = thing(name)
    path = written(tmp_path, kind, name, frame)
    field = parse_field_specification(f"{kind}:{path}").read(path)
    placed = register_points(field.position, it.points, path)
    sample, near = nearest_samples(placed, it.points)
    assert near.mean() > 0.95
    assert (it.part_of_voxel[sample] == it.part_of_point).mean() >= 0.9
    told = sum_up_per_part(field, placed, it.points, it.part_of_point)
    kept = {k: n for k, n in told.items() if not n.unfit}
    assert kept
    for k, numbers in kept.items():
        assert abs(np.log10(numbers.value["young_pa"]) - (5 + k)) <= 0.15


@pytest.mark.parametrize("kind", WRITERS)
def test_numbers_of_a_field_replace_ours_and_the_rest_is_borrowed(kind, tmp_path):
    it, before = thing("armchair"), ours("armchair")
    path = written(tmp_path, kind, "armchair", "y-up")
    field = impose_field(before, it.scene, it.parts, f"{kind}:{path}")
    replaced = [m for m in field.materials if m.grounds["young_pa"].chosen_by == "field"]
    assert len(replaced) >= 3
    for now, then in zip(field.materials, before.materials, strict=True):
        if now not in replaced:
            assert now == then
            continue
        assert now.density == pytest.approx(900) and now.poisson == pytest.approx(0.3)
        assert now.grounds["density"].value == now.density
        assert now.yield_stress == then.yield_stress and now.friction == then.friction
        assert now.grounds["friction"].chosen_by == "borrowed"
    (note,) = field.notes
    assert note in grounding_warnings(field, it.parts, it.scene)
    assert re.search(r"outside our measured ranges, used all the same: \d+", note)


def test_a_part_that_the_field_does_not_resolve_keeps_our_numbers(tmp_path):
    """The spider that holds the lamp's shade is thinner than a voxel."""
    it, before = thing("floor_lamp"), ours("floor_lamp")
    path = written(tmp_path, "vomp", "floor_lamp")
    field = impose_field(before, it.scene, it.parts, f"vomp:{path}")
    told = re.findall(r"([\w ]+) \(E spans [\d.]+ decades within it\)", field.notes[0])
    assert told
    names = [part.name for part in it.parts.catalogue]
    for name in told:
        k = names.index(name.strip())
        assert field.materials[k] == before.materials[k]


def test_a_part_beyond_the_field_keeps_our_numbers(tmp_path):
    it, before = thing("potted_ficus"), ours("potted_ficus")
    leaves = [p.name for p in it.parts.catalogue].index("leaves")
    there = (it.part_of_voxel != leaves) | (it.voxel[:, 2] > 0.9 * it.voxel[:, 2].max())
    path = tmp_path / "field.npz"
    synthetic_fields.write_vomp(path, it.voxel[there], np.full(there.sum(), 1e6))
    field = impose_field(before, it.scene, it.parts, f"vomp:{path}")
    assert field.materials[leaves] == before.materials[leaves]
    assert re.search(r"leaves \(only \d+% of it lies near a point", field.notes[0])


@pytest.mark.slow
def test_pixies_kinds_choose_laws_with_what_these_need(tmp_path):
    it, before = thing("armchair"), ours("armchair")
    laws = {0: Law.COROTATED, 1: Law.VON_MISES, 2: Law.DRUCKER_PRAGER, 3: Law.VON_MISES}
    laws[5] = Law.DRUCKER_PRAGER
    for kind, law in laws.items():
        path = written(tmp_path, "pixie", "armchair", kind=kind)
        for material in impose_field(before, it.scene, it.parts, f"pixie:{path}").materials:
            if material.grounds["young_pa"].chosen_by == "field":
                assert material.law is law
                assert law is not Law.VON_MISES or material.yield_stress
                assert law is not Law.DRUCKER_PRAGER or material.friction_angle
    same = written(tmp_path, "pixie", "armchair", kind=6)  # stationary: judged like any part
    for now, then in zip(
        impose_field(before, it.scene, it.parts, f"pixie:{same}").materials, before.materials, strict=True
    ):
        assert now.law is then.law
    fluid = written(tmp_path, "pixie", "armchair", kind=4)
    with pytest.raises(UserError, match="a fluid for"):
        impose_field(before, it.scene, it.parts, f"pixie:{fluid}")


def test_a_folder_holds_a_file_per_object_named_with_or_without_its_number(tmp_path):
    it, before = thing("armchair"), ours("armchair")
    synthetic_fields.write_vomp(tmp_path / "armchair.npz", it.voxel, it.young_pa)
    field = impose_field(before, it.scene, it.parts, f"vomp:{tmp_path}")
    assert any(m.grounds["young_pa"].chosen_by == "field" for m in field.materials)
    (tmp_path / "armchair.npz").rename(tmp_path / "chair.npz")
    with pytest.raises(UserError, match="no file for any object of the scene: armchair_0"):
        impose_field(before, it.scene, it.parts, f"vomp:{tmp_path}")


def test_a_table_may_tell_density_alone(tmp_path):
    it, before = thing("rubber_duck"), ours("rubber_duck")
    path = tmp_path / "field.csv"
    rows = [f"{x},{y},{z},1234" for x, y, z in it.voxel.tolist()]
    path.write_text("\n".join(["x,y,z,density", *rows]))
    field = impose_field(before, it.scene, it.parts, f"table:{path}")
    for now, then in zip(field.materials, before.materials, strict=True):
        assert now.density == 1234 and now.young_pa == then.young_pa
        assert now.grounds["young_pa"].chosen_by == "borrowed"


def test_one_material_makes_everything_solid_and_equal():
    it, before = thing("armchair"), ours("armchair")
    field = impose_field(before, it.scene, it.parts, "one")
    numbers = {(m.law, m.young_pa, m.poisson, m.density, m.loss) for m in field.materials}
    assert numbers == {(Law.COROTATED, 2e6, 0.4, 200.0, 0.0)}
    assert {s.kind for s in field.structures} == {"solid"}
    said = impose_field(before, it.scene, it.parts, "one:E=1e5,rho=300").materials[0]
    assert (said.young_pa, said.poisson, said.density) == (1e5, 0.4, 300.0)


def test_omniphysgs_keeps_laws_and_walls():
    it, before = thing("floor_lamp"), ours("floor_lamp")
    field = impose_field(before, it.scene, it.parts, "omniphysgs")
    assert [m.law for m in field.materials] == [m.law for m in before.materials]
    assert field.structures == before.structures
    assert {(m.young_pa, m.poisson, m.density) for m in field.materials} == {(2e6, 0.4, 1000.0)}


def test_ground_asks_for_the_field_that_the_command_line_names(tmp_path):
    it = thing("armchair")
    path = written(tmp_path, "vomp", "armchair")
    config = GroundConfig(field=f"vomp:{path}")
    validate_ground(config)
    field = ground(it.scene, it.parts, it.inventory, config)
    assert field.notes and not ours("armchair").notes


# ---------------------------------------------------------------- bad input


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("two", "is not a field"),
        ("vomp:", "is not a field"),
        ("vomp:nowhere.npz", "No such file: nowhere.npz"),
        ("one:E=-1", "'E=-1' is not a valid number"),
        ("one:nu=.5", "'nu=.5' is not a valid number"),
        ("one:G=3", "'G=3' is not a valid number"),
    ],
)
def test_a_specification_that_means_nothing_is_refused(spec, words):
    with pytest.raises(UserError, match=re.escape(words)):
        validate_ground(GroundConfig(field=spec))


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(UserError, match=r"holds no \.ply file"):
        parse_field_specification(f"pixie:{tmp_path}")


def _pickled(folder):
    np.savez(folder / "a.npz", voxel_data=np.array([{"x": 1}], dtype=object))
    return "vomp", folder / "a.npz"


def _cut(folder):
    path = written(folder, "pixie", "armchair")
    path.write_bytes(path.read_bytes()[:5000])
    return "pixie", path


def _cut_zip(folder):
    path = written(folder, "vomp", "armchair")
    path.write_bytes(path.read_bytes()[:5000])
    return "vomp", path


def _nan(folder):
    it = thing("armchair")
    synthetic_fields.write_vomp(folder / "a.npz", it.voxel, np.where(np.arange(len(it.young_pa)) < 3, np.nan,
                                                            it.young_pa))  # fmt: skip
    return "vomp", folder / "a.npz"


def _nowhere(folder):
    it = thing("armchair")
    synthetic_fields.write_pixie(folder / "a.ply", np.full_like(it.voxel, np.nan), it.young_pa)
    return "pixie", folder / "a.ply"


def _normalised(folder):
    np.save(folder / "sample_0_pred.npy", np.zeros((4, 64, 64, 64)))
    return "pixie", folder / "sample_0_pred.npy"


def _array(folder):
    np.save(folder / "a.npy", np.zeros((10, 6)))
    (folder / "a.npy").rename(folder / "a.npz")
    return "vomp", folder / "a.npz"


def _columns(folder):
    np.savez(folder / "a.npz", voxel_data=np.zeros(9, [("x", "f4"), ("y", "f4"), ("z", "f4")]))
    return "vomp", folder / "a.npz"


def _plain_ply(folder):
    (folder / "a.ply").write_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n")
    return "pixie", folder / "a.ply"


def _words(folder):
    (folder / "a.csv").write_text("x,y,z,E\n1,2,3,soft\n")
    return "table", folder / "a.csv"


def _no_names(folder):
    (folder / "a.csv").write_text("1,2,3,4\n")
    return "table", folder / "a.csv"


def _empty(folder):
    (folder / "a.csv").write_text("")
    return "table", folder / "a.csv"


def _few(folder):
    (folder / "a.csv").write_text("x,y,z,E\n1,2,3,4\n")
    return "table", folder / "a.csv"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (_pickled, "holds pickled objects, which are not read"),
        (_cut, "rows of 'vertex' are there"),
        (_cut_zip, "is no sound npz file"),
        (_nan, r"3 of \d+ values of young_pa do not lie between 0 and inf"),
        (_nowhere, "coordinates that are not finite"),
        (_normalised, "Name mapped_preds.ply"),
        (_array, "is no npz file"),
        (_columns, "has no youngs_modulus, poissons_ratio, density"),
        (_plain_ply, "have no y, z, material_id, E, nu, density"),
        (_words, "line 2 holds a cell that is no number"),
        (_no_names, "lacks columns"),
        (_empty, "lacks columns"),
        (_few, "has 1 points; at least 8"),
    ],
)
def test_a_bad_file_is_one_clean_error_that_names_it(make, words, tmp_path):
    kind, path = make(tmp_path)
    with pytest.raises(BadFileError, match=words) as caught:
        parse_field_specification(f"{kind}:{path}").read(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


def test_a_field_of_another_object_does_not_fit(tmp_path):
    it = thing("armchair")
    path = written(tmp_path, "vomp", "floor_lamp")
    with pytest.raises(BadFileError, match="points miss the surface by"):
        impose_field(ours("armchair"), it.scene, it.parts, f"vomp:{path}")


def test_what_cannot_be_computed_with_is_refused(tmp_path):
    it = thing("armchair")
    path = tmp_path / "a.npz"
    synthetic_fields.write_vomp(path, it.voxel, it.young_pa)
    field = read_vomp(path)
    with pytest.raises(BadFileError, match="values of poisson"):
        check_field(replace(field, values={"poisson": np.full(len(it.young_pa), 0.5)}))
