"""Findings of the audit: parts that do not move by their measured values, and outcomes that contradict them.

A part whose stiffness is simulated by less than half, whose wall is simulated thicker than it is, or which has few
cells, gets one finding with the ratios and their effects. An effect is grave where it differs from what the measured
values give by more than a share of the object's size that a person sees; so the same ratio may or may not be grave.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from corporeal.core.audit_data import (
    AuditFinding,
    EffectKind,
    FindingCause,
    FindingEffect,
    FindingSeverity,
    SurfacePairCheck,
)
from corporeal.core.types import MaterialField, Particles, Scene, Trajectory
from corporeal.discretization.filled_shells import acting_material
from corporeal.discretization.foliage import WOOD_MATERIALS
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.simulation.expected_motion import (
    MeasuredPart,
    contact_times,
    expected_deformation,
    expected_sag,
    impact_energy,
    is_limp,
    largest_restitution,
    leaf_length,
    simulated_sag,
)
from corporeal.simulation.finding_messages import finding_sentence
from corporeal.simulation.outcome import REST_DURATION_S, rise_after_impact
from corporeal.simulation.part_motion import ObjectMotion, measure_motion

MIN_STIFFNESS_RATIO = 0.5
"""Simulated over measured stiffness below which a part gets a finding [-]."""
MIN_CELLS_ACROSS = 3.0
"""A deformable solid of fewer cells across has few [cells]."""
MIN_INDENTER_CELLS = 2.0
"""So has what is rigid and strikes something deformable, across its middle side [cells]."""
SPLINE_WIDTH_DX = 2.0
"""Contact acts over at least so much of the grid [cells]."""
VISIBLE_SIZE_RATIO = 0.03
"""A difference of shape or place is seen from so much of the object's longest side on [-]."""
MAX_EXPECTED_RATIO = 3.0
"""A deformation is beyond its estimate from so many times that on [-]."""
MIN_SEPARATED_FRACTION = 0.02
"""Share of a part that has to separate to be seen [-]."""
VISIBLE_REBOUND_RATIO = 0.05
"""A rebound is too high to be overlooked from so much of the object's size on [-]."""
UNACCOUNTED_ENERGY_WARNING_FRACTION, UNACCOUNTED_ENERGY_GRAVE_FRACTION = 0.1, 0.2
"""Unbooked loss over the available energy, for a warning, and for a grave finding [-]."""


def audit_findings(
    scene: Scene,
    particles: Particles,
    field: MaterialField,
    trajectory: Trajectory,
    unbooked: float,
    surfaces: Sequence[SurfacePairCheck] = (),
) -> tuple[AuditFinding, ...]:
    """Return all findings of a run, the gravest first.

    Args:
        scene: What was simulated.
        particles: Its material points.
        field: What every part is made of.
        trajectory: How they moved, with the ledger.
        unbooked: Share of the energy that no booked loss accounts for, less what liquids and grains may have lost [-].
        surfaces: Pairs of objects that came near each other.
    """
    drafts: list[_Draft] = []
    springs = False
    for moved in measure_motion(scene, particles, field, trajectory):
        check = _ObjectCheck(scene, particles, field, trajectory, moved)
        drafts += check.drafts(surfaces)
        springs = springs or check.deforms
    if springs:  # else nothing is there that could have kept the energy
        drafts = _with_energy(drafts, unbooked)
    order: dict[FindingSeverity, int] = {"grave": 0, "warning": 1, "minor": 2}
    return tuple(sorted((d.finding() for d in drafts), key=lambda f: order[f.severity]))


@dataclass(frozen=True)
class _Draft:
    """A finding before its sentence."""

    object: str | None
    part: str | None
    measured: MeasuredPart | None
    causes: tuple[FindingCause, ...] = ()
    cells: float | None = None
    effects: tuple[FindingEffect, ...] = ()

    def finding(self) -> AuditFinding:
        made, grave = self.measured, any(e.grave for e in self.effects)
        energy = any(e.kind == "unaccounted_energy" for e in self.effects)
        found = AuditFinding(
            object=self.object,
            part=self.part,
            severity="grave" if grave else "warning" if energy else "minor",
            causes=self.causes,
            stiffness_ratio=None if made is None else made.stiffness_ratio,
            in_plane_ratio=None if made is None else made.in_plane_ratio,
            cells_across=self.cells,
            effects=self.effects,
            sentence="",
        )
        return replace(found, sentence=finding_sentence(found, made))

    @property
    def softness(self) -> float:
        """Least of its ratios [-]."""
        made = self.measured
        return 1.0 if made is None else min(made.stiffness_ratio, made.in_plane_ratio or 1.0)


class _ObjectCheck:
    """One object's parts and outcome beside what their measured values give."""

    def __init__(
        self, scene: Scene, particles: Particles, field: MaterialField, trajectory: Trajectory, moved: ObjectMotion
    ) -> None:
        self.scene, self.particles, self.field, self.trajectory = scene, particles, field, trajectory
        self.moved, self.thing = moved, scene.objects[moved.number]
        self.visible = VISIBLE_SIZE_RATIO * moved.length
        weight = float(trajectory.ledger.mass[0, moved.number]) * -scene.gravity[2]
        energy = impact_energy(trajectory.ledger, moved.number)
        self.parts = {k: self._measured(k, weight, energy) for k in moved.parts}

    def _measured(self, k: int, weight: float, energy: float) -> MeasuredPart:
        particles, treatment = self.particles, self.particles.treatments[k]
        structure = self.field.structures[k]
        mass = particles.mass_real[k]
        walls = [t for t in (particles.walls[k] if particles.walls else ()) if t > 0.0]
        bears = self.moved.lowest_part == k
        return MeasuredPart(
            material=acting_material(self.field.materials[k], structure, treatment),
            treatment=treatment,
            thickness=walls[0] if walls else structure.thickness or 0.0,
            motion=self.moved.parts[k],
            mass=mass,
            load=weight if bears else mass * -self.scene.gravity[2],
            energy=energy,
            leaf_length=leaf_length(particles, k, self.thing.scale) if self._has_wood() else 0.0,
        )

    @property
    def deforms(self) -> bool:
        """Whether a part of it deforms and springs back."""
        return any(p.treatment.kind in ("deformable", "shell") for p in self.parts.values())

    def _has_wood(self) -> bool:
        """Whether something bears leaves: what is taken for a crown without it is a body of its own stiffness."""
        mine = np.unique(self.particles.part[self.particles.object == self.moved.number])
        return any(self.field.materials[k].name in WOOD_MATERIALS for k in mine)

    def drafts(self, surfaces: Sequence[SurfacePairCheck]) -> list[_Draft]:
        """Return one draft per part that is simulated otherwise or moves otherwise, and of the whole object."""
        rows = [self._part_draft(k, made) for k, made in self.parts.items()]
        found = [*(row for row in rows if row.causes or row.effects), *self._indenter_draft()]
        for k, effect in self._outcome_effects(surfaces):
            found = self._attached(found, k, effect)
        return found

    def _part_draft(self, k: int, made: MeasuredPart) -> _Draft:
        cells = self._few_cells(made)
        causes = (*_causes(made), *cells[1])
        effects = () if made.treatment.kind == "rigid" else tuple(self._part_effects(made, bool(causes)))
        return _Draft(self.thing.name, self.field.words[k].name, made, causes, cells[0], effects)

    def _few_cells(self, made: MeasuredPart) -> tuple[float | None, tuple[FindingCause, ...]]:
        """Cells across what deforms of the object, where they are few."""
        cell, width = self.particles.cell, self.moved.soft_width
        if made.treatment.kind == "deformable" and width / cell < MIN_CELLS_ACROSS:
            return width / cell, ("few cells",)
        return None, ()

    def _indenter_draft(self) -> Iterator[_Draft]:
        """Return a draft if it is rigid, of few cells, and strikes something deformable."""
        cell = self.particles.cell
        if self.moved.middle_side / cell < MIN_INDENTER_CELLS and self._strikes_soft():
            wide = FindingEffect("contact_width", SPLINE_WIDTH_DX * cell, self.moved.middle_side, False)
            across = self.moved.middle_side / cell
            yield _Draft(self.thing.name, None, None, ("indenter of few cells",), across, (wide,))

    def _strikes_soft(self) -> bool:
        """Whether the whole object is rigid and touched something that is deformable and holds together."""
        if any(p.treatment.kind != "rigid" for p in self.parts.values()):
            return False
        number, particles = self.moved.number, self.particles
        met = np.isfinite(self.trajectory.ledger.first_contact[-1, number, : len(self.scene.objects)])
        return any(
            particles.treatments[k].kind in ("deformable", "shell")
            and not CONSTITUTIVE_LAWS[self.field.materials[k].law].loose
            for other in np.flatnonzero(met)
            for k in np.unique(particles.part[particles.object == other])
        )

    def _part_effects(self, made: MeasuredPart, otherwise: bool) -> Iterator[FindingEffect]:
        motion, expected = made.motion, expected_deformation(made)
        actual = motion.shift if made.treatment.kind == "foliage" else motion.deformation
        seen = actual > (1.0 if made.leaf_length > 0.0 else MAX_EXPECTED_RATIO) * expected
        grave = seen and actual - expected > self.visible
        if grave or (otherwise and motion.deformation > 0.0):
            yield FindingEffect("deformation", actual, expected, grave)
        if motion.separated > MIN_SEPARATED_FRACTION:
            yield FindingEffect("separated_share", motion.separated, 0.0, True)
        if otherwise and made.treatment.kind != "foliage":
            sag, right = simulated_sag(made), expected_sag(made)
            if sag > right:
                yield FindingEffect("static_sag", sag, right, sag - right > self.visible and self._stands)
            slow, quick = contact_times(made)
            if slow > quick:
                yield FindingEffect("contact_time", slow, quick, False)

    @property
    def _stands(self) -> bool:
        """Whether something bore it at the end."""
        ledger, number = self.trajectory.ledger, self.moved.number
        late = self.trajectory.time[-2] if len(self.trajectory.time) > 1 else 0.0
        touched = np.nan_to_num(ledger.last_contact[-1, number], nan=-np.inf)
        return bool((touched >= late).any())

    # -------------------------------------------------------------- of the object

    def _outcome_effects(self, surfaces: Sequence[SurfacePairCheck]) -> Iterator[tuple[int | None, FindingEffect]]:
        """Return what contradicts the object's measured values, with the part that causes it; None: not known."""
        if self.thing.path is not None:
            return
        moved = self.moved
        give = self._give_of_support()
        if moved.below_floor - give > self.visible and self._stands:
            yield moved.lowest_part, FindingEffect("depth_below_support", moved.below_floor, give, True)
        yield from ((None, effect) for effect in self._rebound())
        for pair in surfaces:
            yield from ((None, effect) for effect in self._penetration(pair))

    def _give_of_support(self) -> float:
        """How much lower than in its shape at rest it may stand [m]: by its load, and by what yields or still moves."""
        part = self.parts.get(self.moved.lowest_part) if self.moved.lowest_part is not None else None
        if part is None or part.treatment.kind == "rigid":
            return 0.0
        ledger, number = self.trajectory.ledger, self.moved.number
        moves = ledger.rms_speed[-1, number] * REST_DURATION_S > self.particles.cell
        changes = CONSTITUTIVE_LAWS[part.material.law].flows or is_limp(part) or moves
        return max(expected_sag(part), expected_deformation(part) if changes else 0.0)

    def _rebound(self) -> Iterator[FindingEffect]:
        """Rebound from the floor beyond the restitution of all parts."""
        ledger, number = self.trajectory.ledger, self.moved.number
        alone = np.isnan(ledger.first_contact[-1, number, : len(self.scene.objects)]).all()
        if not alone or self.thing.push is not None or self.thing.wind is not None:
            return
        back = rise_after_impact(self.trajectory, number, -self.scene.gravity[2], self.particles.cell)
        if back.ratio is None or back.fall is None or back.rebound is None:
            return
        most = largest_restitution(list(self.parts), self.field) ** 2
        # What flies sideways or turns may be vaulted up by that.
        before = ledger.time <= np.nanmin(ledger.first_contact[-1, number])
        energy = float(ledger.kinetic[before, number].max(initial=0.0))
        aside = max(0.0, energy / (float(ledger.mass[0, number]) * -self.scene.gravity[2]) - back.fall)
        if back.rebound - most * back.fall - aside > VISIBLE_REBOUND_RATIO * self.moved.length:
            yield FindingEffect("rebound", back.ratio, most, True)

    def _penetration(self, pair: SurfacePairCheck) -> Iterator[FindingEffect]:
        """Overlap with another object beyond what contact gives; booked at the smaller one."""
        names = [obj.name for obj in self.scene.objects]
        sizes = {n: self._length_of(names.index(n)) for n in (pair.first, pair.second)}
        if self.thing.name != min(sizes, key=lambda n: sizes[n]):
            return
        begun = float(self.trajectory.ledger.overlap[0, names.index(pair.first), names.index(pair.second)])
        give = max((begun, *(expected_sag(p) for p in self.parts.values())))
        if pair.depth_m - give > max(self.visible, self.particles.cell):
            yield FindingEffect("penetration", pair.depth_m, give, True)

    def _length_of(self, number: int) -> float:
        mine = self.particles.position[self.particles.object == number]
        return float(np.ptp(mine, axis=0).max())

    def _attached(self, found: list[_Draft], part: int | None, effect: FindingEffect) -> list[_Draft]:
        """Add an effect of the object to the finding of the part that causes it, or make one of its own."""
        k = part if part is not None else self._softest()
        name = None if k is None else self.field.words[k].name
        for row, draft in enumerate(found):
            if draft.part == name:
                found[row] = replace(draft, effects=(*draft.effects, effect))
                return found
        return [*found, _Draft(self.thing.name, name, None if k is None else self.parts[k], (), None, (effect,))]

    def _softest(self) -> int | None:
        ratios = {
            k: min(p.stiffness_ratio, p.in_plane_ratio or 1.0)
            for k, p in self.parts.items()
            if p.treatment.kind != "rigid"
        }
        return min(ratios, key=lambda k: ratios[k]) if ratios else next(iter(self.parts), None)


def _causes(made: MeasuredPart) -> tuple[FindingCause, ...]:
    """Return how a part is simulated otherwise than measured."""
    kind, thick = made.treatment.kind, made.treatment.thickness
    if kind == "rigid":
        return ()
    if kind == "foliage":
        return ("springs",)
    ratio = min(made.stiffness_ratio, made.in_plane_ratio or 1.0)
    if ratio >= MIN_STIFFNESS_RATIO:
        return ()
    return ("thickened wall",) if made.wall is not None and thick and thick > made.wall else ("softened",)


def _with_energy(drafts: list[_Draft], unbooked: float) -> list[_Draft]:
    """Add unaccounted energy to the finding of the one object that may have lost it, or to the whole scene."""
    if unbooked <= UNACCOUNTED_ENERGY_WARNING_FRACTION:
        return drafts
    kind: EffectKind = "unaccounted_energy"
    effect = FindingEffect(kind, unbooked, 0.0, unbooked > UNACCOUNTED_ENERGY_GRAVE_FRACTION)
    soft = [d for d in drafts if d.measured is not None and d.measured.treatment.kind != "rigid"]
    if len({d.object for d in soft}) != 1:
        return [*drafts, _Draft(None, None, None, effects=(effect,))]
    worst = min(soft, key=lambda d: d.softness)
    return [replace(d, effects=(*d.effects, effect)) if d is worst else d for d in drafts]
