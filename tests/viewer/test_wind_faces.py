"""The air that the page's scenes stand in."""

from dataclasses import replace

import numpy as np
import pytest

from corporeal.core.types import Wind
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.viewer.live_simulation import live_editor_of
from corporeal.viewer.run_store import RunStore
from corporeal.viewer.wind_faces import with_wind_faces

BALL = 0


@pytest.fixture(scope="module")
def problem(small_run):
    return live_editor_of(RunStore((), small_run.parent).made("drop"), 1).at(()).posed.problem


def moved(problem, wind=None):
    """Positions after a sixtieth of a second, the ball blown at or not."""
    engine = CpuEngine(problem, 1)
    if wind:
        engine.set_wind(BALL, wind)
    engine.advance(1 / 60)
    return engine.snapshot().position


@pytest.mark.slow
def test_calm_air_moves_nothing_and_any_object_can_still_be_blown_at(problem):
    assert all(body.wind is not None and len(body.faces.area) for body in problem.bodies)
    without = replace(problem, bodies=tuple(replace(b, wind=None) for b in problem.bodies))
    assert np.array_equal(moved(problem), moved(without))
    blown = moved(problem, (20.0, 0.0, 0.0)) - moved(problem)
    assert blown[: len(problem.bodies[BALL].position), 0].mean() > 1e-5


def test_an_object_that_has_a_wind_keeps_it(small_run):
    scene = RunStore((), small_run.parent).made("drop").results.assembled.scene
    gale = Wind((8.0, 0.0, 0.0))
    windy = replace(scene, objects=(replace(scene.objects[0], wind=gale), *scene.objects[1:]))
    assert with_wind_faces(windy).objects[0].wind == gale
