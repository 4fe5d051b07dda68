"""Statistics of a registered field per part: medians, spreads, coverage."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from corporeal.fields.field_registration import RegisteredPoints
from corporeal.fields.sampled_field import SampledField

SAMPLE_REACH_SPACINGS = 3.0
"""A point takes the nearest sample's numbers within so many spacings."""
MIN_PART_COVERED_FRACTION = 0.5
"""Least share of a part's points that have a sample within reach."""
MAX_YOUNG_SPAN_DECADES = 2.0
"""Largest span of E within a part, p10 to p90, that is taken for one value [decades]."""
BAND_PERCENTILES = (10, 50, 90)
"""Percentiles."""


@dataclass(frozen=True)
class PartFieldNumbers:
    """What a field says of one part."""

    value: Mapping[str, float]
    """Field of ``types.Material`` → median, SI."""
    band: Mapping[str, tuple[float, float]]
    """The same → 10th and 90th percentile."""
    kind: str | None
    """What most of its points are taken for; None: not said."""
    covered: float
    """Share of its points with a sample within reach, in [0, 1]."""
    decades: float
    """p10 to p90 of E [decades]; 0 where E is not told."""
    unfit: str = ""
    """Why it does not tell the part, in a clause; empty: it does."""


def nearest_samples(
    field: RegisteredPoints, points: Float[np.ndarray, "M 3"]
) -> tuple[Int[np.ndarray, " M"], np.ndarray]:
    """Return the nearest sample of each point, and whether it is within reach."""
    distance, sample = KDTree(field.position).query(points)
    return np.asarray(sample), np.asarray(distance) <= SAMPLE_REACH_SPACINGS * field.spacing


def sum_up_per_part(
    field: SampledField,
    placed: RegisteredPoints,
    points: Float[np.ndarray, "M 3"],
    part_of_point: Int[np.ndarray, " M"],
) -> dict[int, PartFieldNumbers]:
    """Sum up a field over points spread on the surfaces of parts.

    Returns:
        Part → its numbers, for every part that has a point.

    """
    sample, near = nearest_samples(placed, points)
    found = {}
    for part in np.unique(part_of_point[part_of_point >= 0]).tolist():
        mine = part_of_point == part
        found[part] = _sum_up_part(field, sample[mine & near], float(near[mine].mean()))
    return found


def _sum_up_part(field: SampledField, sample: np.ndarray, covered: float) -> PartFieldNumbers:
    if covered < MIN_PART_COVERED_FRACTION:
        unfit = f"only {covered:.0%} of it lies near a point of the field"
        return PartFieldNumbers({}, {}, None, covered, 0.0, unfit)
    bands = {name: np.percentile(v[sample], BAND_PERCENTILES) for name, v in field.values.items()}
    decades = float(np.log10(bands["young"][2] / bands["young"][0])) if "young" in bands else 0.0
    unfit = f"E spans {decades:.1f} decades within it" if decades > MAX_YOUNG_SPAN_DECADES else ""
    kind = None
    if field.kind is not None:
        names, count = np.unique(field.kind[sample], return_counts=True)
        kind = str(names[count.argmax()])
    return PartFieldNumbers(
        value={name: float(b[1]) for name, b in bands.items()},
        band={name: (float(b[0]), float(b[2])) for name, b in bands.items()},
        kind=kind,
        covered=covered,
        decades=decades,
        unfit=unfit,
    )
