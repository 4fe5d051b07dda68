import json
import re
import time

import numpy as np
import pytest
from recognition.facts import facts, judge

from corporeal import materials
from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.description.describe_config import DescribeConfig
from corporeal.io.gltf.gltf_reader import read_glb
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.ground import ground
from corporeal.pipeline.stages.segment import segment
from corporeal.recognition.metadata_recognition import substance_hint
from corporeal.recognition.parts_by_name import identify_parts
from corporeal.render.object_portrait import render_portraits
from corporeal.vlm.recordings import RecordingClient
from sample_scenes import plain, scene
from scripted_model import Oracle, decomposed, everywhere, part, sizes, weighs, whole

VINYL = {"substance": "soft_PVC", "shell_thickness_m": 0.002}
DUCK = ("duck_0", [("body", plain("vinyl"), VINYL), ("beak", plain("vinyl"), {**VINYL, "x": 1})])
VASE = ("vase_0", [("mesh", plain(), {})])
THING = ("thing_0", [("mesh", plain(), {})])


def words(inventory):
    return {(o.name, p.name): p for o in inventory.objects for p in o.parts}


def test_what_the_file_states_is_certain():
    said = words(describe(scene(DUCK)))[("duck_0", "body")]
    assert (said.material, said.margin, said.answered_by) == ("soft_PVC", 1.0, "metadata")
    assert (said.structure, said.thickness, said.built_by) == ("shell", 0.002, "metadata")


def test_a_stated_thickness_of_zero_means_solid():
    solid = ("block_0", [("block", plain(), {"substance": "wood", "shell_thickness_m": 0.0})])
    said = words(describe(scene(solid)))[("block_0", "block")]
    assert (said.structure, said.thickness) == ("solid", None)


def test_open_ware_from_pictures_is_no_solid_and_that_is_reported():
    """What is plain inside looks solid; a model of the same shows its wall itself."""
    bowl = scene(("bowl_0", [("mesh", plain(), {})]))
    made = describe(bowl, from_pictures=[0])
    said = words(made)[("bowl_0", "bowl")]
    assert (said.structure, said.built_by, said.wall_unseen) == ("sheet", "metadata", True)
    assert "By its name it is open ware" in made.warnings[0]
    drawn = describe(bowl)
    assert words(drawn)[("bowl_0", "bowl")].structure is None and not drawn.warnings
    assert not describe(scene(THING), from_pictures=[0]).warnings


def test_open_ware_from_pictures_stays_so_whatever_a_person_says_it_is_made_of(tmp_path):
    """Else a bowl of which only the steel was stated weighed what its surface encloses."""
    (tmp_path / "said.yaml").write_text("bowl_0: steel\n")
    config = DescribeConfig(annotations=tmp_path / "said.yaml")
    bowl = scene(("bowl_0", [("mesh", plain(), {})]))
    said = words(describe(bowl, config, from_pictures=[0]))[("bowl_0", "bowl")]
    assert (said.material, said.answered_by) == ("steel", "annotation")
    assert (said.structure, said.wall_unseen) == ("sheet", True)
    (tmp_path / "said.yaml").write_text("bowl_0: { material: steel, structure: solid }\n")
    said = words(describe(bowl, config, from_pictures=[0]))[("bowl_0", "bowl")]
    assert said.structure == "solid"
    (tmp_path / "said.yaml").write_text("bowl_0: steel\n")
    assert words(describe(bowl, config))[("bowl_0", "bowl")].structure is None


def test_no_wall_from_pictures_is_believed_of_any_source(tmp_path):
    (tmp_path / "said.yaml").write_text("thing_0: { material: steel, structure: sheet }\n")
    config = DescribeConfig(annotations=tmp_path / "said.yaml")
    said = words(describe(scene(THING), config, from_pictures=[0]))[("thing_0", "thing")]
    assert (said.structure, said.built_by, said.wall_unseen) == ("sheet", "annotation", True)
    assert not words(describe(scene(THING), config))[("thing_0", "thing")].wall_unseen


@pytest.mark.parametrize("name", ["frypan", "iron skillet", "steel frying pan"])
def test_pans_are_open_ware(name):
    said = describe(scene((name, [("mesh", plain(), {})])), from_pictures=[0])
    assert [p.structure for o in said.objects for p in o.parts] == ["sheet"]


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
    assert (made.material, made.structure, made.thickness) == ("ceramic", "shell", None)


def test_a_scene_of_a_thousand_surfaces_is_described_in_a_moment():
    pieces = [(f"piece_{k}", plain(f"Metal.{k:03d}"), {}) for k in range(1000)]
    (thing,) = describe(scene(("heap_0", pieces))).objects
    assert [p.material for p in thing.parts] == ["steel"]


@pytest.mark.slow
def test_an_object_of_a_thousand_parts_is_described_in_seconds():
    colours = [(k / 1000, 0.0, 0.0, 1.0) for k in range(1000)]
    pieces = [(f"steel_{k}", plain(f"m{k}", colour=c), {}) for k, c in enumerate(colours)]
    start = time.process_time()
    (thing,) = describe(scene(("heap_0", pieces))).objects
    assert len(thing.parts) > 900
    assert {p.material for p in thing.parts} == {"steel"}
    assert time.process_time() - start < 5


def test_unknown_is_a_normal_answer():
    said = words(describe(scene(THING)))[("thing_0", "thing")]
    assert (said.material, said.margin, said.answered_by) == (None, 0.0, "unknown")
    assert said.reason


def test_objects_are_in_the_scenes_order_and_parts_in_the_catalogues():
    made = scene(DUCK, VASE)
    inventory, identity = describe(made), identify_parts(made, substance_hint)
    assert [o.name for o in inventory.objects] == ["duck_0", "vase_0"]
    assert [p.name for o in inventory.objects for p in o.parts] == [p.name for p in identity.catalogue]


def test_a_person_is_believed_before_the_file(tmp_path):
    (tmp_path / "said.yaml").write_text(
        "duck_0: { material: natural rubber, thickness_mm: 1.5, values: { young_MPa: 2.2 } }\n"
    )
    config = DescribeConfig(annotations=tmp_path / "said.yaml")
    said = words(describe(scene(DUCK, VASE), config))
    body = said[("duck_0", "body")]
    assert (body.material, body.answered_by) == ("natural_rubber", "annotation")
    assert (body.structure, body.thickness) == ("shell", pytest.approx(0.0015))
    assert body.values == {"young_pa": pytest.approx(2.2e6)}
    assert said[("vase_0", "vase")].answered_by == "metadata"


def test_a_person_may_say_only_how_it_is_built(tmp_path):
    (tmp_path / "said.yaml").write_text("vase_0: { structure: shell, thickness_mm: 4 }\n")
    config = DescribeConfig(annotations=tmp_path / "said.yaml")
    said = words(describe(scene(VASE), config))[("vase_0", "vase")]
    assert (said.material, said.thickness) == ("ceramic", pytest.approx(0.004))
    assert (said.answered_by, said.built_by) == ("metadata", "annotation")


def test_a_person_may_name_pieces_of_an_object_from_pictures(tmp_path):
    path = tmp_path / "said.yaml"
    path.write_text("vase_0: { parts: { foot: ABS, bowl: { material: glass, thickness_mm: 3 } } }\n")
    config = DescribeConfig(annotations=path)
    said = words(describe(scene(VASE), config, from_pictures=[0]))[("vase_0", "vase")]
    assert [(p.name, p.material) for p in said.pieces] == [("foot", "ABS"), ("bowl", "glass")]
    assert said.pieces[1].thickness == pytest.approx(0.003)
    assert sum(p.volume_share for p in said.pieces) == 1
    with pytest.raises(UserError, match="no part of 'vase_0' called 'foot'"):
        describe(scene(VASE), config)


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


# ---------------------------------------------------------------- a model's answers


@pytest.fixture
def ask(monkeypatch):
    """Describe a scene with an oracle in the model's place."""

    def asked(oracle, *objects, name="hand-made", library="default", **config):
        settings = DescribeConfig(**({"vlm": "oracle:1", "view_size": 32} | config))

        def connected(spec, record):
            return RecordingClient(oracle, record) if record else oracle

        with monkeypatch.context() as patched:
            patched.setattr("corporeal.pipeline.stages.describe.connect_vlm", connected)
            return describe(scene(*objects, name=name), settings, library)

    return asked


def replay(folder):
    return DescribeConfig(vlm=f"replay:{folder}", view_size=32)


def made_of(*parts):
    return {"parts": list(parts)}


def test_a_model_is_believed_before_the_names_and_unknown_leaves_them_the_word(ask):
    answers = {
        "hand-made/vase_0": made_of(part("vase", "glass", "sheet")),
        "hand-made/thing_0": made_of(part("thing", None, None)),
        "hand-made/bucket_0": made_of(part("bucket", None, None)),
    }
    bucket = ("bucket_0", [("steel", plain(), {})])
    oracle = Oracle(materials=lambda q: answers[q.scene])
    inventory = ask(oracle, VASE, THING, bucket)
    said = words(inventory)
    vase = said[("vase_0", "vase")]
    assert (vase.material, vase.answered_by, vase.structure) == ("glass", "model", "sheet")
    assert vase.built_by == "model"
    assert vase.margin == 0.7
    assert said[("thing_0", "thing")].answered_by == "unknown"
    assert said[("bucket_0", "bucket")].material == "steel"
    assert [(t["task"], t["scene"]) for t in inventory.transcript] == [
        ("parts", "hand-made/vase_0"),
        ("materials", "hand-made/vase_0"),
        ("placement", "hand-made/vase_0"),
        ("mass", "hand-made/vase_0"),
        ("parts", "hand-made/thing_0"),
        ("materials", "hand-made/thing_0"),
        ("mass", "hand-made/thing_0"),
        ("parts", "hand-made/bucket_0"),
        ("materials", "hand-made/bucket_0"),
        ("placement", "hand-made/bucket_0"),
        ("mass", "hand-made/bucket_0"),
        ("extents", "hand-made"),
    ]


def test_what_a_model_says_of_a_part_of_unknown_material_is_kept(ask):
    maybe = [{"material": "ABS", "probability": 0.2}, {"material": "steel", "probability": 0.1}]
    seen = {"reason": "Painted all over.", "alternatives": maybe}
    answers = {
        "hand-made/thing_0": made_of(part("thing", None, "hollow", **seen)),
        "hand-made/bucket_0": made_of(part("bucket", None, "hollow", **seen)),
    }
    bucket = ("bucket_0", [("steel", plain(), {})])
    said = words(ask(Oracle(materials=lambda q: answers[q.scene]), THING, bucket))
    thing, bucket = said[("thing_0", "thing")], said[("bucket_0", "bucket")]
    assert (thing.material, thing.structure, thing.answered_by) == (None, "hollow", "unknown")
    assert thing.alternatives == (("ABS", pytest.approx(0.2)), ("steel", pytest.approx(0.1)))
    assert thing.reason == (
        "The pictures do not show what it is made of: Painted all over. No name in the file says what this is made of."
    )
    assert (bucket.material, bucket.structure, bucket.answered_by) == ("steel", "hollow", "metadata")
    assert (thing.built_by, bucket.built_by) == ("model", "model")
    assert bucket.alternatives == (("ABS", pytest.approx(0.2)),)
    assert bucket.reason.endswith("Painted all over. 'steel' in 'steel' names the material steel.")
    assert bucket.placements["shell_thickness"].fraction == 0.25


def test_pieces_of_unknown_material_are_of_what_the_file_names_and_built_as_they_look(ask):
    shares = {"volume_share": 0.5, "surface_share": 0.5}
    oracle = Oracle(
        parts=decomposed(["rim", "body"]),
        materials=made_of(part("rim", None, **shares), part("body", None, "hollow", **shares)),
    )
    (bucket,) = ask(oracle, ("bucket_0", [("steel", plain(), {})])).objects[0].parts
    assert [(p.name, p.material, p.structure, p.volume_share) for p in bucket.pieces] == [
        ("rim", "steel", "solid", 0.5),
        ("body", "steel", "hollow", 0.5),
    ]


def test_the_question_offers_the_whole_library_in_use_and_nothing_else(ask):
    oracle = Oracle(materials=made_of(part("vase", "ceramic")))
    ask(oracle, VASE, library="reference")
    question = next(q for q in oracle.asked if q.task == "materials")
    offered = re.findall(r"[\w-]+", " ".join(question.lists["materials"].splitlines()))
    assert set(materials.library("reference")) <= set(offered)
    assert "seat_foam" not in question.text
    assert "Parts: vase" in question.text


def test_pictures_are_taken_as_they_are_announced(ask):
    oracle = Oracle(materials=made_of(part("body", "soft_PVC"), part("beak", "soft_PVC")))
    inventory = ask(oracle, DUCK, views=3, view_size=32, view_seed=5)
    (asked,) = (q for q in oracle.asked if q.task == "materials")
    assert [p.shape for p in asked.pictures] == [(32, 32, 3)] * 4
    assert len({p.tobytes() for p in asked.pictures}) == 4
    assert "in 4 pictures" in asked.text
    assert "beak (blue in the last picture)" in asked.text
    assert asked.views == "3 of 8 views, 32 px, seed 5"
    (row,) = (r for r in inventory.transcript if r["task"] == "materials")
    assert row["views"] == asked.views
    assert all(bool(q.pictures) == (q.task != "extents") for q in oracle.asked)


def test_the_critic_chooses_among_ways_of_taking_apart_and_shares_become_pieces(ask):
    oracle = Oracle(
        parts=decomposed(["hammer"], ["head", "handle"]),
        ranking={"ranking": [{"number": 2, "reason": "Two."}, {"number": 1, "reason": "One."}]},
        materials=made_of(
            part("head", "steel", volume_share=0.25, surface_share=0.31),
            part("handle", "hardwood", volume_share=0.73, surface_share=0.69),
        ),
    )
    inventory = ask(oracle, ("hammer_0", [("mesh", plain(), {})]))
    (hammer,) = inventory.objects[0].parts
    assert (hammer.name, hammer.material, hammer.volume_share) == ("hammer", "hardwood", 1.0)
    assert [p.name for p in hammer.pieces] == ["head", "handle"]
    assert sum(p.volume_share for p in hammer.pieces) == pytest.approx(1.0)
    assert hammer.pieces[0].volume_share == pytest.approx(0.25 / 0.98)
    assert hammer.pieces[0].placements["yield_stress"].fraction == 0.25
    assert hammer.placements == hammer.pieces[1].placements
    assert in_turn(oracle) == ["parts", "ranking", "materials", "placement", "mass"]
    options = inventory.transcript[0]["answer"]["decompositions"]
    assert [len(d["parts"]) for d in options] == [1, 2]


def in_turn(oracle):
    """Tasks in the order they were asked; extents, of all objects, are asked at the same time."""
    assert oracle.tasks().count("extents") == 1
    return [task for task in oracle.tasks() if task != "extents"]


def test_known_parts_are_not_asked_for(ask):
    oracle = Oracle(materials=made_of(part("body", "soft_PVC"), part("beak", "ABS")))
    ask(oracle, DUCK)
    assert in_turn(oracle) == ["materials", "placement", "mass"]


def test_what_a_person_has_stated_is_not_asked_for_again(ask, tmp_path):
    (tmp_path / "said.yaml").write_text("vase_0: glass\n")
    oracle = Oracle(materials=made_of(part("thing", "steel")))
    inventory = ask(oracle, VASE, THING, annotations=tmp_path / "said.yaml")
    assert [(q.task, q.scene) for q in oracle.asked if "vase_0" in q.scene] == [
        ("placement", "hand-made/vase_0"),
        ("mass", "hand-made/vase_0"),
    ]
    vase = words(inventory)[("vase_0", "vase")]
    assert (vase.answered_by, vase.placements["young_pa"].fraction) == ("annotation", 0.25)


def test_a_model_that_contradicts_what_the_file_states_is_believed_and_reported_once(ask):
    thin = everywhere(0.0)  # soft_PVC's walls: 0.4 mm; the file states 2 mm
    oracle = Oracle(materials=made_of(part("body", "soft_PVC", "hollow"), part("beak", "ABS", "solid")), placement=thin)
    inventory = ask(oracle, DUCK)
    assert words(inventory)[("duck_0", "beak")].material == "ABS"
    assert inventory.warnings == (
        "duck_0: the file states a wall 2 mm thick for body, the model said a wall 0.4 mm thick; "
        "the file states soft_PVC, a wall 2 mm thick for beak, the model said ABS, solid. "
        "The latter was used; --annotations decides.",
    )
    block = ("block_0", [("block", plain(), {"substance": "wood", "shell_thickness_m": 0.0})])
    oracle = Oracle(parts=whole("block"), materials=made_of(part("block", "wood", "hollow")))
    (warning,) = ask(oracle, block).warnings
    assert warning.startswith("block_0: the file states solid for block, the model said hollow.")
    oracle = Oracle(parts=whole("block"), materials=made_of(part("block", "wood", "solid")))
    assert ask(oracle, block).warnings == ()


def test_where_a_person_or_the_file_is_believed_nothing_is_contradicted(ask, tmp_path):
    (tmp_path / "said.yaml").write_text("duck_0: { material: ABS, structure: solid }\n")
    model = made_of(part("body", "steel"), part("beak", "steel"))
    told = ask(Oracle(materials=model), DUCK, annotations=tmp_path / "said.yaml")
    assert told.warnings == ()
    unknown = made_of(part("body", None, "hollow"), part("beak", None, "hollow"))
    assert ask(Oracle(materials=unknown), DUCK).warnings == ()


def test_what_is_filled_has_contents_whose_density_is_placed_too(ask):
    can = part("can", "aluminium_can_sheet", "filled", contents="water", fill=0.95)
    inventory = ask(Oracle(materials=made_of(can)), ("can_0", [("mesh", plain(), {})]))
    (said,) = inventory.objects[0].parts
    assert (said.structure, said.contents, said.fill) == ("filled", "water", 0.95)
    assert set(said.placements) >= {"contents_density", "shell_thickness", "yield_stress"}


def test_a_weak_model_is_survived_and_reported(ask):
    both = part("vase", "glass", "sheet", probability=1.0)
    both["ways"].append(both["ways"][0] | {"material": "ceramic"})
    inventory = ask(Oracle(materials=made_of(both), extents=None), VASE)
    (vase,) = inventory.objects[0].parts
    assert [(w.material, w.probability) for w in vase.hypotheses] == [("glass", 0.5), ("ceramic", 0.5)]
    assert "the probabilities of vase add up to 2 and were divided by it" in inventory.warnings[0]
    one = ask(Oracle(materials=made_of(part("vase", "glass", "sheet", probability=1.0))), VASE)
    assert "one way only was given for every part, as certain" in one.warnings[0]


def test_each_way_has_places_of_its_own_and_the_mass_is_kept_beside_them(ask):
    maybe = [{"material": "ceramic", "probability": 0.2}]
    said = made_of(part("vase", "glass", "sheet", alternatives=maybe))
    printed = [{"kind": "net weight", "number": 500, "unit": "g", "words": "500 g"}]
    oracle = Oracle(materials=said, mass=weighs(printed=printed))
    (thing,) = ask(oracle, VASE).objects
    first, second = thing.parts[0].hypotheses
    assert set(first.placements) > {"young_pa", "density", "shell_thickness"}
    assert set(second.placements) == {"density", "shell_thickness"}
    assert (thing.evidence.low, thing.evidence.likely, thing.evidence.high) == (0.5, 1.0, 2.0)
    assert thing.evidence.printed[0].value == 0.5
    asked = next(q for q in oracle.asked if q.task == "placement")
    assert "vase, way 2: ceramic, sheet (it looks: plain)" in asked.text
    assert "It was found to be: a thing." in asked.text
    assert ask(oracle, VASE, direct=False).objects[0].evidence is None


def test_a_mass_in_grams_is_not_taken_for_kilograms(ask):
    grams = weighs(3e5, 4e5, 5e5)  # of a tetrahedron in a box of about a cubic metre
    inventory = ask(Oracle(materials=made_of(part("vase", "glass", "sheet")), mass=grams), VASE)
    assert inventory.objects[0].evidence is None
    assert any("Answer in kilograms" in w for w in inventory.warnings)


def test_a_silent_model_leaves_usual_values_that_are_marked_and_reported(ask):
    oracle = Oracle(materials=made_of(part("vase", "glass", "sheet")), placement=None, extents=None)
    inventory = ask(oracle, VASE)
    (vase,) = inventory.objects[0].parts
    assert {p.chosen_by for p in vase.placements.values()} == {"fallback"}
    assert len(inventory.warnings) == 2
    assert "placement got no usable answer (the oracle is silent)" in inventory.warnings[0]
    dumb = ask(Oracle(materials=None, placement=None, extents=None), THING)
    assert dumb.objects[0].parts[0].answered_by == "unknown"
    assert "materials got no usable answer" in dumb.warnings[0]


def test_values_may_be_asked_for_and_become_the_same_places(ask):
    def values(question):
        return {
            "parts": [
                {
                    "part": "vase",
                    "values": [
                        {"quantity": q, "value": float(low), "reason": "Lowest."}
                        for q, low in re.findall(r"^- (\w+): [^:]+: ([\d.e+-]+) to", question.text, flags=re.MULTILINE)
                    ],
                }
            ]
        }

    oracle = Oracle(materials=made_of(part("vase", "glass", "sheet")), placement=values)
    (vase,) = ask(oracle, VASE, sampling="value").objects[0].parts
    assert set(vase.placements) >= {"young_pa", "density", "shell_thickness"}
    assert {p.fraction for p in vase.placements.values()} == {0.0}


def test_values_that_do_not_fit_each_other_are_asked_for_once_more(ask):
    def hard_but_weak(question):
        said = everywhere(0.0)(question)
        for value in said["parts"][0]["values"]:
            value["fraction"] = 1.0 if value["quantity"] == "young" else 0.0
        return said

    clay = made_of(part("thing", "plasticine"))
    stubborn = Oracle(materials=clay, placement=hard_but_weak)
    (said,) = ask(stubborn, THING).objects[0].parts
    assert stubborn.tasks().count("placement") == 2
    again = [q for q in stubborn.asked if q.task == "placement"][1]
    assert "stiff but weak: yield_stress/young is 0.005" in again.text
    assert (said.placements["young_pa"].fraction, said.placements["yield_stress"].fraction) == (1, 0)
    mute = Oracle(materials=clay, placement=[hard_but_weak, None])
    (said,) = ask(mute, THING).objects[0].parts
    assert (said.placements["young_pa"].fraction, said.placements["young_pa"].chosen_by) == (1, "model")
    persuaded = Oracle(materials=clay, placement=[hard_but_weak, everywhere(0.5)])
    (said,) = ask(persuaded, THING).objects[0].parts
    assert {p.fraction for p in said.placements.values()} == {0.5}


def test_a_size_far_from_what_the_model_knows_is_reported(ask):
    inventory = ask(Oracle(materials=made_of(part("vase", "glass")), extents=sizes(0.3)), VASE)
    assert inventory.objects[0].usual_extent == 0.3
    assert inventory.warnings == (
        "vase_0 is 1 m large, but the model says that an object like that (vase) is usually about "
        "30 cm. Set its size with --extent vase_0=0.3.",
    )
    tower = ask(Oracle(materials=made_of(part("vase", "glass")), extents=sizes(112.4)), VASE)
    assert "usually about 112 m. Set its size with --extent vase_0=112." in tower.warnings[0]
    close = ask(Oracle(materials=made_of(part("vase", "glass")), extents=sizes(0.5)), VASE)
    assert close.warnings == ()


def test_no_size_is_asked_of_an_object_of_which_no_name_tells_anything(ask):
    nameless = ("object_0", [("mesh", plain(), {})])
    oracle = Oracle(materials=made_of(part("object", "glass")))
    assert ask(oracle, nameless).objects[0].usual_extent is None
    assert "extents" not in oracle.tasks()
    assert ask(oracle, nameless, VASE).objects[1].usual_extent == 1.0
    (asked,) = (q for q in oracle.asked if q.task == "extents")
    assert asked.prompt.endswith("- vase")


@pytest.mark.parametrize("wrong", [{"views": 0}, {"views": 9}, {"view_size": 8}, {"parallel": 0}])
def test_pictures_that_cannot_be_taken_are_refused(wrong):
    with pytest.raises(UserError, match=f"--{next(iter(wrong)).replace('_', '-')} is"):
        describe(scene(VASE), DescribeConfig(**wrong))


def test_tokens_and_seconds_are_added_up_and_an_unknown_price_is_not_guessed(ask):
    usage = ask(Oracle(materials=made_of(part("vase", "glass"))), VASE).usage
    assert (usage.questions, usage.calls, usage.models) == (5, 5, ("oracle:1",))
    assert (usage.input_tokens, usage.output_tokens) == (5000, 500)
    assert (usage.seconds, usage.dollars) == (2.5, None)


def test_recorded_answers_replay_without_the_model_and_without_pictures(ask, tmp_path):
    oracle = Oracle(materials=made_of(part("vase", "glass", "sheet")))
    told = ask(oracle, VASE, record=tmp_path)
    assert len(list(tmp_path.glob("*.json"))) == 5
    again = describe(scene(VASE), replay(tmp_path))
    (vase,), (old,) = again.objects[0].parts, told.objects[0].parts
    assert (vase.material, vase.answered_by) == ("glass", "recording")
    assert vase.placements["young_pa"].fraction == old.placements["young_pa"].fraction
    assert {p.chosen_by for p in vase.placements.values()} == {"recording"}
    assert again.usage.calls == 0
    with pytest.raises(UserError, match="differs in 'scene'"):
        describe(scene(VASE, name="another"), replay(tmp_path))


def test_a_recording_outlives_a_longer_library_and_not_a_word_that_is_gone(ask, tmp_path, monkeypatch):
    ask(Oracle(materials=made_of(part("vase", "porcelain"))), VASE, record=tmp_path)
    replayed = replay(tmp_path)
    monkeypatch.setattr("corporeal.description.query_scene.part_materials_text", lambda library: "- new: unobtainium")
    assert words(describe(scene(VASE), replayed))[("vase_0", "vase")].material == "porcelain"
    with pytest.raises(UserError, match="'porcelain' is not in the list of materials"):
        describe(scene(VASE), replayed, library="reference")


def test_questions_wait_for_a_person_and_go_on_with_their_answers(tmp_path, monkeypatch):
    config = DescribeConfig(vlm=f"ask:{tmp_path}", view_size=32)
    answers = {
        "parts": whole("vase"),
        "materials": made_of(part("vase", "glass", "sheet")),
        "placement": None,
        "mass": weighs(),
        "extents": {"classes": [{"class_name": "vase", "metres": 1.0}]},
    }
    taken = []

    def counted(*args):
        taken.append(args)
        return render_portraits(*args)

    monkeypatch.setattr("corporeal.description.query_scene.render_portraits", counted)
    rounds = 0
    while rounds < 6:
        rounds += 1
        try:
            inventory = describe(scene(VASE), config)
            break
        except UserError as waits:
            assert "wait" in str(waits)
        for page in (tmp_path / "questions").glob("*.md"):
            file = page.with_suffix(".json")
            task = next(t for t in answers if f"-{t}-" in page.name)
            assert page.with_suffix(".png").exists() == (task != "extents")
            if file.read_text() == "":
                said = answers[task] or everywhere_by_hand(page.read_text())
                file.write_text(f"```json\n{json.dumps(said)}\n```")
    assert rounds == 5
    assert len(taken) == 4  # for the pages of parts, materials, placement and mass
    assert words(inventory)[("vase_0", "vase")].material == "glass"
    assert words(describe(scene(VASE), replay(tmp_path))) == words(inventory)


def everywhere_by_hand(page):
    quantities = re.findall(r"^- (\w+): ", page, flags=re.MULTILINE)
    values = [{"quantity": q, "fraction": 0.5, "reason": "Middle."} for q in quantities if q != "vase"]
    return {"parts": [{"part": "vase", "values": values}]}


def test_a_wrong_answer_by_hand_is_explained_on_its_page(tmp_path):
    config = DescribeConfig(vlm=f"ask:{tmp_path}", view_size=32)
    with pytest.raises(UserError, match="2 questions wait"):
        describe(scene(VASE), config)
    (page,) = (tmp_path / "questions").glob("*parts*.md")
    page.with_suffix(".json").write_text(json.dumps(decomposed(["a", "A"])))
    with pytest.raises(UserError, match="2 questions wait"):
        describe(scene(VASE), config)
    assert "does not fit:** Part names must differ" in page.read_text()
    page.with_suffix(".json").write_text("{")
    with pytest.raises(UserError, match="wait"):
        describe(scene(VASE), config)
    assert "Invalid JSON" in page.read_text()


# ---------------------------------------------------------------- a library of one's own

OWN = """
[sources.mine]
cite = "Our own bench"

[flubber]
law = "neo_hookean"
group = "elastomer"
aliases = ["bouncing goo"]
young_MPa = { low = 1, typical = 2, high = 3, source = "mine" }
poisson = { low = 0.45, typical = 0.47, high = 0.49, source = "mine" }
density_kg_m3 = { low = 900, typical = 1000, high = 1100, source = "mine" }
"""


@pytest.mark.parametrize("base", ["", 'extends = "default"\n'])
def test_a_material_of_ones_own_can_be_annotated_and_stated(tmp_path, base):
    (tmp_path / "own.toml").write_text(base + OWN)
    (tmp_path / "said.yaml").write_text("ball_0: Bouncing goo\n")
    made = scene(("ball_0", [("a", plain(), {})]), ("toy_0", [("b", plain(), {"substance": "flubber"})]))
    config = DescribeConfig(annotations=tmp_path / "said.yaml")
    ball, toy = describe(made, config, str(tmp_path / "own.toml")).objects
    assert (ball.parts[0].material, ball.parts[0].answered_by) == ("flubber", "annotation")
    assert (toy.parts[0].material, toy.parts[0].margin) == ("flubber", 1.0)
    with pytest.raises(UserError, match="Unknown material"):
        describe(made, config)


# ---------------------------------------------------------------- real objects


@pytest.mark.slow
def test_real_files_are_recognised_as_the_facts_recorded_about_them_say(shared_assets):
    recorded = {(r.file, r.part): r.answer for r in judge(facts())}
    seen = {}
    for path in sorted([*shared_assets.glob("objects/*.glb"), *shared_assets.glob("ycb/*.glb")]):
        made = read_glb(path)
        inventory = describe(made)
        parts = segment(made, inventory)
        assert np.all(parts.part_of_point >= 0)
        field = ground(made, parts, inventory)
        told = list(words(inventory).values())
        assert [w.name for w in field.words] == [w.name for w in told]
        seen |= {(path.stem, w.name): w.material for w in told}
    assert len(seen) == 79
    assert seen == {key: recorded[key] for key in seen}


def test_a_model_beside_photographs_is_no_object_from_pictures():
    """A mug as a model is told by its own faces; only the bowl that was photographed is unseen."""
    both = scene(("bowl_0", [("mesh", plain(), {})]), ("mug_0", [("mesh", plain(), {})]))
    made = describe(both, from_pictures=[0])
    assert [w.split(":")[0] for w in made.warnings] == ["bowl_0"]
    bowl, mug = (thing.parts[0] for thing in made.objects)
    alone = describe(scene(("mug_0", [("mesh", plain(), {})]))).objects[0].parts[0]
    assert (bowl.structure, bowl.wall_unseen) == ("sheet", True)
    assert (mug.structure, mug.wall_unseen) == (alone.structure, alone.wall_unseen)
