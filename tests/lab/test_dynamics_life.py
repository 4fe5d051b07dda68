"""Real balls are dropped by every method that needs no files, and held to published rebounds."""

from dataclasses import replace

import pytest

from corporeal.jobs.jobs import perform
from corporeal.lab.evaluation.dynamics import life_drops
from corporeal.lab.evaluation.dynamics.life_drops import drop_jobs, dropped
from corporeal.lab.evaluation.dynamics.methods import Method, method_of, ours
from corporeal.lab.evaluation.dynamics.summary import _life, _ranks
from corporeal.lab.evaluation.life import rebounds
from corporeal.pipeline.runner import Settings

GOLF = next(row for row in rebounds() if row.name == "golf ball")


def test_a_ball_is_dropped_once_and_compared_with_its_range(tmp_path, monkeypatch):
    monkeypatch.setattr(life_drops, "rebounds", lambda: (GOLF,))
    (job,) = drop_jobs(tmp_path, [ours], Settings())
    perform(job, lambda done, words: None)
    assert drop_jobs(tmp_path, [ours], Settings())[0].done
    (found,) = dropped(tmp_path, ours)
    assert 0.5 < found.restitution < 0.9
    near = replace(found, row=replace(GOLF, low=found.restitution + 0.02, high=0.99))
    far = replace(found, row=replace(GOLF, low=found.restitution + 0.05, high=0.99))
    assert _life("ours", [near, far]).inside == 1
    assert _life("ours", [near, far]).off == pytest.approx(0.035)
    assert dropped(tmp_path, method_of("single")) == []


def test_methods_with_files_are_not_dropped(tmp_path):
    methods = [ours, method_of("one"), Method("vomp", "vomp:fields")]
    names = [job.name for job in drop_jobs(tmp_path, methods, Settings())]
    assert len(names) == len(set(names)) == 2 * len(rebounds())
    assert not any(name.endswith(".vomp") for name in names)


def test_ranks_of_restitution_include_real_balls():
    low, high = replace(GOLF, low=0.1, high=0.2), replace(GOLF, low=0.7, high=0.8)
    right = [life_drops.Dropped(low, 0.3), life_drops.Dropped(high, 0.5)]
    assert _ranks("ours", {}, right).restitution.tau == 1
    wrong = [life_drops.Dropped(low, 0.5), life_drops.Dropped(high, 0.3)]
    assert _ranks("ours", {}, wrong).restitution.tau == -1
