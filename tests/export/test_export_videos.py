"""Videos as GLB, Alembic and splats, read again and posed at several instants."""

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from export_helpers import asked_of, rigid

import corporeal as co
from corporeal.core.types import FeatureCloud, Gaussians, Reconstruction
from corporeal.export.animated_glb_reader import read_animated_glb
from corporeal.export.animated_glb_writer import write_animated_glb
from corporeal.export.check_exports import check_target
from corporeal.export.export_target import NothingToWriteError
from corporeal.export.usd_splats import write_splat_sequence
from corporeal.io.gltf.gltf_container import pack_glb, split_glb
from corporeal.io.splat.load_splat import load_splat
from corporeal.simulation.simulation_result import SimulationResult

ROOT = Path(__file__).parents[2]
EMPTY = np.zeros((0, 3))
NOBODY = FeatureCloud(EMPTY, EMPTY, EMPTY, EMPTY, np.zeros(0, dtype=np.int64))


def opened(path):
    data = memoryview(path.read_bytes())
    text, binary = split_glb(path, data)
    return json.loads(bytes(text)), bytes(binary)


def node_of(solid, document):
    """The node of an object; its surfaces may have the same name."""
    (node,) = (n for n in document["nodes"] if n["name"] == solid.title and "children" in n)
    return node


def test_every_vertex_is_where_it_was_within_the_tolerance(written, asked):
    found = check_target("glb", written(write_animated_glb), asked)
    # Quantisation adds a sixteen-thousandth of the size of a surface.
    assert found.measured["vertex_off_m"] < asked.config.tolerance + 1e-4


def test_a_finer_tolerance_is_kept_with_more_modes(played, written, tmp_path):
    errors, modes = [], []
    for tolerance in (5e-3, 5e-4):
        asked = asked_of(played, tolerance=tolerance)
        folder = tmp_path / f"{tolerance}"
        folder.mkdir()
        said = write_animated_glb(asked, folder)
        errors.append(check_target("glb", folder, asked).measured["vertex_off_m"])
        modes.append(said.measured["modes"])
        assert said.measured["vertex_error_m"] <= tolerance
    assert errors[1] < errors[0] and modes[1] > modes[0]
    assert errors[1] < 6e-4


def test_a_changed_frame_is_found(written, asked):
    folder = written(write_animated_glb)
    document, binary = opened(folder / "video.glb")
    (block,) = rigid(asked)
    node = document["nodes"].index(node_of(block, document))
    (channel,) = (
        c for c in document["animations"][0]["channels"] if c["target"] == {"node": node, "path": "translation"}
    )
    sampler = document["animations"][0]["samplers"][channel["sampler"]]
    accessor = document["accessors"][sampler["output"]]
    start = document["bufferViews"][accessor["bufferView"]]["byteOffset"]
    data = bytearray(binary)
    keys = np.frombuffer(data, "<f4", accessor["count"] * 3, start).reshape(-1, 3).copy()
    keys[-1, 0] += 0.01
    data[start : start + keys.nbytes] = keys.tobytes()
    (folder / "video.glb").write_bytes(pack_glb(document, bytes(data)))
    assert check_target("glb", folder, asked).measured["vertex_off_m"] > 5e-3


def test_times_begin_at_zero_and_nodes_say_what_they_are_made_of(written, asked):
    document, _ = opened(written(write_animated_glb) / "video.glb")
    times = document["accessors"][document["animations"][0]["samplers"][0]["input"]]
    assert times["min"] == [0.0] and times["max"] == pytest.approx([0.1])
    for solid in asked.scene.solids:
        node = node_of(solid, document)
        assert node["extras"]["mass_kg"] == pytest.approx(solid.mass)
        told = node["extras"]["parts"][0]["values"]["density"]
        ground = asked.scene.matter[solid.heaviest].material.grounds["density"]
        assert told["value"] == ground.value and told["source"]


def test_weights_of_targets_need_no_clipping(written):
    video = read_animated_glb(written(write_animated_glb) / "video.glb")
    weights = [v for (_, path), v in video.tracks.items() if path == "weights"]
    assert weights
    assert all(w.min() >= 0 and w.max() <= 1 for w in weights)


def test_a_scene_before_any_simulation_is_a_still(written, settled):
    document, _ = opened(written(write_animated_glb, settled) / "video.glb")
    assert "animations" not in document


def test_a_tolerance_of_nothing_is_refused(played, tmp_path):
    with pytest.raises(co.UserError, match="--tolerance is 0 m"):
        write_animated_glb(asked_of(played, tolerance=0.0), tmp_path)


def test_the_khronos_validator_finds_nothing(written, asked):
    if shutil.which("node") is None:
        pytest.skip("the glTF validator needs Node.js, which is not here")
    asks = "require('gltf-validator')"
    if subprocess.run(["node", "-e", asks], cwd=ROOT, capture_output=True).returncode:
        pytest.skip("no gltf-validator: npm install --prefix . --no-save gltf-validator")
    script = (
        f"{asks}.validateBytes(new Uint8Array(require('fs').readFileSync(process.argv[1])))"
        ".then(r => console.log(r.issues.numErrors, r.issues.numWarnings))"
    )
    path = written(write_animated_glb) / "video.glb"
    said = subprocess.run(["node", "-e", script, str(path)], cwd=ROOT, capture_output=True)
    assert said.stdout.split() == [b"0", b"0"], said.stderr


# ---------------------------------------------------------------- Alembic


def test_alembic_holds_every_shape(written, asked):
    pytest.importorskip("alembic3d", reason="pip install 'corporeal[export]'")
    from alembic3d import Abc, AbcGeom

    from corporeal.export.alembic_writer import write_alembic

    folder = written(write_alembic)
    assert check_target("abc", folder, asked).measured["vertex_off_m"] < 1e-6
    top = Abc.IArchive(str(folder / "video.abc")).getTop()
    for solid in asked.scene.solids:
        node = AbcGeom.IXform(top, solid.name)
        said = Abc.IStringProperty(node.getSchema().getUserProperties(), "corporeal").getValue()
        assert json.loads(said)["title"] == solid.title
        schema = AbcGeom.IPolyMesh(node, f"surface_{solid.surface_numbers[0]}").getSchema()
        assert schema.getNumSamples() == len(asked.motion.time)
        clock = schema.getTimeSampling()
        assert clock.getSampleTime(2) == pytest.approx(asked.motion.time[2])


def test_alembic_faces_turn_clockwise_seen_from_outside(written, asked):
    pytest.importorskip("alembic3d", reason="pip install 'corporeal[export]'")
    from alembic3d import Abc, AbcGeom

    from corporeal.export.alembic_writer import write_alembic

    top = Abc.IArchive(str(written(write_alembic) / "video.abc")).getTop()
    (block,) = rigid(asked)
    schema = AbcGeom.IPolyMesh(AbcGeom.IXform(top, block.name), f"surface_{block.surface_numbers[0]}").getSchema()
    sample = schema.getValue(Abc.ISampleSelector(0))
    points = np.array(sample.getPositions())
    faces = np.array(list(sample.getFaceIndices())).reshape(-1, 3)
    a, b, c = np.swapaxes(points[faces] - points.mean(axis=0), 0, 1)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) < 0


# ---------------------------------------------------------------- splats


def gaussians_on(played):
    """A Gaussian at every vertex of the scene, and one of no object."""
    scene = played.prepared.scene
    mean = np.concatenate([*(s.vertices for s in scene.surfaces), [[1.0, 1.0, 1.0]]])
    owner = [np.full(len(s.vertices), s.object) for s in scene.surfaces]
    count = len(mean)
    found = Gaussians(
        mean=mean.astype(np.float32),
        rotation=np.tile(np.float32([1, 0, 0, 0]), (count, 1)),
        scale=np.full((count, 3), 2e-3, np.float32),
        opacity=np.full(count, 0.9, np.float32),
        sh=np.full((count, 1, 3), 0.5, np.float32),
    )
    boxes = np.zeros((len(scene.objects), 2, 3))
    return Reconstruction(
        gaussians=found,
        object_of_gaussian=np.concatenate([*owner, [-1]]),
        cloud=NOBODY,
        object_of_point=np.zeros(0, dtype=np.int64),
        names=tuple(o.name for o in scene.objects),
        boxes=boxes,
        metres_per_unit=1.0,
        world_from_file=np.eye(4),
    )


def test_gaussians_go_where_the_surfaces_go(played, asked, written):
    found = gaussians_on(played)
    made = SimulationResult(played.prepared, played.trajectory, found)
    folder = written(write_splat_sequence, replace(asked, played=made))
    files = sorted(folder.glob("frame_*.ply"))
    assert len(files) == len(asked.motion.time)
    last = load_splat(files[-1])
    moved = np.concatenate(_surfaces(asked))
    np.testing.assert_allclose(last.mean[:-1], moved, atol=2e-3)
    np.testing.assert_allclose(last.mean[-1], 1.0)
    said = json.loads((folder / "video.json").read_text())
    assert said["fps"] == asked.scene.fps and said["parts"]
    assert check_target("splats", folder, asked).measured == {"frames_missing": 0.0, "counts": 1.0}


def test_usd_has_the_gaussians_of_every_object_at_every_frame(played, asked, written):
    pytest.importorskip("pxr", reason="pip install 'corporeal[export]'")
    from pxr import Usd, UsdValidation

    found = gaussians_on(played)
    rng = np.random.default_rng(0)  # looks that differ from side to side turn with their object
    sh = rng.normal(0, 0.3, (found.gaussians.count, 4, 3)).astype(np.float32)
    found = replace(found, gaussians=replace(found.gaussians, sh=sh))
    of = replace(asked, played=SimulationResult(played.prepared, played.trajectory, found))
    folder = written(write_splat_sequence, of)
    stage = Usd.Stage.Open(str(folder / "splats.usda"))
    registry = UsdValidation.ValidationRegistry()
    validators = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    assert [e.GetErrorAsString() for e in validators.Validate(stage)] == []
    assert stage.GetTimeCodesPerSecond() == asked.scene.fps
    for frame in (0, 2, 4):
        wanted = load_splat(folder / f"frame_{frame:04d}.ply")
        for solid in asked.scene.solids:
            prim = stage.GetPrimAtPath(f"/World/{solid.name}/splats")
            own = found.object_of_gaussian == solid.number

            def value(name, prim=prim, frame=frame):
                return np.array(prim.GetAttribute(name).Get(frame))

            np.testing.assert_allclose(value("positions"), wanted.mean[own], atol=2e-6)
            np.testing.assert_allclose(value("scales"), wanted.scale[own], rtol=1e-4)
            np.testing.assert_allclose(value("opacities"), wanted.opacity[own], rtol=1e-4)
            colours = value("radiance:sphericalHarmonicsCoefficients").reshape(-1, 4, 3)
            np.testing.assert_allclose(colours, wanted.sh[own], rtol=6e-6)  # six digits
            turns = prim.GetAttribute("orientations").Get(frame)
            ours = [[q.GetReal(), *q.GetImaginary()] for q in turns]
            same = np.abs(np.sum(np.array(ours) * wanted.rotation[own], axis=1))
            np.testing.assert_allclose(same, 1.0, atol=1e-5)
    still = stage.GetPrimAtPath("/World/background").GetAttribute("positions")
    assert still.GetNumTimeSamples() == 0 and len(still.Get()) == 1
    said = stage.GetPrimAtPath(f"/World/{asked.scene.solids[0].name}").GetCustomDataByKey("corporeal")
    assert said["parts"]["0"]["values"]["young_pa"]["source"]


def _surfaces(asked):
    shapes = asked.motion.shapes(asked.scene.solids)
    numbers = sorted(n for s in asked.scene.solids for n in s.surface_numbers)
    return [shapes.of(n)[0][-1] for n in numbers]


def test_a_scene_of_surfaces_has_no_gaussians(asked, tmp_path):
    with pytest.raises(NothingToWriteError, match="no Gaussians"):
        write_splat_sequence(asked, tmp_path)
