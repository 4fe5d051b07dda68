import pytest
from hypothesis import given
from hypothesis import strategies as st

from corporeal import materials
from corporeal.core.types import PartWords, Placement, Range
from corporeal.materials.consistency import contradictions
from corporeal.materials.offer import choice, contents_offered, substances_offered
from corporeal.materials.placement import (
    CONTENTS,
    Judgement,
    choices,
    from_values,
    odd,
    spelling,
    usual,
)
from corporeal.materials.scale import fraction_of, logarithmic, place
from corporeal.materials.treatments import treatment_problems, treatments

NARROW = Range(2e9, 2.5e9, 3e9, "s")
WIDE = Range(1e4, 6e4, 1.5e5, "s")
RANGES = [r for e in materials.library().values() for r in e.ranges.values()]


def test_a_place_counts_differences_in_a_narrow_range_and_factors_in_a_wide_one():
    assert not logarithmic(NARROW)
    assert place(NARROW, 0.25) == pytest.approx(2.25e9)
    assert logarithmic(WIDE)
    assert place(WIDE, 0.5) == pytest.approx((1e4 * 1.5e5) ** 0.5)
    assert not logarithmic(Range(0.0, 0.1, 0.3, "s"))


@given(st.sampled_from(RANGES), st.floats(0, 1))
def test_no_place_can_leave_the_measured_range(measured, fraction):
    assert place(measured, fraction) in measured


@given(st.sampled_from([r for r in RANGES if r.low < r.high]), st.floats(0, 1))
def test_the_place_of_a_value_is_where_it_came_from(measured, fraction):
    assert fraction_of(measured, place(measured, fraction)) == pytest.approx(fraction, abs=1e-6)


def test_every_treatment_lies_inside_what_was_measured():
    ranges = {name: entry.ranges for name, entry in materials.library().items()}
    assert treatment_problems(ranges) == []
    assert sum(bool(treatments(name)) for name in ranges) >= 12
    steel = ranges["steel"] | {"yield_stress": Range(5e8, 5.5e8, 6e8, "s")}
    found = treatment_problems(ranges | {"steel": steel})
    assert any("'food tin, lid: soft tinplate' puts yield_stress" in f for f in found)
    without = {name: r for name, r in ranges.items() if name != "steel"}
    assert treatment_problems(without) == ["treatments: there is no material 'steel'"]


def test_a_range_is_offered_with_its_unit_its_usual_place_and_what_narrows_it():
    measured = materials.library()["seat_foam"].ranges["young"]
    offered = choice("seat_foam", "young", measured)
    assert offered.bounds == pytest.approx((10.0, 150.0))
    first, *uses = offered.words.splitlines()
    assert first.startswith("Young's modulus: 10 to 150 kPa, logarithmic scale; usually 60 (place")
    assert "  - seat, mattress: 40 to 110 kPa" in uses
    angle = choice("sand", "friction_angle", materials.library()["sand"].ranges["friction_angle"])
    assert angle.words.splitlines()[0].split("; ")[0].endswith("°")


def test_lists_hold_every_name_once_and_what_flows_is_only_inside():
    inside, outside = contents_offered("default"), substances_offered("default")
    assert "water" in inside
    assert "water" not in outside
    for name in materials.substances():
        assert outside.replace("\n", ", ").count(f" {name},") + outside.endswith(f" {name}") == 1


def test_only_what_is_open_is_offered():
    assert choices(PartWords("x", None)) == {}
    solid = choices(PartWords("x", "steel", "solid"))
    assert set(solid) == {"young", "poisson", "density", "yield_stress"}
    shell = choices(PartWords("x", "steel", "shell"))
    assert set(shell) - set(solid) == {"shell_thickness"}
    stated = PartWords("x", "steel", "shell", thickness=1e-3, values={"young": 2.05e11})
    assert set(choices(stated)) == {"poisson", "density", "yield_stress"}
    filled = choices(PartWords("x", "aluminium_can_sheet", "filled", contents="water"))
    assert filled[CONTENTS].range == materials.library()["water"].ranges["density"]


def test_a_name_is_spelt_as_the_library_does_or_is_none():
    assert spelling("Seat Foam", "default", materials.substances()) == "seat_foam"
    assert spelling("unobtainium", "default", materials.substances()) is None
    assert spelling("water", "default", materials.substances()) is None


def test_a_value_on_a_printed_bound_is_inside():
    offered = choices(PartWords("x", "soft_PVC", "solid"))
    low, _ = offered["young"].bounds
    placed = from_values({"young": Judgement(low * (1 - 1e-9), "why")}, "model", offered)
    assert placed["young"] == Placement(0.0, "model", "why")
    fallback = usual(offered, "nobody")["young"]
    typical = offered["young"].range.typical
    assert place(offered["young"].range, fallback.fraction) == pytest.approx(typical)
    assert fallback.chosen_by == "fallback"


def at(**fractions):
    return {field: Placement(x, "model", "") for field, x in fractions.items()}


def test_stiff_but_weak_and_light_but_stiff_do_not_fit():
    clay, foam = PartWords("x", "plasticine"), PartWords("x", "seat_foam")
    assert odd(clay, at(young=1.0, yield_stress=0.0)).keys() == {"yield_stress"}
    assert odd(clay, at(young=0.0, yield_stress=1.0))["yield_stress"].startswith("soft but strong")
    assert odd(foam, at(young=1.0, density=0.0))["young"].startswith("light but stiff")
    for fraction in (0.0, 0.3, 0.5, 1.0):
        assert odd(clay, at(young=fraction, yield_stress=fraction)) == {}
        assert odd(foam, at(young=fraction, density=fraction)) == {}


def test_nobody_is_told_to_mend_a_value_that_was_not_asked_for():
    """Of the ways beside the likeliest only what a mass hangs on is asked."""
    foam = PartWords("x", "packaging_foam", "solid")
    assert set(choices(foam, weighing=True)) == {"density"}
    for fraction in (0.0, 0.5, 1.0):
        assert odd(foam, at(density=fraction)) == {}
    stiff = PartWords("x", "packaging_foam", "solid", values={"young": 1e7})
    assert odd(stiff, at(density=0.0))["young"].startswith("light but stiff")


@pytest.mark.parametrize("entry", materials.library().values(), ids=lambda e: e.name)
def test_what_is_usual_or_at_one_end_fits_in_every_material(entry):
    for end in ("low", "typical", "high"):
        values = {field: getattr(r, end) for field, r in entry.ranges.items()}
        assert contradictions(entry.group, entry.ranges, values) == {}
