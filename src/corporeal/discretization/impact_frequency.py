"""Frequency of damping of soft mats, set by the impacts on them.

Branches keep a loss factor over one decade (``mpm.physics.branches``). A ball that strikes touches for two to three
half periods of its own slowest vibration, which lie in it. A mat is struck in one place: the impact lasts as long as
what strikes it takes to dent it, whatever the mat's length, and its slowest vibration, slower the longer it is, would
leave that outside.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, log, pi, sqrt

from corporeal.core.types import Discretization
from corporeal.discretization.filled_shells import bulk_mass
from corporeal.discretization.hertz_indentation import hertz_contact_time
from corporeal.discretization.part_geometry import ExpectedMotion, ObjectLanding, PartGeometry, is_flat_wall
from corporeal.discretization.step_budget import is_dented_by_impact
from corporeal.mpm.constants import LOSS_BAND_HIGH_RATIO, LOSS_BAND_LOW_RATIO

LOSS_BAND_MIDDLE_RATIO = sqrt(LOSS_BAND_LOW_RATIO * LOSS_BAND_HIGH_RATIO)
"""Middle of the band of a loss factor, over the frequency that it is stated for [-]."""


@dataclass(frozen=True)
class _ImpactOnMat:
    """What one object does to the one that it falls onto."""

    landing: ObjectLanding
    radius: float
    """Half of the middle side of the largest part [m]."""
    compliance: float
    """(1 - ν²)/E as simulated [1/Pa]; 0: it is rigid."""

    def frequency(self, part: PartGeometry, treatment: Discretization) -> float:
        """Angular frequency of the half period that it lasts [rad/s]."""
        plane = 1.0 / (self.compliance + impact_compliance(treatment))
        thick = treatment.thickness or part.size[0]
        return pi / hertz_contact_time(self.landing.mass, self.radius, self.landing.speed, plane, thick)


def tune_loss_to_impacts(
    parts: Sequence[PartGeometry], motions: Sequence[ExpectedMotion], treatments: Sequence[Discretization]
) -> tuple[Discretization, ...]:
    """Centre the loss of soft mats on the first impacts of what falls on them, where those are known.

    Of several the mean of the logarithms counts, by their energies. What falls harder itself keeps its slowest
    vibration, and so does what is as high as it is wide.
    """
    impacts = impacts_on_objects(parts, motions, treatments)
    found = []
    for part, treatment in zip(parts, treatments, strict=True):
        taken = impacts.get(part.object, [])
        energy = sum(b.landing.energy for b in taken)
        own = motions[part.object].landing
        falls = own is not None and own.energy >= energy
        if taken and not falls and is_lossy_mat(part, treatment):
            logs = (b.landing.energy * log(b.frequency(part, treatment)) for b in taken)
            treatment = replace(treatment, vibration=exp(sum(logs) / energy) / LOSS_BAND_MIDDLE_RATIO)
        found.append(treatment)
    return tuple(found)


def is_lossy_mat(part: PartGeometry, treatment: Discretization) -> bool:
    """Return whether a part is soft and has a loss factor, and is a slab or a flat sheet."""
    slab = treatment.kind == "deformable" and not is_dented_by_impact(part)
    return treatment.loss > 0.0 and (slab or (treatment.kind == "shell" and is_flat_wall(part)))


def impacts_on_objects(
    parts: Sequence[PartGeometry], motions: Sequence[ExpectedMotion], treatments: Sequence[Discretization]
) -> dict[int, list[_ImpactOnMat]]:
    """Collect what falls onto every object."""
    found: dict[int, list[_ImpactOnMat]] = {}
    for k, motion in enumerate(motions):
        lands, own = motion.landing, [n for n, p in enumerate(parts) if p.object == k]
        if lands is None or lands.energy <= 0.0 or not own:
            continue
        largest = max(own, key=lambda n: bulk_mass(parts[n]))
        impact = _ImpactOnMat(lands, 0.5 * parts[largest].size[1], impact_compliance(treatments[largest]))
        found.setdefault(lands.onto, []).append(impact)
    return found


def impact_compliance(treatment: Discretization) -> float:
    """(1 - ν²)/E as simulated [1/Pa]; 0: nothing dents it."""
    soft = treatment.kind in ("deformable", "shell") and treatment.simulated_young_pa > 0.0
    return (1.0 - treatment.poisson**2) / treatment.simulated_young_pa if soft else 0.0
