from dataclasses import replace

import numpy as np
import pytest

from corporeal import materials
from corporeal.core.types import Finish, PartDescription, SceneObject
from corporeal.recognition.lexicon import lexicon_terms, metal_materials, mouldable_materials, name_tokens
from corporeal.recognition.metadata_recognition import (
    FileEvidence,
    gather_file_evidence,
    infer_hollow_structure,
    recognise_part,
    substance_hint,
)
from corporeal.recognition.parts_by_name import identify_parts
from sample_scenes import plain, scene


class Named:
    def __init__(self, name):
        self.name, self.extras = name, {}


def about(surface, thing, finish=None, alone=True, metallic=False):
    return FileEvidence(
        surfaces=[Named(surface)],  # type: ignore[list-item]
        finishes=[finish or plain()],
        thing=SceneObject(f"{thing}_0", thing, 1.0),
        alone=alone,
        metallic_means_something=metallic,
    )


def seen(surface, thing, finish=None, alone=True, metallic=False):
    return recognise_part(about(surface, thing, finish, alone, metallic))


def test_every_material_of_the_lexicon_is_in_the_library():
    assert {s.material for s in lexicon_terms()} <= set(materials.library())
    assert metal_materials() <= set(materials.library())
    assert {s.metallic for s in lexicon_terms() if s.metallic} <= metal_materials()
    assert all(0 < s.margin <= 1 for s in lexicon_terms())
    assert mouldable_materials() <= set(materials.library())
    assert {s.material for s in lexicon_terms() if s.moulded} <= mouldable_materials()


def test_every_solid_of_the_library_is_known_by_its_name():
    """A material that has a name there is not unknown, nor taken for another, in a file."""
    cores = {"baseball_core", "golf_ball_core", "softball_core"}
    elsewhere = {"aluminium_can_sheet", "leaf_tissue", "leaves-flowers", "battery_cell"}
    elsewhere |= {"horn"}  # an instrument as often
    colours = {"gold", "silver"}
    only_held = {"liquid", "bulk", "food"}
    said = {
        name: seen(f"{name} surface", "thing").material
        for name, entry in materials.library().items()
        if entry.group not in only_held and name not in cores | elsewhere | colours
    }
    assert {name: found for name, found in said.items() if found != name} == {}


@pytest.mark.parametrize(
    ("name", "material"),
    [
        ("clay pot", "terracotta"),
        ("clay ground", "soil_clay"),
        ("modelling clay", "plasticine"),
        ("pine shelf", "softwood"),
        ("lead pipe", "lead"),
        ("tin toy", "steel"),
        ("steel stainless", "stainless_steel"),
        ("memory foam pillow", "memory_foam"),
        ("limestone block", "marble"),
        ("polyester bag", "synthetic_textile"),
        ("Tontopf", None),
        ("Lehmziegel", "brick"),
        ("mesa de roble", "hardwood"),
        ("poele en fonte", "cast-iron"),
    ],
)
def test_a_word_for_matter_says_what_it_is(name, material):
    assert seen("mesh", name).material == material


@pytest.mark.parametrize("name", ["compost container", "sand tray", "ice box", "snow bin"])
def test_no_container_is_made_of_what_flows(name):
    assert seen("mesh", name).material not in ("potting_soil", "sand", "ice", "snow")


@pytest.mark.parametrize(
    "name", ["ice cream scoop", "napkin ring", "rubber stamp", "apple bowl", "bread plate", "soap dish", "nail gun"]
)
def test_what_is_before_a_noun_of_any_material_is_its_purpose(name):
    assert seen("mesh", name).material is None


@pytest.mark.parametrize(
    ("name", "material"),
    [
        ("wood fireplace", "brick"),
        ("coal stove", "steel"),
        ("charcoal grill", "steel"),
        ("wood stove", "cast-iron"),
        ("wooden oven", "wood"),
    ],
)
def test_what_is_burnt_is_not_what_it_is_burnt_in(name, material):
    assert seen("mesh", name).material == material


def test_words_of_a_phrase_that_is_a_purpose_say_nothing_by_themselves():
    assert seen("mesh", "ice cube").material == "ice"
    assert seen("mesh", "ice cube bucket").material != "ice"


def test_a_part_by_itself_is_of_what_such_parts_are():
    assert seen("mesh", "desk leg").material == "wood"
    assert seen("mesh", "tire_car").structure == "shell", "what is a thing, too, stays one"


def test_no_phrase_means_two_objects():
    told = {}
    for s in lexicon_terms():
        key = (s.phrase, s.kind, s.alpha, s.extents)
        assert told.setdefault(key, s.material) == s.material, key


@pytest.mark.parametrize(
    ("surface", "thing", "material"),
    [
        ("mesh", "soda can", "aluminium_can_sheet"),
        ("mesh", "tomato soup can", "steel"),
        ("mesh", "trash can", "plastics-PP"),
        ("mesh", "steel trash can", "steel"),
        ("mesh", "plastic trash can", "plastics-PP"),
        ("mesh", "metal soda can", "aluminium_can_sheet"),
        ("mesh", "can", None),
        ("mesh", "vase", "ceramic"),
        ("mesh", "rubber duck", "soft_PVC"),
        ("oak_table_top", "table", "hardwood"),
        ("Stainless steel pot", "pot", "stainless_steel"),
        ("mesh", "bottle", None),
        ("mesh", "wine bottle", "glass"),
        ("default", "thing", None),
    ],
)
def test_longer_phrases_say_more_and_ambiguous_words_say_nothing(surface, thing, material):
    assert seen(surface, thing).material == material


def test_an_object_of_another_material_is_built_as_such_objects_are():
    plain, other = (seen("mesh", f"{word} gelatin box") for word in ("cardboard", "steel"))
    usual = seen("mesh", "gelatin box")
    assert replace(plain, reason="", margin=0.0) == replace(usual, reason="", margin=0.0)
    assert other.material != usual.material
    assert (other.structure, other.contents, other.fill) == ("filled", "powder", usual.fill)
    assert other.thickness is None


def test_two_materials_in_one_name_make_neither():
    answer = seen("RubberWood_low", "helmet", alone=False)
    assert answer.material is None
    assert "rubber and wood" in answer.reason


def test_a_marble_of_glass_is_a_toy_and_no_stone():
    assert seen("marble", "marble", Finish("glass")).material == "glass"
    assert seen("marble", "table").material == "marble"


@pytest.mark.parametrize(
    ("finish", "material"),
    [("beech wood", "hardwood"), ("Oak_Wood", "hardwood"), ("pine wood", "softwood"),
     ("wood", "wood"), ("wooden planks of spruce", "softwood"), ("plywood sheet", "plywood")],
)  # fmt: skip
def test_a_particular_wood_stands_before_wood(finish, material):
    assert seen("stool", "stool", Finish(finish)).material == material


def test_a_particular_metal_stands_before_metal():
    assert seen("Metal.Bronze", "guitar", Finish("x", metallic=1.0)).material == "bronze"


def test_a_colour_is_not_a_metal():
    assert seen("Gold", "ribbon", Finish("gold", metallic=0.0)).material is None
    assert seen("Gold", "ring", Finish("gold", metallic=1.0)).material == "gold"


def test_the_exporters_default_metalness_says_nothing():
    shiny = Finish("white", metallic=1.0)
    assert seen("mesh", "thing", shiny, metallic=False).material is None
    assert seen("mesh", "thing", shiny, metallic=True).material == "steel"


def test_a_surface_that_contradicts_the_name_lowers_the_margin():
    calm = seen("wood", "thing", Finish("wood"), metallic=True)
    torn = seen("wood", "thing", Finish("wood", metallic=1.0), metallic=True)
    assert torn.margin < calm.margin
    assert "metallic" in torn.reason


def test_light_through_a_nameless_surface_is_glass():
    assert seen("mesh", "thing", Finish("x", transmission=1.0)).material == "glass"


def test_a_plants_parts_are_recognised_by_their_colour():
    colours = {
        "leaves-flowers": (0.2, 0.5, 0.1, 1.0),
        "terracotta": (0.4, 0.1, 0.03, 1.0),
        "potting_soil": (0.07, 0.03, 0.01, 1.0),
        None: (0.1, 0.1, 0.5, 1.0),
    }
    for material, colour in colours.items():
        said = seen("mesh", "potted plant", Finish("m", colour), alone=False)
        assert said.material == material
        assert said.margin <= 0.4
    picture = np.zeros((2, 2, 3), dtype=np.uint8)
    textured = Finish("m", colours["leaves-flowers"], texture=picture)
    assert seen("mesh", "potted plant", textured, alone=False).material is None
    assert seen("mesh", "car", Finish("m", colours["terracotta"]), alone=False).material is None


def test_a_metallic_statue_is_cast():
    grey, gilt = Finish("m", metallic=0.0), Finish("m", metallic=0.8)
    assert seen("mesh", "statue", grey, metallic=True).material == "granite"
    assert seen("mesh", "statue", gilt, metallic=True).material == "bronze"
    assert seen("mesh", "statue", gilt, metallic=False).material == "granite"


def test_an_object_of_several_parts_does_not_say_what_each_is():
    assert seen("mesh", "chair", alone=True).material == "wood"
    assert seen("mesh", "chair", alone=False).material is None
    assert seen("mesh", "soda can", alone=False).material == "aluminium_can_sheet"


def test_goods_are_full_until_a_word_says_otherwise():
    full = seen("mesh", "tomato soup can")
    assert (full.structure, full.contents, full.thickness) == ("filled", "sauce", 0.0002)
    assert full.fill is not None
    assert 0.8 < full.fill <= 1
    for name in ("empty soup can", "soup can opened", "crushed tuna can"):
        said = seen("mesh", name)
        assert (said.material, said.structure, said.contents) == ("steel", "shell", None)
    label = seen("mesh", "tomato soup can", alone=False)
    assert (label.structure, label.contents) == ("shell", None), "each part would be full"
    assert seen("mesh", "soda can").contents is None, "as often empty as not"


def test_every_content_of_the_lexicon_can_be_held():
    held = [s for s in lexicon_terms() if s.contents]
    assert held
    assert {s.contents for s in held} <= set(materials.content_materials())
    assert all(s.thickness and s.fill and 0 < s.fill <= 1 for s in held)


# ---------------------------------------------------------------- names among names


def told(thing, *parts):
    """Recognise each part of a thing; a part is (surface name, finish name)."""
    made = scene((f"{thing}_0", [(name, plain(finish), {}) for name, finish in parts]))
    identity = identify_parts(made, substance_hint)
    seen_parts = zip(identity.catalogue, gather_file_evidence(made, identity), strict=True)
    return {part.name: recognise_part(said) for part, said in seen_parts}


@pytest.mark.parametrize(
    ("name", "material"),
    [
        ("shoe rack", None),
        ("ball valve", None),
        ("tv cabinet", "wood"),
        ("car tire", "rubber"),
        ("table lamp", None),
        ("desk", "wood"),
        ("cardboard box", "corrugated_cardboard"),
        ("soda can holder", None),
        ("oak shelf", "hardwood"),
    ],
)
def test_of_compound_nouns_the_last_one_is_the_object(name, material):
    assert seen("mesh", name).material == material


@pytest.mark.parametrize(
    "name, counts",
    [
        ("basketball on a concrete court", "basketball"),
        ("Vase_on_wooden_table", "vase"),
        ("tennis ball on carpet", "tennis ball"),
        ("clip-on lamp", "clip on lamp"),
        ("Lamp_On", "lamp on"),
    ],
)
def test_what_an_object_lies_on_is_not_what_it_is_made_of(name, counts):
    assert " ".join(name_tokens(name)) == counts


@pytest.mark.parametrize(
    ("name", "material"),
    [
        ("copper_kettle_old", "copper"),
        ("bronze_ladle", "bronze"),
        ("pot_copper_large", "copper"),  # a pot alone may be of anything
        ("copper plant pot", None),  # a pot for plants is of fired clay, and may have that colour
        ("copper_car", None),
        ("golden_kettle", "stainless_steel"),
    ],
)
def test_a_metals_name_is_no_colour_of_what_is_of_bare_metal(name, material):
    found = seen("mesh", name).material
    assert found == material if material else found not in ("copper", "bronze")


def plural(word):
    """Return an English word's plural as it is spelt."""
    if word.endswith(("s", "x", "z", "ch", "sh", "to")):
        return f"{word}es"
    if word.endswith("y") and word[-2] not in "aeiou":
        return f"{word[:-1]}ies"
    return f"{word[:-2]}ves" if word.endswith(("life", "nife")) else f"{word}s"


def test_many_of_an_object_are_of_what_one_is_of():
    known = {term.phrase[0] for term in lexicon_terms() if len(term.phrase) == 1 and term.kind == "thing"}
    apart = {word for word in known if name_tokens(plural(word)) != name_tokens(word)}
    assert apart <= {"battery", "branch"}, "batteries and branches have rows of their own"


@pytest.mark.parametrize(
    ("name", "counts"),
    [
        ("kitchen_knives", "kitchen knife"),
        ("CardboardBoxes", "cardboard box"),
        ("wooden shelves", "wooden shelf"),
        ("set of wine glasses", "wine glass"),
        ("bookshelves", "bookshelf"),
        ("ripe tomatoes", "ripe tomato"),
        ("glasses_black", "glasse black"),  # spectacles
        ("axes", "axe"),
        ("gloves", "glove"),
        ("olives", "olive"),
        ("vases", "vase"),
        ("skis", "ski"),
        ("table tennis", "table tennis"),
        ("pile of ashes", "ashe"),  # nobody means the wood
    ],
)
def test_plurals_that_change_the_end_of_a_word_are_read(name, counts):
    assert " ".join(name_tokens(name)) == counts


def test_what_all_parts_are_called_says_nothing_of_one():
    said = told("sofa", ("velvet_sofa_legs", "a"), ("velvet_sofa_fabric", "b"))
    assert {k: v.material for k, v in said.items()} == {"velvet_sofa_legs": "wood", "velvet_sofa_fabric": "cotton"}
    said = told("holder", ("glass_lantern_foot", "a"), ("glass_lantern_glass", "b"))
    assert said["glass_lantern_glass"].material == "glass"
    assert said["glass_lantern_foot"].material is None, "the glass is the other part's"


def test_a_substance_that_no_part_claims_is_every_parts():
    said = told("oak_table", ("top_plate", "a"), ("under_part", "b"))
    assert {v.material for v in said.values()} == {"hardwood"}
    assert all(v.margin < 0.5 for v in said.values())
    numbered = told("thing", ("steel_01", "a"), ("steel_02", "b"))
    assert [v.margin for v in numbered.values()] == [seen("steel", "thing").margin] * len(numbered)


def test_a_name_without_words_spoils_no_prefix():
    said = told("lamp", ("lamp_shade", "a"), ("Material.001", "b"), ("lamp_glass", "c"))
    assert said["lamp_glass"].material == "glass"
    assert said["lamp_shade"].material == "cotton"


# -------------------------------------------- compounds, hollow things, unknown ones


@pytest.mark.parametrize(
    ("thing", "material"),
    [
        ("golfball", "golf_ball_core"),
        ("trashcan", "plastics-PP"),
        ("TrashCan_01", "plastics-PP"),
        ("steelbucket", "steel"),
        ("woodentable", "wood"),
        ("carpet", "carpet"),
        ("keyboard", "ABS"),
        ("motherboard", "circuit_board"),
    ],
)
def test_a_compound_says_what_its_words_say(thing, material):
    assert seen("mesh", thing).material == material


@pytest.mark.parametrize("name", ["golfish", "carp", "glassine", "steelworks", "balls", "oakum"])
def test_what_is_no_compound_of_known_words_stays_whole(name):
    assert len(name_tokens(name)) == 1


def test_a_substance_in_a_name_counts_where_the_object_is_unknown():
    painted = Finish("texture", texture=np.zeros((2, 2, 3), dtype=np.uint8))
    cast = seen("mesh", "bronze talisman", painted)
    assert cast.material == "bronze"
    assert cast.margin < seen("mesh", "talisman", Finish("bronze", metallic=1.0)).margin
    assert seen("mesh", "gold talisman", painted).material is None, "gold is as often a colour"
    assert seen("mesh", "bronze car", painted).material == "steel", "here it is a colour"
    assert seen("mesh", "plush doll").material == "fibre_fill"
    assert seen("mesh", "doll").material == "PVC"


@pytest.mark.parametrize(
    ("thing", "structure"),
    [
        ("trash can", "shell"),
        ("paper lantern", "shell"),
        ("storage box", "shell"),
        ("wooden crate", "shell"),
        ("dumpster", "shell"),
        ("refrigerator", "filled"),
        ("kitchen cabinet", "shell"),
        ("container", "shell"),
        ("trash can green large", "shell"),
        ("bucket wooden old", "shell"),
        ("Kleiderschrank", "shell"),
        ("toilet", "shell"),
        ("box spring", None),
        ("bucket hat", None),
        ("wooden chair", None),
        ("garden chair plastic white", "shell"),
        ("chair_metal_01", "shell"),
        ("cast iron bench", None),
        ("thing", None),
    ],
)
def test_what_is_hollow_by_what_it_is_has_a_wall(thing, structure):
    known = about("mesh", thing)
    assert infer_hollow_structure(recognise_part(known), known, lambda _: True).structure == structure


@pytest.mark.parametrize(
    ("thing", "material", "structure"),
    [
        ("steel_ball", "steel", None),
        ("ball_brass", "brass", None),
        ("wooden ball", "wood", None),
        ("stone ball", "granite", None),
        ("glass ball", "glass", None),
        ("foam ball", "seat_foam", None),
        ("wooden duck", "wood", None),
        ("rubber ball", "rubber", "shell"),
        ("leather ball", "leather", "shell"),
        ("plastic duck", "soft_PVC", "shell"),
        ("ball", "rubber", "shell"),
        ("wooden barrel", "wood", "shell"),
        ("steel barrel", "steel", "shell"),
    ],
)
def test_what_is_hollow_because_it_is_moulded_is_solid_of_what_is_not(thing, material, structure):
    """A steel ball of 24 mm was a shell of .7 mm and weighed a sixth of itself."""
    found = seen("mesh", thing)
    assert (found.material, found.structure) == (material, structure)
    if structure is None:
        assert (found.thickness, found.inflation) == (None, None)


@pytest.mark.parametrize(
    ("surface", "thing", "material"),
    [
        ("spring mattress", "spring mattress", "seat_foam"),
        ("mesh", "lead brick", "lead"),
        ("mesh", "glass brick", "glass"),
        ("mesh", "clay brick", "brick"),
        ("mesh", "red brick", "brick"),
        ("mesh", "jelly", "gelatin"),
        ("mesh", "jelly jar", "glass"),
    ],
)
def test_a_word_that_only_says_of_what_kind_leaves_no_doubt(surface, thing, material):
    """A mattress named so in its only mesh was of steel springs as much, and so of plastic."""
    assert seen(surface, thing).material == material


@pytest.mark.parametrize(
    ("name", "words", "file", "surface", "material"),
    [
        ("rubber_ball", "steel ball", "steel_ball.ply", "steel_ball", "rubber"),
        ("rubber_ball", "steel ball", "steel_ball.glb", "geometry_0", "rubber"),
        ("steel_ball_2", "steel ball", "steel_ball.ply", "steel_ball", "steel"),
        ("ball", "steel ball", "steel_ball.ply", "steel_ball", "steel"),
        ("steel_ball_0", "rubber ball", "ball.ply", "ball", "rubber"),
        ("rubber_ball", "ball", "ball.glb", "steel", "steel"),
    ],
)
def test_what_a_person_calls_an_object_wins_over_the_name_of_its_file(name, words, file, surface, material):
    """A "rubber_ball" whose shape was read from steel_ball.ply was of steel."""
    thing = SceneObject(name, words, 0.1, source=f"shapes/{file}")
    assert recognise_part(replace(about(surface, words), thing=thing)).material == material


def test_a_large_statue_of_metal_is_cast_around_a_core():
    def built(name, size):
        known = replace(about("mesh", name), thing=SceneObject("it_0", name, size))
        said = recognise_part(known)
        return said.material, infer_hollow_structure(said, known, lambda _: True).structure

    assert built("bronze bust", 0.5) == ("bronze", "shell")
    assert built("bronze bust", 0.12) == ("bronze", None), "small ones are cast solid"
    assert built("marble bust", 0.5) == ("marble", None)
    assert built("bust", 0.5) == ("granite", None)


def test_a_hollow_object_of_what_has_no_walls_is_left_alone():
    known = about("mesh", "plasticine box")
    assert recognise_part(known).material == "plasticine"
    assert infer_hollow_structure(recognise_part(known), known, lambda name: name != "plasticine").structure is None


def test_a_stated_structure_outranks_what_it_is():
    known = about("mesh", "box")
    solid = replace(recognise_part(known), structure="solid")
    assert infer_hollow_structure(solid, known, lambda _: True) == solid


@pytest.mark.parametrize(
    ("thing", "material"),
    [
        ("snow globe", "hard_plastic"),
        ("sand barrel", "wood"),
        ("hourglass sand timer", "glass"),
        ("stone base sand", "granite"),
    ],
)
def test_no_wall_is_made_of_what_lies_loose(thing, material):
    """A snow globe ended the run: a shell of snow has no usual wall."""
    assert seen("mesh", thing).material == material


def test_what_has_no_usual_wall_is_no_shell_by_its_name():
    words = PartDescription("", "coal", structure="shell", reason="A barrel of coal.")
    found = infer_hollow_structure(words, about("mesh", "coal barrel"), lambda name: False)
    assert found.structure is None
    kept = replace(words, thickness=0.01)
    assert infer_hollow_structure(kept, about("mesh", "coal barrel"), lambda name: False) == kept


@pytest.mark.parametrize(
    ("thing", "material"),
    [
        ("dumbbel", "steel"),
        ("SurfBoard", "rigid_foam"),
        ("wineglas", "glass"),
        ("treestump", "wood"),
        ("yoga_mat.001", "EVA_foam"),
        ("chess piece", "wood"),
        ("Mat_12", None),
        ("canon", None),
    ],
)
def test_slips_and_words_written_apart_or_together_are_known(thing, material):
    assert seen("mesh", thing).material == material


def test_a_substance_behind_the_object_is_what_it_is_made_of():
    found = seen("mesh", "watering can zinc")
    assert (found.material, found.structure) == ("zinc", "shell")
    assert seen("mesh", "bucket sand").structure is None


@pytest.mark.parametrize(
    ("thing", "material"), [("Stone and Beam stoneware vase", "ceramic"), ("stone stoneware", None)]
)
def test_of_two_substances_the_one_beside_the_object_is_meant(thing, material):
    assert seen("mesh", thing).material == material
