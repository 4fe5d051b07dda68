"""Cache of paid answers on the disk.

One JSON file per validated answer, named by a digest of its inputs, and written atomically: several processes may share
the folder.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from threading import Lock
from typing import Any

from pydantic import ValidationError

from corporeal.core import store
from corporeal.vlm import Answer, AnswerCheck, AnswerSchema, Question, Reply, VlmClient, no_complaints

ANSWER_CACHE_VERSION = 1


def answer_cache_folder() -> Path:
    """Return the folder of the cache: as the environment says, else the system's."""
    return store.cache_folder("answers")


class CachingClient:
    """Client that asks a model only what is not in the cache."""

    looks = True

    def __init__(self, model: VlmClient, name: str, settings: Mapping[str, Any], at: Path | None = None) -> None:
        self.model, self.name, self.settings = model, name, dict(settings)
        self.folder = at or answer_cache_folder()
        self._locks: dict[str, Lock] = {}
        self._one = Lock()

    def ask(
        self, question: Question, answer: type[Answer], check: AnswerCheck[Answer] = no_complaints
    ) -> Reply[Answer]:
        """Return the cached answer, or the model's, which is then cached.

        Threads that ask the same at the same time wait for one answer.
        """
        key = self.key(question, answer)
        path = self.folder / key[:2] / f"{key}.json"
        with self._one:
            lock = self._locks.setdefault(key, Lock())
        with lock:
            kept = _read_cached(path, answer, check)
            if kept is not None:
                return Reply(kept, "model", self.name)
            reply = self.model.ask(question, answer, check)
            about = {"task": question.task, "scene": question.scene, "model": self.name}
            store.write_json(path, about | {"answer": reply.answer.model_dump()})
            return reply

    def key(self, question: Question, answer: type[AnswerSchema]) -> str:
        """Return the digest of a question: task, model, text, pictures, shape of the answer, and settings."""
        pictures = [hashlib.sha256(str(p.shape).encode() + p.tobytes()).hexdigest() for p in question.pictures]
        asked = {
            "version": ANSWER_CACHE_VERSION,
            "task": question.task,
            "model": self.name,
            "text": question.text,
            "pictures": pictures,
            "schema": answer.SCHEMA,
            "settings": self.settings,
        }
        if question.turn.number > 1:
            asked["answer_number"] = question.turn.number
        return hashlib.sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest()


def _read_cached(path: Path, answer: type[Answer], check: AnswerCheck[Answer]) -> Answer | None:
    """Return a cached answer; damaged or invalid files are ignored."""
    try:
        kept = answer.model_validate(json.loads(path.read_text(encoding="utf-8"))["answer"])
    except (OSError, ValueError, KeyError, TypeError, ValidationError):
        return None
    return None if check(kept) else kept
