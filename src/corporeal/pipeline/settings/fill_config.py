"""Settings of the stage fill."""

from dataclasses import dataclass
from typing import Literal

from corporeal.core.errors import check_range


@dataclass(frozen=True)
class FillConfig:
    """How objects are filled with material points."""

    detail: Literal["draft", "normal", "fine"] = "draft"
    """Resolution of the simulation grid and limit on the number of time steps."""
    stiffness: Literal["true", "capped"] = "true"
    """true: measured Young's moduli, as far as the limit on time steps allows; capped: moduli capped so that a fixed
    time step is stable, a baseline for comparison."""
    seed: int = 0
    """Random seed of measuring and filling objects."""


def validate(config: FillConfig) -> None:
    """Raise UserError where a setting is invalid for any scene."""
    check_range("--seed", config.seed, 0, 2**63)
