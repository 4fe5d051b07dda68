"""What this process may use of the machine."""

import os

import pytest

from corporeal.machine import cores


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="Linux only")
def test_an_affinity_mask_counts(tmp_path):
    before = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(before)})
        assert cores(tmp_path / "none") == 1
    finally:
        os.sched_setaffinity(0, before)


@pytest.mark.parametrize(
    ("text", "most"),
    [("50000 100000\n", 1), ("max 100000\n", None), ("nonsense", None), ("150000 100000", 2)],
)
def test_a_quota_counts(tmp_path, text, most):
    free = cores(tmp_path / "none")
    (tmp_path / "cpu.max").write_text(text)
    assert cores(tmp_path / "cpu.max") == min(most or free, free)


@pytest.mark.parametrize(
    ("text", "most"), [("1", 1), ("1,2", 1), ("0", None), ("many", None), ("", None)]
)
def test_a_wish_in_the_environment_counts(tmp_path, monkeypatch, text, most):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    free = cores(tmp_path / "none")
    monkeypatch.setenv("OMP_NUM_THREADS", text)
    assert cores(tmp_path / "none") == min(most or free, free)
