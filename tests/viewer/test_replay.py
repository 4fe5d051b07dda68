"""What was done to a live simulation is done again, finer and with the control beside."""

import json
from dataclasses import replace

import numpy as np
import pytest

from corporeal.discretization.discretization_plan import QUALITY_PRESETS
from corporeal.pipeline.stages.fill import FillConfig
from corporeal.pipeline.stages.ground import GroundConfig
from corporeal.viewer.commands import Command
from corporeal.viewer.interaction_controller import RECORDED_GRAB, InteractionController, InteractionEvent
from corporeal.viewer.live_edit import LiveEditor
from corporeal.viewer.live_simulation import LiveSimulation, live_editor_of, no_assets
from corporeal.viewer.replay import (
    InteractionRecord,
    read_record,
    refill_as_draft,
    replay_frames,
    write_record,
    write_replays,
)
from corporeal.viewer.run_store import RunStore

BALL = 0


@pytest.fixture(scope="module")
def made(small_run):
    return RunStore((), small_run.parent).made("drop")


@pytest.fixture(scope="module")
def touched(made):
    """The foam ball is grabbed, pulled up and let go of; then wind blows."""
    live = LiveSimulation(live_editor_of(made, 1), 1)
    live.begin(single=False, twin=True)
    top = tuple(live.hands.engine.snapshot().position[0].tolist())
    high = (top[0], top[1], top[2] + 0.2)
    live._do(Command("grab", object=BALL, point=top, to=high, firm=4.0))
    for _ in range(6):
        live._both(1 / 60)
    live._do(Command("drop"))
    live._do(Command("wind", object=BALL, to=(5.0, 0.0, 0.0)))
    for _ in range(3):
        live._both(1 / 60)
    return live


@pytest.mark.slow
def test_a_record_is_read_as_it_was_written(touched, tmp_path):
    done = InteractionRecord("drop", tuple(touched.hands.touches))
    write_record(tmp_path / "touches.json", done)
    assert read_record(tmp_path / "touches.json") == done
    assert [t.order.do for t in done.touches if t.order] == [RECORDED_GRAB, "drop", "wind"]
    assert done.seconds == pytest.approx(9 / 60)


def test_the_control_beside_is_at_the_same_instant_and_was_pulled_as_well(touched):
    here, there = touched.hands.engine, touched.twin.engine
    assert there.problem.contact == "single" and here.problem.contact == "multi"
    assert there.time == here.time
    rows = slice(*touched.hands.first[[BALL, BALL + 1]])
    risen = [e.snapshot().position[rows, 2].mean() - touched.hands.start[rows, 2].mean()
             for e in (here, there)]  # fmt: skip
    assert min(risen) > 0.01
    assert touched.twin.touches == []
    alone = InteractionController(touched.posed, replace(touched.posed.problem, contact="single"), 1)
    alone.replay(touched.hands.touches)
    np.testing.assert_array_equal(alone.engine.snapshot().position, there.snapshot().position)


@pytest.mark.slow
def test_a_replay_at_draft_lifts_the_ball_too_and_is_the_same_every_time(made, touched):
    done = InteractionRecord("drop", tuple(touched.hands.touches))
    prepared = refill_as_draft(made.results, FillConfig())
    assert prepared.particles.count != len(touched.hands.start)
    growth = LiveEditor(prepared, QUALITY_PRESETS["draft"], no_assets, GroundConfig())
    told = []
    frames = list(replay_frames(growth, "multi", done, told.append))
    again = list(replay_frames(growth, "multi", done, told.append))
    assert told[-1] == 1.0 and frames[0].time == 0.0 and frames[-1].time == done.seconds
    mine = prepared.particles.object == BALL
    risen = frames[-1].position[mine].mean(axis=0) - frames[0].position[mine].mean(axis=0)
    assert risen[2] > 0.01
    for one, other in zip(frames, again, strict=True):
        np.testing.assert_array_equal(one.position, other.position)
    # Without the hand it falls.
    idle = InteractionRecord("drop", tuple(t for t in done.touches if t.order is None))
    *_, last = replay_frames(growth, "multi", idle, told.append)
    assert last.position[mine, 2].mean() < frames[0].position[mine, 2].mean()


@pytest.mark.slow
def test_both_takes_of_a_replay_are_written(small_run, touched, tmp_path):
    done = InteractionRecord("drop", tuple(touched.hands.touches))
    write_record(tmp_path / "touches.json", done)
    write_replays(tmp_path, lambda share, words: None, small_run, tmp_path / "touches.json")
    for contact in ("multi", "single"):
        data = (tmp_path / f"{contact}.take").read_bytes()
        header = json.loads(data[4 : 4 + int.from_bytes(data[:4], "little")])
        assert header["video"]["time"][-1] == pytest.approx(done.seconds)


def test_what_is_taken_is_identified_by_where_it_was_at_the_start(touched):
    """A rigid body that has moved is held at the same point of it in a fresh engine."""
    live = touched
    stone = int(np.flatnonzero(live.posed.object_of_body == 1)[0])
    hands = InteractionController(live.posed, live.posed.problem, 1)
    hands.advance(0.05)
    row = hands.first[stone]
    now = hands.engine.snapshot()
    away = np.array([0.03, 0.0, 0.01])
    point = now.position[row] + now.deformation[row] @ away
    x, y, z = point.tolist()
    hands.obey(Command("grab", object=1, point=(x, y, z), to=(x, y, z)))
    held = hands.touches[-1].order
    assert held is not None and held.do == RECORDED_GRAB
    np.testing.assert_allclose(held.point, hands.start[row] + away, atol=1e-6)
    np.testing.assert_allclose(hands.grip(now.position), point, atol=1e-6)
    fresh = InteractionController(live.posed, live.posed.problem, 1)
    fresh.again(InteractionEvent(replace(held)))
    at = fresh.grip(fresh.engine.snapshot().position)
    np.testing.assert_allclose(at, hands.start[row] + away, atol=1e-6)


def test_a_replay_that_was_not_asked_for_is_not_found(small_run):
    from corporeal.viewer.live_simulation import LiveSession
    from corporeal.viewer.replay_jobs import ReplayJobs
    from corporeal.viewer.run_store import RunStore
    from corporeal.viewer.web_app import SiteOptions, make_app
    from viewer_server import LOCAL, serving

    shelf = RunStore((), small_run.parent)
    replays = ReplayJobs(shelf, LiveSession(shelf.made))
    with serving(make_app(SiteOptions(shelf), LOCAL, replays.routes())) as server:
        for path in ("/replays/x", "/replayed/x", "/replayed/x/multi", "/replayed/..%2f..%2fx/multi"):
            assert server.ask(path).status == 404
        assert server.order("/replay/stop", id="x").status == 400
        assert server.ask("/replay", "POST", b"{}").status == 403


def test_of_several_pulls_between_two_advances_the_last_is_remembered(touched):
    hands = InteractionController(touched.posed, touched.posed.problem, 1)
    place = tuple(hands.start[0].tolist())
    hands.obey(Command("grab", object=BALL, point=place, to=place))
    for k in range(20):
        hands.obey(Command("pull", to=(0.0, 0.0, 0.01 * k)))
    hands.advance(0.01)
    assert [t.order.do if t.order else "" for t in hands.touches] == [RECORDED_GRAB, "pull", ""]
    again = InteractionController(touched.posed, touched.posed.problem, 1)
    again.replay(hands.touches)
    now, then = hands.engine.snapshot(), again.engine.snapshot()
    np.testing.assert_array_equal(now.position, then.position)


@pytest.mark.slow
def test_touching_does_not_take_more_and_more_memory(made):
    from pathlib import Path

    if not Path("/proc/self/statm").exists():
        pytest.skip("this system does not say how much memory a process holds")
    live = LiveSimulation(live_editor_of(made, 1), 1)
    place = tuple(live.hands.start[0].tolist())
    live._do(Command("grab", object=BALL, point=place, to=place))
    pages = []
    for k in range(600):  # twenty seconds of pictures
        high = (place[0], place[1], place[2] + 0.05 + 0.0001 * k)
        live._do(Command("pull", to=high))
        live._both(1e-4)
        live._hand_over()
        assert live.instant is not None
        live.picture(live.instant)
        pages.append(int(Path("/proc/self/statm").read_text().split()[1]))
    kept = len(live.hands.touches) * 600  # bytes, of the record
    grown = (pages[-1] - pages[200]) * 4096
    assert grown < kept + 2e6, f"{grown / 1e6:.1f} MB in 400 pictures"
