"""How large things stand in a scene together: their real sizes, with the differences compressed.

A duck beside a couch is a dot. A power law between 0 (all of one size) and 1 (true relative sizes)
brings things nearer to each other and keeps their order.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.errors import UserError


@dataclass(frozen=True)
class Sizing:
    """How real sizes become sizes in a scene."""

    gamma: float = 0.35
    """Exponent of relative sizes: 0 makes all things equally large, 1 keeps true proportions."""
    metric: bool = False
    """Keep true metres; gamma, working extent and fraction then say nothing."""
    working_extent: float = 1.0
    """L: how large the scene is to be [m]."""
    fraction: float = 0.5
    """f: share of it that the largest object takes up [-]."""


DEFAULT = Sizing()


def scene_extents(real: Sequence[float], sizing: Sizing = DEFAULT) -> Float[np.ndarray, " N"]:
    """Return the largest extent of each of N objects in their scene [m].

    e_i = s_i^γ / max_j s_j^γ · f L

    Args:
        real: Largest extent s_i of each real thing [m].
        sizing: γ, L and f, or true metres.

    Raises:
        UserError: γ, L or f cannot be used, or a real extent is no length.

    """
    _check(sizing)
    sizes = np.asarray(real, dtype=np.float64)
    if not len(sizes) or not (np.isfinite(sizes) & (sizes > 0)).all():
        raise UserError(f"The real extents are {list(real)}. Each must be a length above 0 m.")
    if sizing.metric:
        return sizes
    return (sizes / sizes.max()) ** sizing.gamma * (sizing.fraction * sizing.working_extent)


def _check(sizing: Sizing) -> None:
    for name, value, low, high in (
        ("gamma", sizing.gamma, 0.0, 1.0),
        ("working extent", sizing.working_extent, 1e-3, 1e3),
        ("fraction", sizing.fraction, 1e-2, 1.0),
    ):
        if not low <= value <= high:
            raise UserError(f"The {name} is {value}. Give a number from {low:g} to {high:g}.")
