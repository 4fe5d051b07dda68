"""Settings of the stage describe."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from corporeal.core.errors import check_range
from corporeal.core.setting_types import ReadsPath, WritesPath

MAX_ANSWERS = 40
"""Maximum number of answers to one question: that of Wang et al. (2022)."""


@dataclass(frozen=True)
class DescribeConfig:
    """Recognition of parts and materials."""

    annotations: Path | None = None
    """YAML file with materials of parts; it takes precedence over every other answer."""
    vlm: Annotated[str, ReadsPath(prefixes=("replay",))] = "metadata"
    """"metadata": names and materials in the file. "openai:MODEL", "anthropic:MODEL", "google:MODEL", "ollama:MODEL",
    or "openai:MODEL@http://host/v1" for any compatible server. "ask:FOLDER": you answer. "replay:FOLDER": recorded
    answers."""
    critic: Annotated[str, ReadsPath(prefixes=("replay",))] = ""
    """Model that ranks proposed decompositions into parts, as --vlm; "": the same model, or a cheaper one of
    OpenAI's."""
    record: Annotated[Path | None, WritesPath()] = None
    """Folder to record every answer in, for --vlm replay:FOLDER."""
    sampling: Literal["fraction", "value"] = "fraction"
    """Ask a model for fractions of the measured ranges, or for values, which are then checked."""
    views: int = 4
    """Number of views of each object, of 8 around it; one more shows its parts in colours."""
    view_size: int = 512
    """Height and width of the views [px]."""
    view_seed: int = 0
    """Seed of the choice of views."""
    direct: bool = True
    """Also ask a model, without the library, what is printed on each object and what it weighs. This reweights
    hypotheses, and sets no value.
    """
    answers: int = 1
    """Number of answers to each question about materials, values and mass (self-consistency). Masses are pooled over
    them with equal weights; parts are asked for once.
    """
    parallel: int = 4
    """Number of concurrent questions, in objects."""


DEFAULT_DESCRIBE_CONFIG = DescribeConfig()


def validate(config: DescribeConfig) -> None:
    """Raise UserError where a setting is invalid for any scene."""
    from corporeal.render.object_portrait import (
        DIRECTION_COUNT,  # imports the renderer, which the help does not need
    )

    for name, value, low, high in (
        ("--views", config.views, 1, DIRECTION_COUNT),
        ("--view-size", config.view_size, 16, 2048),
        ("--answers", config.answers, 1, MAX_ANSWERS),
        ("--parallel", config.parallel, 1, 64),
    ):
        check_range(name, value, low, high)
