"""What a run says last: sentences by the kind that they were given where they were made."""

import pytest

from corporeal.core.types import Note, NoteKind
from corporeal.simulation.summary_text import (
    ASSUMPTIONS_SECTION,
    FINDINGS_SECTION,
    LEFT_OUT_SECTION,
    WARNINGS_SECTION,
    split_advice,
    summary_sections,
)
from sample_findings import audit_finding, run_audit

PIECES = Note("can: nobody looked what it is made up of. --vlm or --annotations name pieces.", NoteKind.ASSUMED)
UNKNOWN = Note(
    "axe is of unknown material; plastics-PP is assumed. State its material with --annotations.", NoteKind.GRAVE
)
DEPTH = "Objects penetrate each other by up to 2.0 grid cells: a finer --detail reduces it."
GONE = Note("2 of 10 photographs do not fit the others and were left out: c.jpg, d.jpg.", NoteKind.LEFT_OUT)


def test_the_gravest_comes_first_and_each_once():
    warnings = (GONE, PIECES, DEPTH, UNKNOWN, PIECES)
    soft = audit_finding(sentence="can_0: body is softer.")
    little = audit_finding(sentence="can_0: tab is softer.", severity="minor")
    warnings = (*warnings, Note(soft.sentence, NoteKind.GRAVE))
    told = run_audit(warnings=warnings, hints=("Nothing moves.", PIECES), findings=(soft, little))
    said = summary_sections(told)
    assert list(said.items()) == [
        (FINDINGS_SECTION, (soft.sentence,)),
        (WARNINGS_SECTION, (UNKNOWN, DEPTH)),
        (ASSUMPTIONS_SECTION, (PIECES, "Nothing moves.")),
        (LEFT_OUT_SECTION, (GONE,)),
    ]


@pytest.mark.parametrize("words", [str(GONE), str(PIECES), str(UNKNOWN)])
def test_words_alone_make_no_kind(words):
    said = summary_sections(run_audit(warnings=(words,)))
    assert said == {FINDINGS_SECTION: (), WARNINGS_SECTION: (words,), ASSUMPTIONS_SECTION: (), LEFT_OUT_SECTION: ()}


@pytest.mark.parametrize(
    ("sentences", "first"),
    [
        (GONE, GONE),
        (PIECES, PIECES),
        (UNKNOWN, "axe is of unknown material; plastics-PP is assumed."),
        ("Left out: DSC_1.jpg. Put a newspaper under it.", "Left out:"),
        ("It is 0.5 m long.", "It is 0.5 m long."),
    ],
)
def test_what_is_the_matter_is_the_first_sentence(sentences, first):
    assert split_advice(sentences)[0] == first
    assert " ".join(filter(None, split_advice(sentences))) == sentences
