"""Settings of the stage segment."""

from dataclasses import dataclass

from corporeal.core.errors import check_range


@dataclass(frozen=True)
class SegmentConfig:
    """Part segmentation of objects reconstructed from pictures. Parts of a model file are its nodes and materials."""

    position_weight: float = 0.3
    """Weight of position relative to appearance features; 0: position is not used."""


def validate(config: SegmentConfig) -> None:
    """Raise UserError where a setting is invalid for any scene."""
    check_range("--position-weight", config.position_weight, 0.0, 100.0)
