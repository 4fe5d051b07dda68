"""The benchmark against life drops things as a person's scene would, and says what is missed."""

from dataclasses import replace

import life
import pytest

from corporeal.lab.evaluation.rebound_data import measured_rebounds

ROWS = {row.name: row for row in measured_rebounds()}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rubber ball", "basketball", "ball of memory foam", "wooden ball"])
def test_what_is_dropped_at_draft_comes_back_as_in_life(name):
    found = life.tried(ROWS[name], "draft", 0)
    assert isinstance(found, life.DropResult)
    assert ROWS[name].off(found.restitution) <= life.LEEWAY
    assert abs(found.unbooked) < life.UNBOOKED
    assert (found.contact > 1e-3) == (found.treatment != "rigid")


def a_drop(name, detail, restitution, unbooked=0.02):
    return life.DropResult(name, detail, 0, restitution, 3e-3, "deformable", 1.0, unbooked, 100)


def test_every_target_is_judged():
    row = replace(ROWS["rubber ball"], low=0.7, high=0.8)
    good = [a_drop(row.name, "draft", 0.75), a_drop(row.name, "normal", 0.76)]
    met = life.verdicts(list(life.results([row], good)), [])
    assert all(fine for _, fine in met)
    bad = [a_drop(row.name, "draft", 0.95, 0.2), a_drop(row.name, "normal", 0.76)]
    missed = life.verdicts(list(life.results([row], bad)), ["one did not end"])
    assert not any(fine for _, fine in missed)
    assert "rubber ball (20%)" in missed[3][0]


def test_the_page_holds_every_row_with_its_source():
    row = ROWS["rubber ball"]
    found = list(life.results([row], [a_drop(row.name, "draft", 0.75)]))
    page = life.page(found, life.verdicts(found, []))
    assert "| rubber ball | draft | 0.70–0.85 | 0.750 |" in page
    assert "1. Collected from textbooks" in page


def test_the_page_says_how_many_rows_were_met_before_anything_was_changed():
    row = ROWS["lacrosse ball"]
    assert row.blind
    for speed, now in ((0.8, 1), (0.6, 0)):
        found = list(life.results([row], [a_drop(row.name, "draft", speed)]))
        said = life.page(found, life.verdicts(found, []))
        assert "were written down before they were tried (lacrosse ball): 20" in said
        assert f"{now} are now" in said
