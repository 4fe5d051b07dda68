"""One object's questions, asked for several answers: each answer is a chain of its own.

What is asked about values hangs on what was answered about materials, so that an answer is taken
from its first question to its last before answers are pooled.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from corporeal.core.types import MassEvidence, ObjectAnswer, PartDescription
from corporeal.vlm import SINGLE_ANSWER, AnswerNumber
from corporeal.vlm.human_client import PendingQuestionsError
from corporeal.vlm.interpret_answers import evidence_from_answer
from corporeal.vlm.interview import Interview


def repeat_interview(
    interview: Interview, count: int, described: Callable[[], list[PartDescription]], direct: bool
) -> list[ObjectAnswer]:
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
        return [ObjectAnswer(tuple(described()), _judge_mass(interview, direct))]
    told, whole, waiting = [], [], []
    for number in range(1, count + 1):
        interview.turn = AnswerNumber(number, count)
        before = len(interview.transcript)
        parts = _ask_unless_pending(described, waiting)
        fits = _is_complete(interview.transcript[before:])
        evidence = _ask_unless_pending(partial(_judge_mass, interview, direct), waiting)
        if parts is not None:
            told.append(ObjectAnswer(tuple(parts), evidence))
            whole += [told[-1]] if fits else []
    interview.turn = SINGLE_ANSWER
    if waiting:
        raise PendingQuestionsError(str(waiting[0]), sum(error.count for error in waiting))
    _warn_of_left_out_answers(interview, whole, count)
    return whole or told[:1]


def _ask_unless_pending(ask: Callable, waiting: list[PendingQuestionsError]):
    """Ask; where a person has yet to answer, go on with what else can be asked."""
    try:
        return ask()
    except PendingQuestionsError as error:
        waiting.append(error)
        return None


def _is_complete(rows: Sequence[Mapping]) -> bool:
    """Return whether every question was answered, if only one of the times that it was put."""
    answered = {row["task"] for row in rows if row["answer"] is not None}
    return all(row["task"] in answered for row in rows)


def _judge_mass(interview: Interview, direct: bool) -> MassEvidence | None:
    weighs = interview.mass() if direct else None
    return evidence_from_answer(*weighs) if weighs else None


def _warn_of_left_out_answers(
    interview: Interview, whole: Sequence[ObjectAnswer], count: int
) -> None:
    """Warn of answers that are left out, and say nothing twice."""
    warnings = list(dict.fromkeys(interview.warnings))
    if len(whole) < count:
        kept = f"{len(whole)} of {count} answers count" if whole else "the first answer counts"
        warnings.append(f"{interview.subject.name}: {kept}; a question to the others stayed open.")
    interview.warnings[:] = warnings
