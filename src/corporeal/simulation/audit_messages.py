"""Messages of the audit: what every violation means for the result."""

from collections.abc import Iterable

import numpy as np

from corporeal.core.audit_data import (
    Audit,
    AuditFinding,
    PredictedBreakage,
    SettledObjectOutcome,
    SettlingOutcome,
    SurfacePairCheck,
)
from corporeal.core.types import Note, NoteKind

ALLOWED_BREACHES = {
    "momentum_residual": 1e-3,
    "energy_growth": 0.05,
    "mechanical_growth": 0.01,
    "max_penetration_dx": 1.0,
    "mass_error": 0.01,
}
"""Tolerances, beyond which a violation is reported."""


GRAVE_BREACHES = ("nan_count", "momentum_residual", "mass_error")
"""Violations that are visible errors of the same size."""


def breach_messages(found: Audit) -> list[str]:
    """Describe what every violation means for the result."""
    depth = max(found.floor_penetration_m, found.pair_penetration_m)
    gain = found.energy_gain
    whose = f" Most of it is in {gain.object}, from {gain.time:.2f} s on." if gain else ""
    begun = found.start_penetration_m or 0.0
    into = "the floor" if found.floor_penetration_m == depth else "each other"
    if into == "each other" and depth - begun <= ALLOWED_BREACHES["max_penetration_dx"] * found.cell_m < begun:
        reason = "they overlap at the start. Move them apart in the scene."
    else:
        reason = "contact is softer than in reality. A finer --detail reduces it."
    sentences = {
        "nan_count": "{0} values of the result are not finite: the result is invalid. Please report this.",
        "particles_out_of_domain": "{0} particles left the domain: the objects that they belong "
        "to came apart for numerical reasons.",
        "momentum_residual": "Momentum changed by {0:.1%} without an external impulse: speeds "
        "after impacts are wrong by about as much.",
        "energy_growth": "The energy balance has a residual of {0:.1%}: more energy was counted "
        "as dissipated, mostly by friction of objects coming to rest, than motion and strain lost.",
        "mechanical_growth": "Kinetic and elastic energy grew by {0:.1%}: something rebounded "
        f"higher or moved faster than is physically possible.{whose}",
        "max_penetration_dx": f"Objects penetrate {into} by up to {{0:.1f}} grid cells "
        f"({depth * 1e3:.2g} mm): {reason}",
        "mass_error": "The mass of a part's particles differs by {0:.0%} from the part's "
        "estimated mass: its motion is wrong by about as much.",
    }
    limits = ALLOWED_BREACHES | {"nan_count": 0, "particles_out_of_domain": 0}
    values = {name: getattr(found, name) for name in sentences}
    return [
        Note(text.format(values[name]), NoteKind.GRAVE if name in GRAVE_BREACHES else NoteKind.DOUBT)
        for name, text in sentences.items()
        if values[name] > limits[name]
    ]


def passage_message(pair: SurfacePairCheck) -> str:
    """Describe which object passed through which, and when."""
    other = pair.second if pair.passed == pair.first else pair.first
    return f"{pair.passed} passed through {other} before {pair.passed_s:.2f} s"


def surface_warnings(pairs: Iterable[SurfacePairCheck]) -> list[str]:
    """Return which objects passed through each other, overlap or hover, by their meshes."""
    found = []
    for pair in pairs:
        if pair.passed:
            found.append(
                Note(
                    f"{passage_message(pair)[0].upper()}{passage_message(pair)[1:]}: the result is not physical "
                    "from there on. A finer --detail resolves thin parts better.",
                    NoteKind.GRAVE,
                )
            )
        elif pair.hovers and pair.gap_end_m is not None:
            found.append(
                f"{pair.first} and {pair.second} touch, but their surfaces are "
                f"{pair.gap_end_m * 1e3:.2g} mm apart at the end: the grid is too coarse for the "
                "smaller of them. A finer --detail brings them closer."
            )
    return found


def finding_warnings(findings: Iterable[AuditFinding]) -> list[Note]:
    """Return the sentences of grave findings, and of those that may be seen."""
    kinds = {"grave": NoteKind.GRAVE, "warning": NoteKind.DOUBT}
    return [Note(f.sentence, kinds[f.severity]) for f in findings if f.severity in kinds]


def breakage_message(found: PredictedBreakage) -> str:
    """Return in a sentence what an impact does to a brittle part."""
    impact = (
        f"{found.by} strikes it at {found.speed:.2g} m/s, with {found.ratio:.2g} times the energy "
        "that breaks half of such parts"
    )
    if found.pieces:
        return f"{found.object}: {found.part} breaks into {found.pieces} pieces: {impact}."
    return f"{found.object}: {found.part} {found.word}: {impact}; the simulation keeps it whole."


SAG_WARNING_DX, SAG_MENTION_DX = 1.0, 0.1
"""Displacements for a warning, and for a note [cells]."""


def equilibrium_warnings(settling: SettlingOutcome | None) -> list[str]:
    """Return which objects moved visibly towards equilibrium, and whether it was not reached."""
    if settling is None:
        return []
    sentences = [
        f"{obj.name} moved by {shift_message(obj)} before time 0: the pose in the file is not in static equilibrium."
        for obj in settling.objects
        if obj.moved_dx > SAG_WARNING_DX
    ]
    if not settling.found:
        sentences.append(
            f"Static equilibrium was not reached within {settling.seconds:.2g} s: the simulation "
            "starts before everything is at rest."
        )
    return sentences


def equilibrium_message(settling: SettlingOutcome | None) -> str:
    """Return in a sentence how long objects settled and how far each sank; "" where they did not."""
    if settling is None:
        return ""
    moved = [f"{obj.name} moved by {shift_message(obj)}" for obj in settling.objects if obj.moved_dx > SAG_MENTION_DX]
    return (
        f"Before time 0 objects were relaxed to static equilibrium for {settling.seconds:.2g} s: "
        f"{', '.join(moved) or 'no object moved visibly'}."
    )


def shift_message(obj: SettledObjectOutcome) -> str:
    """How far the centre of mass of an object moved, in words."""
    metres = float(np.linalg.norm(obj.moved_m))
    return f"{metres * 1e3:.2g} mm ({obj.moved_dx:.1f} cells)"
