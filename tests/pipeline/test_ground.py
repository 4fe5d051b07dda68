import json
from dataclasses import replace

import numpy as np
import pytest

from corporeal import materials
from corporeal.core.errors import OutOfRangeError, UserError
from corporeal.core.types import Law, PartDescription, RangePlacement
from corporeal.description.describe_config import DescribeConfig
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.ground import GroundConfig, ground, grounding_warnings
from corporeal.pipeline.stages.segment import segment
from sample_scenes import plain, scene


def stated(name, substance, **extras):
    return (f"{name}_0", [(name, plain(), {"substance": substance, **extras})])


DUCK = stated("duck", "soft_PVC", shell_thickness_m=0.002)
BLOCK = stated("block", "steel")
PLANK = stated("plank", "hardwood")
RIDDLE = ("riddle_0", [("mesh", plain(), {})])


def grounded(*objects, config=None, annotations=None):
    made = scene(*objects)
    words = describe(made, DescribeConfig(annotations=annotations))
    parts = segment(made, words)
    return ground(made, parts, words, config or GroundConfig()), parts, made


def test_every_value_carries_its_range_its_source_and_a_reason():
    field, _, _ = grounded(DUCK, BLOCK, PLANK)
    for material in field.materials:
        assert set(material.grounds) >= {"young_pa", "poisson", "density", "friction", "loss"}
        for name, why in material.grounds.items():
            assert getattr(material, name) == why.value
            assert why.value in why.range
            assert materials.citation(why.range.source) != why.range.source
            assert (why.chosen_by, bool(why.reason)) == ("typical", True)


def test_the_structure_follows_the_description():
    field, _, _ = grounded(DUCK, BLOCK)
    assert (field.structures[0].kind, field.structures[0].thickness) == ("shell", 0.002)
    assert field.structures[1].kind == "solid"
    assert "the shape decides" in field.structures[1].reason


def test_a_shell_of_unstated_thickness_is_as_thin_as_such_objects_are(tmp_path):
    (tmp_path / "a.yaml").write_text("block_0: { structure: shell }")
    field, _, _ = grounded(BLOCK, annotations=tmp_path / "a.yaml")
    assert field.structures[0].thickness == pytest.approx(0.0007)
    (tmp_path / "a.yaml").write_text("block_0: { material: sand, structure: shell }")
    with pytest.raises(UserError, match="Give thickness_mm"):
        grounded(BLOCK, annotations=tmp_path / "a.yaml")


def test_an_unknown_part_gets_a_stated_stand_in_and_a_warning():
    field, parts, made = grounded(RIDDLE, BLOCK)
    assert field.materials[0].name == "plastics-PP"
    assert field.words[0].material is None
    assert {g.chosen_by for g in field.materials[0].grounds.values()} == {"fallback"}
    assert "of this part is unknown" in field.materials[0].grounds["young_pa"].reason
    (warning,) = grounding_warnings(field, parts, made)
    assert warning.startswith("riddle_0: riddle is of unknown material")
    named = replace(made, objects=tuple(replace(o, name="riddle") for o in made.objects))
    (warning,) = grounding_warnings(field, parts, named)
    assert warning.startswith("riddle is of unknown material"), "not twice by one name"


def test_a_person_may_choose_a_value_inside_the_range_and_never_outside(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("block_0: { values: { yield_MPa: 500, density_g_cm3: 7.9 } }")
    field, _, _ = grounded(BLOCK, annotations=path)
    steel = field.materials[0]
    assert steel.yield_stress == pytest.approx(500e6)
    assert steel.density == pytest.approx(7900)
    assert steel.grounds["yield_stress"].chosen_by == "annotation"
    assert steel.grounds["young_pa"].chosen_by == "typical"
    path.write_text("block_0: { values: { young_GPa: 20 } }")
    with pytest.raises(OutOfRangeError, match="Young's modulus of steel is 2e\\+10 Pa"):
        grounded(BLOCK, annotations=path)
    path.write_text("block_0: { values: { cohesion_kPa: 2 } }")
    with pytest.raises(UserError, match="steel has no cohesion"):
        grounded(BLOCK, annotations=path)


def test_friction_and_restitution_are_between_two_and_the_floor_is_one_of_them():
    field, _, _ = grounded(BLOCK, PLANK)
    assert field.friction.shape == field.restitution.shape == (3, 3)
    assert np.allclose(field.friction, field.friction.T)
    assert np.allclose(field.restitution, field.restitution.T)
    assert field.friction[0, 0] == pytest.approx(0.42)  # steel on steel, measured
    assert field.friction[0, 1] == pytest.approx(0.3)  # metal on wood, measured
    assert field.friction[0, 2] == pytest.approx(0.5)  # steel on the concrete floor, measured
    icy, _, _ = grounded(BLOCK, PLANK, config=GroundConfig(floor="ice"))
    assert icy.friction[0, 2] < 0.05


def test_stated_friction_outranks_a_measured_pair(tmp_path):
    (tmp_path / "a.yaml").write_text("block_0: { values: { friction: 0.32 } }")
    field, _, _ = grounded(BLOCK, annotations=tmp_path / "a.yaml")
    floor = materials.find_material("concrete").ranges["friction"].typical
    assert field.friction[0, 1] == pytest.approx((0.32 * floor) ** 0.5)


def test_the_published_vocabulary_grounds_the_same_scene():
    field, _, _ = grounded(DUCK, BLOCK, PLANK, RIDDLE, config=GroundConfig(library="reference"))
    assert [m.name for m in field.materials] == ["rubber", "steel", "wood", "plastics-PP"]
    assert field.materials[0].poisson == pytest.approx(0.4999)


OWN = """
[sources.mine]
cite = "Our own bench"

[steel]
law = "von_mises"
group = "metal"
young_GPa = { low = 200, typical = 201, high = 202, source = "mine" }
poisson = { low = 0.28, typical = 0.29, high = 0.3, source = "mine" }
density_kg_m3 = { low = 7800, typical = 7810, high = 7820, source = "mine" }
yield_MPa = { low = 300, typical = 310, high = 320, source = "mine" }
"""


def test_a_library_of_ones_own_replaces_ours_or_extends_it(tmp_path):
    (tmp_path / "merged.toml").write_text('extends = "default"\n' + OWN)
    config = GroundConfig(library=str(tmp_path / "merged.toml"))
    field, parts, _ = grounded(BLOCK, PLANK, config=config)
    assert field.materials[0].young_pa == pytest.approx(201e9)
    assert field.materials[1].name == "hardwood"
    said = materials.materials_json(field, parts)
    assert said["parts"][0]["values"]["young_pa"]["source"] == "Our own bench"
    (tmp_path / "alone.toml").write_text(OWN)
    alone = GroundConfig(library=str(tmp_path / "alone.toml"), floor="steel", neutral="steel")
    assert grounded(BLOCK, config=alone)[0].materials[0].young_pa == pytest.approx(201e9)
    with pytest.raises(UserError, match=r"has nothing for 'hardwood'.*extends = \"default\""):
        grounded(BLOCK, PLANK, config=alone)


def test_the_record_is_plain_data_with_resolved_citations():
    field, parts, _ = grounded(DUCK, RIDDLE)
    said = json.loads(json.dumps(materials.materials_json(field, parts), allow_nan=False))
    duck = said["parts"][0]
    assert duck["structure"]["thickness"] == 0.002
    assert duck["values"]["young_pa"]["range"] == [3.6e6, 21e6]
    assert "Gent" in duck["values"]["young_pa"]["source"]
    assert said["parts"][1]["answered_by"] == "unknown"


def placed(**fractions):
    return {f: RangePlacement(x, "model", f"{f} so.") for f, x in fractions.items()}


def spoken(thing, words, library="default"):
    """Ground one object of one part of which somebody said ``words``."""
    made = scene(thing)
    told = describe(made)
    (known,) = told.objects
    words = replace(words, name=known.parts[0].name)
    told = replace(told, objects=(replace(known, parts=(words,)),))
    parts = segment(made, told)
    field = ground(made, parts, told, GroundConfig(library=library))
    return field, grounding_warnings(field, parts, made)


def test_values_are_where_a_model_placed_them_and_say_so():
    words = PartDescription("", "soft_PVC", "shell", margin=0.6, placements=placed(young_pa=0.25, shell_thickness=0.5))
    field, said = spoken(RIDDLE, words)
    (material,), (structure,) = field.materials, field.structures
    assert material.young_pa == pytest.approx(3.6e6 + 0.25 * (21e6 - 3.6e6))
    assert material.shell_thickness == pytest.approx(0.4e-3 + 0.5 * 3.6e-3)
    assert structure.thickness == material.shell_thickness
    young_pa, density = material.grounds["young_pa"], material.grounds["density"]
    assert (young_pa.chosen_by, young_pa.reason, young_pa.margin) == ("model", "young_pa so.", 0.6)
    assert (density.chosen_by, density.margin) == ("typical", 0.6)
    assert said == ()


def test_a_wide_range_is_placed_in_factors():
    (foam,) = spoken(RIDDLE, PartDescription("", "seat_foam", placements=placed(young_pa=0.5)))[0].materials
    assert foam.young_pa == pytest.approx((10e3 * 150e3) ** 0.5)


def test_what_is_inside_is_as_dense_as_it_was_placed():
    words = PartDescription("", "aluminium_can_sheet", "filled", contents="water", fill=0.9)
    words = replace(words, placements=placed(contents_density=1.0))
    (structure,) = spoken(RIDDLE, words)[0].structures
    water = materials.library()["water"].ranges["density"]
    assert structure.contents.density == water.high > water.typical
    assert structure.contents.grounds["density"].chosen_by == "model"


def test_values_that_do_not_fit_each_other_are_flagged_where_they_stand_and_in_a_warning():
    words = PartDescription("", "plasticine", placements=placed(young_pa=1.0, yield_stress=0.0))
    field, said = spoken(RIDDLE, words)
    reason = field.materials[0].grounds["yield_stress"].reason
    assert reason.startswith("yield_stress so. It does not fit the others: stiff but weak")
    assert said[0].startswith("riddle_0: riddle: yield_stress of plasticine: It does not fit")


def test_what_a_person_stated_outranks_what_a_model_placed():
    words = PartDescription("", "steel", placements=placed(young_pa=0.0), values={"young_pa": 2.1e11})
    (steel,) = spoken(RIDDLE, words)[0].materials
    assert (steel.young_pa, steel.grounds["young_pa"].chosen_by) == (2.1e11, "annotation")
    assert steel.grounds["young_pa"].margin == 1.0


def test_an_unanswered_placement_is_marked():
    words = PartDescription("", "steel", placements={"young_pa": RangePlacement(0.4, "fallback", "No answer.")})
    (steel,) = spoken(RIDDLE, words)[0].materials
    assert steel.grounds["young_pa"].chosen_by == "fallback"


def test_a_description_without_the_part_is_refused():
    made = scene(BLOCK)
    words = describe(made)
    parts = segment(made, words)
    other = replace(words, objects=(replace(words.objects[0], parts=()),))
    with pytest.raises(UserError, match="has no part 'block'"):
        ground(made, parts, other)


# ---------------------------------------------------------------- what is filled


def said(tmp_path, text):
    (tmp_path / "said.yaml").write_text(text)
    return tmp_path / "said.yaml"


def test_what_is_filled_has_contents_from_the_library(tmp_path):
    path = said(
        tmp_path,
        "block_0: { structure: filled, thickness_mm: 0.2, contents: soup, fill: 0.9 }\n"
        "plank_0: { material: cotton, structure: filled, contents: stuffing }",
    )
    field, _, _ = grounded(BLOCK, PLANK, annotations=path)
    can, pillow = field.structures
    assert (can.kind, can.thickness, can.fill, can.loose) == ("filled", 2e-4, 0.9, True)
    sauce = materials.find_material("sauce")
    assert can.contents.name == "sauce"
    assert can.contents.density == sauce.ranges["density"].typical
    assert can.contents.grounds["density"].range.source == "porous-foods+ketchup-grades"
    assert (pillow.contents.name, pillow.fill, pillow.loose) == ("fibre_fill", 1.0, False)
    assert "taken as full" in pillow.reason


def test_a_library_without_contents_leaves_them_to_the_default_one(tmp_path):
    path = said(tmp_path, "block_0: { structure: filled, thickness_mm: 1, contents: sugar }")
    small = GroundConfig(library="reference")
    field, _, _ = grounded(BLOCK, config=small, annotations=path)
    assert field.structures[0].contents.name == "granules"
    assert field.structures[0].loose


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("block_0: { structure: filled, thickness_mm: 1 }", "not with what"),
        ("block_0: { material: sand, structure: filled, contents: water }", "Give thickness_mm"),
        ("block_0: { structure: filled, thickness_mm: 1, contents: phlogiston }", "phlogiston"),
        ("block_0: { structure: filled, contents: water, fill: 1.5 }", "fill is a share"),
        ("block_0: { structure: filled, contents: 3 }", "contents must be a name"),
    ],
)
def test_what_cannot_be_filled_says_what_to_do(tmp_path, text, words):
    with pytest.raises(UserError, match=words):
        grounded(BLOCK, annotations=said(tmp_path, text))


def test_an_object_of_its_own_can_be_a_liquid(tmp_path):
    field, _, _ = grounded(BLOCK, annotations=said(tmp_path, "block_0: honey"))
    honey = field.materials[0]
    assert honey.law == Law.FLUID
    assert honey.thickness_of_flow == materials.find_material("honey").ranges["viscosity"].typical
    assert honey.flow_index == 1.0


def test_pieces_are_grounded_each_for_itself():
    made = scene(BLOCK)
    words = describe(made, DescribeConfig())
    (thing,) = words.objects
    shaft = PartDescription("shaft", "steel", "solid", volume_share=0.2, surface_share=0.3)
    grip = PartDescription("grip", "ABS", "shell", volume_share=0.8, surface_share=0.7)
    whole = replace(thing.parts[0], pieces=(shaft, grip))
    told = replace(words, objects=(replace(thing, parts=(whole,)),))
    field = ground(made, segment(made, told), told)
    ((first, second),) = field.pieces
    assert (first.material.name, first.structure.kind) == ("steel", "solid")
    assert second.structure.thickness == materials.find_material("ABS").ranges["shell_thickness"].typical
    assert second.words.volume_share == 0.8


def test_pieces_are_in_materials_json_with_the_grounds_of_every_value():
    shaft = PartDescription("shaft", "steel", "solid", volume_share=0.2, reason="It shines.")
    grip = PartDescription("grip", None, "solid", volume_share=0.8, placements=placed(density=0.5))
    made = scene(BLOCK, PLANK)
    told = describe(made)
    whole = replace(told.objects[0].parts[0], pieces=(shaft, grip))
    told = replace(told, objects=(replace(told.objects[0], parts=(whole,)), told.objects[1]))
    parts = segment(made, told)
    field = ground(made, parts, told)
    block, plank = json.loads(json.dumps(materials.materials_json(field, parts)))["parts"]
    assert "pieces" not in plank
    first, second = block["pieces"]
    assert (first["name"], first["volume_share"], first["reason"]) == ("shaft", 0.2, "It shines.")
    assert first["values"]["density"]["range"] == [7800, 7900]
    assert len(first["values"]["density"]["source"]) > 20
    assert (second["recognised"], second["material"]) == (None, "plastics-PP")
    (warning,) = grounding_warnings(field, parts, made)
    assert warning.startswith("block_0: block: grip is of unknown material; plastics-PP is assumed")


@pytest.mark.parametrize(
    ("built_by", "who"),
    [
        ("annotation", "Your annotation says"),
        ("model", "A model says"),
        ("recording", "A recorded answer says"),
        ("metadata", "The file's metadata says"),
    ],
)
def test_the_source_of_a_structure_is_named(built_by, who):
    (solid,) = spoken(RIDDLE, PartDescription("", "steel", "solid", built_by=built_by))[0].structures
    assert solid.reason == f"{who} that it is solid."
    shell = PartDescription("", "terracotta", "shell", built_by=built_by)
    (usual,) = spoken(RIDDLE, shell)[0].structures
    wall = f"{who} that it has a wall."
    assert usual.reason == (
        f"{wall} Its thickness, unless its mesh shows it, is the usual 7 mm, in the range of terracotta: 4 to 15 mm."
    )
    put = replace(shell, placements={"shell_thickness": RangePlacement(1.0, "model", "Thick.")})
    (here,) = spoken(RIDDLE, put)[0].structures
    assert here.reason == (f"{wall} A model puts its thickness at 15 mm, in the range of terracotta: 4 to 15 mm.")
    (stated,) = spoken(RIDDLE, replace(shell, thickness=0.003))[0].structures
    assert stated.reason == f"{wall} Its thickness, 3 mm, is stated."


def test_a_wall_of_unknown_material_is_as_thick_as_the_stand_ins_where_those_are_known():
    words = PartDescription("", None, "shell", reason="Painted.")
    (structure,) = spoken(RIDDLE, words)[0].structures
    assert (structure.kind, structure.thickness) == ("shell", pytest.approx(0.0015))
    (structure,) = spoken(RIDDLE, words, "reference")[0].structures
    assert (structure.kind, structure.thickness) == ("solid", None)
    assert "a shell of unknown material" in structure.reason
