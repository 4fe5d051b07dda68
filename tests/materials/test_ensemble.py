"""Sets of values drawn over the ranges: inside them, consistent, repeatable."""

from dataclasses import replace

import numpy as np
import pytest

from corporeal import materials
from corporeal.core.types import (
    Hypothesis,
    Inventory,
    MaterialField,
    ObjectDescription,
    PartComponent,
    PartDescription,
    RangePlacement,
    Structure,
    apply_hypothesis,
)
from corporeal.materials.pressurised_ball import sealed_air_material
from corporeal.materials.value_sampling import (
    NAMED_WALL_LOG_STD,
    _draw_shares,
    draw_hypotheses,
    sample_material_field,
    triangular_quantile,
)


def usual(name):
    entry = materials.find_material(name)
    return entry.pick(entry.typical())


def field_of(*names, structures=None, words=None, pieces=()):
    made = tuple(usual(n) for n in names)
    count = len(made) + 1
    floor = [*names, "concrete"]
    friction = np.array(
        [
            [
                materials.friction_between(materials.find_material(a), materials.find_material(b)).sliding.typical
                for b in floor
            ]
            for a in floor
        ]
    )
    return MaterialField(
        materials=made,
        structures=structures or (Structure("solid"),) * len(made),
        words=words or tuple(PartDescription(n, n) for n in names),
        friction=friction,
        restitution=np.full((count, count), 0.5),
        pieces=pieces,
    )


def draws(field, owners, count=150):
    return [sample_material_field(field, owners, np.random.default_rng(k)) for k in range(count)]


@pytest.mark.parametrize(("low", "peak", "high"), [(0, 0.5, 1), (0, 0, 0.5), (0.3, 1, 1), (2, 3, 7)])
def test_a_triangle_is_a_distribution_on_its_support(low, peak, high):
    quantiles = (np.arange(20_000) + 0.5) / 20_000
    drawn = np.array([triangular_quantile(q, low, peak, high) for q in quantiles])
    assert drawn.min() >= low
    assert drawn.max() <= high
    assert drawn.mean() == pytest.approx((low + peak + high) / 3, abs=1e-3)
    assert np.all(np.diff(drawn) >= 0)


def test_every_drawn_value_lies_in_its_range_and_spreads_over_it():
    field = field_of("steel", "rubber")
    found = draws(field, [0, 1])
    for k, material in enumerate(field.materials):
        for name, ground in material.grounds.items():
            values = np.array([getattr(f.materials[k], name) for f in found])
            r = ground.range
            assert r.low <= values.min() <= values.max() <= r.high
            if r.high > r.low:
                assert np.ptp(values) > 0.4 * (r.high - r.low) or r.high / max(r.low, 1e-9) > 10
            assert found[0].materials[k].grounds[name].value == values[0]


def test_what_moves_together_in_life_moves_together_here():
    found = draws(field_of("steel", "seat_foam", "steel"), [0, 0, 1])

    def column(part, name):
        return np.array([getattr(f.materials[part], name) for f in found])

    def together(a, b):
        rank = [np.argsort(np.argsort(x)) for x in (a, b)]
        return np.corrcoef(*rank)[0, 1]

    assert together(column(0, "young_pa"), column(0, "yield_stress")) > 0.7
    assert together(column(1, "young_pa"), column(1, "density")) > 0.7
    assert abs(together(column(0, "young_pa"), column(0, "density"))) < 0.25
    assert abs(together(column(0, "young_pa"), column(2, "young_pa"))) < 0.25


def test_one_object_has_one_grade_of_a_material():
    drawn = sample_material_field(field_of("hardwood", "hardwood", "hardwood"), [0, 0, 1], np.random.default_rng(3))
    legs, other = drawn.materials[:2], drawn.materials[2]
    assert legs[0] == legs[1]
    assert legs[0].young_pa != other.young_pa


def test_what_was_chosen_narrows_the_draw_and_what_was_stated_ends_it():
    field = field_of("steel")
    steel = field.materials[0]

    def spread(chosen_by):
        said = replace(steel.grounds["young_pa"], chosen_by=chosen_by)
        told = replace(steel, grounds=steel.grounds | {"young_pa": said})
        found = draws(replace(field, materials=(told,)), [0])
        return float(np.ptp([f.materials[0].young_pa for f in found]))

    assert spread("annotation") == 0.0
    assert 0 < spread("model") < 0.6 * spread("typical")


def test_walls_contents_and_shares_are_drawn_too():
    soup = usual("sauce")
    can = Structure("filled", 4e-4, contents=soup, fill=0.9, loose=True)
    halves = tuple(PartDescription(n, n, volume_share=s, surface_share=s) for n, s in (("steel", 0.3), ("ABS", 0.7)))
    words = PartDescription("can", "steel", "filled", contents="sauce", pieces=halves)
    pieces = (tuple(PartComponent(w, usual(w.name), Structure("solid")) for w in halves),)
    field = field_of("steel", structures=(can,), words=(words,), pieces=pieces)
    found = draws(field, [0])
    made = [f.structures[0] for f in found]
    wall = field.materials[0].grounds["shell_thickness"].range
    assert all(wall.low <= s.thickness <= wall.high for s in made)
    assert len({s.thickness for s in made}) > 140
    assert all(s.contents.density in soup.grounds["density"].range for s in made)
    fills = np.array([s.fill for s in made])
    assert 0.8 <= fills.min() < 0.85
    assert 0.95 < fills.max() <= 1.0
    shares = np.array([[p.words.volume_share for p in f.pieces[0]] for f in found])
    assert np.allclose(shares.sum(axis=1), 1.0)
    assert 0.03 < shares[:, 0].std() < 0.06
    stated = replace(words, thickness=4e-4, answered_by="annotation")
    fixed = draws(replace(field, words=(stated,)), [0], 5)
    assert {(f.structures[0].thickness, f.structures[0].fill) for f in fixed} == {(4e-4, 0.9)}


def test_sealed_air_is_as_it_was_asked_for_in_every_draw():
    """Every interval of a mass that had a basketball in it ended the run."""
    air = Structure("filled", 0.004, contents=sealed_air_material(55e3), fill=1.0, inflated=True)
    field = field_of("rubber", structures=(air,), words=(PartDescription("ball", "rubber"),))
    drawn = draws(field, (0,), 20)
    assert all(d.structures[0] == air for d in drawn)
    assert len({d.materials[0].density for d in drawn}) > 1


def test_what_is_blown_up_by_mouth_may_have_another_wall_and_a_ball_of_rules_not():
    def walls(kpa):
        air = Structure("filled", 3e-4, contents=sealed_air_material(1e3 * kpa), fill=1.0, inflated=True)
        words = PartDescription("x", "soft_PVC", thickness=3e-4, wall_usual=True, inflation=1e3 * kpa)
        field = field_of("soft_PVC", structures=(air,), words=(words,))
        return {d.structures[0].thickness for d in draws(field, (0,), 20)}

    assert len(walls(3)) == 20
    assert walls(80) == {3e-4}


def test_friction_stays_within_what_was_published():
    field = field_of("rubber", "steel")
    found = draws(field, [0, 1], 100)
    published = materials.friction_between(
        materials.find_material("rubber"), materials.find_material("concrete")
    ).sliding
    drawn = np.array([f.friction[0, 2] for f in found])
    assert published.low <= drawn.min() < drawn.max() <= published.high
    assert all(np.array_equal(f.friction, f.friction.T) for f in found)


def test_measured_restitution_stays_within_what_was_published():
    field = field_of("glass", "PMMA")
    found = draws(field, [0, 1], 100)
    drawn = np.array([f.restitution[0, 1] for f in found])
    assert 0.92 <= drawn.min() < drawn.max() <= 0.98
    assert all(np.array_equal(f.restitution, f.restitution.T) for f in found)


def inventory(words):
    return Inventory((ObjectDescription("thing", "thing", (words,)),))


def names(words, count=2000):
    drawn = (draw_hypotheses(inventory(words), np.random.default_rng(k), "default") for k in range(count))
    return [d.objects[0].parts[0].material for d in drawn]


def test_alternatives_come_as_often_as_they_were_stated():
    others = (Hypothesis("glass", None, 0.25), Hypothesis("ABS", None, 0.1))
    words = PartDescription("cup", "porcelain", hypotheses=(Hypothesis("porcelain", None, 0.65), *others))
    found = names(words)
    assert found.count("glass") / len(found) == pytest.approx(0.25, abs=0.03)
    assert found.count("ABS") / len(found) == pytest.approx(0.1, abs=0.02)
    assert set(found) == {"porcelain", "glass", "ABS"}


def test_a_way_is_drawn_as_a_whole_and_needs_walls():
    place = {"shell_thickness": RangePlacement(0.9, "model", "")}
    real = Hypothesis("apple", "solid", 0.5)
    toy = Hypothesis("polystyrene", "hollow", 0.5, placements=place, reason="Too shiny.")
    fruit = replace(apply_hypothesis(PartDescription("fruit", None), real), hypotheses=(real, toy))
    drawn = [
        draw_hypotheses(inventory(fruit), np.random.default_rng(k), "default").objects[0].parts[0] for k in range(40)
    ]
    assert {(p.material, p.structure, tuple(p.placements)) for p in drawn} == {
        ("apple", "solid", ()),
        ("polystyrene", "hollow", ("shell_thickness",)),
    }
    wall_less = next(e.name for e in materials.library().values() if "shell_thickness" not in e.ranges)
    odd = Hypothesis(wall_less, "hollow", 1.0)
    assert set(names(PartDescription("cup", "porcelain", "shell", hypotheses=(odd,)), 20)) == {"porcelain"}


def test_ways_of_one_reading_are_drawn_together():
    def piece(name, real, toy):
        ways = (Hypothesis(real, "solid", 0.5, reading="real"), Hypothesis(toy, "hollow", 0.5, reading="toy"))
        return replace(apply_hypothesis(PartDescription(name, None), ways[0]), hypotheses=ways)

    parts = (piece("peel", "leather", "soft_PVC"), piece("flesh", "apple", "polystyrene"))
    whole = replace(parts[0], name="fruit", pieces=parts)
    met = {
        tuple(
            p.material
            for p in draw_hypotheses(inventory(whole), np.random.default_rng(k), "default").objects[0].parts[0].pieces
        )
        for k in range(40)
    }
    assert met == {("leather", "apple"), ("soft_PVC", "polystyrene")}


def test_shares_of_what_is_nested_stay_possible():
    cover = PartDescription("cover", "leather", "sheet", volume_share=1.0, surface_share=1.0)
    core = PartDescription("core", "cork", volume_share=0.95, surface_share=0.9, inside="cover")
    words = PartDescription("ball", "cork", pieces=(replace(cover, inner_share=0.95), core))
    for k in range(50):
        drawn = _draw_shares(words, np.random.default_rng(k)).pieces
        assert drawn[0].inner_share == drawn[1].volume_share
        assert drawn[1].volume_share <= 0.99 * drawn[0].volume_share
        assert drawn[0].volume_share == pytest.approx(1.0)


def test_what_is_unknown_may_be_anything():
    assert len(set(names(PartDescription("it", None), 300))) > 40


def test_a_small_library_can_be_drawn_from_too():
    entry = materials.find_material("steel", "reference")
    tin = entry.pick(entry.typical())
    can = Structure("filled", 4e-4, contents=usual("granules"), fill=0.9, loose=True)
    words = (PartDescription("can", "steel", "filled", thickness=4e-4, contents="granules"),)
    field = replace(field_of("steel", structures=(can,), words=words), materials=(tin,))
    drawn = sample_material_field(field, [0], np.random.default_rng(1), "reference", "concrete")
    assert drawn.structures[0].contents.density != can.contents.density
    assert drawn.materials[0].density in entry.ranges["density"]
    odd = PartDescription("cup", "steel", hypotheses=(Hypothesis("phlogiston", None, 1.0),))
    kept = draw_hypotheses(inventory(odd), np.random.default_rng(0), "reference")
    assert kept.objects[0].parts[0].material == "steel"


def test_a_wall_that_is_only_usual_of_a_name_is_drawn_and_a_stated_one_is_not():
    shell = PartDescription("safe", "steel", "shell", thickness=0.005, wall_usual=True)
    stated = replace(shell, wall_usual=False)
    ball = replace(shell, inflation=80e3)

    def walls(words):
        field = field_of("steel", structures=(Structure("shell", 0.005),), words=(words,))
        drawn = draws(field, [0])
        assert all(d.words[0].thickness == d.structures[0].thickness for d in drawn)
        return np.log([d.structures[0].thickness / 0.005 for d in drawn])

    assert walls(shell).std() == pytest.approx(NAMED_WALL_LOG_STD, rel=0.2)
    assert np.median(walls(shell)) == pytest.approx(0.0, abs=0.1)
    assert not walls(stated).any()
    assert not walls(ball).any()
