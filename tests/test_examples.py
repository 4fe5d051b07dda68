"""Every example runs, whole and offline, and gives one number that nature or a bound explains."""

import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
LONGEST = 45
"""Lines of an example."""


def example(name):
    return runpy.run_path(str(ROOT / "examples" / name))["main"]()


def test_there_are_eleven_and_the_index_names_each_once():
    assert [path.name[:2] for path in EXAMPLES] == [f"{k:02d}" for k in range(1, 12)]
    page = (ROOT / "docs" / "getting-started" / "examples.md").read_text()
    named = re.findall(r"\d\d_\w+\.py", page)
    assert named == [path.name for path in EXAMPLES]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short(path):
    assert len(path.read_text().splitlines()) <= LONGEST


@pytest.mark.slow
def test_a_rubber_ball_comes_back_but_not_all_the_way():
    assert 0.3 < example("01_drop_a_ball.py") < 0.98


def test_sound_runs_nearly_five_times_faster_in_steel_than_in_lead():
    assert example("02_look_up_materials.py") == pytest.approx(5100 / 1160, rel=0.1)


@pytest.mark.slow
def test_a_sliding_block_stops_where_coulomb_says():
    assert example("03_slide_a_block.py") == pytest.approx(1.0, abs=0.03)


@pytest.mark.slow
def test_a_column_of_sand_runs_out_as_far_as_in_experiments():
    assert example("04_collapse_sand.py") == pytest.approx(1.24, rel=0.25)


@pytest.mark.slow
def test_a_model_becomes_a_report_and_no_momentum_goes_astray():
    assert example("05_run_a_model.py") < 1e-3


@pytest.mark.slow
def test_a_material_with_less_loss_bounces_higher_than_rubber():
    assert 1.0 < example("06_add_a_material.py") < 1.67, "and no higher than it fell"


def test_a_kick_gives_a_ball_its_impulse():
    assert example("07_push_and_pull.py") == pytest.approx(1.0, abs=1e-4)


@pytest.mark.slow
def test_photographs_of_a_box_become_a_body_of_about_its_volume():
    assert example("08_photographs_to_a_scene.py") == pytest.approx(1.0, abs=0.25)


@pytest.mark.slow
def test_an_ensemble_spreads_a_rebound_but_not_beyond_reason():
    assert 0.02 < example("09_vary_the_materials.py") < 0.8


@pytest.mark.slow
def test_a_bar_of_a_law_of_ones_own_swings_at_its_period():
    assert example("11_write_a_law.py") == pytest.approx(1.0, abs=0.04)


@pytest.mark.slow
def test_a_corpus_of_two_scenes_keeps_its_momentum():
    assert example("10_make_a_corpus.py") < 1e-3
