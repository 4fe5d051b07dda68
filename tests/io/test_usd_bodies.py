"""Scenes of several prims in USD: bodies become objects with what UsdPhysics says of them."""

import numpy as np
import pytest

pytest.importorskip("pxr", reason="usd-core reads USD: pip install 'corporeal[usd]'")

import corporeal as co
from corporeal.pipeline.stages.ground import grounding_warnings

KITCHEN = """#usda 1.0
(
    kilogramsPerUnit = 0.001
    metersPerUnit = 0.01
    upAxis = "Y"
    defaultPrim = "kitchen"
)
def Xform "kitchen"
{
    def Xform "mug" (
        displayName = "Blue Mug"
        prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]
    )
    {
        vector3f physics:angularVelocity = (0, 90, 0)
        vector3f physics:velocity = (0, -200, 50)
        float physics:mass = 250
        double3 xformOp:translate = (0, 40, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Cylinder "shape" (
            prepend apiSchemas = ["PhysicsCollisionAPI", "MaterialBindingAPI"]
        )
        {
            uniform token axis = "Y"
            double height = 10
            double radius = 4
            rel material:binding:physics = </kitchen/Ceramic>
        }
    }
    def Xform "block" (
        prepend apiSchemas = ["PhysicsRigidBodyAPI"]
    )
    {
        double3 xformOp:translate = (30, 30, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Cube "shape" (
            prepend apiSchemas = ["PhysicsCollisionAPI", "MaterialBindingAPI"]
        )
        {
            double size = 10
            rel material:binding:physics = </kitchen/Wood>
        }
    }
    def Xform "table"
    {
        double3 xformOp:translate = (0, 12, 0)
        double3 xformOp:scale = (100, 4, 60)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
        def Cube "steel_top"
        {
            double size = 1
        }
        def Cube "steel_edge"
        {
            double size = 1
        }
    }
    def Plane "ground" (
        prepend apiSchemas = ["PhysicsCollisionAPI"]
    )
    {
    }
    def Material "Ceramic" (
        prepend apiSchemas = ["PhysicsMaterialAPI"]
    )
    {
        float physics:dynamicFriction = 0.35
    }
    def Material "Wood" (
        prepend apiSchemas = ["PhysicsMaterialAPI"]
    )
    {
        float physics:density = DENSITY
        float physics:dynamicFriction = 0.45
    }
}
"""
"""A mug and a wooden block that fall onto a steel table, in centimetres and grams."""


@pytest.fixture
def kitchen(tmp_path):
    def read(density="0.7"):
        path = tmp_path / "kitchen.usda"
        path.write_text(KITCHEN.replace("DENSITY", density))
        return co.load_scene(path)

    return read


def test_bodies_are_objects_and_so_is_what_they_stand_on(kitchen):
    scene = kitchen()
    assert [o.name for o in scene.objects] == ["Blue Mug", "block", "table_0"]
    mug = scene.objects[0]
    assert mug.class_name == "blue mug"
    assert mug.mass == pytest.approx(0.25)
    np.testing.assert_allclose(mug.velocity, [0.0, -0.5, -2.0], atol=1e-12)  # +Y up → +Z up
    told = " ".join(scene.warnings)
    assert "spins of bodies (1)" in told
    assert "table_0: no rigid bodies in the file" in told
    assert "no meshes" not in told


@pytest.mark.slow
def test_what_is_stated_is_simulated_and_says_who_stated_it(kitchen):
    scene = kitchen()
    prepared = co.prepare_scene(scene)
    mug, block, _ = (prepared.parts.catalogue[k].object for k in range(3))
    mass = np.bincount(prepared.particles.object, prepared.particles.mass)
    assert mass[mug] == pytest.approx(0.25, rel=1e-6)
    assert mass[block] == pytest.approx(700 * 0.1**3, rel=1e-6)
    wood, ceramic = (prepared.field.materials[k] for k in (1, 0))
    assert wood.density == pytest.approx(700) and wood.friction == pytest.approx(0.45)
    for ground in (wood.grounds["density"], wood.grounds["friction"]):
        assert ground.chosen_by == "annotation"
        assert ground.range.source == "stated by UsdPhysics in kitchen.usda"
    # Friction of a pair is the geometric mean of what the two surfaces were given.
    assert prepared.field.friction[0, 1] == pytest.approx(np.sqrt(0.35 * 0.45), rel=1e-6)
    assert ceramic.friction == pytest.approx(0.35)
    assert any("Blue Mug weighs 0.25 kg, as its file states" in w for w in _warnings(prepared))


def _warnings(prepared):
    return prepared.particles.warnings


@pytest.mark.slow
def test_what_no_such_material_has_is_believed_and_doubted(kitchen):
    scene = kitchen("5")
    prepared = co.prepare_scene(scene)
    assert prepared.field.materials[1].density == pytest.approx(5000)
    (told,) = (d for d in grounding_warnings(prepared.field, prepared.parts, scene) if "density" in d)
    assert "measured values are" in told and told.startswith("block: ")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("density", "mass", "said"),
    [
        ("99", "250", r"density 9.9e\+04 kg/m³ \(stated by UsdPhysics in kitchen.usda\)"),
        ("0.7", "9e9", r"Blue Mug: its file states 9e\+06 kg"),
    ],
)
def test_what_no_matter_has_is_one_sentence(tmp_path, density, mass, said):
    path = tmp_path / "kitchen.usda"
    text = KITCHEN.replace("DENSITY", density)
    path.write_text(text.replace("physics:mass = 250", f"physics:mass = {mass}"))
    with pytest.raises(co.UserError, match=said):
        co.prepare_scene(co.load_scene(path))


@pytest.mark.slow
def test_one_changed_density_is_another_mass(kitchen):
    masses = [
        np.bincount(p.object, p.mass)[1] for p in (co.prepare_scene(kitchen(d)).particles for d in ("0.6", "0.75"))
    ]
    assert masses[1] / masses[0] == pytest.approx(0.75 / 0.6, rel=1e-5)


@pytest.mark.slow
def test_the_whole_file_is_one_object_where_that_is_asked(kitchen, tmp_path):
    kitchen()
    config = co.AssembleConfig(objects="one")
    scene = co.load_scene(tmp_path / "kitchen.usda", config)
    assert len(scene.objects) == 1 and scene.objects[0].mass is None


SHAPES = {
    "Cube": ("double size = 2", 8.0, (2, 2, 2)),
    "Sphere": ("double radius = 1.5", 4 / 3 * np.pi * 1.5**3, (3, 3, 3)),
    "Cylinder": ('double radius = 0.5\ndouble height = 3\ntoken axis = "X"', 0.75 * np.pi, (3, 1, 1)),
    "Capsule": (
        'double radius = 0.5\ndouble height = 1\ntoken axis = "Y"',
        np.pi * 0.25 + 4 / 3 * np.pi * 0.125,
        (1, 2, 1),
    ),
    "Cone": ('double radius = 1\ndouble height = 3\ntoken axis = "Z"', np.pi, (2, 2, 3)),
}


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("kind", SHAPES)
def test_shapes_that_are_stated_by_numbers_have_their_volume(tmp_path, kind, mirrored):
    from corporeal.io.usd.usd_meshes import read_usd

    numbers, volume, size = SHAPES[kind]
    turn = 'double3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]'
    path = tmp_path / "shape.usda"
    path.write_text(
        f'#usda 1.0\n(\nmetersPerUnit = 1\nupAxis = "Z"\n)\ndef {kind} "thing" {{\n'
        f"{numbers}\n{turn if mirrored else ''}\n}}\n"
    )
    (surface,) = read_usd(path).surfaces
    a, b, c = np.swapaxes(surface.vertices[surface.triangles], 0, 1)
    held = np.einsum("ij,ij->", a, np.cross(b, c)) / 6  # outward: above 0
    assert held == pytest.approx(volume, rel=0.01)
    np.testing.assert_allclose(np.ptp(surface.vertices, axis=0), size, rtol=5e-3)
    if kind == "Cone":  # its tip points along its axis
        tip = surface.vertices[surface.vertices[:, 2].argmax()]
        np.testing.assert_allclose(tip, [0, 0, 1.5], atol=1e-12)


@pytest.mark.slow
def test_a_run_begins_with_what_is_stated(kitchen, tmp_path):
    """`corporeal run kitchen.usda`: through the verbs of a run's folder."""
    from corporeal.pipeline.run_pipeline import read_run

    kitchen()
    made = read_run(co.run([tmp_path / "kitchen.usda"], tmp_path / "runs", until="ground"))
    assert made.scene.objects[0].mass == pytest.approx(0.25)
    wood = made.field.materials[1]
    assert wood.grounds["density"].range.source == "stated by UsdPhysics in kitchen.usda"
    assert wood.density == pytest.approx(700)
