"""A scene is composed from a pool: drawn, sized, settled, begun, and written down."""

import json
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.discretization.object_scaling import SceneSizing
from corporeal.geometry.scene_transforms import object_boxes, overlapping_objects
from corporeal.io.gltf.gltf_reader import read_glb
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.compose import ComposeConfig, compose
from corporeal.pool.asset_pool import AssetPool, PoolAsset
from corporeal.scene.interactions import INTERACTION_KINDS, MIN_OBJECTS_OF_KIND
from glb_maker import CUBE, CUBE_TRIANGLES, Maker

CLASSES = {"box": (1, 1, 1), "plank": (4, 0.5, 1), "brick": (2, 1, 1), "tower": (1, 3, 1)}
"""Sides of the boxes that stand in for models, in units of their files (Y up)."""


@pytest.fixture(scope="module")
def pool(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pool")
    assets = []
    for name, sides in CLASSES.items():
        maker = Maker()
        maker.node(mesh=maker.mesh(CUBE * np.array(sides, np.float32), CUBE_TRIANGLES))
        path = maker.save(folder / f"{name}.glb")
        assets.append(
            PoolAsset(
                name=f"{name}_a",
                class_name=name,
                file=path,
                source=f"{name}.glb",
                sha256="0" * 64,
                licence="CC-BY-4.0",
                attribution=f"{name} by somebody",
                extent=float(max(sides)),
                metric=name != "plank",
                triangles=12,
                open_edges=0.0,
                texture=0,
            )
        )
    return AssetPool(folder, tuple(assets))


def composed(pool, folder, **said):
    return compose(pool, folder, replace(ComposeConfig(count="3"), **said))


@pytest.mark.parametrize("kind", INTERACTION_KINDS)
def test_every_interaction_begins_from_a_certified_rest_and_free_of_overlap(pool, tmp_path, kind):
    made = composed(pool, tmp_path, interaction=kind)
    certificate = json.loads((tmp_path / "certificate.json").read_text())
    assert certificate["drift_m"] < 1e-3 * certificate["extent_m"]
    assert certificate["objects"] == len(made.names) >= MIN_OBJECTS_OF_KIND[kind]
    assert made.action.kind == kind
    rest, start = read_glb(tmp_path / "scene.glb"), assemble([tmp_path / "scene.toml"])
    assert rest.settled and start.settled
    assert [o.name for o in start.objects] == list(made.names)
    assert not overlapping_objects(start) and not start.warnings
    still = np.abs(object_boxes(start) - object_boxes(rest)).max(axis=(1, 2)) < 1e-5
    acting = [o.velocity != (0, 0, 0) or o.wind is not None for o in start.objects]
    assert any(~still | np.array(acting))


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_in_another_process(pool, tmp_path):
    code = (
        "import pickle, sys; from pathlib import Path;"
        "from corporeal.pipeline.stages.compose import ComposeConfig, compose;"
        "pool = pickle.load(open(sys.argv[1], 'rb'));"
        "compose(pool, Path(sys.argv[2]), ComposeConfig(count='3', seed=5))"
    )
    (tmp_path / "pool").write_bytes(pickle.dumps(pool))
    subprocess.run([sys.executable, "-c", code, tmp_path / "pool", tmp_path / "there"], check=True)
    composed(pool, tmp_path / "here", seed=5)
    for name in ("scene.glb", "scene.toml", "composition.json"):
        assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()


def test_sizes_are_compressed_and_the_real_ones_are_kept(pool, tmp_path):
    made = composed(pool, tmp_path, assets=("tower_a", "box_a"), arrangement="row")
    scene = read_glb(tmp_path / "scene.glb")
    tower, box = scene.objects
    assert (tower.real_extent, box.real_extent) == (3, 1)
    assert tower.scale * 3 == pytest.approx(0.5, rel=1e-6)
    assert box.scale == pytest.approx(0.5 / 3**0.35, rel=1e-6)
    assert tower.credit == "CC-BY-4.0; tower by somebody"
    assert made.names == ("tower_0", "box_0")


def test_metric_scenes_keep_true_metres(pool, tmp_path):
    composed(pool, tmp_path, assets=("tower_a", "box_a"), sizing=SceneSizing(metric=True))
    scene = read_glb(tmp_path / "scene.glb")
    assert [o.scale for o in scene.objects] == pytest.approx([1, 1], abs=1e-9)
    corners = scene.surfaces[0].vertices
    diagonal = np.linalg.norm(corners[:, None] - corners, axis=2).max()
    assert diagonal == pytest.approx(np.sqrt(11), rel=1e-5)


def test_an_object_of_unknown_size_is_reported_of(pool, tmp_path):
    made = composed(pool, tmp_path, assets=("plank_a",))
    assert any("plank" in w for w in made.warnings)
    said = json.loads((tmp_path / "composition.json").read_text())
    assert said["objects"][0]["said_by"] == "default"


def test_what_a_scene_is_made_of_is_written_down(pool, tmp_path):
    made = composed(pool, tmp_path, seed=2, interaction="none")
    said = json.loads((tmp_path / "composition.json").read_text())
    assert [o["name"] for o in said["objects"]] == list(made.names)
    assert said["interaction"] == "none" and {o["licence"] for o in said["objects"]} == {"CC-BY-4.0"}
    assert not any(o.wind or any(o.velocity) for o in assemble([tmp_path / "scene.toml"]).objects)


@pytest.mark.parametrize(
    ("said", "error", "words"),
    [
        ({"classes": ("duck",)}, UnknownChoiceError, "Choose one of: box, brick, plank, tower"),
        ({"assets": ("duck",)}, UnknownChoiceError, "box_a"),
        ({"classes": ("box",)}, UserError, "--repeat"),
        ({"count": "two"}, UserError, "1-4"),
        ({"count": "4-2"}, UserError, "smaller first"),
    ],
)
def test_what_the_pool_lacks_is_reported_in_one_sentence(pool, tmp_path, said, error, words):
    with pytest.raises(error, match=words):
        composed(pool, tmp_path, **said)
    assert not (tmp_path / "scene.glb").exists()


def test_an_empty_pool_says_where_to_look(tmp_path):
    with pytest.raises(UserError, match="assets list --rejected"):
        compose(AssetPool(Path("nowhere"), ()), tmp_path)
