"""Restitution at the speed of an impact: rated balls, and metals that yield."""

from dataclasses import replace
from math import inf

import pytest

from corporeal import materials
from corporeal.core.types import Provenance
from corporeal.materials.loss_restitution import restitution_of_loss
from corporeal.materials.restitution_speed import material_at_speed, rated_restitutions, yield_restitution


def made(name):
    entry = materials.find_material(name)
    return entry.pick(entry.typical())


def striker(name, solid=True):
    return materials.ImpactBody(materials.find_material(name), made(name), solid)


def test_a_baseball_bounces_better_from_a_hand_than_from_a_bat():
    """Rated at 25.9 m/s; .001 more for every mile per hour less."""
    ball = made("baseball_core")
    dropped = material_at_speed(ball, 25.9 - 10 * 0.44704)
    assert dropped.restitution == pytest.approx(ball.restitution + 0.01, abs=1e-4)
    assert restitution_of_loss(dropped.loss) == pytest.approx(restitution_of_loss(ball.loss) + 0.01, abs=1e-4)
    assert material_at_speed(ball, 25.9).loss == pytest.approx(ball.loss)
    assert material_at_speed(ball, 1e3).restitution == pytest.approx(0.12)


def test_stated_and_unrated_values_stay():
    ball, steel = made("softball_core"), made("steel")
    said = {"loss": replace(ball.grounds["loss"], chosen_by="annotation")}
    stated = replace(ball, grounds=ball.grounds | said)
    assert material_at_speed(stated, 4.0).loss == ball.loss
    assert material_at_speed(stated, 4.0).restitution > ball.restitution
    assert material_at_speed(steel, 4.0) is steel
    assert isinstance(said["loss"], Provenance)


def test_every_rating_is_of_a_material_of_the_library():
    for name, rating in rated_restitutions().items():
        assert materials.find_material(name).name == name
        assert rating.speed_m_s > 0.0 < rating.slope_s_m


def test_a_metal_that_yields_follows_johnson():
    """Lead at 4.43 m/s on concrete: .17; e falls with the fourth root of the speed."""
    lead, concrete = made("lead"), made("concrete")
    assert yield_restitution(lead, concrete, 4.43) == pytest.approx(0.167, abs=0.002)
    slow, fast = (yield_restitution(lead, concrete, v) for v in (1.0, 16.0))
    assert slow / fast == pytest.approx(2.0)
    assert yield_restitution(lead, concrete, 0.0) == yield_restitution(concrete, concrete, 4.0) == 1.0
    assert yield_restitution(lead, concrete, 1e-6) == 1.0 < inf


def test_solid_metals_glass_and_ceramics_need_no_value_on_a_hard_floor():
    """Published: steel on glass .97, aluminium oxide on glass .98, on aluminium .65."""
    bearing, oxide, window = (striker(n) for n in ("hardened_steel", "alumina", "glass"))
    for one in (bearing, oxide):
        assert materials.pair_restitution(one, window, 1.4).value > 0.94
    soft = striker("aluminium")
    assert materials.pair_restitution(oxide, soft, 2.4).value == pytest.approx(0.65, abs=0.08)
    brass = striker("brass")
    slow, fast = (materials.pair_restitution(brass, brass, v).value for v in (1.0, 4.0))
    assert slow / fast == pytest.approx(4.0**0.25)
    # What rings, and what is rough, keeps the rule.
    bowl, plank = striker("glass", solid=False), striker("wood")
    for pair in ((bowl, bearing), (plank, window)):
        rule = materials.series_restitution(pair[0].material, pair[1].material)
        assert materials.pair_restitution(*pair, 3.0).value == pytest.approx(rule)


def metals():
    entries = materials.library().values()
    return [e.name for e in entries if e.group == "metal" and "yield_stress" in e.ranges]


@pytest.mark.parametrize("name", metals())
@pytest.mark.parametrize("below", ["itself", "hardened_steel"])
def test_every_metal_yields_in_a_fast_impact_whatever_was_measured_in_slow_ones(name, below):
    """Balls of bearings, .94 below 3 m/s, and lead, .16, kept that at all speeds."""
    pair = striker(name), striker(name if below == "itself" else below)
    values = [materials.pair_restitution(*pair, v).value for v in (1.0, 25.0, 50.0)]
    assert values[2] == pytest.approx(yield_restitution(*(s.material for s in pair), 50.0))
    assert values[2] / values[1] == pytest.approx(2.0**-0.25, rel=0.02)
    law = materials.pair_restitution_law(*pair, 50.0)
    assert (law.exponent, law.most) == (0.25, materials.pair_restitution(*pair, 0.0).value)
    assert values[0] >= values[1]
