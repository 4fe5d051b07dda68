"""Texture of the floor, and its lighting in each picture.

A picture has its own exposure and white balance, and a flash lights what is near more than what is
far, from another place in every picture. Both are smooth over the floor, and its print is not: of
the logarithms of what all views see there, print is the median of all views, and light what a view
has beside that, as a polynomial of the second degree.
"""

import numpy as np
from jaxtyping import Float

LIGHT_SAMPLE_SPACING_CELLS = 3
"""Cells from one that light is fitted at to the next."""
MIN_LIGHT_SAMPLES = 50
"""Of such cells, for a view to be fitted."""
LIGHT_ITERATIONS, REWEIGHTING_ITERATIONS = 3, 4
"""Of finding print and light in turn, and of weighing anew within one."""
ROBUST_SCALE_LOG = 0.15
"""Difference of logarithms at which a cell counts a quarter: objects stand before some."""
EVEN_LIGHT_WEIGHT = 0.02
"""Weight of light that is even, for each cell's of what is seen."""


def floor_light(
    seen: Float[np.ndarray, "V n n 3"],
) -> Float[np.ndarray, "V n n 3"]:
    """Return the light of each view on each cell of the floor, in logarithms.

    Args:
        seen: Logarithms of colours; nan: not in the picture.

    """
    terms = _light_terms(seen.shape[1])
    few = np.zeros(seen.shape[1:3], np.bool_)
    few[::LIGHT_SAMPLE_SPACING_CELLS, ::LIGHT_SAMPLE_SPACING_CELLS] = True
    flat, basis = seen[:, few], terms[few.ravel()]
    factor = np.zeros((len(seen), terms.shape[1], 3))
    for _ in range(LIGHT_ITERATIONS):
        usual = known_median(flat - basis @ factor)
        for k, one in enumerate(flat):
            good = np.isfinite(one - usual).all(axis=-1)
            if good.sum() >= MIN_LIGHT_SAMPLES:
                factor[k] = _fit_light(basis[good], (one - usual)[good], factor[k])
    return (terms @ factor).reshape(seen.shape)


def known_median(values: Float[np.ndarray, "V *rest"]) -> Float[np.ndarray, "*rest"]:
    """Return the median over views of what is known; nan: no view knows it."""
    ordered, count = np.sort(values, axis=0), np.isfinite(values).sum(axis=0)
    ends = np.stack([np.maximum(count - 1, 0) // 2, np.minimum(count // 2, len(values) - 1)])
    return np.take_along_axis(ordered, ends, axis=0).mean(axis=0)


def _light_terms(count: int) -> Float[np.ndarray, "M 6"]:
    line = np.linspace(-1, 1, count)
    y, x = (a.ravel() for a in np.meshgrid(line, line, indexing="ij"))
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)


def _fit_light(
    terms: Float[np.ndarray, "N 6"], light: Float[np.ndarray, "N 3"], factor: np.ndarray
) -> Float[np.ndarray, "6 3"]:
    """Fit again and again, with less weight for what is far off (after Geman and McClure)."""
    stiff = EVEN_LIGHT_WEIGHT * len(terms) * np.diag([0.0, 1, 1, 1, 1, 1])
    if not factor.any():
        factor = np.zeros_like(factor)
        factor[0] = np.median(light, axis=0)
    for _ in range(REWEIGHTING_ITERATIONS):
        off = (light - terms @ factor).mean(axis=1) / ROBUST_SCALE_LOG
        weighed = terms / np.square(1 + np.square(off))[:, None]
        factor = np.linalg.solve(terms.T @ weighed + stiff, weighed.T @ light)
    return factor
