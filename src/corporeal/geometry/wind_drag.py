"""Wind pressure on objects at rest.

With u the velocity of the air and θ the angle between u and a face's inward normal, the pressure is
½ ρ_air C u² cos³θ where cos θ > 0, and nothing in the lee (Hoerner 1965; see ``mpm/wind.py``, which
does the same for faces in motion and imports nothing of the project: a test holds the two equal).
"""

import numpy as np
from jaxtyping import Float

AIR_DENSITY_KG_M3 = 1.2
"""ρ_air at 20 °C and sea level [kg/m³]."""
FLAT_PLATE_DRAG_COEFFICIENT = 1.17
"""C: pressure on a plate that faces the wind, over ½ ρ u² [-]."""


def drag_areas(
    area: Float[np.ndarray, "A 3"], heading: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "A 3"]:
    """Force on each face over ½ ρ_air u² [m²]: along its inward normal, C A cos³θ large.

    Args:
        area: Outward area vectors of faces at rest [m²].
        heading: Where the air goes, unit.

    """
    size = np.linalg.norm(area, axis=1)
    inward = -area / np.maximum(size, 1e-30)[:, None]
    return (FLAT_PLATE_DRAG_COEFFICIENT * size * np.maximum(inward @ heading, 0.0) ** 3)[
        :, None
    ] * inward
