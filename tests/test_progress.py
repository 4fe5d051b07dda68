"""What is said of work that goes on: in a log, and of a part as of the whole."""

import io
import threading

import numpy as np
import pytest
from rich.console import Console

from corporeal.core import terminal
from corporeal.core.progress import subprogress
from corporeal.core.terminal import StageProgress, duration_words, log_lines
from corporeal.reconstruction.masks import grown_masks as module


def test_progress_of_a_part_is_of_the_whole():
    told = []
    part = subprogress(lambda *what: told.append(what), 0.5, 0.75, ", once more")
    part(0.0, "growing")
    part(1.0, "drawing")
    assert told == [(0.5, "growing, once more"), (0.75, "drawing, once more")]


@pytest.mark.parametrize(
    ("told", "now", "said"),
    [
        ([], 40.0, "video 0% after 40 s"),
        ([(0.01, 3.0)], 40.0, "video 1% after 40 s: drawing"),
        ([(0.0, 0.0), (0.25, 40.0)], 40.0, "video 25% after 40 s, about 2 min left: drawing"),
        # Goes on from what an interrupted run left: that took no time now.
        ([(0.6, 0.0), (0.7, 40.0)], 40.0, "video 70% after 40 s, about 2 min left: drawing"),
        ([(0.6, 0.0)], 40.0, "video 60% after 40 s: drawing"),
    ],
)
def test_the_time_left_follows_from_what_was_done_since_the_first_report(told, now, said):
    verb = StageProgress("video", 0.0)
    for fraction, when in told:
        verb.report(fraction, "drawing", when)
    assert verb.line(now) == said


@pytest.mark.parametrize(("seconds", "said"), [(1.4, "1 s"), (89.0, "89 s"), (90.0, "2 min"), (9000.0, "2.5 h")])
def test_times_are_written_as_people_say_them(seconds, said):
    assert duration_words(seconds) == said


class Heard(io.StringIO):
    """Tells when a line has come."""

    def __init__(self):
        super().__init__()
        self.more = threading.Condition()

    def write(self, text):
        with self.more:
            count = super().write(text)
            self.more.notify_all()
        return count

    def waits_for(self, words):
        with self.more:
            return self.more.wait_for(lambda: words in self.getvalue(), 20)


def test_a_log_has_a_line_where_a_verb_begins_and_ends():
    where = Heard()
    with log_lines(Console(file=where), now=lambda: 0.0, soon=0.01) as tell:
        tell("fill")(0.5, "[b]half[/b]")
        assert where.waits_for("fill begins")
        tell("video")
        assert where.waits_for("video begins")
    assert where.getvalue().splitlines() == ["fill begins", "fill done in 0 s", "video begins", "video done in 0 s"]


def test_what_is_over_at_once_is_not_worth_a_line():
    where = io.StringIO()
    with log_lines(Console(file=where)) as tell:
        tell("assemble")
        tell("describe")
    assert where.getvalue() == ""


def test_what_failed_is_not_reported_to_be_done():
    where = Heard()
    with pytest.raises(ValueError), log_lines(Console(file=where), soon=0.01) as tell:
        tell("fill")
        assert where.waits_for("fill begins")
        raise ValueError
    assert where.getvalue() == "fill begins\n"


def test_a_log_says_so_while_nothing_is_reported_either():
    """Of a call into another library nobody hears anything for minutes."""
    where = Heard()
    with log_lines(Console(file=where), every=0.01, soon=0.01) as tell:
        tell("reconstruct")(0.4, "matching [3/4]")
        assert where.waits_for("reconstruct 40% after 0 s: matching [3/4]")


def test_a_pipe_gets_no_progress_bar(capsys, monkeypatch):
    monkeypatch.setattr(terminal, "console", Console(stderr=True))
    with terminal.progress_bars() as tell:
        tell("masks")(0.5, "growing masks")
    assert "growing" not in capsys.readouterr().err, "no bar"


def test_masks_that_are_grown_again_are_distinguished_and_never_go_back(monkeypatch):
    """The bar began again, with the same words."""
    told = []

    def grow(views, seeds, progress, flat=False):
        for fraction in (0.0, 0.5, 1.0):
            progress(fraction, "growing masks")
        return object()

    def taken_in(views, seeds, grown, progress, flat):
        grow(views, seeds, progress)
        return grown

    monkeypatch.setattr(module, "grow_masks", grow)
    monkeypatch.setattr(module, "merge_attachments", taken_in)
    monkeypatch.setattr(module, "incompleteness_reason", lambda grown: "a part")
    monkeypatch.setattr(module, "mask_doubt", lambda grown: None)
    module._grow_and_describe(None, None, alone=False, progress=lambda *what: told.append(what))  # type: ignore
    fractions, words = zip(*told, strict=True)
    assert (np.diff(fractions) >= 0).all() and fractions[-1] == module.GROWN_THRICE_PROGRESS
    assert len(set(words)) == 3
