"""Recorded answers: free, offline, repeatable.

A recording is one JSON file: task, scene, version of the prompt and facts put into it, schema, views, model, lists,
prompt, answer. It is found by what was asked about what, not by pixels, by model, by words of the prompt, or by how
long the library's lists were; so neither a better renderer nor a new material nor a clearer sentence makes it stale.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from threading import Lock
from typing import Any

from pydantic import ValidationError

from corporeal.core import store
from corporeal.core.errors import BadFileError, UserError
from corporeal.vlm import Answer, AnswerCheck, AnswerSchema, Question, Reply, VlmClient, no_complaints

RECORDING_KEY_FIELDS = ("task", "scene", "prompt_version", "facts", "schema", "views")
"""What must be equal for a recording to answer a question, most telling last to differ."""
ANSWER_NUMBER_KEY = "answer_number"
"""Which of several answers to a question it is; absent: the first, as in recordings of one."""


class ReplayClient:
    """Look each question up in a folder of recorded answers."""

    looks = False

    def __init__(self, folder: str) -> None:
        self.folder = Path(folder)
        if not folder or not self.folder.is_dir():
            raise UserError(f"No folder of recordings at {folder!r}. Use --vlm replay:FOLDER, or --vlm metadata.")
        self.rows = [_read_recording(path) for path in sorted(self.folder.glob("*.json"))]

    def ask(
        self, question: Question, answer: type[Answer], check: AnswerCheck[Answer] = no_complaints
    ) -> Reply[Answer]:
        """Return the recorded answer.

        Raises:
            UserError: There is none; the message names the field in which the nearest one differs. Or there is one that
                no longer fits what can be answered.
        """
        row = self._row(recording_key_row(question, answer))
        if row is None:
            raise UserError(self._why_not(recording_key_row(question, answer)))
        return Reply(_validated(row, answer, check), "recording", str(row.get("model", "")))

    def holds(self, question: Question, answer: type[AnswerSchema]) -> bool:
        """Return whether the question was answered."""
        return self._row(recording_key_row(question, answer)) is not None

    def _row(self, wanted: dict[str, Any]) -> dict | None:
        return next((r for r in self._alike(wanted) if r.get(ANSWER_NUMBER_KEY) == wanted.get(ANSWER_NUMBER_KEY)), None)

    def _alike(self, wanted: dict[str, Any]) -> list[dict]:
        """Return the recorded answers to a question, whichever of several they are."""
        return [r for r in self.rows if all(r[f] == wanted[f] for f in RECORDING_KEY_FIELDS)]

    def _why_not(self, wanted: dict[str, Any]) -> str:
        about = f"{wanted['task']!r} about {wanted['scene']!r}"
        if not self.rows:
            return f"No recording in {self.folder}: nothing answers {about}."
        if alike := self._alike(wanted):
            return (
                f"No recording in {self.folder} is answer {wanted.get(ANSWER_NUMBER_KEY, '1')} to {about}; it "
                f"holds {len(alike)}. Record more of them, or ask for fewer (--answers)."
            )
        nearest = max(self.rows, key=lambda row: [row[f] == wanted[f] for f in RECORDING_KEY_FIELDS])
        differs = next(f for f in RECORDING_KEY_FIELDS if nearest[f] != wanted[f])
        how = f"differs in {_difference(differs, nearest[differs], wanted[differs])}"
        if differs in ("prompt_version", "schema"):
            return (
                f"The answers in {self.folder} are to another wording of the questions "
                f"({nearest['file']} {how}): record them again, or use --vlm metadata."
            )
        return (
            f"No recording in {self.folder} answers {about}. The nearest, {nearest['file']}, "
            f"{how}. Record it again, or use --vlm metadata."
        )


class RecordingClient:
    """Record every answer of another client where ``ReplayClient`` finds it."""

    def __init__(self, model: VlmClient, folder: Path) -> None:
        self.model, self.folder, self._one = model, folder, Lock()
        self.looks = model.looks

    def ask(
        self, question: Question, answer: type[Answer], check: AnswerCheck[Answer] = no_complaints
    ) -> Reply[Answer]:
        """Pass the question on and record its answer."""
        reply = self.model.ask(question, answer, check)
        with self._one:
            write_recording(self.folder, question, reply.answer, reply.model)
        return reply


def write_recording(folder: Path, question: Question, answer: AnswerSchema, model: str) -> Path:
    """Keep an answer where ``ReplayClient`` finds it; the file appears whole or not at all."""
    row = recording_key_row(question, type(answer))
    key = recording_digest(row)[:16]
    row |= {"model": model, "lists": dict(question.lists), "prompt": question.prompt}
    row |= {"answer": answer.model_dump()}
    path = folder / f"{question.task}-{key}.json"
    store.write_json(path, row)
    return path


def recording_key_row(question: Question, answer: type[AnswerSchema]) -> dict[str, Any]:
    """Name a question by all that its answer depends on."""
    number = question.turn.number
    return {
        "task": question.task,
        "scene": question.scene,
        "prompt_version": question.prompt_version or question.prompt,
        "facts": dict(question.facts),
        "schema": answer.SCHEMA,
        "views": question.views,
        **({ANSWER_NUMBER_KEY: str(number)} if number > 1 else {}),
    }


def recording_digest(row: Mapping[str, Any]) -> str:
    """Return the name of what was asked, in hexadecimal digits."""
    named = {f: row[f] for f in (*RECORDING_KEY_FIELDS, ANSWER_NUMBER_KEY) if f in row}
    return hashlib.sha256(json.dumps(named, sort_keys=True).encode()).hexdigest()


def _read_recording(path: Path) -> dict:
    try:
        row = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadFileError(path, f"is not a recording ({error}).", "Delete it.") from error
    missing = [f for f in (*RECORDING_KEY_FIELDS, "answer") if not isinstance(row, dict) or f not in row]
    if missing:
        raise BadFileError(path, f"is not a recording: it has no {missing[0]!r}.", "Delete it.")
    return row | {"file": path.name}


def _validated(row: dict, answer: type[Answer], check: AnswerCheck[Answer]) -> Answer:
    try:
        found = answer.model_validate(row["answer"])
    except ValidationError as error:
        raise BadFileError(
            row["file"], f"its answer does not fit: {first_validation_problem(error)}.", "Record it again."
        ) from error
    complaints = check(found)
    if complaints:
        raise BadFileError(row["file"], f"its answer does not fit: {complaints[0]}", "Record it again.")
    return found


def first_validation_problem(error: ValidationError) -> str:
    """Return where an answer first leaves its shape, and how."""
    first = error.errors()[0]
    return f"{'.'.join(str(x) for x in first['loc'])}: {first['msg']}"


def _difference(name: str, recorded: Any, wanted: Any) -> str:
    """Name what differs, of facts the first one, and quote both."""
    if isinstance(recorded, Mapping):
        names = [n for n in (*wanted, *recorded) if recorded.get(n) != wanted.get(n)]
        name, recorded, wanted = names[0], recorded.get(names[0], ""), wanted.get(names[0], "")
    return f"{name!r}: recorded {_quote_difference(recorded, wanted)}, asked {_quote_difference(wanted, recorded)}"


def _quote_difference(text: str, other: str) -> str:
    """Quote the first words in which a text differs from another."""
    if len(text) <= 60:
        return repr(text)
    at = next((k for k, (a, b) in enumerate(zip(text, other, strict=False)) if a != b), 0)
    at = max(at - 20, 0)
    return repr(f"{'...' if at else ''}{text[at : at + 57]}...")
