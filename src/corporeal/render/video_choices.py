"""Choices of video settings."""

from typing import Literal

CameraShot = Literal["wide", "close", "follow"]
"""wide: everything, all the time; close: what is struck first; follow: what moves."""
ColourQuantity = Literal["material", "law", "object", "part", "young_pa", "poisson", "density"]
"""What parts can be coloured by."""
