"""Metric scale of a reconstruction, with its source."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import Note, NoteKind, Vector

SCALE_DOUBT_FACTOR = 2.0
"""Ratio of two scales that is reported."""
MIN_METRES_PER_UNIT = 1e-6
"""Metres that one unit of a file may be, and the inverse of the most."""
PLAUSIBLE_SCENE_EXTENTS_M = (2e-3, 50.0)
"""Extents of whole scenes [m]."""
NEUTRAL_SCENE_SIZE_M = 0.5
"""Assumed size of a scene of unknown scale [m]."""


MeasuredDistance = tuple[float, float, float, float, float, float, float]
"""Two points of a file, x y z x y z, and how far apart they are in reality [m]."""


@dataclass(frozen=True)
class MetricScale:
    """What one unit of a file is, for the report to state."""

    metres_per_unit: float
    """[m]"""
    source: Literal["file", "distance", "extent", "default"]
    """The file's kind is in metres; two points whose distance is known; how large such an object is as a rule, stated
    or by a model; a default size.
    """
    reason: str
    """In one sentence."""
    warnings: tuple[str, ...] = ()
    """Contradictions, in sentences."""


@dataclass(frozen=True)
class ObjectExtent:
    """How large one object is, in the file and in reality."""

    name: str
    units: float
    """Longest side in the file [its unit]."""
    metres: float
    """The same in reality [m]."""
    who: str
    """Source of the statement, in words for the report ("the command line", "a model")."""


def choose_metric_scale(
    distance: MetricScale | None = None,
    stated: Sequence[ObjectExtent] = (),
    file: MetricScale | None = None,
    usual: Sequence[ObjectExtent] = (),
    size: float = 1.0,
) -> MetricScale:
    """Return the scale that the best witness names, and what the others say against it.

    In this order: a measured distance, stated sizes of objects, a file in metres, how large such objects usually are,
    and for want of all a neutral stand-in.

    Args:
        distance: Of two points, or of cameras.
        stated: Statements of a person about single objects.
        file: Where the file's kind is in metres.
        usual: What a model or a table says of objects of these classes.
        size: Of the whole in the file, for the stand-in [its unit].

    Raises:
        UserError: A size is not positive and finite.
    """
    witnesses = [distance, scale_from_extents(stated), file, scale_from_extents(usual)]
    heard = [w for w in witnesses if w is not None]
    if not heard:
        return _stand_in_scale(size)
    first, *others = heard
    against = [_contradiction_text(first, other) for other in others]
    return replace(first, warnings=(*first.warnings, *(w for w in against if w)))


def scale_from_extents(extents: Sequence[ObjectExtent]) -> MetricScale | None:
    """Return the scale at which most objects have their sizes: the median of their ratios.

    Raises:
        UserError: A size is not positive and finite.
    """
    if not extents:
        return None
    ratios = [_scale_ratio(e.metres, e.units, f"The extent of {e.name}") for e in extents]
    scale = float(np.exp(np.median(np.log(ratios))))
    extents_text = "; ".join(f"{e.name} {e.units:.4g} units, {e.metres:.3g} m ({e.who})" for e in extents)
    odd = [e.name for e, r in zip(extents, ratios, strict=True) if _scales_differ(r, scale)]
    warnings = ()
    if odd:
        warnings = (
            Note(
                f"At one unit = {scale:.4g} m the sizes of {', '.join(odd)} are off by more than a "
                f"factor of {SCALE_DOUBT_FACTOR:g}. State the size of one object with --extent NAME=METRES.",
                NoteKind.ASSUMED,
            ),
        )
    return MetricScale(scale, "extent", f"One unit is {scale:.4g} m: {extents_text}.", warnings)


def _stand_in_scale(size: float) -> MetricScale:
    scale = _scale_ratio(NEUTRAL_SCENE_SIZE_M, size, "The whole")
    words = f"Its scale is unknown: the whole was assumed to be {NEUTRAL_SCENE_SIZE_M:g} m."
    warning = Note(f"{words} State the size of one object with --extent NAME=METRES.", NoteKind.ASSUMED)
    return MetricScale(scale, "default", words, (warning,))


def _contradiction_text(believed: MetricScale, other: MetricScale) -> str:
    if not _scales_differ(believed.metres_per_unit, other.metres_per_unit):
        return ""
    ratio = other.metres_per_unit / believed.metres_per_unit
    return Note(
        f"The scale may be wrong. Contradicting: {other.reason} By that everything would be "
        f"{ratio:.3g} times as large. Set it with --metres-per-unit, or with --extent "
        "NAME=METRES.",
        NoteKind.GRAVE,
    )


def _scales_differ(a: float, b: float) -> bool:
    return not 1 / SCALE_DOUBT_FACTOR <= a / b <= SCALE_DOUBT_FACTOR


def scale_from_file(kind: str) -> MetricScale:
    """Take the file's unit for a metre, as formats of measured scenes have it.

    Poses from pictures alone (COLMAP, and most splats trained on them) have no such unit.
    """
    return MetricScale(1.0, "file", f"{kind}: its unit was assumed to be one metre.")


def scale_from_distance(a: Vector, b: Vector, metres: float) -> MetricScale:
    """Return the scale at which two points of the file are so far apart.

    Raises:
        UserError: The points are one, or the distance is not positive and finite.
    """
    units = math.dist(a, b)
    scale = _scale_ratio(metres, units, "The distance of the two points")
    words = f"Two points {units:.4g} units apart are {metres:.4g} m apart."
    return MetricScale(scale, "distance", words)


def stated_metric_scale(per_unit: float | None, points: MeasuredDistance | None, who: str) -> MetricScale | None:
    """Return the measured unit of a file; None: not measured.

    Args:
        per_unit: What one unit is [m].
        points: Whose distance is known.
        who: Source of the statement, for the report.

    Raises:
        UserError: Both were stated, or a statement makes no sense.
    """
    if per_unit is not None and points is not None:
        raise UserError("--metres-per-unit and --known-distance exclude each other. Give one of them.")
    if points is not None:
        found = scale_from_distance(points[:3], points[3:6], points[6])
        per_unit, reason = found.metres_per_unit, f"{found.reason[:-1]}, {who} said."
    elif per_unit is None:
        return None
    else:
        reason = f"One unit of the file is {per_unit:.4g} m, {who} said."
    if not MIN_METRES_PER_UNIT <= per_unit <= 1 / MIN_METRES_PER_UNIT:
        said = "--metres-per-unit" if points is None else "--known-distance: one unit"
        raise UserError(f"{said} is {per_unit:.4g} m. It must be from {MIN_METRES_PER_UNIT:g} to 1e+06 m.")
    return MetricScale(per_unit, "distance", reason)


def implausible_scene_extent(extent: float) -> str | None:
    """State that a whole scene is too large or too small to be one that people stand objects in.

    Args:
        extent: Of the whole [m].
    """
    low, high = PLAUSIBLE_SCENE_EXTENTS_M
    if low <= extent <= high:
        return None
    return Note(
        f"The whole would be {extent:.3g} m large, which is implausible. State the size of one "
        "object with --extent NAME=METRES, or what one unit is with --metres-per-unit.",
        NoteKind.ASSUMED,
    )


def _scale_ratio(metres: float, units: float, what: str) -> float:
    scale = metres / units if units > 0 else math.nan
    if not (0 < scale < math.inf and metres < math.inf):
        raise UserError(f"{what} is {units:.4g} units and {metres:.4g} m. Both must be positive.")
    return scale
