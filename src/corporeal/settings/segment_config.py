"""How objects from pictures are taken apart: what a person may ask."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SegmentConfig:
    """Part segmentation of objects from pictures; a model's parts are its nodes and materials."""

    position_weight: float = 0.3
    """Weight of position relative to appearance features; 0: position is not used."""
