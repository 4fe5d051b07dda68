"""c of what rolls, from the loss of the two that press on each other."""

from dataclasses import replace

import numpy as np
import pytest

import corporeal as co
from corporeal.discretization.rolling_resistance import (
    RollingBody,
    rolling_resistance_length,
    rolling_resistance_lengths,
)
from corporeal.materials.range_placement import library_entry

BALL = RollingBody(radius=0.01, weight=0.32)


def material(name):
    entry = library_entry(name)
    return entry.pick(entry.typical())


def test_a_ball_of_rubber_on_steel_by_hand():
    """a³ = 3 N R/(4 E*), α = 1 - e², c = 3/16 α a: of what is stiff nothing is left."""
    soft = replace(material("rubber"), young_pa=3e6, poisson=0.5, loss=0.1)
    a = (0.75 * 0.32 * 0.01 * 0.75 / 3e6) ** (1 / 3)
    e = np.exp(-1.385 * 0.1 + 0.133 * 0.01)
    found = rolling_resistance_length(BALL, soft, material("hardened_steel"))
    assert found == pytest.approx(3 / 16 * (1 - e**2) * a, rel=1e-3)


def test_a_cylinder_of_rubber_by_hand():
    soft = replace(material("rubber"), young_pa=3e6, poisson=0.5, loss=0.1)
    a = np.sqrt(4 * 0.32 * 0.01 * 0.75 / 3e6 / (np.pi * 0.05))
    e = np.exp(-1.385 * 0.1 + 0.133 * 0.01)
    roller = RollingBody(radius=0.01, weight=0.32, length=0.05)
    found = rolling_resistance_length(roller, soft, material("hardened_steel"))
    assert found == pytest.approx(2 / (3 * np.pi) * (1 - e**2) * a, rel=1e-3)


def test_which_of_two_gives_way_does_not_matter_and_carpets_brake_most():
    ball, floors = material("hardened_steel"), ("hardened_steel", "concrete", "felt", "carpet")
    found = [rolling_resistance_length(BALL, ball, material(f)) for f in floors]
    assert found == sorted(found)
    assert found == [rolling_resistance_length(BALL, material(f), ball) for f in floors]
    assert found[0] / BALL.radius < 1e-5  # measured on polished plates: of the order of 1e-5
    assert 0.01 < found[-1] / BALL.radius < 0.1


def test_only_what_is_round_and_rigid_is_braked():
    marble = co.ball("glass", 0.01, (0.0, 0.0, 0.1))
    die = co.box("wood", (0.02, 0.02, 0.02), (0.1, 0.0, 0.1))
    prepared = co.prepare_scene(co.build_scene(marble, die))
    problem = co.pose_problem(prepared)
    glass, wood, concrete = (material(m) for m in ("glass", "wood", "concrete"))
    rolling = problem.rolling_resistance
    assert rolling is not None
    roller = RollingBody.of(problem.bodies[0])
    assert roller.radius == pytest.approx(0.01, rel=0.02) and roller.length == 0.0
    assert rolling[0, 2] == rolling[2, 0] == rolling_resistance_length(roller, glass, concrete) > 0.0
    assert rolling[0, 1] == rolling[1, 0] == rolling_resistance_length(roller, glass, wood)
    assert rolling[1, 2] == 0.0  # a die has no round points
    unknown = rolling_resistance_lengths(problem.bodies, (glass, wood), None, 1)
    assert unknown[0, 2] == 0.0 and unknown[0, 1] > 0.0
