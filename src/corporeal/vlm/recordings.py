"""Answers recorded earlier: free, offline, repeatable.

A recording is one JSON file: task, prompt, schema, scene, views, model, answer. It is found by what
was asked about what, not by pixels or by model, so a better renderer does not make it stale.
"""

import hashlib
import json
import os
from pathlib import Path

from pydantic import BaseModel, ValidationError

from corporeal.errors import BadFileError, UserError
from corporeal.vlm import Answer, Question

FIELDS = ("task", "scene", "prompt", "schema", "views")
"""What must be equal for a recording to answer a question, most telling last to differ."""


class Recordings:
    """Look each question up in a folder of recorded answers."""

    def __init__(self, folder: str) -> None:
        self.folder = Path(folder)
        if not folder or not self.folder.is_dir():
            raise UserError(
                f"No folder of recordings at {folder!r}. Say --vlm replay:FOLDER, or --vlm "
                "metadata to go without."
            )
        self.rows = [_read(path) for path in sorted(self.folder.glob("*.json"))]

    def ask(self, question: Question, answer: type[Answer]) -> Answer:
        """Return the recorded answer.

        Raises:
            UserError: There is none; the message names the field in which the nearest one differs.

        """
        wanted = _asked(question, answer)
        for row in self.rows:
            if all(row[f] == wanted[f] for f in FIELDS):
                return _validated(row, answer)
        raise UserError(self._why_not(wanted))

    def _why_not(self, wanted: dict[str, str]) -> str:
        about = f"{wanted['task']!r} about {wanted['scene']!r}"
        if not self.rows:
            return f"No recording in {self.folder}: nothing answers {about}."
        nearest = max(self.rows, key=lambda row: [row[f] == wanted[f] for f in FIELDS])
        differs = next(f for f in FIELDS if nearest[f] != wanted[f])
        return (
            f"No recording in {self.folder} answers {about}. The nearest, {nearest['file']}, "
            f"differs in {differs!r}: recorded {_short(nearest[differs])}, asked "
            f"{_short(wanted[differs])}. Record it again, or use --vlm metadata."
        )


def record(folder: Path, question: Question, answer: BaseModel, model: str) -> Path:
    """Keep an answer where ``Recordings`` finds it; the file appears whole or not at all."""
    row = _asked(question, type(answer)) | {"model": model, "answer": answer.model_dump()}
    key = hashlib.sha256("\0".join(row[f] for f in FIELDS).encode()).hexdigest()[:16]
    folder.mkdir(parents=True, exist_ok=True)
    path, draft = folder / f"{question.task}-{key}.json", folder / f".{key}.part"
    draft.write_text(json.dumps(row, indent=1, ensure_ascii=False), encoding="utf-8")
    os.replace(draft, path)
    return path


def _asked(question: Question, answer: type[BaseModel]) -> dict[str, str]:
    schema = json.dumps(answer.model_json_schema(), sort_keys=True)
    return {
        "task": question.task,
        "scene": question.scene,
        "prompt": question.prompt,
        "schema": hashlib.sha256(schema.encode()).hexdigest()[:16],
        "views": question.views,
    }


def _read(path: Path) -> dict:
    try:
        row = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadFileError(path, f"is not a recording ({error}).", "Delete it.") from error
    missing = [f for f in (*FIELDS, "answer") if not isinstance(row, dict) or f not in row]
    if missing:
        raise BadFileError(path, f"is not a recording: it has no {missing[0]!r}.", "Delete it.")
    return row | {"file": path.name}


def _validated(row: dict, answer: type[Answer]) -> Answer:
    try:
        return answer.model_validate(row["answer"])
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(x) for x in first["loc"])
        raise BadFileError(
            row["file"], f"its answer does not fit: {where}: {first['msg']}.", "Record it again."
        ) from error


def _short(text: str) -> str:
    return repr(text if len(text) <= 60 else f"{text[:57]}...")
