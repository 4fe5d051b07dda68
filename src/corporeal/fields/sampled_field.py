"""A material field sampled at points."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from corporeal.core.errors import BadFileError

FIELD_VALUE_BOUNDS: Mapping[str, tuple[float, float]] = {
    "young_pa": (0.0, np.inf),
    "density": (0.0, np.inf),
    "poisson": (-1.0, 0.5),
}
"""Field of ``types.Material`` → open interval beyond which nothing can be computed [SI]."""
MIN_FIELD_POINTS = 8
"""Points that a registration needs."""


@dataclass(frozen=True)
class SampledField:
    """Numbers of N points, in the frame and unit of whoever wrote them."""

    method: str
    """Whose ("VoMP")."""
    path: Path
    position: Float[np.ndarray, "N 3"]
    values: Mapping[str, Float[np.ndarray, " N"]]
    """Field of ``types.Material`` → value at each point, SI."""
    kind: np.ndarray | None = None
    """What the method takes each point for, in its words, (N,); None: it does not say."""


def check_field(field: SampledField) -> SampledField:
    """Return a field all of whose numbers can be computed with.

    Raises:
        BadFileError: It has too few points, or a number that is not finite or impossible.
    """
    count = len(field.position)
    if count < MIN_FIELD_POINTS:
        what = f"has {count} points; at least {MIN_FIELD_POINTS} are needed."
        raise BadFileError(field.path, what, "Write the field of the whole object.")
    bad = int((~np.isfinite(field.position)).any(axis=1).sum())
    if bad:
        what = f"{bad} of {count} points have coordinates that are not finite."
        raise BadFileError(field.path, what, "Write the file again without them.")
    if not np.ptp(field.position, axis=0).max() > 0:
        raise BadFileError(field.path, "all points coincide.", "Write the file again.")
    for name, value in field.values.items():
        low, high = FIELD_VALUE_BOUNDS[name]
        bad = int((~((value > low) & (value < high))).sum())
        if bad:
            what = f"{bad} of {count} values of {name} do not lie between {low:g} and {high:g}."
            raise BadFileError(field.path, what, "Check the units (SI), or leave them out.")
    return field
