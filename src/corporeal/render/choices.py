"""What a person may ask to see of a scene."""

from typing import Literal

Shot = Literal["wide", "close", "follow"]
"""wide: everything, all the time; close: what is struck first; follow: what moves."""
Quantity = Literal["material", "law", "object", "part", "young", "poisson", "density"]
"""What parts can be coloured by."""
