"""Who is asked what is in a scene, and how."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from corporeal.core.errors import check_range
from corporeal.core.setting_types import ReadsPath, WritesPath

MAX_ANSWERS = 40
"""To one question: Wang et al. (2022) sampled so many."""


@dataclass(frozen=True)
class DescribeConfig:
    """What recognises parts and materials."""

    annotations: Path | None = None
    """YAML file with materials of parts; it takes precedence over every other answer."""
    vlm: Annotated[str, ReadsPath(prefixes=("replay",))] = "metadata"
    """"metadata": names and materials in the file. "openai:MODEL", "anthropic:MODEL",
    "google:MODEL", "ollama:MODEL", or "openai:MODEL@http://host/v1" for any compatible server.
    "ask:FOLDER": you answer. "replay:FOLDER": recorded answers."""
    critic: Annotated[str, ReadsPath(prefixes=("replay",))] = ""
    """Model that ranks proposed decompositions into parts, as --vlm; "": the same model, or a
    cheaper one of OpenAI's."""
    record: Annotated[Path | None, WritesPath()] = None
    """Folder to record every answer in, for --vlm replay:FOLDER."""
    sampling: Literal["fraction", "value"] = "fraction"
    """Ask a model for fractions of the measured ranges, or for values, which are then checked."""
    views: int = 4
    """Pictures of each object, out of 8 around it; one more shows its parts in colours."""
    view_size: int = 512
    """Their height and width [px]."""
    view_seed: int = 0
    """Chooses the views."""
    direct: bool = True
    """Also ask a model, without the library, what is printed on each object and what it weighs.
    This reweights the ways it may be, and sets no value."""
    answers: int = 1
    """Number of answers to each question about materials, values and mass (self-consistency). What
    an object may weigh is pooled over them, each with the same weight; parts are asked for once."""
    parallel: int = 4
    """Number of objects that a model is asked about at the same time."""


DEFAULT_DESCRIBE_CONFIG = DescribeConfig()


def validate(config: DescribeConfig) -> None:
    """Raise UserError where a setting cannot be right, whatever the scene."""
    from corporeal.render.object_portrait import (
        DIRECTION_COUNT,  # with all that draws, which help needs not
    )

    for name, value, low, high in (
        ("--views", config.views, 1, DIRECTION_COUNT),
        ("--view-size", config.view_size, 16, 2048),
        ("--answers", config.answers, 1, MAX_ANSWERS),
        ("--parallel", config.parallel, 1, 64),
    ):
        check_range(name, value, low, high)
