import sys

import numpy as np
import pytest

from corporeal.errors import UnknownChoiceError, UserError
from corporeal.geometry.identity import identify
from corporeal.stages.describe import (
    DescribeConfig,
    MaterialsAnswer,
    PartAnswer,
    describe,
    question,
)
from corporeal.stages.ground import ground
from corporeal.stages.segment import segment
from corporeal.vlm.metadata import matter_hint
from corporeal.vlm.recordings import record
from handmade import plain, scene

VINYL = {"substance": "soft_PVC", "shell_thickness_m": 0.002}
DUCK = ("duck_0", [("body", plain("vinyl"), VINYL), ("beak", plain("vinyl"), {**VINYL, "x": 1})])
VASE = ("vase_0", [("mesh", plain(), {})])
THING = ("thing_0", [("mesh", plain(), {})])


def words(inventory):
    return {(o.name, p.name): p for o in inventory.objects for p in o.parts}


def test_what_the_file_states_is_certain():
    said = words(describe(scene(DUCK)))[("duck_0", "body")]
    assert (said.material, said.margin, said.answered_by) == ("soft_PVC", 1.0, "metadata")
    assert (said.structure, said.thickness) == ("shell", 0.002)


def test_a_stated_thickness_of_zero_means_solid():
    solid = ("block_0", [("block", plain(), {"substance": "wood", "shell_thickness_m": 0.0})])
    said = words(describe(scene(solid)))[("block_0", "block")]
    assert (said.structure, said.thickness) == ("solid", None)


def test_a_foreign_substance_is_no_obstacle():
    odd = ("vase_0", [("mesh", plain(), {"substance": "unobtainium"})])
    assert words(describe(scene(odd)))[("vase_0", "vase")].material == "ceramic"


@pytest.mark.parametrize(
    "said",
    [
        {"substance": ["a", "list"], "shell_thickness_m": "thin"},
        {"substance": {"a": 1}, "shell_thickness_m": float("nan")},
        {"substance": 7, "shell_thickness_m": -1.0},
        {"substance": True, "shell_thickness_m": True},
    ],
)
def test_nonsense_in_a_foreign_file_is_no_obstacle(said):
    made = words(describe(scene(("vase_0", [("mesh", plain(), said)]))))[("vase_0", "vase")]
    assert (made.material, made.structure, made.thickness) == ("ceramic", None, None)


def test_a_scene_of_a_thousand_surfaces_is_described_in_a_moment():
    pieces = [(f"piece_{k}", plain(f"Metal.{k:03d}"), {}) for k in range(1000)]
    (thing,) = describe(scene(("heap_0", pieces))).objects
    assert [p.material for p in thing.parts] == ["steel"]


def test_unknown_is_a_normal_answer():
    said = words(describe(scene(THING)))[("thing_0", "thing")]
    assert (said.material, said.margin, said.answered_by) == (None, 0.0, "unknown")
    assert said.reason


def test_objects_are_in_the_scenes_order_and_parts_in_the_catalogues():
    made = scene(DUCK, VASE)
    inventory, identity = describe(made), identify(made, matter_hint)
    assert [o.name for o in inventory.objects] == ["duck_0", "vase_0"]
    assert [p.name for o in inventory.objects for p in o.parts] == [
        p.name for p in identity.catalogue
    ]


def test_a_person_is_believed_before_the_file(tmp_path):
    (tmp_path / "said.yaml").write_text(
        "duck_0: { material: natural rubber, thickness_mm: 1.5, values: { young_MPa: 2.2 } }\n"
    )
    config = DescribeConfig(annotations=tmp_path / "said.yaml")
    said = words(describe(scene(DUCK, VASE), config))
    body = said[("duck_0", "body")]
    assert (body.material, body.answered_by) == ("natural_rubber", "annotation")
    assert (body.structure, body.thickness) == ("shell", pytest.approx(0.0015))
    assert body.values == {"young": pytest.approx(2.2e6)}
    assert said[("vase_0", "vase")].answered_by == "metadata"


def test_a_person_may_say_only_how_it_is_built(tmp_path):
    (tmp_path / "said.yaml").write_text("vase_0: { structure: shell, thickness_mm: 4 }\n")
    config = DescribeConfig(annotations=tmp_path / "said.yaml")
    said = words(describe(scene(VASE), config))[("vase_0", "vase")]
    assert (said.material, said.thickness) == ("ceramic", pytest.approx(0.004))


def test_an_annotation_that_does_not_fit_is_refused(tmp_path):
    path = tmp_path / "said.yaml"
    config = DescribeConfig(annotations=path)
    path.write_text("vase_0: ceramik\n")
    with pytest.raises(UnknownChoiceError, match="Unknown material 'ceramik'"):
        describe(scene(VASE), config)
    path.write_text("duck_0: ABS\n")
    with pytest.raises(UserError, match=r"no object called 'duck_0'. There are: vase_0"):
        describe(scene(VASE), config)
    path.write_text("vase_0: { values: { young: 3 } }\n")
    with pytest.raises(UserError, match="Unknown quantity 'young'"):
        describe(scene(VASE), config)


def recorded(tmp_path, made, *answers):
    identity = identify(made, matter_hint)
    for number, answer in enumerate(answers):
        asked = question(made, number, identity)
        record(tmp_path, asked, MaterialsAnswer(parts=answer), "some-model")
    return DescribeConfig(vlm=f"replay:{tmp_path}")


def test_a_recorded_answer_is_believed_before_the_names(tmp_path):
    made = scene(VASE, THING)
    config = recorded(
        tmp_path,
        made,
        [PartAnswer(part="vase", material="glass", structure="shell", thickness_mm=3)],
        [PartAnswer(part="thing", material=None)],
    )
    inventory = describe(made, config)
    said = words(inventory)
    vase = said[("vase_0", "vase")]
    assert (vase.material, vase.answered_by, vase.thickness) == ("glass", "recording", 0.003)
    assert said[("thing_0", "thing")].answered_by == "unknown"
    assert [t["scene"] for t in inventory.transcript] == ["hand-made/vase_0", "hand-made/thing_0"]


def test_the_question_offers_the_whole_library_and_nothing_else():
    made = scene(VASE)
    prompt = question(made, 0, identify(made, matter_hint)).prompt
    assert "seat_foam" in prompt
    assert "Parts: vase." in prompt


def test_a_recording_of_something_else_is_refused(tmp_path):
    made = scene(VASE)
    strange = recorded(tmp_path, made, [PartAnswer(part="lid", material="glass")])
    with pytest.raises(UserError, match="speaks of a part 'lid'"):
        describe(made, strange)
    with pytest.raises(UserError, match="differs in 'scene'"):
        describe(scene(VASE, name="another"), strange)


def test_a_live_model_is_refused_with_what_to_use_instead():
    with pytest.raises(UserError, match="not connected"):
        describe(scene(VASE), DescribeConfig(vlm="openai:gpt-5.4"))


# ---------------------------------------------------------------- real objects

HARD_PLASTIC = {"ABS", "plastics-PP", "plastics-HDPE", "polystyrene", "PVC", "polycarbonate"}
WOODS = {"wood", "hardwood", "softwood", "plywood", "mdf"}
STEELS = {"steel", "stainless_steel"}
TRUTH = {
    # Our own reading of each object: part's beginning → what would be right. "": any part.
    "duck_khronos": {"": {"soft_PVC", "rubber", "natural_rubber"}},
    "soda_can_coke": {"": {"aluminium", "aluminium_can_sheet"}},
    "soda_can_crushed_kenney": {"": {"aluminium", "aluminium_can_sheet"}},
    "vase_smallhouse": {"": {"ceramic", "porcelain", "terracotta"}},
    "ball_smallhouse": {"": {"rubber", "leather", "soft_PVC"}},
    "armchair_kaolin": {"M_Armchair_Cushions": {"seat_foam"}, "Sides": WOODS},
    "couch_smallhouse": {"": {"seat_foam"}},
    "lamp_barn_khronos": {"Lamp Metal": STEELS | {"aluminium", "brass"}, "Lamp Glass": {"glass"}},
    "plant_potted_market": {
        "NurbsPath": {"leaves-flowers", "leaf_tissue"},
        "plant": {"terracotta"},
    },
    "tree_oak_gazebo": {"branch": {"leaves-flowers"}, "bark": WOODS},
    "tree_lowpoly_playcanvas": {"": WOODS},
    "bed_smallhouse": {"": {"seat_foam", "cotton"} | WOODS},
    "chair_smallhouse_a": {"": WOODS},
    "table_polyhaven": {"": WOODS},
    "cabinet_polyhaven": {"": WOODS},
    "tea_set_polyhaven": {"": {"porcelain", "ceramic"}},
    "pillow_smallhouse": {"": {"fibre_fill", "seat_foam"}},
    "quilt_smallhouse": {"": {"fibre_fill", "cotton"}},
    "cardboard_box_gazebo": {"": {"corrugated_cardboard", "cardboard"}},
    "cinder_block_gazebo": {"": {"concrete"}},
    "cone_gazebo": {"": {"soft_PVC", "rubber", "PVC"}},
    "trash_can_smallhouse": {"": HARD_PLASTIC | STEELS},
    "water_bottle_khronos": {"": HARD_PLASTIC | STEELS | {"PET", "aluminium"}},
    "avocado_khronos": {"": {"soft_fruit", "apple"}},
    "cat_statue_playcanvas": {"": {"granite", "marble", "bronze"}},
    "flight_helmet_khronos": {
        "Hose": {"rubber"},
        "RubberWood": {"rubber", "wood"},
        "GlassPlastic": {"glass"} | HARD_PLASTIC,
        "MetalParts": STEELS | {"aluminium", "brass"},
        "LeatherParts": {"leather"},
        "Lenses": {"glass", "polycarbonate", "PMMA"},
    },
    "guitar_market": {"parlourGuitar": WOODS, "Metal.Bronze": {"bronze"}, "Metal.Iron": STEELS},
    "teddy_bullet_notex": {"": {"fibre_fill", "cotton"}},
    "hammer_gazebo": {"": STEELS | WOODS},
    "drill_gazebo": {"": HARD_PLASTIC},
    "fitness_smallhouse": {"": STEELS},
    "tv_smallhouse": {"": HARD_PLASTIC},
    "frypan_gso": {"": STEELS | {"aluminium", "cast-iron"}},
    "sand_mound_kenney": {"": {"sand", "soil_clay"}},
    "013_apple": {"": HARD_PLASTIC},  # a plastic fruit
    "011_banana": {"": HARD_PLASTIC},  # a plastic fruit
    "070-b_colored_wood_blocks": {"": WOODS},
    "024_bowl": {"": STEELS},
    "065-c_cups": {"": HARD_PLASTIC},
    "065-f_cups": {"": HARD_PLASTIC},
    "059_chain": {"": HARD_PLASTIC},  # a plastic chain
    "062_dice": {"": HARD_PLASTIC | {"PMMA"}},
    "030_fork": {"": STEELS},
    "009_gelatin_box": {"": {"cardboard"}},
    "058_golf_ball": {"": {"TPU", "rubber"}},
    "040_large_marker": {"": HARD_PLASTIC},
    "050_medium_clamp": {"": HARD_PLASTIC | STEELS},
    "006_mustard_bottle": {"": HARD_PLASTIC | {"PET"}},
    "038_padlock": {"": STEELS | {"brass"}},
    "043_phillips_screwdriver": {"": STEELS | HARD_PLASTIC},
    "037_scissors": {"": STEELS},
    "054_softball": {"": {"leather", "cork", "TPU"}},
    "026_sponge": {"": {"seat_foam"}},
    "004_sugar_box": {"": {"cardboard"}},
    "005_tomato_soup_can": {"": STEELS},
}


def judged(path):
    """Read, describe, segment and ground a real file; yield (part, material, right)."""
    from corporeal.formats.glb import read_glb

    made = read_glb(path)
    inventory = describe(made)
    parts = segment(made, inventory)
    field = ground(made, parts, inventory)
    assert np.all(parts.part_of_point >= 0)
    assert len(field.materials) == len(parts.catalogue)
    for words in (p for o in inventory.objects for p in o.parts):
        truth = TRUTH[path.stem]
        right = next((truth[b] for b in truth if words.name.startswith(b)), set())
        yield words.name, words.material, words.material in right


def test_names_alone_are_more_often_right_than_wrong_and_know_when_they_do_not_know(
    shared_assets, capsys
):
    files = [*shared_assets.glob("objects/*.glb"), *shared_assets.glob("ycb/*.glb")]
    rows = [(f.stem, *row) for f in sorted(files) for row in judged(f)]
    unknown = sum(material is None for _, _, material, _ in rows)
    right = sum(good for *_, good in rows)
    wrong = len(rows) - unknown - right
    table = [
        f"{len(rows)} parts of {len(files)} files: {right} right, {wrong} wrong, {unknown} unknown",
        *(
            f"  {stem}: {part} is not {said}"
            for stem, part, said, good in rows
            if said and not good
        ),
    ]
    with capsys.disabled():
        sys.stdout.write("\n" + "\n".join(table) + "\n")
    assert wrong / len(rows) <= 0.15
    assert right / len(rows) >= 0.6
