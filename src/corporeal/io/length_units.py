"""Units of length for --unit."""

from typing import Literal

LengthUnit = Literal["auto", "m", "cm", "mm", "in", "ft"]
"""auto: as the file states, else what its size makes likely."""
METRES_OF_LENGTH_UNIT = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
"""Of each unit [m]."""
