"""Walls as triangle shells with their true thickness: --walls shells."""

from dataclasses import replace

import numpy as np
import pytest

import corporeal as co
from corporeal.discretization.build_model import build_model
from corporeal.discretization.step_budget import slow_waves

DEFAULT = co.Settings()
SHELLS = replace(DEFAULT, fill=replace(DEFAULT.fill, walls="shells"))


@pytest.fixture(scope="module")
def duck():
    return co.prepare_scene(co.showcase_scene("duck-on-mud"), SHELLS)


def shell_of(prepared):
    model = build_model(prepared.scene, prepared.particles, prepared.field)
    return next(body for body in model.problem.bodies if body.shell is not None)


def test_a_duck_has_its_wall_its_mass_and_its_measured_modulus_in_bending(duck):
    treatment = next(t for t in duck.particles.treatments if t.kind == "shell")
    number = duck.particles.treatments.index(treatment)
    assert treatment.thickness == pytest.approx(0.002)
    assert treatment.bending_young_pa == treatment.young_pa
    assert 0.5 * treatment.young_pa < treatment.simulated_young_pa <= treatment.young_pa
    own = duck.particles.part == number
    assert duck.particles.mass[own].sum() == pytest.approx(duck.particles.mass_real[number])
    assert "as in reality" in treatment.reason


def test_its_body_has_a_shell_over_its_own_particles(duck):
    body = shell_of(duck)
    assert body.shell is not None and body.shell.triangle.max() < len(body.position)
    assert np.unique(body.shell.thickness) == pytest.approx([0.002])
    assert (body.shell.membrane_young_pa <= body.shell.young_pa).all()
    edges = np.linalg.norm(np.diff(body.position[body.shell.triangle[:, :2]], axis=1), axis=2)
    assert np.median(edges) == pytest.approx(duck.particles.cell / 2, rel=0.3)


def test_without_asking_walls_are_thickened():
    plain = co.prepare_scene(co.showcase_scene("duck-on-mud"))
    assert not len(plain.particles.shell_triangle)
    wall = next(t for t in plain.particles.treatments if t.kind == "shell")
    assert wall.thickness is not None and wall.thickness > 0.01


def test_what_the_budget_takes_of_plane_and_bending_is_said_of_each(duck):
    treatment = next(t for t in duck.particles.treatments if t.kind == "shell")
    cell = duck.particles.cell
    slower = slow_waves(treatment, 0.5 * treatment.wave_speed, cell, "The step budget reduces its wave speed")
    assert slower.simulated_young_pa == pytest.approx(0.25 * treatment.simulated_young_pa, rel=0.01)
    assert slower.bending_young_pa == treatment.bending_young_pa
    assert slower.yield_stress == treatment.yield_stress
    assert "in its plane 4 times" in slower.reason and "bending" not in slower.reason
    slowest = slow_waves(slower, 0.01 * treatment.wave_speed, cell, "The step budget reduces its wave speed")
    assert slowest.bending_young_pa < treatment.bending_young_pa and "in bending" in slowest.reason
