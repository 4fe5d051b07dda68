"""Every example runs and gives one physical number."""

import runpy
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def example(name):
    return runpy.run_path(str(EXAMPLES / name))["main"]()


def test_a_rubber_ball_comes_back_but_not_all_the_way():
    assert 0.3 < example("01_drop_a_ball.py") < 0.98
