"""Every example runs and gives one physical number."""

import runpy
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def example(name):
    return runpy.run_path(str(EXAMPLES / name))["main"]()


def test_a_rubber_ball_comes_back_but_not_all_the_way():
    assert 0.3 < example("01_drop_a_ball.py") < 0.98


def test_a_dragged_ball_trails_behind_the_hand():
    assert 0.05 < example("02_drag_an_object.py") < 0.4


def test_three_bricks_make_a_pile_as_high_as_themselves():
    assert abs(example("03_settle_a_pile.py") - 1) < 0.005
