"""Repeated interviews on one object; each answer is a complete interview.

Questions on values depend on the answers on materials, so complete interviews are pooled.
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
    """Return the descriptions of one object by ``count`` answers.

    Answers with an unusable reply are left out with a warning; if all are, the first is used,
    completed from the file.

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
    """Ask; if a person has yet to answer, continue with other questions."""
    try:
        return ask()
    except PendingQuestionsError as error:
        waiting.append(error)
        return None


def _is_complete(rows: Sequence[Mapping]) -> bool:
    """Return whether every question was answered at least once."""
    answered = {row["task"] for row in rows if row["answer"] is not None}
    return all(row["task"] in answered for row in rows)


def _judge_mass(interview: Interview, direct: bool) -> MassEvidence | None:
    weighs = interview.mass() if direct else None
    return evidence_from_answer(*weighs) if weighs else None


def _warn_of_left_out_answers(
    interview: Interview, whole: Sequence[ObjectAnswer], count: int
) -> None:
    """Warn of answers that are left out, without repetition."""
    warnings = list(dict.fromkeys(interview.warnings))
    if len(whole) < count:
        kept = f"{len(whole)} of {count} answers count" if whole else "the first answer counts"
        warnings.append(f"{interview.subject.name}: {kept}; a question to the others stayed open.")
    interview.warnings[:] = warnings
