"""One object's questions, asked for several answers: each answer is a chain of its own.

What is asked about values hangs on what was answered about materials, so that an answer is taken
from its first question to its last before answers are pooled.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from corporeal.core.types import Account, Evidence, PartWords
from corporeal.vlm import ONCE, Turn
from corporeal.vlm.by_hand import WaitingError
from corporeal.vlm.interview import Interview
from corporeal.vlm.words import evidence_of


def told_several_times(
    interview: Interview, count: int, described: Callable[[], list[PartWords]], direct: bool
) -> list[Account]:
    """Return what each of ``count`` answers says of one object.

    An answer of which a question got nothing usable is left out, and that is said; where all are,
    the first stands, with what the file says in place of what is missing.

    Args:
        interview: Of the object.
        count: How many answers are wanted.
        described: Asks about its parts, as often as it is called.
        direct: Whether its mass is asked for outright.

    Raises:
        WaitingError: Questions wait for a person: as many as can be asked now.

    """
    if count == 1:
        return [Account(tuple(described()), _judged(interview, direct))]
    told, whole, waiting = [], [], []
    for number in range(1, count + 1):
        interview.turn = Turn(number, count)
        before = len(interview.transcript)
        parts = _unless_it_waits(described, waiting)
        fits = _is_whole(interview.transcript[before:])
        evidence = _unless_it_waits(partial(_judged, interview, direct), waiting)
        if parts is not None:
            told.append(Account(tuple(parts), evidence))
            whole += [told[-1]] if fits else []
    interview.turn = ONCE
    if waiting:
        raise WaitingError(str(waiting[0]), sum(error.count for error in waiting))
    _say_what_is_left_out(interview, whole, count)
    return whole or told[:1]


def _unless_it_waits(ask: Callable, waiting: list[WaitingError]):
    """Ask; where a person has yet to answer, go on with what else can be asked."""
    try:
        return ask()
    except WaitingError as error:
        waiting.append(error)
        return None


def _is_whole(rows: Sequence[Mapping]) -> bool:
    """Tell whether every question was answered, if only one of the times that it was put."""
    answered = {row["task"] for row in rows if row["answer"] is not None}
    return all(row["task"] in answered for row in rows)


def _judged(interview: Interview, direct: bool) -> Evidence | None:
    weighs = interview.mass() if direct else None
    return evidence_of(*weighs) if weighs else None


def _say_what_is_left_out(interview: Interview, whole: Sequence[Account], count: int) -> None:
    """Warn of answers that are left out, and say nothing twice."""
    warnings = list(dict.fromkeys(interview.warnings))
    if len(whole) < count:
        kept = f"{len(whole)} of {count} answers count" if whole else "the first answer counts"
        warnings.append(f"{interview.subject.name}: {kept}; a question to the others stayed open.")
    interview.warnings[:] = warnings
