"""The live simulation runs on whichever engine the run's settings name."""

import numpy as np
import pytest

import corporeal as co
from corporeal.core.errors import UserError
from corporeal.discretization.discretization_plan import QualityPreset
from corporeal.mpm.problem import ENGINES, Engine
from corporeal.mpm.reference.engine import ReferenceEngine
from corporeal.pipeline.results import StageResults
from corporeal.pipeline.stages.fill import fill
from corporeal.viewer.commands import Command
from corporeal.viewer.live_assets import LiveAssets
from corporeal.viewer.live_simulation import LiveSession, LiveSimulation, live_editor_of
from corporeal.viewer.run_store import LiveInput, RunStore

BALL, STONE, NEW = 0, 1, 2
COARSE = QualityPreset(4, 24, 2000, 2e3, float("inf"))


@pytest.fixture(scope="module")
def results():
    """A foam ball and a stone just over the floor, filled coarsely."""
    soft = co.ball("seat_foam", radius=0.05, at=(0, 0, 0.06), name="ball")
    stone = co.ball("granite", radius=0.05, at=(0.4, 0, 0.06), name="stone")
    ready = co.prepare_scene(co.build_scene(soft, stone))
    return StageResults(
        assemble=ready.scene,
        describe=ready.inventory,
        segment=ready.parts,
        ground=ready.field,
        fill=fill(ready.scene, ready.parts, ready.field, quality=COARSE),
    )


class Plain:
    """An engine with the base contract alone."""

    name = "plain"

    def __init__(self, problem, threads=None):
        self.inner = ReferenceEngine(problem, threads)
        self.problem = problem

    @property
    def time(self):
        return self.inner.time

    @property
    def steps(self):
        return self.inner.steps

    def advance(self, until):
        self.inner.advance(until)

    def stable_step(self):
        return self.inner.stable_step()

    def step(self, dt):
        self.inner.step(dt)

    def snapshot(self):
        return self.inner.snapshot()

    def measure(self):
        return self.inner.measure()

    def save(self):
        return self.inner.save()

    def restore(self, saved):
        self.inner.restore(saved)

    def stop(self, bodies):
        self.inner.stop(bodies)

    def start_from(self, saved, bodies):
        self.inner.start_from(saved, bodies)


@pytest.mark.slow
def test_the_reference_engine_is_pulled_blown_at_and_joined_in_a_live_session(results, tmp_path):
    made = LiveInput(results, "draft", engine="reference")
    live = LiveSimulation(live_editor_of(made, 1, LiveAssets(RunStore((), tmp_path)).find), 1, made.engine)
    hands = live.hands
    assert isinstance(hands.engine, ReferenceEngine)
    assert hands.engine.snapshot().position.shape[0] < 2000
    place = tuple(hands.start[0].tolist())
    live._do(Command("grab", object=BALL, point=place, to=(place[0], place[1], place[2] + 0.1)))
    live._do(Command("wind", object=STONE, to=(0.0, 20.0, 0.0)))
    live._do(Command("gravity", to=(0.0, 0.0, -1.0)))
    live._both(2e-3)
    ledger = hands.engine.measure()
    lifted, blown = (ledger.momentum / ledger.mass[:, None])[[BALL, STONE], [2, 1]]
    assert lifted > 0.0 and blown > 0.0
    assert ledger.momentum[STONE, 2] / ledger.mass[STONE] == pytest.approx(-2e-3, rel=0.05)
    held = hands.grip(hands.engine.snapshot().position)
    live._do(Command("add", thing="corporeal/steel_ball", point=(0.2, 0.3, 0.0), to=(0, 0, 0.05)))
    np.testing.assert_allclose(hands.grip(hands.engine.snapshot().position), held, atol=1e-9)
    live._both(1e-3)
    ledger = hands.engine.measure()
    assert isinstance(hands.engine, ReferenceEngine) and len(ledger.mass) == 3
    assert ledger.momentum[NEW, 2] / ledger.mass[NEW] == pytest.approx(-1e-3, rel=0.05)
    live._hand_over()
    assert live.instant is not None
    picture = live.picture(live.instant)
    assert np.frombuffer(picture[16:24], "<f8")[0] == hands.engine.time
    assert int.from_bytes(picture[44:48], "little") == live.face.generation == 1


def test_a_visitor_of_such_a_run_is_sent_pictures(results):
    room = LiveSession(lambda name: LiveInput(results, "draft", engine="reference"))
    live = room.enter("drop")
    try:
        assert live.wait(0, 60.0) > 0
        live.ask(Command("play", 1))
        number = 0
        for _ in range(20):
            number = live.wait(number, 10.0)
            if np.frombuffer(live.latest[16:24], "<f8")[0] > 0.0:
                break
        else:
            pytest.fail(f"It does not move: {live.message}")
        assert isinstance(live.hands.engine, ReferenceEngine)
    finally:
        room.close()


def test_an_engine_of_which_nothing_more_is_known_is_watched_and_says_what_it_cannot(results, monkeypatch):
    monkeypatch.setitem(ENGINES, "plain", f"{__name__}:Plain")
    made = LiveInput(results, "draft", engine="plain")
    live = LiveSimulation(live_editor_of(made, 1), 1, made.engine)
    live._both(1e-3)
    assert isinstance(live.hands.engine, Plain) and isinstance(live.hands.engine, Engine)
    assert live.hands.engine.time == pytest.approx(1e-3)
    place = tuple(live.hands.start[0].tolist())
    for order, words in (
        (Command("grab", object=BALL, point=place, to=place), "cannot push or pull bodies"),
        (Command("wind", object=BALL, to=(1.0, 0.0, 0.0)), "cannot change gravity or wind"),
        (Command("gravity", to=(0.0, 0.0, -1.0)), "cannot change gravity or wind"),
    ):
        with pytest.raises(UserError, match=words):
            live._do(order)
        live.orders.append(order)
        live._obey()
        assert f"The engine 'plain' {words}" in live.message
    live._both(1e-3)
