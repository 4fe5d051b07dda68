"""Real balls are dropped by every method that needs no files, and held to published rebounds."""

from dataclasses import replace

import pytest

from corporeal.jobs.job import perform_job
from corporeal.lab.evaluation.dynamics import rebound_drops
from corporeal.lab.evaluation.dynamics.compared_methods import OUR_METHOD, Method, parse_method
from corporeal.lab.evaluation.dynamics.dynamics_summary import _life, _ranks
from corporeal.lab.evaluation.dynamics.rebound_drops import drop_jobs, read_drops
from corporeal.lab.evaluation.rebound_data import measured_rebounds
from corporeal.pipeline.run_pipeline import Settings

GOLF = next(row for row in measured_rebounds() if row.name == "golf ball")


def test_a_ball_is_dropped_once_and_compared_with_its_range(tmp_path, monkeypatch):
    monkeypatch.setattr(rebound_drops, "measured_rebounds", lambda: (GOLF,))
    (job,) = drop_jobs(tmp_path, [OUR_METHOD], Settings())
    perform_job(job, lambda done, words: None)
    assert drop_jobs(tmp_path, [OUR_METHOD], Settings())[0].done
    (found,) = read_drops(tmp_path, OUR_METHOD)
    assert 0.5 < found.restitution < 0.9
    near = replace(found, row=replace(GOLF, low=found.restitution + 0.02, high=0.99))
    far = replace(found, row=replace(GOLF, low=found.restitution + 0.05, high=0.99))
    assert _life("ours", [near, far]).inside == 1
    assert _life("ours", [near, far]).off == pytest.approx(0.035)
    assert read_drops(tmp_path, parse_method("single")) == []


def test_methods_with_files_are_not_dropped(tmp_path):
    methods = [OUR_METHOD, parse_method("one"), Method("vomp", "vomp:fields")]
    names = [job.name for job in drop_jobs(tmp_path, methods, Settings())]
    assert len(names) == len(set(names)) == 2 * len(measured_rebounds())
    assert not any(name.endswith(".vomp") for name in names)


def test_ranks_of_restitution_include_real_balls():
    low, high = replace(GOLF, low=0.1, high=0.2), replace(GOLF, low=0.7, high=0.8)
    right = [rebound_drops.MethodDrop(low, 0.3), rebound_drops.MethodDrop(high, 0.5)]
    assert _ranks("ours", {}, right).restitution.tau == 1
    wrong = [rebound_drops.MethodDrop(low, 0.5), rebound_drops.MethodDrop(high, 0.3)]
    assert _ranks("ours", {}, wrong).restitution.tau == -1
