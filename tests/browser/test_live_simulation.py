"""A simulation that runs is touched with the mouse, in a real browser."""

import json
import time

import numpy as np
import pytest

from chromium import PATIENCE, browser, wait

READY = "window.viewer?.stats.ready && viewer.stats.drawn > 2"
MIDDLE = """(() => {
  const stage = viewer.stages[0], mesh = stage.meshes.find(m => m.surface.object === OBJECT)
  mesh.geometry.computeBoundingBox()
  const w = mesh.geometry.boundingBox.getCenter(viewer.eye.position.clone())
  const z = w.applyMatrix4(mesh.matrix).z, c = w.project(viewer.eye)
  const r = viewer.canvas.getBoundingClientRect(), wide = r.width / viewer.stages.length
  return [r.left + (c.x + 1) / 2 * wide, r.top + (1 - c.y) / 2 * r.height, z] })()"""
RISEN = 0.1
"""[m]"""


def at_rest(live):
    """The time at which a paused simulation has done all orders and stood still for a second."""
    since, then = time.monotonic(), live.hands.engine.time
    end = since + PATIENCE
    while time.monotonic() - since < 1:
        assert time.monotonic() < end, "the simulation goes on though it is paused"
        time.sleep(0.05)
        if live.playing or live.orders or live.hands.engine.time != then:
            since, then = time.monotonic(), live.hands.engine.time
    return then


@pytest.mark.slow
def test_the_mouse_lifts_a_ball_and_the_force_at_rest_is_its_weight(small_run, tmp_path):
    from corporeal.viewer.asset_routes import asset_routes
    from corporeal.viewer.live_assets import LiveAssets
    from corporeal.viewer.live_simulation import MAX_FPS, LiveSession
    from corporeal.viewer.live_socket import live_route
    from corporeal.viewer.run_store import RunStore
    from corporeal.viewer.web_app import SiteOptions, make_app
    from viewer_server import LOCAL, serving

    shelf = RunStore((), small_run.parent)
    things = LiveAssets(shelf)
    room = LiveSession(shelf.made, things.find)
    app = make_app(SiteOptions(shelf), LOCAL, (live_route(room), *asset_routes(things, room)))
    with serving(app) as server, browser(tmp_path) as tab:
        tab.open(f"{server.address}/view/drop")
        tab.until(READY)
        tab.run("viewer.openTab('Touch')")
        tab.until("viewer.stats.got > 5 && viewer.stats.time > 0.3")
        live = room.live
        assert live is not None
        # Lift the stone, and hold it.
        x, y, before = tab.run(MIDDLE.replace("OBJECT", "1"))
        tab.mouse("mouseMoved", x, y, button="none", buttons=0)
        tab.mouse("mousePressed", x, y)
        for k in range(30):
            tab.mouse("mouseMoved", x, y - 10 * k)
            time.sleep(0.03)
        tab.until("viewer.live.grip?.to")
        tab.until(f"{MIDDLE.replace('OBJECT', '1')}[2] > {before + RISEN}")
        body = int(np.flatnonzero(live.posed.object_of_body == 1)[0])
        weight = float(live.hands.engine.measure().mass[body]) * 9.81
        tab.until(f"Math.abs(viewer.stats.force / {weight} - 1) < 0.05")
        # Without gravity what is let go of goes straight on, however it swung.
        tab.run("viewer.pages.get('Touch') && viewer.live.tell({do: 'gravity', to: [0, 0, 0]})")
        tab.mouse("mouseReleased", x, y - 290)
        tab.until("viewer.live.grip === null && viewer.stats.force === 0")
        # A pause holds, and what was done can be done again, bit for bit.
        tab.press(" ")
        tab.until("!viewer.playing")
        then = at_rest(live)
        flying = live.hands.engine.measure().momentum[body]
        tab.run("viewer.live.tell({do: 'step'})")
        wait(lambda: live.hands.engine.time > then + 0.99 / MAX_FPS)
        at_rest(live)
        np.testing.assert_allclose(live.hands.engine.measure().momentum[body], flying, atol=1e-6)
        again = type(live.hands)(live.posed, live.posed.problem, threads=1)
        again.replay(live.hands.touches)
        now, then = live.hands.engine.snapshot(), again.engine.snapshot()
        np.testing.assert_array_equal(now.position, then.position)
        np.testing.assert_array_equal(now.velocity, then.velocity)
        # Back to what was recorded; the simulation ends with its last visitor.
        tab.run("viewer.openTab('Look')")
        tab.until("viewer.stages[0].frame >= 0")
        wait(lambda: room.live is None)
        assert tab.errors == []


@pytest.mark.slow
def test_the_control_runs_beside_and_what_was_touched_is_replayed_at_draft(small_run, tmp_path):
    from corporeal.viewer.asset_routes import asset_routes
    from corporeal.viewer.live_assets import LiveAssets
    from corporeal.viewer.live_simulation import LiveSession
    from corporeal.viewer.live_socket import live_route
    from corporeal.viewer.replay_jobs import REPLAYS_FOLDER, ReplayJobs
    from corporeal.viewer.run_store import RunStore
    from corporeal.viewer.web_app import SiteOptions, make_app
    from viewer_server import LOCAL, serving

    shelf = RunStore((), small_run.parent)
    things = LiveAssets(shelf)
    room = LiveSession(shelf.made, things.find)
    replays = ReplayJobs(shelf, room)
    routes = (live_route(room), *asset_routes(things, room), *replays.routes())
    app = make_app(SiteOptions(shelf), LOCAL, routes)
    before = sorted(path.name for path in small_run.rglob("*"))
    with serving(app) as server, browser(tmp_path) as tab:
        tab.open(f"{server.address}/view/drop")
        tab.until(READY)
        # Before anything is simulated there is nothing to replay.
        assert "nothing to replay" in server.order("/replay", run="drop").json["error"]
        tab.run("viewer.openTab('Touch')")
        tab.until("viewer.stats.got > 5")
        tab.run("viewer.live.contact.value = 'both'; viewer.live.contact.onchange()")
        tab.until("viewer.stages.length === 2 && viewer.stats.time > 0.01")
        captions = "[...document.querySelectorAll('.caption')].map(c => c.innerText)"
        told = ["objects slide and part", "all stick: one grid"]
        tab.until(f"JSON.stringify({captions}) === '{json.dumps(told, separators=(',', ':'))}'")
        # The stone is lifted on the left, and rises on the right as well.
        x, y, _ = tab.run(MIDDLE.replace("OBJECT", "1"))
        beside = MIDDLE.replace("OBJECT", "1").replace("stages[0]", "stages[1]")
        start = tab.run(beside)[2]
        tab.mouse("mouseMoved", x, y, button="none", buttons=0)
        tab.mouse("mousePressed", x, y)
        for k in range(15):
            tab.mouse("mouseMoved", x, y - 10 * k)
            time.sleep(0.03)
        tab.until(f"{beside}[2] > {start + 0.02}")
        tab.mouse("mouseReleased", x, y - 140)
        tab.press(" ")
        tab.until("!viewer.playing")
        tab.picture(tmp_path / "beside.png")
        # Once more, at draft; then both beside each other on one timeline.
        tab.run("viewer.live.replay.click()")
        tab.until("!!viewer.live.again.querySelector('a')", 400.0)
        tab.run("viewer.live.again.querySelector('a').click()")
        tab.until("window.viewer?.takes?.length === 2 && viewer.stats.drawn > 2")
        assert tab.run("viewer.names.map(n => n.textContent)")[1] == "all stick: one grid"
        assert tab.run("viewer.takes.every(t => t.times.length > 2)")
        assert "Contact alone" in tab.run("viewer.panel.innerText")
        tab.picture(tmp_path / "replayed.png")
        assert tab.run("[...viewer.pages.keys()]") == ["Look", "Audit"]
        assert tab.errors == []
    # The run itself is as it was; the record lies beside it.
    assert sorted(path.name for path in small_run.rglob("*")) == before
    assert len(list((small_run.parent / REPLAYS_FOLDER).glob("*.json"))) == 1


@pytest.mark.slow
def test_an_object_from_the_pool_is_dropped_where_one_clicks(small_run, tmp_path):
    from corporeal.viewer.asset_routes import asset_routes
    from corporeal.viewer.live_assets import LiveAssets
    from corporeal.viewer.live_simulation import LiveSession
    from corporeal.viewer.live_socket import live_route
    from corporeal.viewer.run_store import RunStore
    from corporeal.viewer.web_app import SiteOptions, make_app
    from viewer_server import LOCAL, serving

    shelf = RunStore((), small_run.parent)
    things = LiveAssets(shelf)
    room = LiveSession(shelf.made, things.find)
    app = make_app(SiteOptions(shelf), LOCAL, (live_route(room), *asset_routes(things, room)))
    with serving(app) as server, browser(tmp_path) as tab:
        tab.open(f"{server.address}/view/drop")
        tab.until(READY)
        tab.run("viewer.openTab('Touch')")
        tab.until("viewer.stats.got > 5 && viewer.live.thing.options.length > 10")
        groups = tab.run("[...viewer.live.thing.querySelectorAll('optgroup')].map(g => g.label)")
        assert groups == ["this run", "models of corporeal"]
        assert tab.run("viewer.live.thing.value") == "corporeal/rubber_ball"
        names = "viewer.stages[0].take.header.objects.map(o => o.name)"
        assert tab.run(names) == ["ball", "stone"]
        x, y, _ = tab.run(MIDDLE.replace("OBJECT", "1"))
        # Onto the stone: the foam ball of the run itself, from above it.
        tab.run("viewer.live.thing.value = 'drop/ball'; viewer.live.dropIt.click()")
        tab.mouse("mouseMoved", x, y, button="none", buttons=0)
        tab.mouse("mousePressed", x, y)
        tab.mouse("mouseReleased", x, y)
        tab.until(f"{names}.length === 3", 60.0)
        tab.until("viewer.live.rigid.length === 3")
        live = room.live
        assert live is not None
        # Below where it began, and not where it is seen first: it falls all the time.
        high = live.hands.start[slice(*live.hands.first[[2, 3]]), 2].mean()
        tab.picture(tmp_path / "dropped.png")
        tab.until(f"{MIDDLE.replace('OBJECT', '2')}[2] < {high} - 0.05")
        wait(lambda: live.hands.engine.measure().first_contact[1, 2] > 0)
        assert tab.run("viewer.live.said.textContent + viewer.live.dropWords.textContent") == ""
        assert tab.run("[...viewer.live.who.options].map(o => o.text)")[2] == "ball 1"
        # What is asked for wrongly is said, and goes on.
        tab.run("viewer.live.tell({do: 'add', thing: 'corporeal/whale', point: [0, 0, 0]})")
        tab.until("viewer.live.said.textContent.includes('whale')")
        # Beginning again takes it away, and so does going back to what was recorded.
        tab.run("viewer.live.tell({do: 'reset'})")
        tab.until(f"{names}.length === 2")
        tab.run("viewer.openTab('Look')")
        tab.until("viewer.stages[0].frame >= 0 && viewer.stages[0].take === viewer.takes[0]")
        assert tab.errors == []
