"""What the Khronos glTF validator says of the files we write.

It runs where Node.js and the module are: npm install --prefix . --no-save gltf-validator
"""

import json
import shutil
import subprocess
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_glb_merge import HERE, UPRIGHT, dressed, pictures, skinned

from corporeal.io.gltf.glb_merge import MergeMember, merge_glb_files
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.io.gltf.gltf_reader import read_glb
from corporeal.showcase.showcase_scenes import build_showcase_scene

ROOT = Path(__file__).parents[2]
SCRIPT = """
const {validateBytes} = require('gltf-validator');
const {readFileSync} = require('fs');
const {dirname, join} = require('path');
(async () => {
  const found = [];
  for (const file of process.argv.slice(1)) {
    const beside = uri => Promise.resolve(new Uint8Array(readFileSync(join(dirname(file), uri))));
    const options = {maxIssues: 0, externalResourceFunction: beside};
    const report = await validateBytes(new Uint8Array(readFileSync(file)), options);
    found.push(report.issues.messages.filter(m => m.severity < 2).map(m => [m.severity, m.code]));
  }
  console.log(JSON.stringify(found));
})();
"""


def node(*arguments):
    return subprocess.run(["node", *map(str, arguments)], cwd=ROOT, capture_output=True, text=True, timeout=300)


@pytest.fixture(scope="module")
def judge():
    """For each file, how often the validator finds each kind of error, and of warning."""
    if shutil.which("node") is None:
        pytest.skip("the glTF validator needs Node.js, which is not here")
    if node("-e", "require('gltf-validator')").returncode:
        pytest.skip("no gltf-validator: npm install --prefix . --no-save gltf-validator")

    def judged(*files):
        run = node("-e", SCRIPT, *files)
        assert run.returncode == 0, run.stderr
        return [Counter((severity, code) for severity, code in x) for x in json.loads(run.stdout)]

    return judged


def errors(found):
    return {code: n for (severity, code), n in found.items() if severity == 0}


def with_bounds(made):
    for mesh in made.json["meshes"]:
        position = mesh["primitives"][0]["attributes"]["POSITION"]
        made.json["accessors"][position] |= {"min": [0, 0, 0], "max": [1, 1, 1]}
    return made


def test_merged_files_are_valid(judge, tmp_path):
    made = with_bounds(dressed()), with_bounds(skinned())
    files = [m.save(tmp_path / f"{k}.glb") for k, m in enumerate(made)]
    members = [MergeMember(f, f"m_{k}", HERE, UPRIGHT, 2.0, {}) for k, f in enumerate(files * 2)]
    path = tmp_path / "scene.glb"
    merge_glb_files(path, members, "scene", {"gravity_m_s2": [0, 0, -9.81]})
    (found,) = judge(path)
    # Below its object, a skinned mesh is no root; its place is its skeleton's all the same.
    assert set(found) <= {(1, "NODE_SKINNED_MESH_NON_ROOT"), (1, "NODE_SKINNED_MESH_LOCAL_TRANSFORMS")}


def test_the_validator_is_asked(judge, tmp_path):
    made = with_bounds(dressed())
    made.json["accessors"][0]["count"] = 1000
    (found,) = judge(made.save(tmp_path / "a.glb"))
    assert errors(found)


@pytest.mark.slow
def test_the_showcase_is_valid(judge, tmp_path):
    write_glb(tmp_path / "scene.glb", build_showcase_scene("duck-on-mud"))
    (found,) = judge(tmp_path / "scene.glb")
    assert not found


# ---------------------------------------------------------------- real models


def groups(shared_assets, size=4):
    files = [f for room in ("objects", "ycb") for f in (shared_assets / room).glob("*.glb")]
    files.sort()
    return [files[k : k + size] for k in range(0, len(files), size)]


def scattered(files):
    random = np.random.default_rng(5)
    places = random.uniform(-1, 1, (len(files), 3)).tolist()
    turns = random.normal(size=(len(files), 4)).tolist()
    return [
        MergeMember(file, f"thing_{k}", tuple(place), tuple(turn), 0.5 + k, {"class": "thing"})
        for k, (file, place, turn) in enumerate(zip(files, places, turns, strict=True))
    ]


def placed(vertices, m):
    w, x, y, z = m.quaternion
    return m.scale * vertices @ Rotation.from_quat([x, y, z, w]).as_matrix().T + m.position


@pytest.mark.slow
def test_real_models_keep_their_shapes_and_looks(shared_assets, tmp_path):
    checked = 0
    for files in groups(shared_assets):
        members = scattered(files)
        path = tmp_path / "scene.glb"
        merge_glb_files(path, members, "scene", {})
        after = read_glb(path)
        assert set(pictures(path)) <= {s for f in files for s in pictures(f)}
        for k, m in enumerate(members):
            before = read_glb(m.file, "one")
            mine = [s for s in after.surfaces if s.object == k]
            for a, b in zip(mine, before.surfaces, strict=True):
                # By corners: normals that are made split vertices, in either pose a few others.
                was = placed(b.vertices, m)[b.triangles]
                assert np.abs(a.vertices[a.triangles] - was).max() <= 1e-6
                assert (a.uv is None) == (b.uv is None)
                if a.uv is not None and b.uv is not None:
                    np.testing.assert_array_equal(a.uv[a.triangles], b.uv[b.triangles])
                worn, old = after.finishes[a.finish], before.finishes[b.finish]
                np.testing.assert_array_equal(worn.texture, old.texture)
                same = ("colour", "alpha_mode", "roughness", "metallic", "transmission", "emission")
                assert [getattr(worn, x) for x in same] == [getattr(old, x) for x in same]
                assert a.name == b.name
                checked += 1
    assert checked >= 53


@pytest.mark.slow
def test_real_models_merge_without_new_errors(judge, shared_assets, tmp_path):
    paths = []
    for size in (2, 4):
        for k, files in enumerate(groups(shared_assets, size)):
            paths.append(tmp_path / f"{size}-{k}.glb")
            merge_glb_files(paths[-1], scattered(files), "scene", {})
    inputs = [f for files in groups(shared_assets) for f in files]
    known = {kind for found in judge(*inputs) for kind in found}
    for path, found in zip(paths, judge(*paths), strict=True):
        assert not errors(found), path
        assert set(found) <= known, path
