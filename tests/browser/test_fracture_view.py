"""A run in which a thing broke, in a real browser: its pieces are seen."""

import pytest
import trimesh

import corporeal as co
from chromium import browser
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.pipeline.run_pipeline import Settings, run
from corporeal.pipeline.stages.simulate import SimulateConfig

READY = "window.viewer?.stats.ready && viewer.stats.drawn > 2"
OBJECTS = "viewer.stages[0].meshes.map(m => m.surface.object)"
SPREAD = """(() => {
  const places = viewer.stages[0].meshes.map(m => m.matrix.elements)
  const off = e => Math.max(...e.map((v, i) => Math.abs(v - places[0][i])))
  return Math.max(...places.map(off)) })()"""
"""How differently the surfaces have moved."""


@pytest.fixture(scope="module")
def broken_run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("broken")
    tile = trimesh.creation.box((0.1, 0.1, 0.004))
    tile.apply_transform(trimesh.transformations.euler_matrix(0.1, 0.07, 0.0))
    tile.apply_translation((0, 0, 0.3))
    thing = co.solid("terracotta", tile.vertices, tile.faces, (0, 0, -14.0), "tile")
    write_glb(folder / "tile.glb", co.build_scene(thing, duration=0.04, fps=120))
    settings = Settings(simulate=SimulateConfig(breaking=True))
    return run([folder / "tile.glb"], folder / "runs" / "tile", settings, until="simulate")


@pytest.mark.slow
def test_the_page_shows_the_pieces_of_what_broke(broken_run, tmp_path):
    from corporeal.pipeline.run_pipeline import read_run
    from corporeal.viewer.run_store import RunStore
    from corporeal.viewer.web_app import SiteOptions, make_app
    from viewer_server import LOCAL, serving

    pieces = len(read_run(broken_run).trajectory.breaks[0].surfaces)
    assert pieces > 5
    shelf = RunStore((), broken_run.parent)
    with serving(make_app(SiteOptions(shelf), LOCAL)) as server, browser(tmp_path) as tab:
        tab.open(f"{server.address}/view/tile")
        tab.until(READY)
        assert sorted(tab.run(OBJECTS)) == list(range(pieces))
        tab.run("viewer.pause(), viewer.clock = 0")
        tab.until(f"{SPREAD} < 1e-4")
        tab.run("viewer.clock = 0.04")
        tab.until(f"{SPREAD} > 0.05")
