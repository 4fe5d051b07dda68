"""The question about one video after one look, and what asking it costs.

It is named by a digest of the motion that it shows: an answer to another motion is never found, and nothing in it says
which condition the video is of. The version in ``video.md`` covers the questions of ``questions.toml``, too.
"""

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from corporeal.vlm import OnDemandPictures, Question
from corporeal.vlm.prompt_files import Prompt, read_prompt
from corporeal.vlm.token_prices import price_usd
from video_judge.camera_staging import CLOSE_UP_PICTURES, DATED_PICTURES, Staging
from video_judge.judge_pictures import PICTURES_PER_LOOK, judge_pictures, pictures_description
from video_judge.subquestions import question_catalogue
from video_judge.video_motion import VideoMotion

DYNAMICS_TASK = "dynamics"
DIGEST_TOLERANCE = 1e-3
"""Motions are alike whose positions agree to this share of the scene's size."""
TOKENS_PER_CHARACTER, TOKENS_PER_PICTURE, TOKENS_PER_ANSWER = 0.25, 350, 400
"""Tokens of a letter of text, of a picture of 400 x 300, and of an answer."""


@dataclass(frozen=True)
class VideoQuestion:
    """A video, ready to be asked about."""

    scene: str
    condition: str
    look: int
    question: Question


def motion_digest(video: VideoMotion, staging: Staging) -> str:
    """Name a motion by where particles of every object are at the instants of the pictures."""
    instants = np.unique([*staging.times.tolist(), *(c.time for c in staging.closes)])
    boxes = staging.reel.boxes[0]
    size = float(np.linalg.norm(np.nanmax(boxes[:, 1], axis=0) - np.nanmin(boxes[:, 0], axis=0)))
    x = video.sampled(instants) / (DIGEST_TOLERANCE * max(size, 1e-9))
    whole = np.nan_to_num(np.round(x), nan=0.0, posinf=1e9, neginf=-1e9)
    return hashlib.sha256(np.clip(whole, -1e9, 1e9).astype(np.int64).tobytes()).hexdigest()[:12]


def video_question(video: VideoMotion, staging: Staging, scene_text: str, look: int) -> Question:
    """Ask about one video.

    Args:
        video: What is shown.
        staging: When and from where.
        scene_text: Facts of the scene: ``prompt_context.scene_facts``.
        look: From which side; also decides the order of the questions.

    """
    name = f"film-{motion_digest(video, staging)}"
    places = question_order(name, look)
    return Question(
        task=DYNAMICS_TASK,
        prompt=prompt_text(scene_text, places),
        scene=name,
        views=pictures_description(look),
        pictures=OnDemandPictures(lambda: judge_pictures(video, staging, look)),
        prompt_version=_template().version,
        facts={"told": scene_text, "questions": " ".join(question_catalogue().question[k].id for k in places)},
    )


def question_order(name: str, look: int) -> list[int]:
    """Return the order of the questions: another for each video and look, and always the same."""
    seed = hashlib.sha256(f"{name} {look}".encode()).digest()[:8]
    dice = np.random.default_rng(int.from_bytes(seed, "big"))
    return dice.permutation(len(question_catalogue().question)).tolist()


def prompt_text(scene_text: str, places: list[int]) -> str:
    """Write the prompt."""
    asked = [question_catalogue().question[k] for k in places]
    text = _template().text.replace("{count}", str(PICTURES_PER_LOOK)).replace("{dated}", str(DATED_PICTURES))
    text = text.replace("{close}", str(CLOSE_UP_PICTURES)).replace("{facts}", scene_text)
    return text.replace("{questions}", "\n".join(f"- {q.id}: {q.text}" for q in asked))


@cache
def _template() -> Prompt:
    return read_prompt(files("video_judge").joinpath("video.md"))


@dataclass(frozen=True)
class JudgingCost:
    """Estimated cost of the questions."""

    videos: int
    """Videos times looks."""
    tokens: int
    dollars: float | None
    """At list prices [US$]; None: the table of prices does not know the model."""


def estimate_cost(asked: list[VideoQuestion], model: str) -> JudgingCost:
    """Reckon what asking about videos costs, answers that are kept already included."""
    read = sum(
        round(TOKENS_PER_CHARACTER * len(a.question.text)) + TOKENS_PER_PICTURE * PICTURES_PER_LOOK for a in asked
    )
    written = TOKENS_PER_ANSWER * len(asked)
    return JudgingCost(len(asked), read + written, price_usd(model, read, written))
