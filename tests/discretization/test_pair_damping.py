"""What is soft loses for what is rigid and meets it, by the first impacts and real moduli."""

from dataclasses import replace
from math import pi
from typing import Literal

import pytest

import corporeal as co
from corporeal.core.types import Discretization, Law, Material, Structure
from corporeal.discretization.hertz_indentation import hertz_contact_time
from corporeal.discretization.impact_frequency import LOSS_BAND_MIDDLE_RATIO, tune_loss_to_impacts
from corporeal.discretization.impact_speeds import FLOOR_NUMBER
from corporeal.discretization.pair_damping import find_impact_partners, pair_loss_factor_of_parts
from corporeal.discretization.part_geometry import ExpectedMotion, ObjectLanding, PartGeometry
from corporeal.materials.contact_pairs import compliance_share, contact_loss_factor
from corporeal.mpm.constants import GRID_LOSS_FACTOR, MIN_CELLS_FOR_GRID_LOSS

Kind = Literal["rigid", "deformable", "shell"]
SOFT = Material("soft", Law.COROTATED, 4e6, 0.5, 1000.0, loss=0.1)
LOSSY = Material("lossy", Law.HENCKY, 4e6, 0.5, 1000.0, loss=0.5)
STEEL = Material("steel", Law.VON_MISES, 2e11, 0.3, 7850.0, loss=0.001)
SLAB = PartGeometry(0, SOFT, Structure("solid"), (0.01, 0.1, 0.1), 1e-4, 0.024)


def ball(material, number):
    return PartGeometry(number, material, Structure("solid"), (0.03, 0.03, 0.03), 1.4e-5, 2.8e-3)


def fallen(onto, mass=0.01, speed=2.0):
    return ExpectedMotion(2.0, 9.81, landing=ObjectLanding(onto, speed, mass))


LYING = fallen(FLOOR_NUMBER, speed=0.0)


def soft_loss(parts, motions, floor=STEEL):
    rigid = [p.material is not SOFT for p in parts]
    (met, *_) = find_impact_partners(parts, motions, rigid, floor)
    return pair_loss_factor_of_parts(SOFT, met)


def test_two_alike_share_an_impact_and_the_stiffer_takes_less():
    assert compliance_share(SOFT, LOSSY) == pytest.approx(0.5)
    assert contact_loss_factor(SOFT, LOSSY) == pytest.approx(0.3)
    assert compliance_share(replace(SOFT, young_pa=1.2e7), LOSSY) == pytest.approx(0.25)
    assert compliance_share(SOFT, STEEL) + compliance_share(STEEL, SOFT) == pytest.approx(1.0)


def test_a_slab_loses_for_a_rigid_ball_that_falls_on_it():
    assert soft_loss([SLAB, ball(LOSSY, 1)], [LYING, fallen(0)]) == pytest.approx(0.3)
    # Of several, by their energies: three parts of four are steel's.
    both = [SLAB, ball(LOSSY, 1), ball(STEEL, 2)]
    assert soft_loss(both, [LYING, fallen(0), fallen(0, 0.03)]) == pytest.approx(0.15)


def test_a_soft_ball_loses_for_the_floor_that_it_falls_on():
    assert soft_loss([ball(SOFT, 0)], [fallen(FLOOR_NUMBER)], LOSSY) == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("parts", "motions", "floor"),
    [
        ([SLAB, ball(LOSSY, 1)], [LYING, fallen(FLOOR_NUMBER)], LOSSY),  # it falls beside it
        ([SLAB, ball(STEEL, 1)], [LYING, fallen(0)], LOSSY),  # a thousandth is no share
        ([SLAB, ball(LOSSY, 1)], [LYING, fallen(0, speed=0.0)], LOSSY),  # it lies on it
        ([SLAB, ball(SOFT, 1)], [LYING, fallen(0)], LOSSY),  # what is soft loses by itself
        ([ball(SOFT, 0)], [fallen(FLOOR_NUMBER)], None),  # by older runs
        ([ball(SOFT, 0)], [ExpectedMotion(2.0, 9.81)], LOSSY),  # nobody knows what it meets
    ],
)
def test_all_else_keeps_the_very_loss_of_its_material(parts, motions, floor):
    assert soft_loss(parts, motions, floor) == SOFT.loss


def mat(young_pa=4e6, kind: Kind = "deformable", thickness=None, loss=0.1):
    return Discretization(
        kind=kind,
        young_pa=young_pa,
        simulated_young_pa=young_pa,
        poisson=0.5,
        density=1000.0,
        yield_stress=None,
        thickness=thickness,
        strain=1.0,
        impact_speed=2.0,
        wave_speed=1.0,
        step=1.0,
        reason="",
        loss=loss,
    )


RIGID = mat(kind="rigid")


def test_a_mat_loses_at_the_frequency_of_the_impact():
    parts, moving = [SLAB, ball(LOSSY, 1)], [LYING, fallen(0)]
    (found, struck) = tune_loss_to_impacts(parts, moving, [mat(), RIGID])
    lasts = hertz_contact_time(0.01, 0.015, 2.0, 4e6 / 0.75, 0.01)
    assert found.vibration == pytest.approx(pi / lasts / LOSS_BAND_MIDDLE_RATIO)
    assert struck is RIGID
    # Of two alike at once the same; a ball as soft as the mat takes longer.
    again = tune_loss_to_impacts([*parts, ball(LOSSY, 2)], [*moving, fallen(0)], [mat(), RIGID, RIGID])
    assert again[0].vibration == pytest.approx(found.vibration)
    slower = tune_loss_to_impacts(parts, moving, [mat(), mat()])[0]
    assert slower.vibration == pytest.approx(found.vibration / 2**0.4)


def test_only_what_is_flat_and_struck_and_loses_is_tuned():
    cube = replace(SLAB, size=(0.1, 0.1, 0.1))
    hollow = replace(SLAB, structure=Structure("shell", 0.002))
    sheet = replace(SLAB, structure=Structure("shell", 0.008))
    striker, moving = ball(LOSSY, 1), [LYING, fallen(0)]
    for part, treated in ((cube, mat()), (hollow, mat(kind="shell", thickness=0.004))):
        assert tune_loss_to_impacts([part, striker], moving, [treated, RIGID])[0] is treated
    clay = mat(loss=0.0)
    assert tune_loss_to_impacts([SLAB, striker], moving, [clay, RIGID])[0] is clay
    lying = mat()
    assert tune_loss_to_impacts([SLAB, striker], [LYING, LYING], [lying, RIGID])[0] is lying
    assert tune_loss_to_impacts([SLAB, striker], [fallen(FLOOR_NUMBER), fallen(0)], [lying, RIGID])[0] is lying
    carpet = mat(kind="shell", thickness=0.01)
    assert tune_loss_to_impacts([sheet, striker], moving, [carpet, RIGID])[0].vibration > 0.0


def test_nothing_is_dented_deeper_than_it_is_thick():
    thin, thick = (hertz_contact_time(0.01, 0.015, 2.0, 1e4, h) for h in (0.001, 0.002))
    assert thick == pytest.approx(2 * thin)
    # T = 2.87 (m²/(R E*² v))^(1/5) (Johnson, Contact Mechanics, eq. 11.24).
    hertz = 2.87 * (1e-3**2 / (0.01 * 4e10**2 * 1.0)) ** 0.2
    assert hertz_contact_time(1e-3, 0.01, 1.0, 4e10, 1.0) == pytest.approx(hertz, rel=0.01)


@pytest.mark.slow
def test_a_verb_says_what_a_slab_loses_for():
    # It does not lie on the floor, where it would be rigid.
    slab = co.box("rubber", (0.06, 0.06, 0.01), at=(0, 0, 0.0052), name="slab")
    made = co.build_scene(co.ball("apple", 0.015, (0, 0, 0.03), (0, 0, -2.0), "fruit"), slab)
    ready = co.prepare_scene(made)
    fruit, rubber = ready.particles.treatments
    assert fruit.kind == "rigid"
    assert "apple" in rubber.reason
    both = contact_loss_factor(*ready.field.materials)
    assert both > ready.field.materials[1].loss + 0.1
    across = max(0.01 / ready.particles.cell, MIN_CELLS_FOR_GRID_LOSS)
    assert rubber.loss == pytest.approx(both - GRID_LOSS_FACTOR / across**2, abs=1e-3)
    problem = co.pose_problem(ready)
    assert problem.bodies[1].vibration[0] == rubber.vibration > 0.0
