"""Sealed air: a soft solid that presses and bounces as a limp ball full of it does."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

from corporeal.materials import find_material
from corporeal.materials.loss_restitution import restitution_of_loss
from corporeal.materials.pressurised_ball import (
    REFERENCE_SQUEEZE_RATIO,
    InflatedBall,
    equivalent_solid,
    inflated_ball_material,
    is_carried_by_air,
    pressed_gauge_pressure,
    sealed_air_material,
)


def limp_force(gauge, radius, depth):
    """F = p A of a limp ball pressed flat, with its air compressed adiabatically."""
    volume = 4 / 3 * pi * radius**3
    left = volume - pi * depth**2 * (radius - depth / 3)
    pressure = (101_325 + gauge) * (volume / left) ** 1.4 - 101_325
    return pressure * pi * (2 * radius * depth - depth**2)


def contact_time(force, mass, speed):
    """Time of a bounce against a rigid plane [s], by stepping m x'' = -F(x)."""
    x, t, dt = 0.0, 0.0, 2e-6
    while x >= 0.0:
        speed -= dt * force(x) / mass
        x, t = x + dt * speed, t + dt
    return t


def hertz(material, radius):
    plane = material.young_pa / (1 - material.poisson**2)
    return lambda x: 4 / 3 * plane * sqrt(radius) * max(x, 0.0) ** 1.5


@pytest.mark.parametrize("gauge", [0.0, 3e3, 30e3, 80e3])
def test_solid_and_limp_ball_press_alike_at_a_fifth_of_the_radius(gauge):
    air, radius = sealed_air_material(gauge), 0.11
    depth = REFERENCE_SQUEEZE_RATIO * radius
    assert hertz(air, radius)(depth) == pytest.approx(limp_force(gauge, radius, depth), rel=0.05)


@pytest.mark.parametrize("speed", [6.0, 10.0, 19.0])
def test_a_football_touches_as_long_as_a_limp_one(speed):
    air, radius, mass = sealed_air_material(80e3), 0.11, 0.43
    limp = contact_time(lambda x: limp_force(80e3, radius, max(x, 0.0)), mass, speed)
    solid = contact_time(hertz(air, radius), mass, speed)
    assert solid == pytest.approx(limp, rel=0.15)
    stiff = contact_time(lambda x: 3 * hertz(air, radius)(x), mass, speed)
    assert stiff != pytest.approx(limp, rel=0.15)


def test_air_without_gauge_pressure_resists_and_what_is_inflated_resists_more():
    pressures = [pressed_gauge_pressure(p) for p in (0.0, 1e3, 1e4, 1e5)]
    assert pressures[0] > 3e3
    assert np.all(np.diff(pressures) > 0)


@pytest.mark.parametrize(
    ("skin", "thickness", "radius", "gauge", "bears"),
    [
        ("rubber", 0.003, 0.11, 80e3, True),  # football
        ("rubber", 0.004, 0.033, 80e3, True),  # tennis ball
        ("soft_PVC", 0.0003, 0.2, 0.0, True),  # beach ball, as good as empty
        ("soft_PVC", 0.002, 0.04, 0.0, False),  # duck, were it sealed
        ("ABS", 0.0004, 0.02, 0.0, False),  # table tennis ball
        ("steel", 0.003, 0.11, 80e3, False),
    ],
)
def test_air_carries_where_it_is_stiffer_than_the_skin(skin, thickness, radius, gauge, bears):
    material = find_material(skin).pick(find_material(skin).typical())
    assert is_carried_by_air(gauge, material, thickness, radius) is bears


def test_the_loss_is_that_of_the_restitution_and_every_number_has_its_range():
    air = sealed_air_material(55e3)
    assert restitution_of_loss(air.loss) == pytest.approx(air.restitution)
    for name, ground in air.grounds.items():
        assert ground.value in ground.range
        assert getattr(air, name) == ground.value


def racquetball(gauge=0.0):
    rubber = find_material("rubber").pick(find_material("rubber").typical())
    return InflatedBall(gauge, rubber, 0.0036, 0.0286)


def test_an_impact_is_stored_in_wall_and_air_where_a_ball_turns():
    """By stepping m x'' = -(k x + p A), with the air compressed adiabatically."""
    ball, mass, speed = racquetball(), 0.04, 6.9

    def force(x):
        return ball.spring * x + limp_force(ball.gauge_pressure, ball.radius, x)

    x, v, dt = 0.0, speed, 1e-6
    while v > 0.0:
        v -= dt * force(x) / mass
        x += dt * v
    energy = 0.5 * mass * speed**2
    assert ball.squeeze(energy) == pytest.approx(x / ball.radius, rel=0.01)
    solid = replace(inflated_ball_material(ball), young_pa=equivalent_solid(ball, energy).young_pa)
    assert hertz(solid, ball.radius)(x) == pytest.approx(force(x), rel=0.02)


def test_the_harder_a_sealed_ball_is_struck_the_more_the_air_bears_which_loses_nothing():
    ball = racquetball()
    losses = [equivalent_solid(ball, energy).loss for energy in (0.0, 0.3, 1.0, 3.0)]
    assert losses[0] < ball.skin.loss
    assert np.all(np.diff(losses) < 0)
    assert losses[-1] > 0.3 * ball.skin.loss


def test_a_thick_wall_is_dented_no_less_than_a_solid_ball():
    rubber = racquetball().skin
    solid = InflatedBall(0.0, rubber, 0.0286, 0.0286)
    depth = REFERENCE_SQUEEZE_RATIO * solid.radius
    assert solid.spring * depth < 1.05 * hertz(rubber, solid.radius)(depth)
