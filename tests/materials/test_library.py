import re
from math import sqrt

import numpy as np
import pytest

from corporeal import materials
from corporeal.core.errors import OutOfRangeError, UnknownChoiceError, UserError
from corporeal.core.types import Law, MaterialField, Part, PartDescription, Parts, Provenance, Structure
from corporeal.materials.contact_pairs import measured_friction_pairs, measured_restitution_pairs
from corporeal.materials.flat_crush import layered_materials
from corporeal.materials.library_entry import source_table
from corporeal.materials.restitution_speed import rated_restitutions

LIBRARIES = ["default", "reference"]


def test_every_source_can_be_looked_up_and_none_is_idle():
    cited = {
        row["source"] for table in (measured_friction_pairs(), measured_restitution_pairs()) for row in table.values()
    }
    cited |= {rating.source for rating in rated_restitutions().values()}
    cited |= {one.source for one in layered_materials().values()}
    for name in LIBRARIES:
        for entry in materials.library(name).values():
            cited |= {key for r in entry.ranges.values() for key in r.source.split("+")}
    assert cited == set(source_table())
    assert all(row["check"] in {"read", "recalled", "ours"} for row in source_table().values())


def test_estimates_are_few_and_never_the_stiffness_of_a_metal():
    entries = materials.library().values()
    numbers = [(e, f, r) for e in entries for f, r in e.ranges.items()]
    core = [(e, f, r) for e, f, r in numbers if f in {"young_pa", "poisson", "density"}]
    guessed = [(e.name, f) for e, f, r in core if r.source == "engineering-estimate"]
    assert len(guessed) / len(core) < 0.25
    assert not [g for g in guessed if materials.find_material(g[0]).group == "metal"]


def test_the_default_library_knows_everyday_materials():
    assert len(materials.library()) >= 60
    for word in (
        "seat foam, packaging foam, potting soil, mud, hardwood, plywood, MDF, terracotta, "
        "porcelain, stainless steel, brass, leather, cotton, cardboard, paper, ABS, PET, PVC, "
        "nylon, silicone, natural rubber, gypsum, granite, brick, fruit flesh, cork, EVA foam, "
        "soil, rubber, aluminium, wood, foam, steel, glass, leaves, sand, snow, apple"
    ).split(", "):
        assert materials.find_material(word)


def test_every_published_name_means_something_in_the_default_library():
    assert all(materials.find_material(name) for name in materials.library("reference"))


def test_every_material_has_a_counterpart_in_the_published_vocabulary():
    for entry in materials.library().values():
        assert materials.library_counterpart(entry, "reference").number > 0


def test_every_source_key_on_a_value_resolves():
    known = materials.cited_sources()
    for entry in materials.library().values():
        assert all(r.source in known for r in entry.ranges.values())


@pytest.mark.parametrize("name", ["Cast Iron", "cast_iron", "CAST-IRON", " cast  iron "])
def test_spelling_does_not_matter(name):
    assert materials.find_material(name).name == "cast-iron"


def test_an_unknown_material_shows_the_menu():
    with pytest.raises(UnknownChoiceError, match=r"Unknown material 'stel'.*steel"):
        materials.find_material("stel")
    with pytest.raises(UnknownChoiceError, match=r"Did you mean steel.*\?$"):
        materials.find_material("stel")
    with pytest.raises(UnknownChoiceError, match="Unknown material library 'mine'"):
        materials.library("mine")


def test_a_value_outside_the_measured_range_is_refused():
    steel = materials.find_material("steel")
    grounds = steel.typical()
    soft = Provenance(200.0, steel.ranges["young_pa"], "annotation", "")
    with pytest.raises(OutOfRangeError, match="Young's modulus of steel is 200 Pa"):
        steel.pick(grounds | {"young_pa": soft})
    angle = Provenance(0.5, steel.ranges["young_pa"], "annotation", "")
    with pytest.raises(UserError, match="steel has no friction angle"):
        steel.pick(grounds | {"friction_angle": angle})


@pytest.mark.parametrize("name", LIBRARIES)
def test_typical_values_make_a_material(name):
    for entry in materials.library(name).values():
        made = entry.pick(entry.typical())
        assert made.poisson < 0.5
        assert (made.yield_stress is not None) == (made.law is Law.VON_MISES)
        assert (made.friction_angle is not None) == (made.law is Law.DRUCKER_PRAGER)


def test_stiffness_comes_in_the_order_everybody_knows():
    order = "seat_foam mud rubber packaging_foam cork HDPE ABS wood concrete glass steel"
    stiffness = [materials.find_material(n).ranges["young_pa"].typical for n in order.split()]
    assert stiffness == sorted(stiffness)


def test_what_a_ball_of_it_loses_is_in_the_order_everybody_knows():
    order = "natural_rubber rubber EVA_foam baseball_core softball_core memory_foam"
    loss = [materials.find_material(n).ranges["loss"].typical for n in order.split()]
    assert loss == sorted(loss)


def test_what_breaks_before_it_yields_has_a_strength_and_nothing_else_has():
    brittle = {e.name for e in materials.library().values() if "strength" in e.ranges}
    minerals = {e.name for e in materials.library().values() if e.group == "mineral"}
    assert minerals < brittle
    assert brittle - minerals == {"cast-iron", "phenolic", "melamine", "circuit_board"}
    for name in brittle:
        entry = materials.find_material(name)
        assert entry.law is Law.HENCKY
        strain = entry.ranges["strength"].typical / entry.ranges["young_pa"].typical
        assert 5e-5 < strain < 0.02, name
    assert materials.find_material("glass").pick(materials.find_material("glass").typical()).strength == 60e6
    assert materials.find_material("steel").pick(materials.find_material("steel").typical()).strength is None


def test_an_unknown_kind_of_plastic_spans_the_kinds_that_it_may_be():
    hard, soft = (materials.find_material("plastic"), materials.find_material("soft plastic, kind unknown"))
    for name in "PP HDPE polystyrene ABS PVC PET polycarbonate nylon".split():
        for field in ("density", "young_pa"):
            assert materials.find_material(name).ranges[field].typical in hard.ranges[field], (name, field)
    for name in "LDPE soft_PVC TPU".split():
        for field in ("density", "young_pa"):
            assert materials.find_material(name).ranges[field].typical in soft.ranges[field], (name, field)


def test_balls_weigh_what_their_rules_say():
    for name, diameter, low, high in (("baseball", 0.074, 0.142, 0.149), ("softball", 0.097, 0.177, 0.198)):
        mass = materials.find_material(name).ranges["density"].typical * np.pi / 6 * diameter**3
        assert low < mass < high, name
    cell = materials.find_material("battery").ranges["density"].typical * np.pi / 4 * 0.0145**2 * 0.0505
    assert cell == pytest.approx(0.023, rel=0.05)


def test_a_note_on_a_number_is_shown_under_it():
    shown = materials.describe_material("cork")
    assert "cells buckle" in shown.split("Restitution")[1].split("Loss")[0]


def test_a_light_object_dropped_on_mud_leaves_an_imprint():
    """Energy of a 70 g toy falling .13 m against the bearing capacity of a flat 6 cm footprint."""
    mud = materials.find_material("mud").pick(materials.find_material("mud").typical())
    assert mud.cohesion is not None
    energy, radius, bearing = 0.07 * 9.81 * 0.13, 0.06, 6.2 * mud.cohesion
    depth = sqrt(energy / (bearing * 3.14159 * radius))
    assert 0.003 < depth < 0.03


def test_measured_friction_comes_before_the_rule():
    steel, oak, glass = (materials.find_material(n) for n in ("steel", "hardwood", "glass"))
    assert materials.friction_between(steel, steel).sliding.typical == pytest.approx(0.42)
    assert "metal on wood" in materials.friction_between(steel, oak).reason
    ruled = materials.friction_between(glass, oak)
    assert ruled.reason.startswith("rule")
    assert ruled.sliding.typical == pytest.approx(
        sqrt(glass.ranges["friction"].typical * oak.ranges["friction"].typical)
    )


def test_friction_does_not_care_who_is_named_first():
    names = list(materials.library())
    for a, b in zip(names, names[7:], strict=False):
        one, other = materials.find_material(a), materials.find_material(b)
        there, back = materials.friction_between(one, other), materials.friction_between(other, one)
        assert there.sliding.typical == pytest.approx(back.sliding.typical)


def test_the_rule_comes_near_what_was_measured():
    ratios = []
    for key, row in measured_friction_pairs().items():
        names = [n for n in key if n != "metal"]
        if len(names) == len(key) and "PTFE" not in key and "ice" not in key:
            own = [materials.find_material(n).ranges["friction"].typical for n in row["of"]]
            ratios.append(materials.combine_friction(own[0], own[1]) / row["sliding"][1])
    assert sorted(ratios)[len(ratios) // 2] == pytest.approx(1.0, abs=0.25)
    assert max(ratios) < 3.0


def test_the_softer_body_decides_how_two_bodies_part():
    made = {n: materials.find_material(n).pick(materials.find_material(n).typical()) for n in ("steel", "rubber")}
    assert materials.series_restitution(made["steel"], made["rubber"]) == pytest.approx(
        made["rubber"].restitution, abs=1e-3
    )
    assert materials.series_restitution(made["steel"], made["steel"]) == pytest.approx(made["steel"].restitution)


def striker(name, solid=True, **stated):
    entry = materials.find_material(name)
    grounds = entry.typical()
    for field, value in stated.items():
        grounds[field] = Provenance(value, grounds[field].range, "annotation", "stated")
    return materials.ImpactBody(entry, entry.pick(grounds), solid)


def test_measured_restitution_comes_before_the_rule():
    glass, acrylic, bearing = (striker(n) for n in ("glass", "PMMA", "hardened_steel"))
    assert materials.pair_restitution(glass, glass).value == pytest.approx(0.97)
    assert materials.pair_restitution(glass, acrylic) == materials.pair_restitution(acrylic, glass)
    floor = striker("concrete")
    of_its_family = materials.pair_restitution(bearing, floor)
    assert of_its_family.measured is not None
    assert of_its_family.measured.source == "physics-factbook"
    plank = striker("wood")
    ruled = materials.pair_restitution(glass, plank)
    assert ruled.measured is None
    assert ruled.value == materials.series_restitution(glass.material, plank.material)


def test_walls_and_stated_values_do_not_rebound_as_measured_balls_do():
    ball, bowl = striker("glass"), striker("glass", solid=False)
    stated = striker("glass", restitution=0.7)
    rule = materials.series_restitution(ball.material, ball.material)
    assert materials.pair_restitution(bowl, ball).value == pytest.approx(rule)
    assert materials.pair_restitution(stated, stated).value == pytest.approx(0.7)
    assert materials.pair_restitution(ball, ball).value > rule + 0.1


def test_every_measured_restitution_is_a_range_of_known_materials():
    groups = {e.group for e in materials.library().values()}
    for key, row in measured_restitution_pairs().items():
        assert all(name in groups or materials.find_material(name) for name in key)
        low, typical, high = row["restitution"]
        assert 0 < low <= typical <= high <= 1


def test_the_tables_are_readable_and_complete():
    text = materials.list_materials()
    assert len(text.splitlines()) == len(materials.library()) + 2
    assert re.search(r"steel\s+von_mises\s+200–216 \(207\) GPa", text)
    shown = materials.describe_material("HDPE")
    assert "plastics-HDPE" in shown
    assert "appendix A" in shown
    assert "620–1080 (900) MPa" in shown
    assert "940–970 (955) kg/m³" in shown


def test_containers_hold_what_kitchens_and_workshops_hold():
    held = materials.content_materials()
    for word in ("drink", "cooking oil", "soup", "flour", "sugar", "rice", "sand", "stuffing"):
        assert materials.find_material(word).name in held
    assert not {"steel", "glass", "cardboard"} & set(held)
    order = "flakes biscuits powder granules water sauce"
    density = [materials.find_material(n).ranges["density"].typical for n in order.split()]
    assert density == sorted(density)


def test_what_is_inside_is_in_materials_json_with_its_grounds():
    tin, soup = (materials.find_material(n).pick(materials.find_material(n).typical()) for n in ("steel", "sauce"))
    made = Structure("filled", 2e-4, "said", contents=soup, fill=0.9)
    words, one = PartDescription("can", "steel", "filled"), np.ones((2, 2))
    field = MaterialField((tin,), (made,), (words,), one, one)
    parts = Parts(np.zeros(1, int), np.zeros(1, int), np.ones(1), (Part("can", 0, "node"),))
    said = materials.materials_json(field, parts)["parts"][0]["structure"]
    assert (said["contents"], said["fill"]) == ("sauce", 0.9)
    assert said["contents_values"]["density"]["range"] == [1000, 1250]


def test_coffee_is_a_drink_or_a_powder_and_neither_is_guessed():
    with pytest.raises(UnknownChoiceError) as refused:
        materials.find_material("coffee")
    assert str(refused.value).endswith("Did you mean ground_coffee or 'coffee drink' (water)?")
    assert materials.find_material("coffee drink").name == "water"
    assert materials.find_material("coffee powder").name == "ground_coffee"
