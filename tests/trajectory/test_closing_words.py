"""What a run says last: kinds and weight by the words of sentences."""

import pytest

from corporeal.trajectory.closing_words import ASSUMED, DOUBT, LEFT_OUT, closing_words, parted
from made_findings import run_audit

MADE_UP = "Between a.jpg and b.jpg lie 240° from which nobody looked: what faces there is made up."
PIECES = "can: nobody looked what it is made up of. --vlm or --annotations name pieces."
UNKNOWN = "axe is of unknown material; plastics-PP stands in. Say what it is with --annotations."
DEPTH = "Objects penetrate each other by up to 2.0 grid cells: a finer --detail reduces it."
GONE = "2 of 10 photographs do not fit the others and were left out: c.jpg, d.jpg."
MASKS = "There were no masks. They lie in 0-reconstruct/masks: what is corrected there is taken."
CHECK = f"{MASKS} Check them: its outlines contradict each other (60% agree)."


@pytest.mark.parametrize(
    ("warning", "kind"),
    [
        (MADE_UP, DOUBT),
        (PIECES, ASSUMED),
        (UNKNOWN, DOUBT),
        (DEPTH, DOUBT),
        (GONE, LEFT_OUT),
        (MASKS, ASSUMED),
        (CHECK, DOUBT),
    ],
)
def test_a_sentence_tells_by_its_words_what_it_is(warning, kind):
    said = closing_words(run_audit(warnings=(warning,)))
    assert {k for k, sentences in said.items() if sentences} == {kind}


def test_the_gravest_comes_first_and_each_once():
    warnings = (GONE, PIECES, DEPTH, UNKNOWN, PIECES)
    said = closing_words(run_audit(warnings=warnings, hints=("Nothing moves.", PIECES)))
    assert list(said.items()) == [
        (DOUBT, (UNKNOWN, DEPTH)),
        (ASSUMED, (PIECES, "Nothing moves.")),
        (LEFT_OUT, (GONE,)),
    ]


@pytest.mark.parametrize(
    ("sentences", "first"),
    [
        (GONE, GONE),
        (PIECES, PIECES),
        (UNKNOWN, "axe is of unknown material; plastics-PP stands in."),
        ("Left out: DSC_1.jpg. Put a newspaper under it.", "Left out:"),
        ("It is 0.5 m long.", "It is 0.5 m long."),
    ],
)
def test_what_is_the_matter_is_the_first_sentence(sentences, first):
    assert parted(sentences)[0] == first
    assert " ".join(filter(None, parted(sentences))) == sentences
