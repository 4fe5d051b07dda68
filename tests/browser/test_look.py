"""The report's 3D view, in a real browser: from a file, without any request."""

import io

import pytest
from PIL import Image

from chromium import browser
from corporeal.pipeline import read_back
from corporeal.playback import cast_of, playback, recorded
from corporeal.render.page import page, safe
from corporeal.render.viewer_page import inline_view

READY = "window.viewer?.stats.ready && viewer.stats.drawn > 2"
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
    made = read_back(small_run)
    cast = cast_of(made.prepared)
    recording = recorded(cast, made.trajectory)
    view = inline_view(playback(made.prepared, cast, made.played.outcome, recording))
    above = ("summary", "film", "caption", "verdict", "expectations", "parts", "masses", "figures")
    empty = dict.fromkeys((*above, "grounds", "audit", "sources", "credits", "settings"), "")
    text = page(
        "corporeal.stages", "report.html", **empty, title=safe("drop"), width=640, view=view
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
        assert tab.run("document.querySelector('.picked').textContent") == ""
        # Colours change what is seen, and the key says what they mean.
        for by, word in (("stress", "von Mises"), ("young", "Young"), ("speed", "speed")):
            tab.run(f"viewer.by.value = '{by}', viewer.paint('{by}')")
            assert word in tab.run("viewer.legend.textContent")
        assert colours_in(tab.picture()) > 200
        tab.press("?")
        assert tab.run("!viewer.help.hidden")
        # On a telephone the picture, the timeline and the list still fit.
        tab.resize(390, 800, mobile=True)
        tab.until("viewer.see.clientWidth > 300 && viewer.see.clientHeight > 150")
        assert tab.run("document.documentElement.scrollWidth") <= 390
        assert tab.errors == []


@pytest.mark.slow
def test_two_runs_stand_beside_each_other_under_one_policy(small_run, tmp_path):
    from corporeal.viewer.shelf import Shelf
    from corporeal.viewer.site import Shown, site
    from viewer_served import LOCAL, serving

    app = site(Shown(Shelf((), small_run.parent)), LOCAL)
    with serving(app) as server, browser(tmp_path) as tab:
        tab.open(f"{server.address}/view/drop/drop")
        tab.until(READY)
        assert tab.run("viewer.stages.length") == 2
        assert "Nothing that was asked for differs" in tab.run("viewer.panel.textContent")
        tab.open(f"{server.address}/home")
        tab.until("window.home?.ready")
        assert tab.run("document.querySelectorAll('.run').length") == 1
        assert all(r.startswith((server.address, "data:", "blob:")) for r in tab.requests)
        assert tab.errors == []
