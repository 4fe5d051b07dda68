"""Settings of the stage fill."""

from dataclasses import dataclass
from typing import Literal

from corporeal.core.errors import check_range


@dataclass(frozen=True)
class FillConfig:
    """How objects are filled with material points."""

    detail: Literal["draft", "normal", "fine"] = "draft"
    """Spatial resolution and step budget; the only setting of accuracy."""
    stiffness: Literal["true", "capped"] = "true"
    """Young's moduli as measured, or capped by the published rule (a control only)."""
    seed: int = 0
    """Seed of all random numbers."""


def validate(config: FillConfig) -> None:
    """Raise UserError where a setting is invalid for any scene."""
    check_range("--seed", config.seed, 0, 2**63)
