"""MJCF and URDF, read again by MuJoCo."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from export_helpers import asked_of, replaced, rigid, soft

import corporeal as co
from corporeal.export.check_exports import body_mass_error, check_target, drift_in_mujoco, urdf_in_mujoco
from corporeal.export.export_target import ExportConfig, ExportRequest, NothingToWriteError
from corporeal.export.mjcf_writer import TIME_STEP_S, write_mjcf
from corporeal.export.physical_scene import physical_scene
from corporeal.export.scene_motion import motion_of_scene
from corporeal.export.urdf_writer import write_urdf


def compiled(folder):
    return mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))


def before(scene, **settings):
    """What is asked of a scene before any simulation."""
    prepared = co.prepare_scene(scene)
    motion = motion_of_scene(prepared)
    return ExportRequest(physical_scene(prepared, motion), motion, ExportConfig(**settings))


def compare_bodies(model, asked):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for solid in rigid(asked):
        body = model.body(solid.name)
        assert body_mass_error(body, solid) < 1e-6
        np.testing.assert_allclose(data.xipos[body.id], solid.origin, atol=1e-9)
        turn = data.ximat[body.id].reshape(3, 3)
        inertia = turn @ np.diag(body.inertia) @ turn.T
        np.testing.assert_allclose(inertia, solid.inertia, atol=1e-6 * inertia.max())


def compare_pairs(model, asked):
    """Friction of every pair of shapes is that of the two materials."""
    of_geom = {"floor": -1}
    for solid in rigid(asked):
        of_geom |= {f"{solid.name}_piece_{k}": c.part for k, c in enumerate(solid.pieces)}
        of_geom[f"{solid.name}_hull"] = solid.hull.part
    for k in range(model.npair):
        a, b = (of_geom[model.geom(int(g[k])).name] for g in (model.pair_geom1, model.pair_geom2))
        assert model.pair_friction[k, 0] == pytest.approx(asked.scene.friction[a, b], rel=1e-9)


def test_bodies_have_the_mass_inertia_and_frame_that_were_simulated(written, asked):
    compare_bodies(compiled(written(write_mjcf)), asked)


def test_pairs_have_the_friction_of_their_materials(written, settled):
    model = compiled(written(write_mjcf, settled))
    assert model.npair >= 6  # three boxes with the floor, and with one another
    compare_pairs(model, settled)


def test_nothing_else_can_meet(written, settled):
    model = compiled(written(write_mjcf, settled))
    for geom in range(model.ngeom):
        assert model.geom_contype[geom] == 0


def test_what_was_settled_stays_where_it_is(written, settled):
    drift = drift_in_mujoco(compiled(written(write_mjcf, settled)), rigid(settled), 2.0)
    assert set(drift) == {"board", "block", "cube"}
    assert max(drift.values()) < 1e-4


def test_the_check_measures_the_drift(written, settled):
    found = check_target("mjcf", written(write_mjcf, settled), settled)
    assert found.measured["mass_and_inertia_off"] < 1e-6
    assert max(v for k, v in found.measured.items() if k.startswith("drift_m")) < 1e-4


def sliding(folder, angle, seconds=0.5):
    """How far the board goes on ground that is tilted by so much [m]."""
    model = compiled(folder)
    model.opt.gravity[:] = 9.81 * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    data = mujoco.MjData(model)
    while data.time < seconds:
        mujoco.mj_step(model, data)
    return float(data.body("board").xpos[0])


def test_a_board_slides_from_the_angle_of_its_friction_on(written):
    """Coulomb: it starts at tan α = μ, and goes ½ g (sin α - μ cos α) t² then."""
    scene = co.build_scene(co.box("wood", (0.3, 0.3, 0.05), (0, 0, 0.025), name="board"))
    asked = before(replace(scene, settled=True))
    folder = written(write_mjcf, asked)
    friction = float(asked.scene.friction[0, -1])
    assert sliding(folder, np.arctan(friction) - 0.05) < 1e-3
    angle, seconds = np.arctan(friction) + 0.15, 0.5
    wanted = 0.5 * 9.81 * (np.sin(angle) - friction * np.cos(angle)) * seconds**2
    assert sliding(folder, angle, seconds) == pytest.approx(wanted, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("restitution", [0.4, 0.6, 0.8, 0.9])
def test_a_ball_returns_the_share_of_its_speed_that_it_should(written, restitution):
    scene = co.build_scene(co.ball("steel", 0.03, (0, 0, 0.08)))
    asked = before(scene)
    table = np.full_like(asked.scene.restitution, restitution)
    asked = replace(asked, scene=replace(asked.scene, restitution=table))
    model = compiled(written(write_mjcf, asked))
    assert model.opt.timestep == TIME_STEP_S
    data = mujoco.MjData(model)
    down, up = 0.0, 0.0
    while data.time < 0.3:
        mujoco.mj_step(model, data)
        speed = float(data.qvel[2])
        down, up = min(down, speed), max(up, speed)
    assert up / -down == pytest.approx(restitution, abs=0.07)


def test_velocities_are_a_keyframe(written, asked):
    model = compiled(written(write_mjcf))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    (block,) = rigid(asked)
    np.testing.assert_allclose(data.body("block").cvel[3:], 0.0)  # before forward
    mujoco.mj_forward(model, data)
    joint = model.body("block").jntadr[0]
    speed = data.qvel[model.jnt_dofadr[joint] :][:6]
    np.testing.assert_allclose(speed[:3], block.velocity, rtol=1e-9)


def test_soft_objects_fall_and_stay_whole(written):
    """A rubber cube comes down at 2 m/s, and is held by the floor at its height."""
    cube = co.box("rubber", (0.05, 0.05, 0.05), (0, 0, 0.03), (0, 0, -2), name="cube")
    scene = co.build_scene(cube)
    asked = before(scene)
    (cube,) = soft(asked)
    model = compiled(written(write_mjcf, asked))
    assert model.nflex == 1
    assert model.body_mass.sum() == pytest.approx(cube.mass, rel=1e-6)
    data = mujoco.MjData(model)
    while data.time < 0.15:
        mujoco.mj_step(model, data)
    heights = data.flexvert_xpos[:, 2]
    assert np.isfinite(heights).all()
    assert -2e-3 < heights.min() < 3e-3
    assert np.ptp(heights) == pytest.approx(0.05, rel=0.2)


def test_soft_objects_are_left_out_where_asked(played, written):
    asked = asked_of(played, soft="none")
    assert compiled(written(write_mjcf, asked)).nflex == 0


def test_provenance_is_text_that_mujoco_keeps(written, asked):
    import json

    model = compiled(written(write_mjcf))
    for k, matter in enumerate(asked.scene.matter):
        row = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, f"corporeal part_{k}")
        start, size = model.text_adr[row], model.text_size[row]
        said = json.loads(bytes(model.text_data[start : start + size]).rstrip(b"\0").decode())
        young_pa = matter.material.grounds["young_pa"]
        assert said["values"]["young_pa"]["value"] == young_pa.value
        assert said["values"]["young_pa"]["range"] == [young_pa.range.low, young_pa.range.high]


@pytest.mark.parametrize(
    ("old", "new", "compare"),
    [
        ('mass="1', 'mass="2', compare_bodies),
        ('<body name="block" pos="', '<body name="block" pos="1', compare_bodies),
        ('friction="0.', 'friction="0.9', compare_pairs),
    ],
)
def test_one_changed_number_is_found(written, settled, old, new, compare):
    folder = written(write_mjcf, settled)
    text = (folder / "scene.xml").read_text()
    if old not in text:  # the mass begins with another digit
        at = text.index('<inertial pos="0 0 0" mass="') + len('<inertial pos="0 0 0" ')
        old, new = text[at : at + 8], text[at : at + 6] + "9" + text[at + 6 : at + 8]
    replaced(folder / "scene.xml", old, new)
    with pytest.raises(AssertionError):
        compare(compiled(folder), settled)


def test_urdf_bodies_have_mass_and_inertia(written, asked):
    folder = written(write_urdf)
    (block,) = rigid(asked)
    model = urdf_in_mujoco(folder / f"{block.name}.urdf")
    assert body_mass_error(model.body("body"), block) < 1e-6
    assert check_target("urdf", folder, asked).measured["mass_and_inertia_off"] < 1e-6


def test_one_changed_mass_of_a_urdf_is_found(written, asked):
    folder = written(write_urdf)
    replaced(folder / "block.urdf", '<mass value="', '<mass value="1')
    assert check_target("urdf", folder, asked).measured["mass_and_inertia_off"] > 0.1


def test_where_a_urdf_stands_is_beside_it(written, asked):
    import json

    folder = written(write_urdf)
    said = json.loads((folder / "placements.json").read_text())
    (block,) = rigid(asked)
    np.testing.assert_allclose(said["block"]["position_m"], block.origin)
    np.testing.assert_allclose(said["block"]["velocity_m_s"], block.velocity)


def test_where_nothing_is_rigid_no_urdf_can_be_written(tmp_path):
    asked = before(co.build_scene(co.ball("rubber", 0.05, (0, 0, 0.06), (0, 0, -3))))
    with pytest.raises(NothingToWriteError, match="rigid"):
        write_urdf(asked, tmp_path)
