"""The benchmark of solids, from pictures to a page: what was pictured comes back."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from corporeal.io.photos.transforms_json import write_views
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.capture import CaptureConfig, capture
from corporeal.reconstruction.gaussians import training_schedule
from corporeal.reconstruction.surface.surface_config import ClosedSurfaceConfig


@pytest.fixture
def scene(tmp_path):
    """Write a folder as `corporeal assemble` does: a mottled box on the floor, and views of it."""
    folder = tmp_path / "crate"
    folder.mkdir()
    box = trimesh.creation.box(bounds=[[-0.3, -0.2, 0], [0.3, 0.2, 0.35]])
    for _ in range(4):
        box = box.subdivide()
    colour = np.random.default_rng(0).integers(40, 255, (len(box.vertices), 3))
    box.visual.vertex_colors = np.column_stack([colour, np.full(len(colour), 255)])
    # glTF has +y up.
    up = trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0])
    whole = trimesh.Scene()
    whole.add_geometry(box.apply_transform(up), node_name="crate", geom_name="crate")
    whole.export(folder / "scene.glb")
    views = capture(assemble([folder / "scene.glb"]), CaptureConfig(24, (144, 144), threads=1))
    write_views(folder / "views", views)
    return folder


@pytest.fixture
def bench(monkeypatch):
    import solids

    monkeypatch.setattr(solids, "PLACES", 20_000)
    monkeypatch.setattr(solids, "POINTS", 2_000)
    monkeypatch.setattr(solids, "CLAD", 4_000)
    monkeypatch.setattr(solids, "CORES", 1)
    coarse = ClosedSurfaceConfig(object_grid_cells=60_000, survey_grid_cells=20_000, threads=1)
    monkeypatch.setattr(solids, "SURFACES", coarse)
    return solids


def row(line):
    cells = [c.strip() for c in line.strip("|").split("|")]
    assert len(cells) == 12
    return {
        "closed": cells[3] == "yes",
        "volume": float(cells[4].rstrip("%")) / 100,
        "overlap": float(cells[5]),
        "apart": (float(cells[6]), float(cells[7])),
    }


@pytest.mark.slow
def test_a_page_is_made_of_what_was_clad(bench, scene, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(bench, "PAGE", tmp_path / "page.md")
    words = ["x", str(scene), "--clad", str(scene), "--out", str(tmp_path), "--docs"]
    monkeypatch.setattr(bench, "learned", lambda *_: bench.clad(bench.truth(scene_of(scene))))
    monkeypatch.setattr(sys, "argv", words)
    bench.main()
    page = (tmp_path / "page.md").read_text().splitlines()
    rows = [row(line) for line in page if line.startswith("| crate")]
    assert len(rows) == 2 and sum(line.startswith("| crate, clad |") for line in page) == 1
    for found in rows:
        assert found["closed"] and abs(found["volume"]) < 0.1 and found["overlap"] > 0.85
    assert "| crate | crate_0 |" in capsys.readouterr().out


def scene_of(folder):
    return assemble([folder / "scene.glb"])


@pytest.mark.slow
def test_pictures_of_a_crate_become_the_crate(bench, scene, tmp_path, monkeypatch):
    small = replace(training_schedule.TRAINING_PRESETS["draft"], gaussians=6000, steps=500)
    monkeypatch.setitem(training_schedule.TRAINING_PRESETS, "draft", small)
    found = row(bench.judged(scene, "draft", tmp_path)[0])
    assert found["closed"] and abs(found["volume"]) < 0.1
    assert max(found["apart"]) < 1.0 and found["overlap"] > 0.85
