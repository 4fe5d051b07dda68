"""How large a reconstruction is in metres, and who said so."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from corporeal.errors import UserError
from corporeal.types import Vector

DOUBT = 2.0
"""Factor between two scales from which on somebody must be told."""
NEUTRAL = 0.5
"""Stands in for the size of a scene of which nobody knows it [m]."""


@dataclass(frozen=True)
class MetricScale:
    """What one unit of a file is, for the report to state."""

    metres_per_unit: float
    """[m]"""
    source: Literal["file", "distance", "extent", "nobody"]
    """The file's kind is in metres; two points whose distance is known; how large such a thing is
    as a rule, which somebody or a model said; a neutral stand-in."""
    reason: str
    """In one sentence."""
    warnings: tuple[str, ...] = ()
    """What speaks against it, in sentences."""


@dataclass(frozen=True)
class Extent:
    """How large one thing is, in the file and in reality."""

    name: str
    units: float
    """Longest side in the file [its unit]."""
    metres: float
    """The same in reality [m]."""
    who: str
    """Who said so, in words for the report ("the command line", "a model")."""


def chosen(
    distance: MetricScale | None = None,
    stated: Sequence[Extent] = (),
    file: MetricScale | None = None,
    usual: Sequence[Extent] = (),
    size: float = 1.0,
) -> MetricScale:
    """Return the scale that the best witness names, and what the others say against it.

    In this order: a distance that somebody measured, sizes of things that somebody stated, a file
    in metres, how large such things usually are, and for want of all a neutral stand-in.

    Args:
        distance: Of two points, or of cameras.
        stated: What a person said of single things.
        file: Where the file's kind is in metres.
        usual: What a model or a table says of things of these classes.
        size: Of the whole in the file, for the stand-in [its unit].

    Raises:
        UserError: A size is not positive and finite.

    """
    witnesses = [distance, of_extents(stated), file, of_extents(usual)]
    heard = [w for w in witnesses if w is not None]
    if not heard:
        return _stand_in(size)
    first, *others = heard
    against = [_against(first, other) for other in others]
    return replace(first, warnings=(*first.warnings, *(w for w in against if w)))


def of_extents(extents: Sequence[Extent]) -> MetricScale | None:
    """Return the scale at which most things have their sizes: the median of their ratios.

    Raises:
        UserError: A size is not positive and finite.

    """
    if not extents:
        return None
    ratios = [_ratio(e.metres, e.units, f"The extent of {e.name}") for e in extents]
    scale = float(np.exp(np.median(np.log(ratios))))
    told = "; ".join(f"{e.name} {e.units:.4g} units, {e.metres:.3g} m ({e.who})" for e in extents)
    odd = [e.name for e, r in zip(extents, ratios, strict=True) if _differ(r, scale)]
    warnings = ()
    if odd:
        warnings = (
            f"At one unit = {scale:.4g} m the sizes of {', '.join(odd)} are off by more than a "
            f"factor of {DOUBT:g}. State the size of one thing with --extent NAME=METRES.",
        )
    return MetricScale(scale, "extent", f"One unit is {scale:.4g} m: {told}.", warnings)


def _stand_in(size: float) -> MetricScale:
    scale = _ratio(NEUTRAL, size, "The whole")
    words = f"Nobody knows how large it is: the whole was taken as {NEUTRAL:g} m."
    warning = f"{words} State the size of one thing with --extent NAME=METRES."
    return MetricScale(scale, "nobody", words, (warning,))


def _against(believed: MetricScale, other: MetricScale) -> str:
    if not _differ(believed.metres_per_unit, other.metres_per_unit):
        return ""
    ratio = believed.metres_per_unit / other.metres_per_unit
    return f"{other.reason} That differs by a factor of {ratio:.3g} from what was believed."


def _differ(a: float, b: float) -> bool:
    return not 1 / DOUBT <= a / b <= DOUBT


def of_file(kind: str) -> MetricScale:
    """Take the file's unit for a metre, as formats of measured scenes have it.

    Poses from pictures alone (COLMAP, and most splats trained on them) have no such unit.
    """
    return MetricScale(1.0, "file", f"{kind}: its unit was taken for one metre.")


def of_distance(a: Vector, b: Vector, metres: float) -> MetricScale:
    """Return the scale at which two points of the file are so far apart.

    Raises:
        UserError: The points are one, or the distance is not positive and finite.

    """
    units = math.dist(a, b)
    scale = _ratio(metres, units, "The distance of the two points")
    words = f"Two points {units:.4g} units apart are {metres:.4g} m apart."
    return MetricScale(scale, "distance", words)


def of_extent(low: Vector, high: Vector, metres: float, who: str) -> MetricScale:
    """Return the scale at which the longest edge of a box is so long.

    Args:
        low: One corner of the box.
        high: The opposite corner.
        metres: How long the edge is in reality [m].
        who: Who said so, for the report ("a model", "the command line").

    Raises:
        UserError: The box is a point, or the length is not positive and finite.

    """
    units = float(np.ptp([low, high], axis=0).max())
    scale = _ratio(metres, units, "The extent of the thing")
    words = f"It is {units:.4g} units large in the file and {metres:.4g} m in reality, {who} said."
    return MetricScale(scale, "extent", words)


def _ratio(metres: float, units: float, what: str) -> float:
    scale = metres / units if units > 0 else math.nan
    if not (0 < scale < math.inf and metres < math.inf):
        raise UserError(f"{what} is {units:.4g} units and {metres:.4g} m. Both must be positive.")
    return scale
