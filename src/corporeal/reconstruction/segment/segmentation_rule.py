"""What a person may ask that objects are told apart by."""

from typing import Literal

SegmentationRule = Literal["auto", "masks", "look", "components"]
