"""What was done to a live simulation is done again, finer and with the control beside."""

import json
from dataclasses import replace

import numpy as np
import pytest

from corporeal.discretization.plan import QUALITIES
from corporeal.pipeline.stages.fill import FillConfig
from corporeal.pipeline.stages.ground import GroundConfig
from corporeal.viewer.growth import Growth
from corporeal.viewer.hands import HOLD, Hands, Touch
from corporeal.viewer.live import Live, live_scene, no_things
from corporeal.viewer.orders import Order
from corporeal.viewer.shelf import Shelf
from corporeal.viewer.touches import Record, as_draft, read_record, replayed, takes, write_record

BALL = 0


@pytest.fixture(scope="module")
def made(small_run):
    return Shelf((), small_run.parent).made("drop")


@pytest.fixture(scope="module")
def touched(made):
    """The foam ball is grabbed, pulled up and let go of; then wind blows."""
    live = Live(live_scene(made, 1), 1)
    live.begin(single=False, twin=True)
    top = tuple(live.hands.engine.snapshot().position[0].tolist())
    high = (top[0], top[1], top[2] + 0.2)
    live._do(Order("grab", object=BALL, point=top, to=high, firm=4.0))
    for _ in range(6):
        live._both(1 / 60)
    live._do(Order("drop"))
    live._do(Order("wind", object=BALL, to=(5.0, 0.0, 0.0)))
    for _ in range(3):
        live._both(1 / 60)
    return live


def test_a_record_is_read_as_it_was_written(touched, tmp_path):
    done = Record("drop", tuple(touched.hands.touches))
    write_record(tmp_path / "touches.json", done)
    assert read_record(tmp_path / "touches.json") == done
    assert [t.order.do for t in done.touches if t.order] == [HOLD, "drop", "wind"]
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
    alone = Hands(touched.posed, replace(touched.posed.problem, contact="single"), 1)
    alone.replay(touched.hands.touches)
    np.testing.assert_array_equal(alone.engine.snapshot().position, there.snapshot().position)


def test_a_replay_at_draft_lifts_the_ball_too_and_is_the_same_every_time(made, touched):
    done = Record("drop", tuple(touched.hands.touches))
    prepared = as_draft(made.results, FillConfig())
    assert prepared.particles.count != len(touched.hands.start)
    growth = Growth(prepared, QUALITIES["draft"], no_things, GroundConfig())
    told = []
    frames = list(replayed(growth, "multi", done, told.append))
    again = list(replayed(growth, "multi", done, told.append))
    assert told[-1] == 1.0 and frames[0].time == 0.0 and frames[-1].time == done.seconds
    mine = prepared.particles.object == BALL
    risen = frames[-1].position[mine].mean(axis=0) - frames[0].position[mine].mean(axis=0)
    assert risen[2] > 0.01
    for one, other in zip(frames, again, strict=True):
        np.testing.assert_array_equal(one.position, other.position)
    # Without the hand it falls.
    idle = Record("drop", tuple(t for t in done.touches if t.order is None))
    *_, last = replayed(growth, "multi", idle, told.append)
    assert last.position[mine, 2].mean() < frames[0].position[mine, 2].mean()


def test_both_takes_of_a_replay_are_written(small_run, touched, tmp_path):
    done = Record("drop", tuple(touched.hands.touches))
    write_record(tmp_path / "touches.json", done)
    takes(tmp_path, lambda share, words: None, small_run, tmp_path / "touches.json")
    for contact in ("multi", "single"):
        data = (tmp_path / f"{contact}.take").read_bytes()
        header = json.loads(data[4 : 4 + int.from_bytes(data[:4], "little")])
        assert header["film"]["time"][-1] == pytest.approx(done.seconds)


def test_what_is_taken_is_told_by_where_it_was_at_the_start(touched):
    """A rigid body that has moved is held at the same point of it in a fresh engine."""
    live = touched
    stone = int(np.flatnonzero(live.posed.object_of_body == 1)[0])
    hands = Hands(live.posed, live.posed.problem, 1)
    hands.advance(0.05)
    row = hands.first[stone]
    now = hands.engine.snapshot()
    away = np.array([0.03, 0.0, 0.01])
    point = now.position[row] + now.deformation[row] @ away
    x, y, z = point.tolist()
    hands.obey(Order("grab", object=1, point=(x, y, z), to=(x, y, z)))
    held = hands.touches[-1].order
    assert held is not None and held.do == HOLD
    np.testing.assert_allclose(held.point, hands.start[row] + away, atol=1e-6)
    np.testing.assert_allclose(hands.grip(now.position), point, atol=1e-6)
    fresh = Hands(live.posed, live.posed.problem, 1)
    fresh.again(Touch(replace(held)))
    at = fresh.grip(fresh.engine.snapshot().position)
    np.testing.assert_allclose(at, hands.start[row] + away, atol=1e-6)


def test_a_replay_that_nobody_asked_for_is_not_found(small_run):
    from corporeal.viewer.live import Room
    from corporeal.viewer.replays import Replays
    from corporeal.viewer.shelf import Shelf
    from corporeal.viewer.site import Shown, site
    from viewer_served import LOCAL, serving

    shelf = Shelf((), small_run.parent)
    replays = Replays(shelf, Room(shelf.made))
    with serving(site(Shown(shelf), LOCAL, replays.routes())) as server:
        for path in (
            "/replays/x",
            "/replayed/x",
            "/replayed/x/multi",
            "/replayed/..%2f..%2fx/multi",
        ):
            assert server.ask(path).status == 404
        assert server.order("/replay/stop", id="x").status == 400
        assert server.ask("/replay", "POST", b"{}").status == 403


def test_of_several_pulls_between_two_advances_the_last_is_remembered(touched):
    hands = Hands(touched.posed, touched.posed.problem, 1)
    place = tuple(hands.start[0].tolist())
    hands.obey(Order("grab", object=BALL, point=place, to=place))
    for k in range(20):
        hands.obey(Order("pull", to=(0.0, 0.0, 0.01 * k)))
    hands.advance(0.01)
    assert [t.order.do if t.order else "" for t in hands.touches] == [HOLD, "pull", ""]
    again = Hands(touched.posed, touched.posed.problem, 1)
    again.replay(hands.touches)
    now, then = hands.engine.snapshot(), again.engine.snapshot()
    np.testing.assert_array_equal(now.position, then.position)


@pytest.mark.slow
def test_touching_does_not_take_more_and_more_memory(made):
    from pathlib import Path

    if not Path("/proc/self/statm").exists():
        pytest.skip("this system does not say how much memory a process holds")
    live = Live(live_scene(made, 1), 1)
    place = tuple(live.hands.start[0].tolist())
    live._do(Order("grab", object=BALL, point=place, to=place))
    pages = []
    for k in range(600):  # twenty seconds of pictures
        high = (place[0], place[1], place[2] + 0.05 + 0.0001 * k)
        live._do(Order("pull", to=high))
        live._both(1e-4)
        live._hand_over()
        assert live.instant is not None
        live.picture(live.instant)
        pages.append(int(Path("/proc/self/statm").read_text().split()[1]))
    kept = len(live.hands.touches) * 600  # bytes, of the record
    grown = (pages[-1] - pages[200]) * 4096
    assert grown < kept + 2e6, f"{grown / 1e6:.1f} MB in 400 pictures"
