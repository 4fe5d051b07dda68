"""Robust statistics."""

SIGMA_PER_MEDIAN_DEVIATION = 1.4826
"""Standard deviation over the median distance from the median, where errors are normal:
1/Φ⁻¹(3/4) (Hampel 1974)."""
