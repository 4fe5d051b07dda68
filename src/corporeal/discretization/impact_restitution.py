"""Restitution of rigid parts at their impact speeds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal import materials
from corporeal.core.types import Discretization, MaterialField
from corporeal.discretization.layered_sheets import PartProportions, layered_restitution_law
from corporeal.materials import ImpactBody, RestitutionLaw
from corporeal.materials.restitution_speed import NOMINAL_IMPACT_SPEED_M_S

CONSTANT_RESTITUTION_LAW = (NOMINAL_IMPACT_SPEED_M_S, 0.0, 0.0, 0.0, 1.0)
"""The law of what does not change: see ``Problem.restitution_law``."""


@dataclass(frozen=True)
class PairRestitutions:
    """Restitution of all pairs of K parts and the floor."""

    restitution: Float[np.ndarray, "K1 K1"]
    """At the speeds of their first impacts [-]."""
    laws: Float[np.ndarray, "K1 K1 5"]
    """How it changes with speed: see ``Problem.restitution_law``."""


def restitutions_at_impact(
    field: MaterialField, treatments: Sequence[Discretization], shapes: Mapping[int, PartProportions] | None = None
) -> PairRestitutions:
    """Carry the restitution of all pairs of parts and the floor to the speeds of their impacts.

    The ratio to what the same pair has at ``NOMINAL_IMPACT_SPEED_M_S`` is applied, so that what
    was drawn from a measured range stays drawn, and so do the laws by which later, slower impacts
    lose less. What strikes a sheet that is laid on the floor rebounds as from the floor.

    Args:
        field: With the restitution at ``NOMINAL_IMPACT_SPEED_M_S``.
        treatments: One per part: they know how fast it will be struck.
        shapes: Of parts by their numbers, where sheets are weak across their layers.
    """
    table = np.array(field.restitution)
    laws = np.tile(CONSTANT_RESTITUTION_LAW, (*table.shape, 1))
    if field.floor is None:
        return PairRestitutions(table, laws)
    known = materials.library()
    bodies = [*field.materials, field.floor]
    solid = [*(s.kind == "solid" for s in field.structures), True]
    speeds = [*(t.impact_speed for t in treatments), 0.0]
    strikers = [
        ImpactBody(known[m.name], m, whole) if m.name in known else None for m, whole in zip(bodies, solid, strict=True)
    ]
    for i, one in enumerate(strikers):
        for j, other in enumerate(strikers[: i + 1]):
            if one is None or other is None:
                continue
            speed = max(speeds[i], speeds[j]) or NOMINAL_IMPACT_SPEED_M_S
            law = _restitution_of_pair(one, other, speed, table[i, j])
            law = layered_restitution_law(field, shapes or {}, (i, j), speed, law.value) or law
            table[i, j] = table[j, i] = law.value
            laws[i, j] = laws[j, i] = law.speed, law.slope, law.exponent, law.least, law.most
    for k in (k for k, treatment in enumerate(treatments) if treatment.is_floor_covering):
        table[k, :-1] = table[:-1, k] = table[-1, :-1]
        laws[k, :-1] = laws[:-1, k] = laws[-1, :-1]
    return PairRestitutions(table, laws)


def _restitution_of_pair(one: ImpactBody, other: ImpactBody, speed: float, drawn: float) -> RestitutionLaw:
    """Carry the restitution that two bodies have at ``NOMINAL_IMPACT_SPEED_M_S`` to the speed of their impact."""
    nominal = materials.pair_restitution(one, other, NOMINAL_IMPACT_SPEED_M_S).value
    law = materials.pair_restitution_law(one, other, speed)
    ratio, value = 1.0, drawn
    if nominal > 0.0:
        ratio = drawn / nominal
        value = min(1.0, ratio * law.value) if speed != NOMINAL_IMPACT_SPEED_M_S else drawn
    return replace(
        law, value=value, slope=ratio * law.slope, least=min(law.least, value), most=min(1.0, ratio * law.most)
    )
