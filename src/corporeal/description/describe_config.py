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
    """YAML file that states materials of parts; overrides --vlm and the file."""
    vlm: Annotated[str, ReadsPath(prefixes=("replay",))] = "metadata"
    """Source of materials. "metadata": names and materials in the file, no model. "openai:MODEL", "anthropic:MODEL",
    "google:MODEL", "ollama:MODEL", or "openai:MODEL@http://host/v1" for any compatible server. "ask:FOLDER": questions
    are written to FOLDER and you answer them. "replay:FOLDER": answers recorded with --record."""
    critic: Annotated[str, ReadsPath(prefixes=("replay",))] = ""
    """Model that ranks proposed decompositions into parts, written as for --vlm; by default "openai:gpt-5-mini" if
    --vlm is openai:MODEL without a URL, else the model of --vlm."""
    record: Annotated[Path | None, WritesPath()] = None
    """Folder to record every answer in, for --vlm replay:FOLDER."""
    sampling: Literal["fraction", "value"] = "fraction"
    """Ask the model for positions in the measured ranges (fraction, 0 to 1), or for values in physical units, checked
    against these ranges (value)."""
    views: int = 4
    """Number of rendered views per object, chosen from 8 around it; one more view shows its parts in colours."""
    view_size: int = 512
    """Height and width of the views [px]."""
    view_seed: int = 0
    """Seed of the choice of views."""
    direct: bool = True
    """Also ask the model for quantities printed on each object and a direct estimate of its mass. The answer only
    reweights hypotheses.
    """
    answers: int = 1
    """Number of answers per question on materials, values and mass (self-consistency); masses are pooled with equal
    weights. The question on parts is asked once.
    """
    parallel: int = 4
    """Number of objects asked about concurrently."""


DEFAULT_DESCRIBE_CONFIG = DescribeConfig()


def validate(config: DescribeConfig) -> None:
    """Raise UserError where a setting is invalid for any scene."""
    from corporeal.render.object_portrait import DIRECTION_COUNT  # imports the renderer, which the help does not need

    for name, value, low, high in (
        ("--views", config.views, 1, DIRECTION_COUNT),
        ("--view-size", config.view_size, 16, 2048),
        ("--answers", config.answers, 1, MAX_ANSWERS),
        ("--parallel", config.parallel, 1, 64),
    ):
        check_range(name, value, low, high)
