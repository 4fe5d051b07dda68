"""Walls as triangle shells with their true thickness: --walls shells."""

from dataclasses import replace

import numpy as np
import pytest

import corporeal as co
from corporeal.core.types import Structure
from corporeal.discretization.build_model import build_model
from corporeal.discretization.object_filling import ObjectFilling
from corporeal.discretization.part_model import PartModel
from corporeal.discretization.point_masses import warn_of_unmeshed_walls
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


@pytest.mark.parametrize(("laid", "warned"), [(1.0, False), (0.95, False), (0.6, True), (1.3, True)])
def test_a_mesh_that_holds_another_amount_of_material_is_reported(duck, laid, warned):
    density = 1000.0
    packing = ObjectFilling(
        points=np.eye(3),
        volumes=np.full(3, laid / 3 / density),
        part=np.zeros(3, np.int64),
        sheet=np.zeros(3, bool),
        triangle=np.array([[0, 1, 2]]),
        wall=np.full(1, 0.001),
    )
    made = PartModel(Structure("shell", 0.001), False, 0.001, 0.0, 0.75, 0.25, 1.0, 0.001, density)
    treatment = replace(next(t for t in duck.particles.treatments if t.kind == "shell"), density=density)
    found = list(warn_of_unmeshed_walls([packing], {0: made}, [treatment]))
    assert bool(found) == warned
    assert all(f"hold {laid:.2g} of its material" in words for words in found)


def test_the_duck_is_meshed_whole(duck):
    assert not any("of its material" in str(words) for words in duck.particles.warnings)
