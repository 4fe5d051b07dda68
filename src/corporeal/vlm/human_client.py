"""Manual answers: every question is written to a page, and waits for its answer.

For a chat window without an API key, or answers by a person. Answers are kept as recordings in the same folder, for
``--vlm replay:FOLDER``.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Lock

import numpy as np
from PIL import Image
from pydantic import ValidationError

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.vlm import Answer, AnswerCheck, AnswerSchema, Question, Reply, no_complaints
from corporeal.vlm.recordings import (
    ReplayClient,
    first_validation_problem,
    recording_digest,
    recording_key_row,
    write_recording,
)

QUESTIONS_FOLDER = "questions"
HUMAN_MODEL_NAME = "by hand"
ANSWER_SHAPE_TEXT = """

---
Give the answer as JSON of this shape, and nothing else:

```
{shape}
```
"""


class PendingQuestionsError(UserError):
    """Questions wait for answers."""

    def __init__(self, message: str, count: int = 1) -> None:
        super().__init__(message)
        self.count = count
        """How many of them."""


class HumanClient:
    """Write each question to a folder; read the answer beside it."""

    looks = True

    def __init__(self, folder: str) -> None:
        if not folder:
            raise UserError("Name the folder of the questions: --vlm ask:FOLDER.")
        self.folder = Path(folder)
        self.pages = self.folder / QUESTIONS_FOLDER
        with store.disk_errors(self.pages):
            self.pages.mkdir(parents=True, exist_ok=True)
        self.kept = ReplayClient(folder)
        self._one = Lock()

    def ask(
        self, question: Question, answer: type[Answer], check: AnswerCheck[Answer] = no_complaints
    ) -> Reply[Answer]:
        """Return the answer beside the question, or the one that was recorded earlier.

        Raises:
            WaitingError: There is no answer yet, or it is invalid; the page says why.
        """
        page = self.pages / self._name(question, answer)
        found = _read_answer(page.with_suffix(".json"), answer, check)
        if isinstance(found, AnswerSchema):
            with self._one:
                write_recording(self.folder, question, found, HUMAN_MODEL_NAME)
            return Reply(found, "recording", HUMAN_MODEL_NAME)
        if not found and self.kept.holds(question, answer):
            return self.kept.ask(question, answer, check)
        _write_page(page, question, answer, found)
        raise PendingQuestionsError(f"{page.with_suffix('.md')} waits for an answer.")

    def _name(self, question: Question, answer: type[AnswerSchema]) -> str:
        key = recording_digest(recording_key_row(question, answer))[:6]
        plain = re.sub(r"[^\w.-]+", "-", f"{question.scene}-{question.task}")
        number = question.turn.number
        return f"{plain}{f'-answer-{number}' if number > 1 else ''}-{key}.md"


def refuse_pending(results: list, spec: str) -> list:
    """Return the results, if no question waits.

    Args:
        results: Of independent jobs; ``PendingQuestionsError`` where questions wait.
        spec: As in --vlm: "ask:FOLDER".

    Raises:
        WaitingError: Questions wait: the message says how many, where, and what to do.
    """
    waiting = sum(r.count for r in results if isinstance(r, PendingQuestionsError))
    if waiting:
        count = f"{waiting} question{'s wait' if waiting > 1 else ' waits'}"
        raise PendingQuestionsError(
            f"{count} in {Path(spec.partition(':')[2]) / QUESTIONS_FOLDER}. Each is a .md file, most with a "
            "picture (.png): put the answer into the .json file of the same name, then type the "
            "same command again.",
            waiting,
        )
    return results


def is_not_pending(error: Exception) -> bool:
    """Return whether an error is not a waiting question."""
    return not isinstance(error, PendingQuestionsError)


def _read_answer(path: Path, answer: type[Answer], check: AnswerCheck[Answer]) -> Answer | str:
    """Return the answer in a file, or what is wrong with it; "" where there is none."""
    text = path.read_text(encoding="utf-8").strip() if path.exists() else ""
    if not text:
        return ""
    fenced = re.fullmatch(r"```\w*\s*(.*?)\s*```", text, re.DOTALL)
    try:
        found = answer.model_validate_json(fenced[1] if fenced else text)
    except ValidationError as error:
        return first_validation_problem(error)
    return "\n".join(check(found)) or found


def _write_page(page: Path, question: Question, answer: type[AnswerSchema], wrong: str) -> None:
    schema = answer.model_json_schema()
    text = question.text + ANSWER_SHAPE_TEXT.format(shape=schema_example(schema, schema.get("$defs", {})))
    if wrong:
        text = f"**The answer given so far does not fit:** {wrong}\n\n{text}"
    store.write_bytes(page, text.encode())
    page.with_suffix(".json").touch()
    if question.pictures:
        Image.fromarray(tile_pictures(question.pictures)).save(page.with_suffix(".png"))


def schema_example(schema: Mapping, known: Mapping, indent: str = "") -> str:
    """Write a JSON schema as a person reads it: an example with types for values."""
    if "$ref" in schema:
        return schema_example(known[schema["$ref"].rpartition("/")[2]], known, indent)
    if "anyOf" in schema:
        return " or ".join(schema_example(option, known, indent) for option in schema["anyOf"])
    if "enum" in schema:
        return " | ".join(f'"{choice}"' for choice in schema["enum"])
    if schema["type"] == "array":
        return f"[{schema_example(schema['items'], known, indent)}, ...]"
    if schema["type"] == "object":
        inner = f"{indent}  "
        rows = (
            f'{inner}"{name}": {schema_example(value, known, inner)}' for name, value in schema["properties"].items()
        )
        return "{\n" + ",\n".join(rows) + f"\n{indent}}}"
    return f"{schema['type']}{_limits(schema)}"


def _limits(schema: Mapping) -> str:
    if "minimum" in schema and "maximum" in schema:
        return f" {schema['minimum']}–{schema['maximum']}"
    return ""


def tile_pictures(pictures: Sequence[np.ndarray]) -> np.ndarray:
    """Tile pictures of one size in rows, (H, W, 3) uint8; the last row may be short."""
    columns = int(np.ceil(np.sqrt(len(pictures))))
    blank = np.full_like(pictures[0], 255)
    filled = [*pictures, *[blank] * (-len(pictures) % columns)]
    rows = [np.hstack(filled[k : k + columns]) for k in range(0, len(filled), columns)]
    return np.vstack(rows)
