"""Descriptions of scenes: objects, parts and hypotheses."""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class RangePlacement:
    """Place of a value inside a measured range."""

    fraction: float
    """0: the low end, 1: the high end; on a logarithmic scale where the range is wide."""
    chosen_by: Literal["model", "recording", "fallback", "evidence"]
    reason: str
    """Why there, in one sentence."""


@dataclass(frozen=True)
class MeasuredRange:
    """An interval of measured values with the usual one, and where it was read."""

    low: float
    typical: float
    high: float
    source: str
    """Citation key, resolved in ``materials/sources.toml``."""

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high


@dataclass(frozen=True)
class Provenance:
    """Why one value is what it is."""

    value: float
    """SI."""
    range: MeasuredRange
    """The measured interval the value was chosen from, SI."""
    chosen_by: str
    """"typical", "model", "recording", "annotation", "fallback" …"""
    reason: str
    margin: float = 0.0
    """How sure the material is, and so its range: 0 (a guess) to 1 (stated outright)."""


StructureKind = Literal["solid", "shell", "sheet", "hollow", "filled", "packed"]
"""How a part is made: solid throughout; a wall, open or closed (``shell``, if not stated which; ``sheet`` open: cup,
plate, lid, cover; ``hollow`` closed about air); a wall with contents behind it (``filled``); or parts and air
(``packed``).
"""
WALLED_KINDS: tuple[str, ...] = ("shell", "sheet", "hollow", "filled")
"""What has a wall."""


@dataclass(frozen=True)
class Hypothesis:
    """One way a part may be: of what, how built, with what in it, and where in its ranges."""

    material: str | None
    """A name from the library; None: unknown."""
    structure: StructureKind | None
    probability: float
    """In [0, 1]; those of a part add up to 1 at most."""
    contents: str | None = None
    fill: float | None = None
    """Share of the cavity inside the wall that the contents take up, in [0, 1]."""
    solidity: float | None = None
    """Of what is packed: share of its outer shape that is material, in [0, 1]."""
    reading: str = ""
    """What the whole object is then ("imitation"): ways of one reading are drawn together."""
    reason: str = ""
    placements: dict[str, RangePlacement] = field(default_factory=dict)


@dataclass(frozen=True)
class PrintedFact:
    """Something that is printed on an object and says how much of it there is."""

    kind: str
    """"net weight", "total weight", "volume", "size", "count" or "other"."""
    value: float | None
    """[kg], [m³] or [m]; None: not a number that weighs."""
    words: str
    """As read."""


@dataclass(frozen=True)
class MassEvidence:
    """An estimate of an object's mass made without the library: it reweights, and sets no value."""

    low: float
    """90 % of what it may weigh lies between ``low`` and ``high`` [kg]."""
    likely: float
    """[kg]"""
    high: float
    """[kg]"""
    reason: str
    printed: tuple[PrintedFact, ...] = ()
    answered_by: Literal["model", "recording"] = "model"


AnswerSource = Literal["annotation", "recording", "model", "metadata", "unknown"]


@dataclass(frozen=True)
class ScanThickening:
    """How much of what a scan draws of a part the real part takes up: scans thicken what is thin.

    Shares of volume [-]: 1 where the model is as thick as the real object.
    """

    low: float
    """90 % of what it may be lies between ``low`` and ``high``."""
    likely: float
    high: float
    reason: str
    answered_by: Literal["model", "recording"] = "model"


@dataclass(frozen=True)
class PartDescription:
    """The description of one part: what it is made of and how, and by what source."""

    name: str
    material: str | None
    """A name from the library; None: unknown, which is a normal answer."""
    structure: StructureKind | None = None
    """How the part is made; None: unknown, the shape decides."""
    thickness: float | None = None
    """Thickness of the wall of what is a shell or filled, where it is known [m]."""
    answered_by: AnswerSource = "unknown"
    margin: float = 0.0
    """How sure: 0 (a guess) to 1 (stated outright)."""
    reason: str = ""
    """Why this answer, in one sentence."""
    values: dict[str, float] = field(default_factory=dict)
    """Numbers that a person stated: field of ``Material`` → value, SI."""
    stated: dict[str, Provenance] = field(default_factory=dict)
    """Numbers that the scene's file states, with who says so; a person's go before them."""
    contents: str | None = None
    """A name from the library: what is behind the wall of what is filled."""
    fill: float | None = None
    """Share of the cavity inside the wall that the contents take up, in [0, 1]."""
    solidity: float | None = None
    """Of what is packed: share of its outer shape that is material, in [0, 1]."""
    hypotheses: tuple[Hypothesis, ...] = ()
    """All ways it may be, the one above among them, likeliest first; empty: only the one above."""
    placements: dict[str, RangePlacement] = field(default_factory=dict)
    """Field of ``Material`` → where in its range a model put it; fields not named are typical."""
    inflation: float | None = None
    """Gauge pressure of the air sealed behind the wall [Pa]; 0: no more than around it; None: it is not sealed."""
    rebound: float | None = None
    """Restitution on a hard floor that rules ask of balls of its name [-]; None: none is known."""
    volume_share: float = 1.0
    """Of a piece: its outer shape's share of the volume inside the part's surface, in [0, 1]."""
    surface_share: float = 1.0
    """Of a piece: the area of its own outer face over that of the part's surface, in [0, 1]."""
    inside: str = ""
    """Of a piece: the piece that encloses it; "": it lies at the part's surface."""
    inner_share: float = 0.0
    """Of a piece: the share of the same volume that lies within pieces inside it, in [0, 1]."""
    missing: bool = False
    """Whether the mesh does not show this piece, as a scanner does not see glass."""
    pieces: "tuple[PartDescription, ...]" = ()
    """What the part consists of where its mesh does not tell them apart: the shaft and the handle of a scanned
    screwdriver. The words above are then those of the piece that matters most."""
    built_by: AnswerSource = "unknown"
    """The source of how it is built; ``answered_by``: of what it is made of."""
    swelling: ScanThickening | None = None
    """How much of what the mesh draws of it is real; None: unknown, the mesh counts."""
    wall_unseen: bool = False
    """Whether its surface need not show the inner face of its wall, as pictures do not where that is plain: how thick
    the surface draws it tells nothing."""
    wall_usual: bool = False
    """Whether ``thickness`` is that of most objects of its name: it is not stated for this one."""
    wall_why: str = ""
    """Where such a usual thickness is from; "": its table does not say."""

    @property
    def alternatives(self) -> tuple[tuple[str, float], ...]:
        """Other materials it may be, with the probabilities of all ways that have them."""
        found: dict[str, float] = {}
        for way in self.hypotheses:
            if way.material not in (None, self.material):
                found[str(way.material)] = found.get(str(way.material), 0.0) + way.probability
        return tuple(found.items())


def apply_hypothesis(words: PartDescription, way: Hypothesis) -> PartDescription:
    """Let a part be in one of its ways: of that, built so, with that in it."""
    return replace(
        words,
        material=way.material,
        structure=way.structure,
        contents=way.contents,
        fill=way.fill,
        solidity=way.solidity,
        placements=way.placements,
        reason=way.reason,
    )


@dataclass(frozen=True)
class ObjectAnswer:
    """What one of several answers to the same questions says of one object."""

    parts: tuple[PartDescription, ...]
    evidence: MassEvidence | None = None


@dataclass(frozen=True)
class ObjectDescription:
    """One object's parts, in words."""

    name: str
    class_name: str
    parts: tuple[PartDescription, ...]
    usual_extent: float | None = None
    """How large such an object usually is, as a model says [m]."""
    evidence: MassEvidence | None = None
    """An estimate of its mass made without the library; None: not asked."""
    answers: tuple[ObjectAnswer, ...] = ()
    """Each of several answers, as a whole; the fields above pool them. Empty: one was given."""


@dataclass(frozen=True)
class ModelUsage:
    """What the questions to models took; nothing where nothing was asked."""

    models: tuple[str, ...] = ()
    """Who answered, as in --vlm, or whoever gave the recorded answers."""
    questions: int = 0
    calls: int = 0
    """Requests that were sent; 0 where all answers came from the disk."""
    input_tokens: int = 0
    output_tokens: int = 0
    seconds: float = 0.0
    """Of waiting [s]."""
    dollars: float | None = 0.0
    """At list prices [US$]; None where one model's price is not known."""
    prices_of: str = ""
    """Date of the list prices."""


NO_USAGE = ModelUsage()


@dataclass(frozen=True)
class Inventory:
    """What is in the scene, in words only. Objects are in the scene's order."""

    objects: tuple[ObjectDescription, ...]
    transcript: tuple[dict, ...] = ()
    """Every question put to a model with its answer, as data."""
    usage: ModelUsage = NO_USAGE
    """What the questions took."""
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know about the answers, in sentences."""


@dataclass(frozen=True)
class Part:
    """One entry of the catalogue of parts."""

    name: str
    object: int
    found_by: str
    """What the part was separated by: "node", "material", "whole object" …"""


@dataclass(frozen=True)
class Parts:
    """Which point belongs to which object and part. A mesh's points are its triangles, in order."""

    object_of_point: Int[np.ndarray, " N"]
    part_of_point: Int[np.ndarray, " N"]
    """Index into ``catalogue``; -1: none."""
    confidence: Float[np.ndarray, " N"]
    """In [0, 1]."""
    catalogue: tuple[Part, ...]
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know, in sentences."""
