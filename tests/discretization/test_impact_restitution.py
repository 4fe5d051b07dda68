"""Restitution is carried to the speed of each pair's first impact when a problem is posed."""

from dataclasses import replace

import numpy as np
import pytest

import corporeal as co
from corporeal import materials
from corporeal.discretization.impact_restitution import restitutions_at_impact
from corporeal.materials import ImpactBody
from corporeal.mpm.physics.impact_support import restitution_at_speed


def fallen(material, speed):
    made = co.build_scene(co.ball(material, 0.02, (0, 0, 0.03), (0, 0, -speed), "thing"))
    (surface,) = made.surfaces
    return co.prepare_scene(replace(made, surfaces=(replace(surface, extras={"substance": material}),)))


def test_a_lead_ball_rebounds_less_the_harder_it_strikes():
    ready = fallen("lead", 4.0)
    assert ready.particles.treatments[0].kind == "rigid"
    problem = co.pose_problem(ready)
    nominal = ready.field.restitution[0, -1]
    # Of its estimated speed at impact, which its start above the floor adds to.
    struck = ready.particles.treatments[0].impact_speed
    assert problem.restitution[0, -1] == pytest.approx(nominal * struck**-0.25, rel=1e-3)
    assert np.allclose(problem.restitution, problem.restitution.T)


def test_what_was_drawn_stays_drawn_and_what_is_unknown_stays():
    ready = fallen("softball_core", 4.0)
    field, treatments = ready.field, ready.particles.treatments
    (usual,) = restitutions_at_impact(field, treatments).restitution[:1, -1]
    drawn = replace(field, restitution=0.9 * field.restitution)
    assert restitutions_at_impact(drawn, treatments).restitution[0, -1] == pytest.approx(0.9 * usual)
    strange = replace(field.materials[0], name="of a library of one's own")
    own = replace(field, materials=(strange,))
    assert restitutions_at_impact(own, treatments).restitution[0, -1] == field.restitution[0, -1]
    floorless = restitutions_at_impact(replace(field, floor=None), treatments)
    assert np.array_equal(floorless.restitution, field.restitution)
    assert (floorless.laws[..., 1:3] == 0.0).all()


@pytest.mark.parametrize("material", ["softball_core", "brass", "lead", "glass", "wood"])
@pytest.mark.parametrize("speed", [0.3, 4.0])
def test_slower_impacts_follow_the_law_of_their_materials(material, speed):
    entries = [materials.find_material(name) for name in (material, "concrete")]
    one, other = (ImpactBody(entry, entry.pick(entry.typical())) for entry in entries)
    law = materials.pair_restitution_law(one, other, speed)
    numbers = np.array([law.speed, law.slope, law.exponent, law.least, law.most])
    for v in speed * np.array([1.0, 0.7, 0.4, 0.1, 0.02]):
        exact = materials.pair_restitution(one, other, float(v)).value
        assert restitution_at_speed(law.value, numbers, float(v)) == pytest.approx(exact, abs=2e-3)
