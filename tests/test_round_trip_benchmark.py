"""What the benchmark of the round trip tells the second run, and what it changes for the spread."""

import numpy as np
import pytest
import trimesh
import yaml
from round_trip import ASIDE, Piece, _called, _merged, as_told, put_aside

from corporeal.geometry.scene_transforms import object_boxes
from corporeal.pipeline.results import StageResults
from corporeal.pipeline.run_pipeline import Settings, open_run
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.capture import CaptureConfig, capture


def piece(name, pixels, colour, material, area, **said):
    return Piece(name, pixels, colour, {"material": material, "structure": "solid"} | said, area)


def test_pieces_built_alike_are_reported_as_one_and_invisible_differences_are_not_reported():
    shell = {"structure": "shell"}
    told = _merged(
        [
            piece("stem", 100, "brown", "steel", 0.1, **shell, thickness_mm=1.0),
            piece("shade", 900, "white", "steel", 0.3, **shell, thickness_mm=2.0),
            piece("base", 200, "black", "steel", 0.1),
            piece("bulb", 9, "white", "glass", 0.1),
        ]
    )
    assert list(told) == ["white shade", "black base"]
    assert told["white shade"] == {"material": "steel", **shell, "thickness_mm": 1.75}


def test_large_pieces_that_are_reported_as_one_are_all_named():
    foam = [
        piece("cushion", 400, "grey", "foam", 0.1),
        piece("body", 900, "grey", "foam", 0.1),
        piece("button", 200, "grey", "foam", 0.1),
    ]
    assert list(_merged(foam)) == ["grey body and cushion"]


@pytest.mark.parametrize(("rgb", "term"), [((200, 30, 30), "red"), ((10, 10, 10), "black"), ((200, 200, 195), "white")])
def test_colours_go_by_the_basic_terms(rgb, term):
    assert _called(np.array(rgb)) == term


@pytest.fixture
def drum(tmp_path):
    """Write the model of a wall with both faces, open at its ends, on the floor."""
    mesh = trimesh.creation.annulus(0.195, 0.2, 0.4, sections=48).subdivide()
    mesh.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    whole = trimesh.Scene()
    whole.add_geometry(mesh, node_name="drum", geom_name="drum")
    whole.export(tmp_path / "drum.glb")
    return tmp_path / "drum.glb"


@pytest.mark.slow
def test_a_wall_that_is_modelled_with_both_faces_is_reported_as_a_wall(drum, tmp_path):
    with open_run([drum], tmp_path / "run", Settings(), lambda verb: _deaf, "ground") as done:
        views = capture(done.made.scene, CaptureConfig(4, (48, 48), threads=1))
        told = yaml.safe_load(as_told(done.made, views, tmp_path / "told.yaml").read_text())
    (row,) = told.values()
    assert row["structure"] == "shell"
    assert row["thickness_mm"] == pytest.approx(5 * np.cos(np.pi / 48) * 0.4 / 0.405, rel=0.02)


def _deaf(fraction, words):
    pass


def test_objects_are_put_aside_by_a_hundredth_of_their_size(drum, tmp_path):
    scene = assemble([drum])
    aside = assemble([put_aside(StageResults(assemble=scene), drum, tmp_path, seed=1)])
    shift = object_boxes(aside)[0] - object_boxes(scene)[0]
    assert np.linalg.norm(shift[0]) == pytest.approx(ASIDE * np.ptp(object_boxes(scene)[0], axis=0).max())
    np.testing.assert_allclose(shift[0], shift[1], atol=1e-9)
    assert shift[0, 2] == pytest.approx(0, abs=1e-9)  # what stands on the floor stays on it
