"""USD, read again by OpenUSD's own library."""

import numpy as np
import pytest
from export_helpers import asked_of, replaced, rigid, soft, turned

from corporeal.core.types import Law
from corporeal.export.check_exports import check_target
from corporeal.export.usd_writer import write_usd

pxr = pytest.importorskip("pxr", reason="usd-core reads USD: pip install 'corporeal[export]'")
from pxr import Usd, UsdGeom, UsdPhysics, UsdShade  # noqa: E402


@pytest.fixture
def usd(written):
    return written(write_usd)


def opened(folder, name="sim.usda"):
    return Usd.Stage.Open(str(folder / name))


def attribute(stage, path, name):
    found = stage.GetPrimAtPath(path).GetAttribute(name)
    assert found, f"{path} has no {name}"
    return found.Get()


def compare_bodies(stage, asked):
    """Every rigid body's mass, inertia, frame and velocity."""
    for solid in rigid(asked):
        prim = stage.GetPrimAtPath(f"/World/{solid.name}")
        mass = UsdPhysics.MassAPI(prim)
        assert mass.GetMassAttr().Get() == pytest.approx(solid.mass, rel=1e-6)
        assert tuple(mass.GetCenterOfMassAttr().Get()) == (0, 0, 0)
        q = mass.GetPrincipalAxesAttr().Get()
        axes = turned([q.GetReal(), *q.GetImaginary()], np.eye(3)).T
        inertia = axes @ np.diag(mass.GetDiagonalInertiaAttr().Get()) @ axes.T
        np.testing.assert_allclose(inertia, solid.inertia, atol=1e-6 * inertia.max())
        place = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0).ExtractTranslation()
        np.testing.assert_allclose(place, solid.origin, rtol=0, atol=1e-9)
        body = UsdPhysics.RigidBodyAPI(prim)
        np.testing.assert_allclose(body.GetVelocityAttr().Get(), solid.velocity, rtol=1e-6)


def compare_friction(stage, asked):
    """Products of the surfaces' frictions are those of the pairs, as far as is said."""
    pairs = asked.scene.friction
    said = stage.GetPrimAtPath("/World/Physics").GetCustomDataByKey("corporeal")
    names = [*(f"part_{k}" for k in range(len(asked.scene.matter))), "floor"]
    own = [attribute(stage, f"/World/Matter/{n}", "physics:dynamicFriction") for n in names]
    solid = [m.object for m in asked.scene.matter] + [-1]
    for i in range(len(own)):
        for j in range(i):
            if solid[i] != solid[j]:
                assert abs(own[i] * own[j] - pairs[i, j]) <= said["largest_error"] + 1e-6


def test_openusd_finds_nothing_to_complain_of(usd, asked):
    found = check_target("usd", usd, asked)
    assert found.doubts == ()
    assert found.measured["findings"] == 0
    assert found.measured["mass_and_inertia_off"] < 1e-6


def test_a_finding_is_reported(usd, asked):
    replaced(usd / "physics.usda", "physics:mass = ", "physics:mass = -")
    replaced(usd / "sim.usda", "metersPerUnit = 1", "")
    found = check_target("usd", usd, asked)
    assert found.measured["findings"] > 0 or found.measured["mass_and_inertia_off"] > 1


def test_bodies_have_the_mass_inertia_and_frame_that_were_simulated(usd, asked):
    compare_bodies(opened(usd), asked)


def test_frictions_of_surfaces_multiply_to_those_of_pairs(usd, asked):
    compare_friction(opened(usd), asked)


def test_the_scene_says_its_units_and_gravity(usd):
    stage = opened(usd)
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert UsdPhysics.GetStageKilogramsPerUnit(stage) == 1
    assert attribute(stage, "/World/Physics", "physics:gravityMagnitude") == pytest.approx(9.81)
    assert tuple(attribute(stage, "/World/Physics", "physics:gravityDirection")) == (0, 0, -1)


def test_names_in_any_alphabet_are_shown(usd, asked):
    stage = opened(usd)
    for solid in asked.scene.solids:
        assert stage.GetPrimAtPath(f"/World/{solid.name}").GetDisplayName() == solid.title


def test_soft_matter_keeps_mass_modulus_and_parts(usd, asked):
    stage = opened(usd)
    for solid in soft(asked):
        path = f"/World/{solid.name}/particles"
        masses = np.array(attribute(stage, path, "physics:masses"))
        assert masses.sum() == pytest.approx(solid.mass, rel=1e-6)
        for part in solid.parts:
            treatment = asked.scene.matter[part].treatment
            material = f"/World/Matter/part_{part}"
            for dialect in ("physics", "omniphysics", "newton:mpm"):
                young_pa = attribute(stage, material, f"{dialect}:youngsModulus")
                assert young_pa == pytest.approx(treatment.simulated_young_pa, rel=1e-6)
            subset = UsdGeom.Subset(stage.GetPrimAtPath(f"{path}/part_{part}"))
            chosen = np.array(subset.GetIndicesAttr().Get())
            np.testing.assert_array_equal(chosen, np.flatnonzero(solid.grains.part == part))
            bound = UsdShade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial("physics")
            assert str(bound[0].GetPath()) == material


def test_grains_yield_on_the_cone_of_ours(usd, asked):
    """√J₂ = sin φ (p + c / tan φ) at three pressures."""
    stage = opened(usd)
    (k,) = (k for k, m in enumerate(asked.scene.matter) if m.material.law is Law.DRUCKER_PRAGER)
    material = asked.scene.matter[k].material
    path = f"/World/Matter/part_{k}"
    names = ("yieldStress", "internalFriction", "tensileYieldRatio", "yieldPressure")
    stress, slope, tip, limit = (attribute(stage, path, f"newton:mpm:{n}") for n in names)
    cohesion, angle = material.cohesion or 0.0, material.friction_angle
    for pressure in (0.0, 1e3, 1e5):
        ours = np.sin(angle) * (pressure + cohesion / np.tan(angle))
        assert stress + slope * (pressure + tip * limit) == pytest.approx(ours, rel=1e-5, abs=1e-2)


def test_tetrahedra_are_right_handed_and_closed(usd, asked):
    stage = opened(usd)
    for solid in soft(asked):
        prim = stage.GetPrimAtPath(f"/World/{solid.name}")
        prim.GetVariantSet("simulated").SetVariantSelection("tetrahedra")
        mesh = UsdGeom.TetMesh(stage.GetPrimAtPath(f"/World/{solid.name}/tetrahedra"))
        assert not UsdGeom.TetMesh.FindInvertedElements(mesh)
        ours = np.sort(np.array(mesh.GetSurfaceFaceVertexIndicesAttr().Get()), axis=1)
        theirs = np.sort(np.array(UsdGeom.TetMesh.ComputeSurfaceFaces(mesh)), axis=1)
        assert set(map(tuple, ours.tolist())) == set(map(tuple, theirs.tolist()))


def test_one_of_two_ways_to_simulate_lives(usd, asked):
    for way, other in (("particles", "tetrahedra"), ("tetrahedra", "particles")):
        stage = opened(usd)
        for solid in soft(asked):
            prim = stage.GetPrimAtPath(f"/World/{solid.name}")
            prim.GetVariantSet("simulated").SetVariantSelection(way)
            assert stage.GetPrimAtPath(f"/World/{solid.name}/{way}").IsActive()
            assert not stage.GetPrimAtPath(f"/World/{solid.name}/{other}").IsActive()


def test_the_video_moves_as_the_run_did(usd, asked):
    stage = opened(usd, "video.usda")
    assert stage.GetTimeCodesPerSecond() == asked.scene.fps
    assert stage.GetEndTimeCode() == len(asked.motion.time) - 1
    shapes = asked.motion.shapes(asked.scene.solids)
    for solid in asked.scene.solids:
        for number in solid.surface_numbers:
            mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"/World/{solid.name}/surface_{number}"))
            for frame in (0, 2, 4):
                points = np.array(mesh.GetPointsAttr().Get(frame), dtype=float)
                world = np.array(UsdGeom.Xformable(mesh).ComputeLocalToWorldTransform(frame))
                there = points @ world[:3, :3] + world[3, :3]
                np.testing.assert_allclose(there, shapes.of(number)[0][frame], atol=1e-6)


def test_no_stage_has_both_physics_and_motion(usd):
    video, sim = opened(usd, "video.usda"), opened(usd)
    assert not any(p.HasAPI(UsdPhysics.RigidBodyAPI) for p in video.Traverse())
    for prim in sim.Traverse():
        assert not any(a.GetNumTimeSamples() for a in prim.GetAttributes())


def test_every_value_says_its_range_and_source(usd, asked):
    stage = opened(usd)
    for k, matter in enumerate(asked.scene.matter):
        said = stage.GetPrimAtPath(f"/World/Matter/part_{k}").GetCustomDataByKey("corporeal")
        for name, ground in matter.material.grounds.items():
            told = said["values"][name]
            assert told["value"] == ground.value
            assert tuple(told["range"]) == (ground.range.low, ground.range.high)
            assert told["chosen_by"] == ground.chosen_by
            assert told["source"] and told["reason"] == ground.reason
        assert said["simulated"]["simulated_young_pa"] == matter.treatment.simulated_young_pa


@pytest.mark.parametrize(
    ("old", "compare"),
    [
        ("physics:mass = ", compare_bodies),
        ("physics:diagonalInertia = (", compare_bodies),
        ("physics:dynamicFriction = ", compare_friction),
    ],
)
def test_one_changed_number_of_physics_is_found(usd, asked, old, compare):
    replaced(usd / "physics.usda", old, f"{old}9")
    with pytest.raises(AssertionError):
        compare(opened(usd), asked)


def test_one_changed_frame_is_found(usd, asked):
    (block,) = rigid(asked)
    text = (usd / "geometry.usda").read_text(encoding="utf-8")
    at = text.index(f'"{block.name}"')
    old = text[at:].split("xformOp:translate = ")[1].split(")")[0]
    replaced(usd / "geometry.usda", f"xformOp:translate = {old}", "xformOp:translate = (0, 0, 0.2")
    with pytest.raises(AssertionError):
        compare_bodies(opened(usd), asked)


def test_what_cannot_be_simulated_is_left_out_where_asked(played, written):
    of = asked_of(played, soft="none")
    folder = written(write_usd, of)
    stage = opened(folder)
    for solid in soft(of):
        assert not stage.GetPrimAtPath(f"/World/{solid.name}/particles")
        assert stage.GetPrimAtPath(f"/World/{solid.name}/surface_{solid.surface_numbers[0]}")


def test_a_wall_stands_where_it_did(settled, tmp_path):
    from dataclasses import replace

    from corporeal.core.types import Wall

    walls = (Wall((-1.0, 0.0, 0.0), (1.5, 0.0, 0.0)), Wall((0.0, 0.0, -1.0), (0.0, 0.0, 3.0)))
    of = replace(settled, scene=replace(settled.scene, walls=walls))
    write_usd(of, tmp_path)
    stage = opened(tmp_path)
    for k, wall in enumerate(walls):
        prim = UsdGeom.Xformable(stage.GetPrimAtPath(f"/World/wall_{k}"))
        world = np.array(prim.ComputeLocalToWorldTransform(0))
        np.testing.assert_allclose(np.array([0, 0, 1]) @ world[:3, :3], wall.normal, atol=1e-7)
        np.testing.assert_allclose(world[3, :3], wall.point)


def test_colliders_have_few_corners_where_asked(settled, tmp_path):
    from dataclasses import replace

    import corporeal as co
    from corporeal.export.export_target import ExportConfig, ExportRequest
    from corporeal.export.physical_scene import physical_scene
    from corporeal.export.scene_motion import motion_of_scene

    prepared = co.prepare_scene(co.build_scene(co.ball("steel", 0.03, (0, 0, 0.03))))
    motion = motion_of_scene(prepared)
    of = ExportRequest(physical_scene(prepared, motion), motion, ExportConfig())
    corners = {}
    for most in (0, 64):
        folder = tmp_path / f"{most}"
        folder.mkdir()
        config = ExportConfig(hull_vertices=most)
        written = write_usd(replace(of, config=config), folder)
        stage = opened(folder)
        hull = UsdGeom.Mesh(stage.GetPrimAtPath("/World/ball/colliders/hull"))
        points = np.array(hull.GetPointsAttr().Get())
        corners[most] = len(points)
        assert points[:, 2].min() == pytest.approx(-0.03, abs=1e-3)
        assert any("--hull-vertices 64" in s for s in written.unsaid) is (most == 0)
    assert corners[0] > 64 >= corners[64]
    # 64 corners have 34 faces: each touches the ball in the middle of a 34th of it, 0.35 rad wide,
    # and three meet in a corner at some 0.5 rad from there, 1 / cos 0.5 = 1.14 radii out.
    assert 0.05 * 0.03 < written.measured["hull_thickened_m"] < 0.15 * 0.03
    with pytest.raises(co.UserError, match="--hull-vertices is 5"):
        write_usd(replace(of, config=ExportConfig(hull_vertices=5)), tmp_path)
