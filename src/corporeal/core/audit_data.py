"""Data of the audit of a finished simulation: outcome and violations.

Computed in ``trajectory.outcome`` and ``trajectory.audit``, kept as ``audit.json`` (``trajectory. audit_file``), whose
keys are the names of the fields below. All quantities are SI; a name ends in its unit where JSON needs one: ``_m``,
``_s``, ``_deg``, ``_kg``, and ``_dx`` for grid cells. None stands for what did not happen.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, Self

from corporeal.core.types import ModelUsage, Note, NoteKind, Vector, note_kinds, notes_with_kinds

FLOOR_NAME = "floor"
"""The other body of a pair, where it is no object."""


@dataclass(frozen=True)
class ObjectOutcome:
    """What happened to one object."""

    at_rest: bool
    """Whether it would move less than a cell in 0.3 s at its speeds of the last 0.3 s."""
    rms_speed_end: float
    """Root mean square of its particles' speeds at the end [m/s]."""
    shape_error_end: float
    """Root mean square displacement once rigid motion is removed, over its diagonal [-]."""
    shape_error_max: float
    """The same, its largest over time [-]."""
    dent_depth_m: float
    """Of the largest dent that is left at the end, from averages over the last 0.3 s [m].

    Of what holds together: how far a patch of its material went from where it was (``trajectory. residual_shape``). Of
    grains and pastes: how deep the free surface fell (``surface_mark``).
    """
    dent_depth_dx: float
    """[cells]"""
    dent_place: Vector | None
    """Centroid of the dent on the object as it started [m]."""
    dent_share: float
    """Share of its particles in the dent; of grains and pastes, of the columns of a cell's width
    in which the surface fell by more than a cell [-]."""
    dent_from_contact_m: Mapping[str, float | None]
    """Other body → distance of the dent's centroid from where the two first touched [m]."""
    deepest_squeeze_m: float
    """Displacement that a hundredth of the particles exceed once rigid motion is removed, at any time [m]."""
    moved_m: Vector
    """Displacement of the centre of mass [m]."""
    moved_level_m: float
    """Its horizontal part [m]."""
    turned_deg: float
    """Angle of the best rigid fit [degrees]."""
    rest_drift_m: float
    """Extent of the centre's path in the last 0.3 s [m]."""
    length_m: float
    """Longest side of its box at the start [m]."""
    fall_m: float | None
    """Free fall from rest that ends at its speed of first contact [m]."""
    rebound_m: float | None
    """How far its centre rose after that [m]."""
    rebound_ratio: float | None
    """Rebound over fall [-]."""
    reach_m: float | None = None
    """Level distance from its middle within which 98 % of its mass lie at the end, and a quarter cell [m]."""
    height_m: float | None = None
    """Of its top over its bottom at the end, a particle's own size included [m]."""
    left_vessel: float | None = None
    """Share of it that is outside of the vessel that held it [-]; None: none did."""
    rim_height_m: float | None = None
    """By how much the surface of grains or paste rose where it rose most [m]; None: it holds together, or the run is
    from before this was measured."""


@dataclass(frozen=True)
class PairOutcome:
    """What happened between two bodies."""

    first_contact_s: float | None
    """[s]"""
    contact_point: Vector | None
    """Of the first contact [m]."""
    separated: bool | None
    """Whether they stayed more than a cell apart for 0.1 s afterwards."""
    gap_start_dx: float | None
    """Distance of their surfaces at the start [cells]; None for the floor, as all gaps."""
    gap_end_m: float | None
    """At the end [m]."""
    gap_end_dx: float | None
    """[cells]"""
    largest_gap_after_m: float | None
    """Largest after the first contact [m]."""
    impulse: float
    """Exchanged over the whole time [N s]."""


@dataclass(frozen=True)
class Outcome:
    """What was seen."""

    objects: Mapping[str, ObjectOutcome]
    """By name, in the scene's order."""
    pairs: Mapping[str, PairOutcome]
    """By "a|b", in the scene's order; the floor comes last."""
    order: tuple[tuple[str, str], ...]
    """Pairs of objects by first contact; those that touch as the run begins are left out."""
    cell_m: float
    """Grid spacing dx [m]."""
    duration_s: float
    """[s]"""

    def pair(self, first: str, second: str) -> PairOutcome:
        """Return what happened between two bodies, named in either order.

        Raises:
            KeyError: There are no such two bodies.
        """
        name = pair_name(first, second)
        return self.pairs[name if name in self.pairs else pair_name(second, first)]

    @property
    def between_objects(self) -> list[PairOutcome]:
        """Pairs of two objects."""
        return [p for name, p in self.pairs.items() if not name.endswith(f"|{FLOOR_NAME}")]

    @property
    def with_floor(self) -> list[PairOutcome]:
        """Pairs of an object and the floor."""
        return [p for name, p in self.pairs.items() if name.endswith(f"|{FLOOR_NAME}")]


def pair_name(first: str, second: str) -> str:
    """Name two bodies by which ``Outcome.pairs`` keeps them."""
    return f"{first}|{second}"


@dataclass(frozen=True)
class PartAudit:
    """Real and simulated numbers of one part side by side."""

    name: str
    object: str | None
    """None: it has no particles."""
    material: str
    law: str
    treatment: str
    """rigid, deformable, shell or foliage."""
    structure: str
    """solid, shell or filled."""
    young_pa: float
    """Young's modulus of the material [Pa]."""
    simulated_young_pa: float
    """As simulated [Pa]."""
    nu: float
    """Poisson's ratio [-]."""
    density: float
    """[kg/m³]"""
    density_sim: float
    """[kg/m³]"""
    yield_stress: float | None
    """[Pa]"""
    yield_stress_sim: float | None
    """[Pa]"""
    thickness_m: float | None
    """Of its wall [m]."""
    contents: str | None
    """Material behind the wall."""
    fill: float | None
    """Share of the cavity inside the wall that the contents take up, in [0, 1]."""
    thickness_sim_m: float | None
    """Simulated thickness of the wall [m]."""
    mass_kg: float
    """Estimated, at the scene's scale [kg]."""
    real_mass_kg: float | None
    """Of the real object [kg]."""
    reason: str
    """Why it is simulated so."""


@dataclass(frozen=True)
class SettledObjectOutcome:
    """How one object moved before time 0."""

    name: str
    moved_m: Vector
    """Of its centre of mass [m]."""
    moved_dx: float
    """[cells]"""
    farthest_m: float
    """Of the particle that moved most [m]."""


@dataclass(frozen=True)
class SettlingOutcome:
    """How everything that lies or stands found its balance before time 0."""

    seconds: float
    """Simulated time that it took [s]."""
    found: bool
    """Whether it came to rest."""
    objects: tuple[SettledObjectOutcome, ...]


@dataclass(frozen=True)
class EnergyGain:
    """Where energy that no work accounts for gathered."""

    object: str
    """Whose motion, strain and height gained the most."""
    frame: int
    """First frame in which the growth was beyond what is allowed."""
    time: float
    """[s]"""


@dataclass(frozen=True)
class SurfacePairCheck:
    """Two objects that came near each other, measured between their meshes."""

    first: str
    second: str
    gap_end_m: float | None
    """Distance of the surfaces at the end, negative where they overlap [m]; None: far apart."""
    depth_m: float
    """Deepest overlap of the surfaces in the frames that were looked at [m]."""
    passed: str | None
    """Which of the two passed through the other."""
    passed_s: float | None
    """First frame in which it was on the other side [s]."""
    hovers: bool = False
    """Whether at the end one rests on the other without touching it, visibly for its size."""


@dataclass(frozen=True)
class PredictedBreakage:
    """What the hardest first impact does to a brittle part."""

    object: str
    part: str
    by: str
    """The other body, or the floor."""
    time: float
    """[s]"""
    speed: float
    """Along the impact, where it struck [m/s]."""
    energy: float
    """Of the impact [J]."""
    ratio: float
    """Over what half of such parts bear [-]."""
    word: Literal["holds", "may break", "would break"]
    pieces: int = 0
    """That it broke into; 0: the simulation keeps it whole."""


EffectKind = Literal[
    "deformation",
    "static_sag",
    "contact_time",
    "contact_width",
    "rebound",
    "depth_below_support",
    "penetration",
    "separated_share",
    "unaccounted_energy",
]
FindingCause = Literal["thickened wall", "softened", "springs", "few cells", "indenter of few cells"]
FindingSeverity = Literal["grave", "warning", "minor"]


@dataclass(frozen=True)
class FindingEffect:
    """What of a result differs from what the measured values give."""

    kind: EffectKind
    """Lengths [m]: largest deformation, compression by load, depth below where it can stand, penetration, width over
    which it presses. Time of an impact [s]. Shares [-]: rebound over height of fall, what is separated, energy."""
    simulated: float
    """In this run: measured in the trajectory, or of the simulated numbers (static_sag, contact_time)."""
    expected: float
    """The most that the measured material values give."""
    grave: bool
    """Whether the difference can be seen at the size of the object."""


@dataclass(frozen=True)
class AuditFinding:
    """A part whose motion does not follow from its measured values, or an outcome that contradicts them."""

    object: str | None
    """None: of the whole scene."""
    part: str | None
    """None: of the whole object."""
    severity: FindingSeverity
    """grave: an effect can be seen. minor: other numbers than the measured ones, without such an effect."""
    causes: tuple[FindingCause, ...]
    """Empty: only the outcome is known."""
    stiffness_ratio: float | None
    """Simulated over measured Young's modulus [-]; 0: it has no elastic stiffness of its own."""
    in_plane_ratio: float | None
    """Simulated over measured E t of a wall [-]; None: it is no wall."""
    cells_across: float | None
    """Narrowest side of what has few cells [cells]."""
    effects: tuple[FindingEffect, ...]
    sentence: str


@dataclass(frozen=True)
class Audit:
    """A simulation checked against the laws it must obey."""

    particles: int
    objects: int
    frames: int
    cell_m: float
    """Grid spacing dx [m]."""
    steps: int
    dt_min: float
    """Smallest time step [s]."""
    dt_max: float
    """Largest time step [s]."""
    nan_count: int
    """Numbers that are not finite; must be 0."""
    particles_out_of_domain: int
    """Particles lost; must be 0."""
    momentum_residual: float
    """Momentum that no impulse accounts for, relative [-]."""
    energy_growth: float
    """Energy with booked losses that no work accounts for, relative [-]."""
    mechanical_growth: float
    """The same without the losses [-]."""
    unbooked_loss: float | None = field(default=None, kw_only=True)
    """Largest share of the energy that transfers took, which no booked loss accounts for [-]."""
    impact_loss: float | None = field(default=None, kw_only=True)
    """Share of the energy that normal contact took: restitution, and nodes that stop [-]."""
    impact_gain: float | None = field(default=None, kw_only=True)
    """What it gave to pairs that have more from it than it took, likewise [-]."""
    energy_gain: EnergyGain | None = field(default=None, kw_only=True)
    """Who gained, and when, where ``mechanical_growth`` is beyond what is allowed."""
    surfaces: tuple[SurfacePairCheck, ...] = field(default=(), kw_only=True)
    """Pairs of objects that came near each other, measured between their meshes."""
    mass_error: float
    """Largest difference of a part's particles from its estimated mass, relative [-]."""
    max_penetration_m: float
    """Deepest overlap of objects, or with the floor and walls [m]."""
    max_penetration_dx: float
    """[cells]"""
    floor_penetration_m: float
    """With the floor and walls [m]."""
    pair_penetration_m: float
    """Of objects [m]."""
    start_penetration_m: float | None = field(default=None, kw_only=True)
    """Of objects at the start: how deep the scene puts them into each other [m]."""
    parts: tuple[PartAudit, ...]
    """One per part, in the catalogue's order."""
    settling: SettlingOutcome | None
    """None: nothing was left to settle before time 0."""
    warnings: tuple[str, ...]
    """What to read before trusting the video, in sentences."""
    kind_of_warning: tuple[NoteKind, ...] = field(default=(), kw_only=True)
    """One for each."""
    breakage: tuple[PredictedBreakage, ...] = field(default=(), kw_only=True)
    """One per brittle rigid part that something struck."""
    findings: tuple[AuditFinding, ...] = field(default=(), kw_only=True)
    """Parts that do not move by their measured values, and outcomes that contradict them; the gravest first."""

    @property
    def notes(self) -> tuple[Note, ...]:
        """The warnings, each with its kind."""
        return notes_with_kinds(self.warnings, self.kind_of_warning)

    def noting(self, notes: Iterable[str]) -> Self:
        """Return the same with these for warnings."""
        every = tuple(notes)
        return replace(self, warnings=tuple(map(str, every)), kind_of_warning=note_kinds(every))


@dataclass(frozen=True)
class Expectation:
    """One object that had to be seen, and whether it was."""

    sentence: str
    value: str
    """What was measured, in words and units."""
    target: str
    """What it had to be."""
    met: bool


@dataclass(frozen=True)
class RunAudit(Audit):
    """The audit of a simulation, what happened in it, and what the whole run took."""

    outcome: Outcome
    expectations: tuple[Expectation, ...]
    """Of scenes of the showcase."""
    seconds: Mapping[str, float]
    """Stage → what it took, and "total" [s]."""
    peak_memory_mb: float
    """Largest resident memory of the process [MB]."""
    settings: Mapping[str, str]
    """What the report says of them: detail, stiffness, contact, engine."""
    questions: ModelUsage
    """What questions to models took."""
    hints: tuple[str, ...] = field(default=(), kw_only=True)
    """What may not be as expected though nothing is wrong, with the option that changes it."""
