"""Where in a measured range: fractions and values, on the scale that suits the range."""

import math

from corporeal.core.types import MeasuredRange

LOG_SCALE_MIN_RATIO = 10.0
"""A range whose ends differ by more than this factor is divided on a logarithmic scale."""


def is_logarithmic(r: MeasuredRange) -> bool:
    """Return whether places in a range are counted in factors, not in differences."""
    return r.low > 0 and r.high / r.low > LOG_SCALE_MIN_RATIO


def value_at_fraction(r: MeasuredRange, fraction: float) -> float:
    """Return the value at a place in a range, 0 its low end and 1 its high end.

    x = a + f (b - a), or on a logarithmic scale x = a (b/a)^f.
    """
    if is_logarithmic(r):
        value = r.low * (r.high / r.low) ** fraction
    else:
        value = r.low + fraction * (r.high - r.low)
    return min(max(value, r.low), r.high)  # rounding must not leave the range


def fraction_of(r: MeasuredRange, value: float) -> float:
    """Return the place of a value in a range: the inverse of ``value_at_fraction``; 0.5 in a single value."""
    if r.high <= r.low:
        return 0.5
    if is_logarithmic(r):
        return math.log(value / r.low) / math.log(r.high / r.low)
    return (value - r.low) / (r.high - r.low)
