"""USD comes back in: ours with all that it carries, other people's with what UsdPhysics says."""

from dataclasses import replace

import numpy as np
import pytest
from export_helpers import asked_of

pytest.importorskip("pxr", reason="usd-core reads USD: pip install 'corporeal[export]'")

import corporeal as co
from corporeal.core.errors import UserError
from corporeal.core.types import Wall
from corporeal.export.export_target import ExportConfig, ExportRequest
from corporeal.export.physical_scene import physical_scene
from corporeal.export.scene_motion import motion_of_scene
from corporeal.export.usd_writer import write_usd
from corporeal.io.usd.usd_bodies import read_usd_physics

FOREIGN = """#usda 1.0
(
    kilogramsPerUnit = 0.001
    metersPerUnit = 0.01
    upAxis = "Y"
)
def Xform "cup" (
    prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]
)
{
    float physics:mass = 250
    def Cube "shape" (
        prepend apiSchemas = ["PhysicsCollisionAPI", "MaterialBindingAPI"]
    )
    {
        rel material:binding:physics = </glaze>
    }
}
def Material "glaze" (
    prepend apiSchemas = ["PhysicsMaterialAPI"]
)
{
    float physics:density = 2.4
    float physics:dynamicFriction = 0.35
    float physics:staticFriction = 0.4
}
"""


def test_our_own_come_back_with_values_ranges_and_sources(written, asked):
    bodies = read_usd_physics(written(write_usd) / "sim.usda")
    assert [b.title for b in bodies] == [s.title for s in asked.scene.solids]
    for body, solid in zip(bodies, asked.scene.solids, strict=True):
        if solid.rigid:
            assert body.mass == pytest.approx(solid.mass, rel=1e-6)
        found = {m.path: m for m in body.materials}
        for part in solid.parts:
            matter = asked.scene.matter[part]
            back = found[f"/World/Matter/part_{part}"]
            assert back.name == matter.material.name
            assert set(back.values) == set(matter.material.grounds)
            for name, ground in matter.material.grounds.items():
                told = back.values[name]
                assert told.value == ground.value
                assert told.range == (ground.range.low, ground.range.high)
                assert told.chosen_by == ground.chosen_by and told.reason == ground.reason
                assert told.source == matter.provenance["values"][name]["source"]


def test_masses_densities_and_frictions_of_others_come_in_their_units(tmp_path):
    path = tmp_path / "cup.usda"
    path.write_text(FOREIGN)
    (cup,) = read_usd_physics(path)
    assert cup.mass == pytest.approx(0.25)
    (glaze,) = cup.materials
    assert glaze.name == "glaze"
    assert glaze.values["density"].value == pytest.approx(2400.0)
    assert glaze.values["friction"].value == pytest.approx(0.35)
    assert "restitution" not in glaze.values
    assert {v.source for v in glaze.values.values()} == {"stated by UsdPhysics in cup.usda"}
    assert {v.range for v in glaze.values.values()} == {None}


@pytest.mark.parametrize("text", ["", "not USD", "#usda 1.0\ndef"])
def test_what_is_no_usd_is_reported(tmp_path, text):
    path = tmp_path / "x.usda"
    path.write_text(text)
    with pytest.raises(UserError, match="cannot be read as USD"):
        read_usd_physics(path)


def test_what_is_not_there_is_reported(tmp_path):
    with pytest.raises(UserError, match="no such file"):
        read_usd_physics(tmp_path / "x.usda")


@pytest.mark.slow
def test_our_own_come_back_as_a_scene_with_all_that_they_carry(played, tmp_path):
    """Out, in, prepared again: the same names, motion, materials, frictions and masses."""
    before = played.prepared
    walls = (Wall((-1.0, 0.0, 0.0), (1.5, 0.0, 0.0)),)
    scene = replace(before.scene, walls=walls, gravity=(0.0, 0.3, -3.7))
    before = replace(before, scene=scene)
    motion = motion_of_scene(before)
    write_usd(ExportRequest(physical_scene(before, motion), motion, ExportConfig()), tmp_path)
    scene = co.load_scene(tmp_path / "sim.usda")
    for old, new in zip(before.scene.objects, scene.objects, strict=True):
        assert (new.name, new.class_name) == (old.name, old.class_name)
        assert new.real_extent == old.real_extent and new.scale == old.scale
        np.testing.assert_allclose(new.velocity, old.velocity, atol=1e-9)
    assert (scene.walls, scene.gravity) == (walls, (0.0, 0.3, -3.7))
    assert (scene.duration, scene.fps, scene.settled) == (0.1, 40, False)
    after = co.prepare_scene(scene)
    for old, new in zip(before.field.materials, after.field.materials, strict=True):
        assert (old.name, old.law) == (new.name, new.law)
        assert old.grounds == new.grounds  # value, range, source, chooser, reason, margin
    np.testing.assert_array_equal(before.field.friction, after.field.friction)
    np.testing.assert_allclose(after.particles.mass_real, before.particles.mass_real, rtol=1e-6)


@pytest.mark.slow
def test_what_is_left_out_of_the_simulation_is_still_one_object(played, tmp_path):
    write_usd(asked_of(played, soft="none"), tmp_path)
    scene = co.load_scene(tmp_path / "sim.usda")
    assert len(scene.objects) == len(played.prepared.scene.objects)
