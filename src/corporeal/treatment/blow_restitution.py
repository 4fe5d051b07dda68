"""Restitution of rigid parts at the speeds of their first blows."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from corporeal import materials
from corporeal.materials import Striker
from corporeal.materials.blow import NOMINAL
from corporeal.types import MaterialField, Treatment


def in_blows(field: MaterialField, treatments: Sequence[Treatment]) -> Float[np.ndarray, "K1 K1"]:
    """Carry the restitution of all pairs of parts and the floor to the speeds of their blows.

    The ratio to what the same pair has at ``NOMINAL`` is applied, so that what was drawn from a
    measured range stays drawn. Later, slower blows have the first one's.

    Args:
        field: With the restitution at ``NOMINAL``.
        treatments: One per part: they know how fast it will be struck.

    """
    if field.floor is None:
        return field.restitution
    known = materials.library()
    bodies = [*field.materials, field.floor]
    solid = [*(s.kind == "solid" for s in field.structures), True]
    speeds = [*(t.impact_speed for t in treatments), 0.0]
    strikers = [
        Striker(known[m.name], m, whole) if m.name in known else None
        for m, whole in zip(bodies, solid, strict=True)
    ]
    table = np.array(field.restitution)
    for i, one in enumerate(strikers):
        for j, other in enumerate(strikers[: i + 1]):
            speed = max(speeds[i], speeds[j]) or NOMINAL
            if one is None or other is None or speed == NOMINAL:
                continue
            nominal, struck = (materials.restitution(one, other, v).value for v in (NOMINAL, speed))
            ratio = struck / nominal if nominal > 0.0 else 1.0
            table[i, j] = table[j, i] = min(1.0, table[i, j] * ratio)
    return table
