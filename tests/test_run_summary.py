"""What a finished run says in the terminal."""

import pytest
from rich.console import Console

from corporeal.cli import run_summary
from corporeal.cli.run_summary import show_summary
from corporeal.core import store
from corporeal.core.audit_data import PredictedBreakage
from corporeal.core.types import Note, NoteKind
from corporeal.simulation.audit_file import AUDIT_FILE
from sample_findings import audit_finding, run_audit


def breakage(word, ratio, pieces=0):
    return PredictedBreakage("glass_0", "glass", "tile_0", 0.3, 3.1, 0.75, ratio, word, pieces)


@pytest.mark.parametrize(
    ("found", "told"),
    [
        (breakage("would break", 11.0), ("glass would break", "with --breaking")),
        (breakage("may break", 3.0), ("glass may break",)),
        (breakage("holds", 0.4), ()),
        (breakage("would break", 11.0, pieces=7), ()),
    ],
)
def test_what_would_break_is_reported_where_the_video_shows_it_whole(tmp_path, capsys, found, told):
    """A glass that fell on a tile bounced, and only the report said that it would break."""
    store.write_json(tmp_path / AUDIT_FILE, store.to_plain(run_audit(breakage=(found,))))
    show_summary(tmp_path)
    said = capsys.readouterr()
    text = said.out + said.err
    assert all(words in text for words in told)
    assert ("break" in text) == bool(told)


@pytest.mark.parametrize(("count", "told"), [(6, "and 1 warning more:"), (7, "and 2 warnings more:")])
def test_warnings_that_are_left_out_are_counted_as_one_counts(tmp_path, capsys, count, told):
    warnings = tuple(f"Number {k}." for k in range(count))
    store.write_json(tmp_path / AUDIT_FILE, store.to_plain(run_audit(warnings=warnings)))
    show_summary(tmp_path)
    said = capsys.readouterr()
    assert told in said.out + said.err


def test_what_a_run_says_last_is_in_order_of_weight(tmp_path, capsys):
    warnings = (
        Note("1 picture was left out: a.jpg.", NoteKind.LEFT_OUT),
        Note("Say more with --vlm.", NoteKind.ASSUMED),
        "It may be wrong.",
    )
    store.write_json(tmp_path / AUDIT_FILE, store.to_plain(run_audit(warnings=warnings, hints=("Still.",))))
    show_summary(tmp_path)
    said = capsys.readouterr()
    assert (said.out + said.err).splitlines()[-4:] == [
        "warning: It may be wrong.",
        "hint: Say more with --vlm.",
        "hint: Still.",
        "left out: 1 picture was left out: a.jpg.",
    ]


def test_every_grave_finding_is_one_line_at_the_end(tmp_path, capsys):
    """Of a shelf that buckled like rubber the terminal said that it rebounds too little."""
    found = tuple(audit_finding(sentence=f"shelf_{k}: boards is softer. Look.") for k in range(7))
    notes = (*(Note(f.sentence, NoteKind.GRAVE) for f in found), "It may be wrong.")
    audit = run_audit(warnings=notes, findings=(*found, audit_finding(severity="minor", sentence="A little.")))
    store.write_json(tmp_path / AUDIT_FILE, store.to_plain(audit))
    show_summary(tmp_path)
    said = capsys.readouterr()
    lines = (said.out + said.err).splitlines()
    assert lines[-8:] == ["warning: It may be wrong.", *(f"grave: {f.sentence}" for f in found)]


def test_in_a_terminal_sentences_stand_beside_their_word(tmp_path, capsys, monkeypatch):
    where = Console(stderr=True, force_terminal=True, width=40, color_system=None)
    monkeypatch.setattr(run_summary, "console", where)
    warnings = ("It may be wrong by a factor. Measure one of its sides by hand.",)
    store.write_json(tmp_path / AUDIT_FILE, store.to_plain(run_audit(warnings=warnings)))
    show_summary(tmp_path)
    lines = [line.rstrip() for line in capsys.readouterr().err.splitlines()]
    begun = next(k for k, line in enumerate(lines) if line.startswith("warning: It may"))
    assert len(lines) > begun + 1, "40 columns do not hold it"
    assert all(line.startswith(" " * 9) for line in lines[begun + 1 :])
