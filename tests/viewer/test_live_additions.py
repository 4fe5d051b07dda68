"""Things are dropped into a live simulation: it goes on, with one object more."""

import json

import numpy as np
import pytest

from corporeal.core.errors import UserError
from corporeal.viewer.commands import Command, parse_command
from corporeal.viewer.interaction_controller import RECORDED_ADD, InteractionController
from corporeal.viewer.live_assets import LiveAssets
from corporeal.viewer.live_simulation import LiveSimulation, live_editor_of
from corporeal.viewer.replay import InteractionRecord, drop_events, read_record, write_record, write_replays
from corporeal.viewer.run_store import RunStore

BALL, STONE, NEW = 0, 1, 2
SPOT = (0.7, 0.0, 0.05)
"""On the stone [m]."""
THING = "drop/ball"
"""The foam ball of the run itself."""


@pytest.fixture(scope="module")
def shelf(small_run):
    return RunStore((), small_run.parent)


@pytest.fixture(scope="module")
def live(shelf):
    """The foam ball once more, onto the stone; the control beside."""
    live = LiveSimulation(live_editor_of(shelf.made("drop"), 1, LiveAssets(shelf).find), 1)
    live.begin(single=False, twin=True)
    for _ in range(3):
        live._both(1 / 60)
    live._do(Command("add", thing=THING, point=SPOT, to=(0.0, 0.0, 0.05)))
    for _ in range(8):
        live._both(1 / 60)
    return live


@pytest.mark.slow
def test_an_object_falls_from_above_what_is_pointed_at_and_strikes_it(live):
    engine, before = live.hands.engine, live.growth.at(()).prepared
    scene = live.growth.at(live.hands.added).prepared.scene
    assert [o.name for o in scene.objects] == ["ball", "stone", "ball_1"]
    foot = live.hands.added[0].foot
    top = before.particles.position[before.particles.object == STONE, 2].max()
    assert foot[:2] == SPOT[:2]
    # The stone has fallen since.
    assert 0.04 < foot[2] - 0.05 < top + 0.01
    now = engine.measure()
    assert now.first_contact[STONE, NEW] > 3 / 60
    assert now.pair_impulse[STONE, NEW] > 0
    assert now.mass[NEW] == pytest.approx(now.mass[BALL], rel=0.05)
    assert len(now.mass) == 3 and np.isnan(now.first_contact[BALL, NEW])


def test_the_control_beside_has_it_too(live):
    here, there = live.hands.engine, live.twin.engine
    assert there.problem.contact == "single" and there.time == here.time
    assert len(there.problem.bodies) == len(here.problem.bodies) == 3
    assert live.twin.added == live.hands.added and live.twin.touches == []
    rows = slice(*live.hands.first[[NEW, NEW + 1]])
    fallen = [live.hands.start[rows, 2].mean() - e.snapshot().position[rows, 2].mean()
              for e in (here, there)]  # fmt: skip
    assert min(fallen) > 0.02


def test_what_was_done_is_done_again_bit_for_bit(live):
    again = InteractionController(live.posed, live.posed.problem, 1, live.growth)
    again.replay(live.hands.touches)
    now, then = live.hands.engine.snapshot(), again.engine.snapshot()
    np.testing.assert_array_equal(now.position, then.position)
    np.testing.assert_array_equal(now.velocity, then.velocity)


def test_pictures_and_the_honest_line_know_it(live):
    hello = live.hello()
    assert hello["generation"] == live.face.generation > 0 and len(hello["rigid"]) == 3
    assert f"{live.face.prepared.particles.count:,} particles" in hello["honest"]
    live._hand_over()
    assert live.instant is not None
    picture = live.picture(live.instant)
    assert int.from_bytes(picture[44:48], "little") == live.face.generation
    take = live.face.take()
    header = json.loads(take[4 : 4 + int.from_bytes(take[:4], "little")])
    assert [o["name"] for o in header["objects"]] == ["ball", "stone", "ball_1"]


@pytest.mark.slow
def test_a_hand_that_holds_something_goes_on_holding_it(shelf):
    live = LiveSimulation(live_editor_of(shelf.made("drop"), 1, LiveAssets(shelf).find), 1)
    place = tuple(live.hands.start[0].tolist())
    high = (place[0], place[1], place[2] + 0.1)
    live._do(Command("grab", object=BALL, point=place, to=high))
    live._do(Command("gravity", to=(0.0, 0.0, -1.0)))
    live._both(1 / 60)
    held = live.hands.grip(live.hands.engine.snapshot().position)
    live._do(Command("add", thing="corporeal/steel_ball", point=(0.3, 0.3, 0.0), to=(0, 0, 0.3)))
    now = live.hands.engine.snapshot().position
    assert held is not None
    np.testing.assert_allclose(live.hands.grip(now), held, atol=1e-6)
    live._both(1 / 60)
    assert live.hands.grip(live.hands.engine.snapshot().position)[2] > held[2]
    speed = live.hands.engine.measure()
    assert speed.momentum[NEW, 2] / speed.mass[NEW] == pytest.approx(-1.0 / 60, rel=0.05)
    # Beginning again takes it away.
    live._do(Command("reset"))
    assert live.face is live.bare and len(live.hands.engine.problem.bodies) == 2


@pytest.mark.slow
def test_a_replay_at_draft_drops_it_at_the_same_time(small_run, live, tmp_path):
    done = InteractionRecord("drop", tuple(live.hands.touches))
    write_record(tmp_path / "touches.json", done)
    assert read_record(tmp_path / "touches.json") == done
    ((when, one),) = drop_events(done)
    assert when == pytest.approx(3 / 60) and one.thing == THING
    write_replays(tmp_path, lambda share, words: None, small_run, tmp_path / "touches.json", [small_run])
    for contact in ("multi", "single"):
        data = (tmp_path / f"{contact}.take").read_bytes()
        header = json.loads(data[4 : 4 + int.from_bytes(data[:4], "little")])
        assert [o["name"] for o in header["objects"]] == ["ball", "stone", "ball_1"]
        assert header["video"]["since"] == {"2": when}


@pytest.mark.slow
def test_what_cannot_be_dropped_is_refused_and_the_simulation_goes_on(shelf):
    live = LiveSimulation(live_editor_of(shelf.made("drop"), 1, LiveAssets(shelf).find), 1)
    for thing, word in (
        ("corporeal/whale", "no 'corporeal/whale'"),
        ("nothing", "RUN/OBJECT"),
        ("../drop/ball", "to drop"),
        ("corporeal/couch", "Drop something smaller|too large"),
    ):
        with pytest.raises(UserError, match=word):
            live._do(Command("add", thing=thing, point=SPOT, to=(0.0, 0.0, 0.1)))
    with pytest.raises(UserError, match="no space"):
        live.hands.obey(Command(RECORDED_ADD, thing=THING, point=(0.7, 0.0, 0.03), to=(0.0, 0.0, 0.1)))
    assert len(live.hands.engine.problem.bodies) == 2 and live.hands.touches == []
    live._both(1 / 60)
    with pytest.raises(UserError):
        parse_command(json.dumps({"do": RECORDED_ADD}))
    with pytest.raises(UserError, match="not a name"):
        parse_command(json.dumps({"do": "add", "thing": 3}))
