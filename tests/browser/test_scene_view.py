"""The report's 3D view, in a real browser: from a file, without any request."""

import io

import numpy as np
import pytest
from PIL import Image

from chromium import browser
from corporeal.core.types import FeatureCloud, Gaussians, Reconstruction
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.pipeline.run_pipeline import read_run
from corporeal.pipeline.viewer_data import bind_scene, record_trajectory, viewer_recording
from corporeal.render.html_page import escape_html, fill_page
from corporeal.render.viewer_page import inline_view

READY = "window.viewer?.stats.ready && viewer.stats.drawn > 2"
CONTEXT = "viewer.renderer.getContext()"
MIDDLE = """(() => {
  const stage = viewer.stages[0], mesh = stage.meshes.find(m => m.surface.object === OBJECT)
  mesh.geometry.computeBoundingBox()
  const middle = mesh.geometry.boundingBox.getCenter(viewer.eye.position.clone())
  const c = middle.applyMatrix4(mesh.matrix).project(viewer.eye)
  const r = viewer.canvas.getBoundingClientRect()
  return [r.left + (c.x + 1) / 2 * r.width, r.top + (1 - c.y) / 2 * r.height] })()"""


@pytest.fixture(scope="module")
def report(small_run, tmp_path_factory):
    """The report's page with the view alone: the rest of it is tested without a browser."""
    made = read_run(small_run)
    cast = bind_scene(made.prepared)
    recording = record_trajectory(cast, made.trajectory)
    view = inline_view(viewer_recording(made.prepared, cast, made.played.outcome, recording))
    above = ("summary", "video", "caption", "verdict", "expectations", "parts", "masses", "figures")
    empty = dict.fromkeys((*above, "grounds", "audit", "sources", "credits", "settings"), "")
    text = fill_page(
        "corporeal.pipeline.stages", "report.html", **empty, title=escape_html("drop"), width=640, view=view
    )
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(text)
    return path


def colours_in(png):
    """How many colours a screenshot has."""
    return len(Image.open(io.BytesIO(png)).convert("RGB").getcolors(1 << 24))


@pytest.mark.slow
def test_a_report_plays_from_a_file_and_a_click_opens_the_card(report, tmp_path):
    with browser(tmp_path) as tab:
        tab.open(report.as_uri())
        tab.until(READY)
        asked = [r for r in tab.requests if not r.startswith(("data:", "blob:"))]
        assert asked == [report.as_uri()]
        # It plays, holds, and goes on picture by picture.
        tab.run("viewer.resume()")
        tab.until("viewer.stats.frames > 3")
        assert tab.run("viewer.canvas.getBoundingClientRect().height") > 400
        tab.run("viewer.pause(), viewer.clock = 0, viewer.canvas.focus()")
        tab.press("ArrowRight")
        tab.until("viewer.stages[0].frame === 1")
        # A click on the ball opens its card, with both stiffnesses.
        tab.until("!viewer.dirty")
        tab.click(*tab.run(MIDDLE.replace("OBJECT", "0")))
        said = tab.until("document.querySelector('.picked').textContent")
        assert "E real" in said and "simulated" in said and "Source of the range" in said
        tab.press("Escape")
        tab.until("document.querySelector('.picked').textContent === ''")
        # Colours change what is seen, and the key says what they mean.
        for by, word in (("stress", "von Mises"), ("young_pa", "Young"), ("speed", "speed")):
            tab.run(f"viewer.by.value = '{by}', viewer.paint('{by}')")
            tab.until(f"viewer.legend.textContent.includes('{word}')")
        tab.until("!viewer.dirty")
        assert colours_in(tab.picture()) > 200
        tab.press("?")
        tab.until("!viewer.help.hidden")
        # On a telephone the picture, the timeline and the list still fit.
        tab.resize(390, 800, mobile=True)
        tab.until("viewer.see.clientWidth > 300 && viewer.see.clientHeight > 150")
        tab.until("document.documentElement.scrollWidth <= 390")
        tab.until("document.querySelector('.track').clientWidth > 250")
        assert tab.errors == []


@pytest.mark.slow
def test_two_runs_stand_beside_each_other_under_one_policy(small_run, tmp_path):
    from corporeal.viewer.run_store import RunStore
    from corporeal.viewer.web_app import SiteOptions, make_app
    from viewer_server import LOCAL, serving

    app = make_app(SiteOptions(RunStore((), small_run.parent)), LOCAL)
    with serving(app) as server, browser(tmp_path) as tab:
        tab.open(f"{server.address}/view/drop/drop")
        tab.until(READY)
        assert tab.run("viewer.stages.length") == 2
        tab.until("viewer.panel.textContent.includes('Nothing that was asked for differs')")
        tab.open(f"{server.address}/home")
        tab.until("window.home?.ready")
        assert tab.run("document.querySelectorAll('.run').length") == 1
        assert all(r.startswith((server.address, "data:", "blob:")) for r in tab.requests)
        assert tab.errors == []


def clothed(made, count=4000):
    """Gaussians all over the first object, red, as if it had been reconstructed from pictures."""
    rng = np.random.default_rng(0)
    surface = next(s for s in made.scene.surfaces if s.object == 0)
    rows = rng.integers(len(surface.vertices), size=count)
    axes = rng.normal(size=(count, 4))
    gaussians = Gaussians(
        mean=surface.vertices[rows] + 0.001 * rng.normal(size=(count, 3)),
        rotation=axes / np.linalg.norm(axes, axis=1, keepdims=True),
        scale=np.full((count, 3), [0.004, 0.003, 0.001]),
        opacity=np.full(count, 0.9),
        sh=np.tile((np.array([0.9, 0.05, 0.05]) - 0.5) / SH_DC_COEFFICIENT, (count, 1, 1)),
    )
    cloud = FeatureCloud(gaussians.mean, gaussians.mean, axes, axes, np.ones(count, dtype=np.int64))
    owner, box = np.zeros(count, dtype=np.int64), np.zeros((1, 2, 3))
    return Reconstruction(gaussians, owner, cloud, owner, ("ball",), box, 1.0, np.eye(4))


RED = """(() => { const box = document.createElement('canvas'), from = viewer.canvas
  viewer.draw()
  box.width = from.width; box.height = from.height
  const pen = box.getContext('2d'); pen.drawImage(from, 0, 0)
  const data = pen.getImageData(0, 0, box.width, box.height).data, found = [0, 0]
  for (let i = 0; i < data.length; i += 4) {
    if (data[i] > 150 && data[i + 1] < 90) { found[0]++; found[1] += (i / 4 / box.width) | 0 }
  }
  return [found[0], found[1] / Math.max(found[0], 1) / box.height] })()"""


@pytest.mark.slow
def test_gaussians_stand_for_surfaces_and_move_with_them(small_run, tmp_path):
    made = read_run(small_run)
    cast = bind_scene(made.prepared)
    found = clothed(made)
    take = viewer_recording(made.prepared, cast, made.played.outcome, record_trajectory(cast, made.trajectory),
                    found=found)  # fmt: skip
    path = tmp_path / "view.html"
    path.write_text(f"<!doctype html><meta charset=utf-8><body>{inline_view(take)}")
    with browser(tmp_path) as tab:
        tab.open(path.as_uri())
        tab.until(READY)
        tab.run("viewer.pause(), viewer.clock = 0")
        tab.until("viewer.stages[0].frame === 0")
        # A software renderer, like a telephone, begins with surfaces.
        assert not tab.run("viewer.soft.checked") and tab.run(RED)[0] == 0
        tab.run("viewer.soft.click()")
        tab.until("viewer.stages[0].splats && !viewer.dirty")
        many, high = tab.run(RED)
        assert many > 200
        tab.picture(tmp_path / "splats.png")
        # They fall with the ball, and a click on it opens its card all the same.
        tab.run("viewer.clock = viewer.length")
        tab.until("viewer.stages[0].frame > 3 && !viewer.dirty")
        less, low = tab.run(RED)
        assert low > high + 0.02 and less > 0.5 * many
        tab.click(*tab.run(MIDDLE.replace("OBJECT", "0")))
        assert "E real" in tab.until("document.querySelector('.picked').textContent")
        tab.run("viewer.by.value = 'stress', viewer.paint('stress')")
        tab.until("viewer.stages[0].splats === null")
        # Hidden with their object.
        tab.run("viewer.by.value = 'itself', viewer.paint('itself')")
        tab.until(f"{RED}[0] > 100")
        tab.run("viewer.stages[0].reveal(0, false)")
        tab.until(f"{RED}[0] === 0")
        assert tab.errors == []


@pytest.mark.slow
def test_a_lost_context_is_drawn_anew_without_a_touch(report, tmp_path):
    with browser(tmp_path) as tab:
        tab.open(report.as_uri())
        tab.until(READY)
        tab.run("viewer.pause()")
        tab.until("!viewer.dirty && viewer.ratio > viewer.dense")
        before = colours_in(tab.picture(tmp_path / "before.png"))
        tab.run(f"window.lost = {CONTEXT}.getExtension('WEBGL_lose_context'), lost.loseContext()")
        tab.until(f"{CONTEXT}.isContextLost()")
        drawn = tab.run("viewer.stats.drawn")
        tab.run("lost.restoreContext()")
        tab.until(f"viewer.stats.drawn > {drawn} && !viewer.dirty")
        assert colours_in(tab.picture(tmp_path / "after.png")) > 0.9 * before


REFUSING = """{
  const given = HTMLCanvasElement.prototype.getContext
  HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    return /webgl/.test(kind) && ASKED ? null : given.call(this, kind, ...more) }
}"""


@pytest.mark.slow
@pytest.mark.parametrize("asked", ["true", "this.isConnected"])
def test_a_browser_that_draws_no_3d_says_so_in_a_sentence(report, tmp_path, asked):
    """It refuses at once, or only once the page asks for its picture."""
    with browser(tmp_path) as tab:
        script = REFUSING.replace("ASKED", asked)
        tab.ask("Page.addScriptToEvaluateOnNewDocument", source=script)
        tab.open(report.as_uri())
        tab.until("window.viewer?.stats.ready")
        tab.until("document.querySelector('#view .none')?.innerText.includes('shows no 3D')")
        assert tab.run("document.querySelectorAll('#view canvas').length") == 0


@pytest.mark.slow
@pytest.mark.parametrize("without", ["scripts", "streams"])
def test_a_browser_that_cannot_run_the_view_says_so_in_a_sentence(report, tmp_path, without):
    with browser(tmp_path) as tab:
        if without == "scripts":
            tab.ask("Emulation.setScriptExecutionDisabled", value=True)
        else:
            source = "delete window.DecompressionStream"
            tab.ask("Page.addScriptToEvaluateOnNewDocument", source=source)
        tab.open(report.as_uri())
        said = "document.querySelector('#view')?.innerText ?? ''"
        tab.until(f"/video below/.test({said})")
        if without == "streams":  # a script replaces what stands there for those without any
            tab.until(f"/DecompressionStream/.test({said})")
        else:
            assert "DecompressionStream" not in tab.run(said)
