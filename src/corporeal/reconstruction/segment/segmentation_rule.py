"""Choices for --apart."""

from typing import Literal

SegmentationRule = Literal["auto", "masks", "look", "components"]
