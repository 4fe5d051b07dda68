"""An impact across layers is work against the pressure at which they fold."""

from dataclasses import replace
from math import pi, sqrt

import pytest

from corporeal import materials
from corporeal.materials import ImpactBody
from corporeal.materials.contact_pairs import contact_loss_factor, pair_restitution
from corporeal.materials.flat_crush import (
    ImpactingBall,
    LayeredSheet,
    crush_restitution,
    crush_restitution_law,
    material_across_layers,
)
from corporeal.materials.loss_restitution import restitution_of_loss

RADIUS, THICK = 0.016, 0.008


def made(name):
    entry = materials.find_material(name)
    return entry.pick(entry.typical())


BOARD = LayeredSheet(made("corrugated_cardboard"), THICK)


def ball(name, radius=RADIUS):
    material = made(name)
    return ImpactingBall(material, 4 / 3 * pi * radius**3 * material.density, radius)


def test_a_rigid_ball_loses_the_pressure_times_what_it_crushes():
    """Hard and slow: e² is what both store, 8 p² a³/3E*, over p π a⁴/4R, for a thick sheet."""
    thick = replace(BOARD, thickness=1.0)
    steel, speed = ball("steel"), 0.5
    p, young_pa = thick.layers.crush_pa, thick.layers.young_across_pa
    energy = 0.5 * steel.mass * speed**2
    a = (4 * RADIUS * energy / (pi * p)) ** 0.25
    e = crush_restitution(steel, thick, speed, 0.3)
    plain = sqrt(8 / 3 * p**2 * a**3 / young_pa / energy) * restitution_of_loss(thick.material.loss)
    assert e == pytest.approx(plain, rel=0.08)


def test_what_presses_less_than_the_layers_bear_loses_nothing_to_them():
    rubber = ball("rubber")
    elastic = crush_restitution(rubber, BOARD, 0.0, 0.79)
    assert crush_restitution(rubber, BOARD, 0.02, 0.79) == pytest.approx(elastic)
    # Both return their own parts of what they store.
    low, high = sorted((rubber.material.restitution, material_across_layers(BOARD.material).restitution))
    assert low < elastic < high
    speeds = (0.3, 1.0, 3.0)
    found = [crush_restitution(rubber, BOARD, v, 0.79) for v in speeds]
    assert elastic > found[0] > found[1] > found[2] > 0.3


def test_a_sheet_takes_no_more_than_its_thickness():
    """A heavy ball packs it, and rebounds from what is packed."""
    heavy = ball("steel", 0.05)
    takes = pi * heavy.radius * BOARD.depth**2 * BOARD.layers.crush_pa
    energy = 0.5 * heavy.mass * 6.0**2
    assert takes < 0.1 * energy
    assert crush_restitution(heavy, BOARD, 6.0, 0.6) == pytest.approx(0.6, abs=0.03)
    assert crush_restitution(heavy, replace(BOARD, thickness=1.0), 6.0, 0.6) < 0.25
    assert BOARD.depth == pytest.approx(THICK * (1 - 1.4 * 150 / 690))


@pytest.mark.parametrize("speed", [1.0, 3.0])
def test_slower_impacts_follow_a_power(speed):
    rubber = ball("rubber")
    law = crush_restitution_law(rubber, BOARD, speed, 0.79)
    assert law.value == crush_restitution(rubber, BOARD, speed, 0.79)
    for v in (speed, 0.7 * speed, 0.25 * speed):
        exact = crush_restitution(rubber, BOARD, v, 0.79)
        power = min(law.most, law.value * (v / law.speed) ** -law.exponent)
        assert power == pytest.approx(exact, abs=0.01)


def test_two_lossy_bodies_lose_in_series():
    """Their loss factors add up by compliance; of what is far stiffer nothing is seen."""
    one, other = (ImpactBody(materials.find_material(n), made(n)) for n in ("potato", "rubber"))
    e = pair_restitution(one, other).value
    assert e == pair_restitution(other, one).value
    assert e == pytest.approx(restitution_of_loss(contact_loss_factor(one.material, other.material)), abs=0.01)
    own = pair_restitution(one, one).value
    assert own == pytest.approx(one.material.restitution)
    stiff = replace(other, material=replace(other.material, young_pa=1e13))
    assert pair_restitution(one, stiff).value == pytest.approx(own)
