"""The question about one film after one look, and what asking it costs.

It is named by a digest of the motion that it shows: an answer to another motion is never found, and
nothing in it says which condition the film is of.
"""

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from corporeal.lab.evaluation.judge.filmed_motion import FilmedMotion
from corporeal.lab.evaluation.judge.judge_pictures import PICTURES, how, shown
from corporeal.lab.evaluation.judge.staging import CLOSE, DATED, Staging
from corporeal.lab.evaluation.judge.subquestions import catalogue
from corporeal.vlm import Album, Question
from corporeal.vlm.prices import dollars

TASK = "dynamics"
GRAIN = 1e-3
"""Motions are alike whose positions agree to this share of the scene's size."""
LETTER, PICTURE, ANSWER = 0.25, 350, 400
"""Tokens of a letter of text, of a picture of 400 x 300, and of an answer."""


@dataclass(frozen=True)
class FilmAsked:
    """A film, ready to be asked about."""

    scene: str
    condition: str
    look: int
    question: Question


def digest(film: FilmedMotion, staging: Staging) -> str:
    """Name a motion by where particles of every object are at the instants of the pictures."""
    instants = np.unique([*staging.times.tolist(), *(c.time for c in staging.closes)])
    boxes = staging.reel.boxes[0]
    size = float(np.linalg.norm(np.nanmax(boxes[:, 1], axis=0) - np.nanmin(boxes[:, 0], axis=0)))
    x = film.sampled(instants) / (GRAIN * max(size, 1e-9))
    whole = np.nan_to_num(np.round(x), nan=0.0, posinf=1e9, neginf=-1e9)
    return hashlib.sha256(np.clip(whole, -1e9, 1e9).astype(np.int64).tobytes()).hexdigest()[:12]


def question(film: FilmedMotion, staging: Staging, told: str, look: int) -> Question:
    """Ask about one film.

    Args:
        film: What is shown.
        staging: When and from where.
        told: What the judge is told of the scene: ``told_facts.facts``.
        look: From which side; also decides the order of the questions.

    """
    name = f"film-{digest(film, staging)}"
    return Question(
        task=TASK,
        prompt=wording(told, order(name, look)),
        scene=name,
        views=how(look),
        pictures=Album(lambda: shown(film, staging, look)),
    )


def order(name: str, look: int) -> list[int]:
    """Return the order of the questions: another for each film and look, and always the same."""
    seed = hashlib.sha256(f"{name} {look}".encode()).digest()[:8]
    dice = np.random.default_rng(int.from_bytes(seed, "big"))
    return dice.permutation(len(catalogue().question)).tolist()


def wording(told: str, places: list[int]) -> str:
    """Write the prompt."""
    asked = [catalogue().question[k] for k in places]
    text = _template().replace("{count}", str(PICTURES)).replace("{dated}", str(DATED))
    text = text.replace("{close}", str(CLOSE)).replace("{facts}", told)
    return text.replace("{questions}", "\n".join(f"- {q.id}: {q.text}" for q in asked))


@cache
def _template() -> str:
    return files("corporeal.lab.evaluation.judge").joinpath("film.md").read_text(encoding="utf-8")


@dataclass(frozen=True)
class Price:
    """What asking takes, reckoned before anybody is asked."""

    films: int
    """Films times looks."""
    tokens: int
    dollars: float | None
    """At list prices [US$]; None: the table of prices does not know the model."""


def price(asked: list[FilmAsked], model: str) -> Price:
    """Reckon what asking about films costs, answers that are kept already included."""
    read = sum(round(LETTER * len(a.question.text)) + PICTURE * PICTURES for a in asked)
    written = ANSWER * len(asked)
    return Price(len(asked), read + written, dollars(model, read, written))
