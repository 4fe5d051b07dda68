import pytest
from hypothesis import given
from hypothesis import strategies as st

from corporeal import materials
from corporeal.core.types import MeasuredRange, PartDescription, RangePlacement
from corporeal.materials.material_candidates import (
    content_materials_text,
    fraction_of,
    is_logarithmic,
    part_materials_text,
    quantity_choice,
    value_at_fraction,
)
from corporeal.materials.range_modifiers import is_within_range, range_modifier_table, range_modifiers
from corporeal.materials.range_placement import (
    CONTENTS_DENSITY_FIELD,
    QuantityJudgement,
    library_spelling,
    placement_contradictions,
    placements_from_values,
    quantity_choices,
    usual_placements,
    value_contradictions,
)

NARROW = MeasuredRange(2e9, 2.5e9, 3e9, "s")
WIDE = MeasuredRange(1e4, 6e4, 1.5e5, "s")
RANGES = [r for e in materials.library().values() for r in e.ranges.values()]


def test_a_place_counts_differences_in_a_narrow_range_and_factors_in_a_wide_one():
    assert not is_logarithmic(NARROW)
    assert value_at_fraction(NARROW, 0.25) == pytest.approx(2.25e9)
    assert is_logarithmic(WIDE)
    assert value_at_fraction(WIDE, 0.5) == pytest.approx((1e4 * 1.5e5) ** 0.5)
    assert not is_logarithmic(MeasuredRange(0.0, 0.1, 0.3, "s"))


@given(st.sampled_from(RANGES), st.floats(0, 1))
def test_no_place_can_leave_the_measured_range(measured, fraction):
    assert value_at_fraction(measured, fraction) in measured


@given(st.sampled_from([r for r in RANGES if r.low < r.high]), st.floats(0, 1))
def test_the_place_of_a_value_is_where_it_came_from(measured, fraction):
    assert fraction_of(measured, value_at_fraction(measured, fraction)) == pytest.approx(fraction, abs=1e-6)


def range_modifier_problems(ranges):
    """Say what is wrong with the table of uses, one sentence each, beside a library's measured ranges."""
    for material, known in range_modifier_table().items():
        if material not in ranges:
            yield f"there is no material {material!r}"
            continue
        for use in known:
            for field, (low, high) in use.bands.items():
                whole = ranges[material].get(field)
                if whole is None or not is_within_range(low, high, whole):
                    yield f"{material}: {use.words!r} puts {field} outside the measured range"


def test_every_treatment_lies_inside_what_was_measured():
    ranges = {name: entry.ranges for name, entry in materials.library().items()}
    assert list(range_modifier_problems(ranges)) == []
    assert sum(bool(range_modifiers(name)) for name in ranges) >= 12
    steel = ranges["steel"] | {"yield_stress": MeasuredRange(5e8, 5.5e8, 6e8, "s")}
    found = range_modifier_problems(ranges | {"steel": steel})
    assert any("'food tin, lid: soft tinplate' puts yield_stress" in f for f in found)
    without = {name: r for name, r in ranges.items() if name != "steel"}
    assert list(range_modifier_problems(without)) == ["there is no material 'steel'"]


def test_a_range_is_offered_with_its_unit_its_usual_place_and_what_narrows_it():
    measured = materials.library()["seat_foam"].ranges["young_pa"]
    offered = quantity_choice("seat_foam", "young_pa", measured)
    assert offered.bounds == pytest.approx((10.0, 150.0))
    first, *uses = offered.words.splitlines()
    assert first.startswith("Young's modulus: 10 to 150 kPa, logarithmic scale; usually 60 (place")
    assert "  - seat, mattress: 40 to 110 kPa" in uses
    angle = quantity_choice("sand", "friction_angle", materials.library()["sand"].ranges["friction_angle"])
    assert angle.words.splitlines()[0].split("; ")[0].endswith("°")


def test_lists_hold_every_name_once_and_what_flows_is_only_inside():
    inside, outside = content_materials_text("default"), part_materials_text("default")
    assert "water" in inside
    assert "water" not in outside
    for name in materials.part_materials():
        assert outside.replace("\n", ", ").count(f" {name},") + outside.endswith(f" {name}") == 1


def test_only_what_is_open_is_offered():
    assert quantity_choices(PartDescription("x", None)) == {}
    solid = quantity_choices(PartDescription("x", "steel", "solid"))
    assert set(solid) == {"young_pa", "poisson", "density", "yield_stress"}
    shell = quantity_choices(PartDescription("x", "steel", "shell"))
    assert set(shell) - set(solid) == {"shell_thickness"}
    stated = PartDescription("x", "steel", "shell", thickness=1e-3, values={"young_pa": 2.05e11})
    assert set(quantity_choices(stated)) == {"poisson", "density", "yield_stress"}
    filled = quantity_choices(PartDescription("x", "aluminium_can_sheet", "filled", contents="water"))
    assert filled[CONTENTS_DENSITY_FIELD].range == materials.library()["water"].ranges["density"]


def test_a_name_is_spelt_as_the_library_does_or_is_none():
    assert library_spelling("Seat Foam", "default", materials.part_materials()) == "seat_foam"
    assert library_spelling("unobtainium", "default", materials.part_materials()) is None
    assert library_spelling("water", "default", materials.part_materials()) is None


def test_a_value_on_a_printed_bound_is_inside():
    offered = quantity_choices(PartDescription("x", "soft_PVC", "solid"))
    low, _ = offered["young_pa"].bounds
    placed = placements_from_values({"young_pa": QuantityJudgement(low * (1 - 1e-9), "why")}, "model", offered)
    assert placed["young_pa"] == RangePlacement(0.0, "model", "why")
    fallback = usual_placements(offered, "nobody")["young_pa"]
    typical = offered["young_pa"].range.typical
    assert value_at_fraction(offered["young_pa"].range, fallback.fraction) == pytest.approx(typical)
    assert fallback.chosen_by == "fallback"


def at(**fractions):
    return {field: RangePlacement(x, "model", "") for field, x in fractions.items()}


def test_stiff_but_weak_and_light_but_stiff_do_not_fit():
    clay, foam = PartDescription("x", "plasticine"), PartDescription("x", "seat_foam")
    assert placement_contradictions(clay, at(young_pa=1.0, yield_stress=0.0)).keys() == {"yield_stress"}
    soft = placement_contradictions(clay, at(young_pa=0.0, yield_stress=1.0))["yield_stress"]
    assert soft.startswith("soft but strong")
    assert placement_contradictions(foam, at(young_pa=1.0, density=0.0))["young_pa"].startswith("light but stiff")
    for fraction in (0.0, 0.3, 0.5, 1.0):
        assert placement_contradictions(clay, at(young_pa=fraction, yield_stress=fraction)) == {}
        assert placement_contradictions(foam, at(young_pa=fraction, density=fraction)) == {}


def test_no_correction_is_asked_for_a_value_that_was_not_asked_for():
    """Of the ways beside the likeliest only what a mass hangs on is asked."""
    foam = PartDescription("x", "packaging_foam", "solid")
    assert set(quantity_choices(foam, weighing=True)) == {"density"}
    for fraction in (0.0, 0.5, 1.0):
        assert placement_contradictions(foam, at(density=fraction)) == {}
    stiff = PartDescription("x", "packaging_foam", "solid", values={"young_pa": 1e7})
    assert placement_contradictions(stiff, at(density=0.0))["young_pa"].startswith("light but stiff")


@pytest.mark.parametrize("entry", materials.library().values(), ids=lambda e: e.name)
def test_what_is_usual_or_at_one_end_fits_in_every_material(entry):
    for end in ("low", "typical", "high"):
        values = {field: getattr(r, end) for field, r in entry.ranges.items()}
        assert value_contradictions(entry.group, entry.ranges, values) == {}
