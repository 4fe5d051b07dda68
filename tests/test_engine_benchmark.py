"""The benchmark of the engine: rows as promised, nothing forgotten when memory is counted."""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest

from corporeal.core.process_resources import usable_cores

BENCHMARKS = Path(__file__).parent.parent / "benchmarks"
KEYS = {
    "engine", "device", "threads", "law", "particles", "objects", "ns_per_particle_substep",
    "bytes_per_particle",
}  # fmt: skip


@pytest.fixture(scope="module")
def engine():
    sys.path.insert(0, str(BENCHMARKS))
    try:
        import engine

        yield engine
    finally:
        sys.path.remove(str(BENCHMARKS))


def test_rows_and_page_are_made_from_one_run(engine, tmp_path, monkeypatch):
    tiny = engine.Size(1000, (500, 2000), (2,), (32,), 2, (1,))
    monkeypatch.setattr(engine, "QUICK", tiny)
    monkeypatch.setattr(engine, "DOCS", tmp_path)
    words = ["engine.py", "--quick", "--docs", "--json", str(tmp_path / "rows.json")]
    words += ["--history", str(tmp_path / "history.csv")]
    monkeypatch.setattr(sys, "argv", words)
    engine.main()
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert all(set(row) == KEYS for row in rows)
    assert {row["law"] for row in rows} == {
        "corotated", "neo_hookean", "hencky", "drucker_prager", "von_mises", "fluid",
    }  # fmt: skip
    assert {row["objects"] for row in rows} >= {1, 2}
    assert all(row["ns_per_particle_substep"] > 0 for row in rows)
    kept = list(csv.DictReader((tmp_path / "history.csv").open(encoding="utf-8")))
    # A heap, the same on more threads, and a free flight are no rows of the first table.
    more = 2 + sum(threads <= usable_cores() for threads in (2, 4))
    assert len(kept) == len(rows) + more, "so are they in the history"
    assert kept[0]["ratio"] == "1.000"
    assert all(float(row["ratio"]) > 0 for row in kept)
    page = (tmp_path / "reference" / "substep-benchmark.md").read_text()
    assert page.count("| corporeal |") == len(rows) + more, "heaps and a free flight are shown too"
    assert len(list((tmp_path / "images").glob("benchmarks-*.png"))) == 3


def test_memory_is_counted_once(engine):
    from cost.contest import held

    class Window:
        __module__ = "corporeal.mpm.cpu.field_window"

        def __init__(self):
            self.part = np.zeros(1000)
            self.view = self.part[10:].reshape(99, 10).T
            self.lists = {"a": [np.zeros(10, np.int32)]}

    class Engine:
        __module__ = "corporeal.mpm.cpu.engine"

        def __init__(self):
            self.problem = np.zeros(5000)
            self.window = {0: Window()}
            self.same = self.window[0]

    assert held(Engine()) == 8 * 1000 + 40


def test_blocks_have_the_particles_they_say_and_do_not_overlap(engine):
    from cost.blocks import CELL, drop_of, problem_of

    for given in ({}, {"objects": 16}, {"objects": 16, "heap": True}, {"objects": 8, "extent": 64}):
        drop = drop_of(20_000, **given)
        bodies = problem_of(drop).bodies
        assert sum(len(b.position) for b in bodies) == drop.particles
        assert drop.particles == pytest.approx(20_000, rel=0.25)
        places = np.concatenate([b.position for b in bodies])
        assert len(np.unique(np.floor(places / (0.4 * CELL)), axis=0)) == drop.particles
        if drop.extent:
            np.testing.assert_allclose(np.ptp(places, axis=0), drop.extent * CELL, rtol=0.02)


@pytest.mark.slow
def test_a_checkout_costs_what_it_costs(engine):
    """Both processes run the same code, so their costs agree but for the machine's noise."""
    import against

    case = against.Case("COROTATED", 1, 2000)
    here, there, ratio = against.compare(case, against.HERE, rounds=3, substeps=4)
    assert here > 0 and there > 0
    assert 0.2 < ratio < 5.0


def test_phases_of_a_heap_add_up_and_contact_costs_nothing_where_there_is_none(engine):
    from cost import phases
    from cost.blocks import drop_of

    drops = drop_of(1000), drop_of(4000, objects=8, heap=True)
    lines = phases.table(drops, 4).splitlines()
    rows = {line.split("|")[1].strip(): line.split("|")[2:-1] for line in lines[2:]}
    values = {name: [float(cell) for cell in cells] for name, cells in rows.items()}
    whole, ratio = values.pop("all"), values.pop("against the first")
    for column in range(2):
        parts = sum(value[column] for value in values.values())
        assert parts == pytest.approx(whole[column], abs=0.05 * len(values))
    assert values["move"][0] > 0.5 * (whole[0] - values[phases.BETWEEN][0])
    assert values["reach"][0] == 0.0 < values["reach"][1]
    assert ratio[0] == 1.0 < ratio[1]


def test_phases_are_not_timed_on_several_threads():
    from cost.phase_clock import PhaseClock

    from corporeal.core.errors import UserError

    class OnTwo:
        threads = 2

    with pytest.raises(UserError, match="one thread, not 2"):
        PhaseClock(OnTwo())
