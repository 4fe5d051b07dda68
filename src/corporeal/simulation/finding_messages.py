"""Sentences of the audit's findings."""

from collections.abc import Callable

from corporeal.core.audit_data import AuditFinding, EffectKind, FindingEffect
from corporeal.simulation.expected_motion import MeasuredPart

ADVICE = "A finer --detail comes closer to the measured values."


def finding_sentence(found: AuditFinding, part: MeasuredPart | None) -> str:
    """Say what is simulated otherwise than measured, and what of it can be seen."""
    who = _subject(found)
    how = _treatment_words(found, part)
    grave = [e for e in found.effects if e.grave]
    if all(e.kind == "unaccounted_energy" for e in grave):  # what else an impact does
        grave += [e for e in found.effects if e.kind == "contact_time"] * bool(grave)
    told = grave or list(found.effects)
    effects = "; ".join(EFFECT_WORDS[e.kind](e) for e in told)
    if not how:
        return f"{who}: {effects}. {ADVICE}"
    return f"{who} is simulated {how}: {effects or 'no effect was found'}. {ADVICE}"


def _subject(found: AuditFinding) -> str:
    if found.object is None:
        return "The scene"
    return found.object if found.part is None else f"{found.object}: {found.part}"


def _treatment_words(found: AuditFinding, part: MeasuredPart | None) -> str:
    """Return how a part is simulated, with its ratios; "": as measured."""
    words = []
    if "springs" in found.causes:
        words.append("without elastic stiffness of its own (0 of the measured), its material points on springs")
    elif found.causes and found.stiffness_ratio is not None and found.stiffness_ratio < 0.999:
        words.append(f"with {found.stiffness_ratio:.2g} of its measured Young's modulus")
    if found.in_plane_ratio is not None and part is not None and part.wall and part.treatment.thickness:
        thick = f"{_length(part.wall)} thick"
        if part.treatment.thickness > part.wall:
            thick += f", simulated {_length(part.treatment.thickness)} thick"
        words.append(f"{found.in_plane_ratio:.2g} of its stiffness in the plane of its wall ({thick})")
    if found.cells_across is not None:
        words.append(f"only {found.cells_across:.1f} grid cells across")
    return ", ".join(words)


def _length(metres: float) -> str:
    return f"{metres * 1e3:.3g} mm" if metres < 1.0 else f"{metres:.3g} m"


def _deformation(e: FindingEffect) -> str:
    return f"it deforms by {_length(e.simulated)}, where its measured stiffness gives at most {_length(e.expected)}"


def _static_sag(e: FindingEffect) -> str:
    return f"its load compresses it by {_length(e.simulated)} instead of {_length(e.expected)}"


def _contact_time(e: FindingEffect) -> str:
    return f"an impact takes about {e.simulated * 1e3:.2g} ms instead of {e.expected * 1e3:.2g} ms"


def _contact_width(e: FindingEffect) -> str:
    return f"it presses over a width of {_length(e.simulated)} instead of {_length(e.expected)}"


def _rebound(e: FindingEffect) -> str:
    return (
        f"it rebounds to {e.simulated:.2g} of the height that it fell from, where the restitution of its materials "
        f"gives at most {e.expected:.2g}"
    )


def _depth_below_support(e: FindingEffect) -> str:
    return f"it ends {_length(e.simulated)} below where it can stand, where contact gives at most {_length(e.expected)}"


def _penetration(e: FindingEffect) -> str:
    return f"it sinks {_length(e.simulated)} into what it touches, where contact gives at most {_length(e.expected)}"


def _separated_share(e: FindingEffect) -> str:
    return f"{e.simulated:.0%} of it separates from the rest of the object, though nothing may break"


def _unaccounted_energy(e: FindingEffect) -> str:
    return f"{e.simulated:.0%} of the energy is lost in transfers between material points and grid, as no material does"


EFFECT_WORDS: dict[EffectKind, Callable[[FindingEffect], str]] = {
    "deformation": _deformation,
    "static_sag": _static_sag,
    "contact_time": _contact_time,
    "contact_width": _contact_width,
    "rebound": _rebound,
    "depth_below_support": _depth_below_support,
    "penetration": _penetration,
    "separated_share": _separated_share,
    "unaccounted_energy": _unaccounted_energy,
}
"""Kind of effect → its words."""
