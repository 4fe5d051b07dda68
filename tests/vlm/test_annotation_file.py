import pytest

from corporeal.core.errors import UserError
from corporeal.vlm.annotation_file import PartAnnotation, read_annotations

SCENE = {"duck_0": ["body", "beak"], "vase_0": ["vase"]}


def told(tmp_path, text):
    (tmp_path / "said.yaml").write_text(text)
    return read_annotations(tmp_path / "said.yaml", SCENE)


def test_what_is_stated_of_an_object_holds_for_all_its_parts(tmp_path):
    said = told(tmp_path, "duck_0: soft_PVC\n")
    assert said == {("duck_0", p): PartAnnotation("soft_PVC") for p in ("body", "beak")}


def test_what_is_stated_of_a_part_comes_before_what_is_stated_of_its_object(tmp_path):
    said = told(tmp_path, "duck_0:\n  material: soft_PVC\n  thickness_mm: 2\n  parts:\n    beak: ABS\n")
    assert said[("duck_0", "body")].thickness == pytest.approx(0.002)
    assert said[("duck_0", "beak")] == PartAnnotation("ABS")


def test_pieces_of_undivided_parts_may_be_named(tmp_path):
    (tmp_path / "said.yaml").write_text("vase_0: {parts: {foot: wood, bowl: glass}}\n")
    said = read_annotations(tmp_path / "said.yaml", SCENE, free=["vase_0"])
    assert said == {("vase_0", "foot"): PartAnnotation("wood"), ("vase_0", "bowl"): PartAnnotation("glass")}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("duk_0: ABS", "there is no object called 'duk_0'. There are: duck_0, vase_0."),
        ("duck_0: {parts: {sole: ABS}}", "there is no part of 'duck_0' called 'sole'. There are: body, beak."),
        ("duck_0: {stuff: ABS}", "unknown key 'stuff'"),
        ("duck_0: {structure: holey}", "Choose one of: solid, shell, sheet, hollow, filled, packed"),
        ("duck_0: {thickness_mm: thin}", "thickness_mm must be a number"),
        ("duck_0: {thickness_mm: -1}", "above 0"),
        ("duck_0: {thickness_mm: .nan}", "must be a number"),
        ("duck_0: {values: {young_MPa: .inf}}", "must be a number"),
        ("[" * 600, "is not YAML"),
        ("duck_0: {parts: {1: ABS}}", "there is no part of 'duck_0' called '1'"),
        ("duck_0: {values: {young_MPa: soft}}", "young_MPa must be a number"),
        ("duck_0: {values: 3}", "'values' must map"),
        ("duck_0: [1, 2]", "must be a material's name or a mapping"),
        ("duck_0: {parts: [a]}", "'parts' of 'duck_0' must map"),
        ("duck_0: {material: 3}", "material must be a name"),
        ("- duck_0", "must map object names"),
        ("a: b: c", "is not YAML"),
    ],
)
def test_what_does_not_fit_is_named_with_what_would(tmp_path, text, message):
    with pytest.raises(UserError) as error:
        told(tmp_path, text)
    assert message in str(error.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(UserError, match=r"nowhere.yaml: cannot be read"):
        read_annotations(tmp_path / "nowhere.yaml", SCENE)
