"""Inference of the up axis of meshes that don't state it.

There are two criteria. As it is taken it would tip over, and does not if the other usual axis points up. Or it stands
on the plane through the origin that the other axis is normal to, as models are placed by who makes them, while the axis
that is taken goes through its middle. Chairs and shelves also stand on their backs, and balls stand anyhow: what
neither tells may lie on its side all the same.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import ConvexHull, QhullError

from corporeal.geometry.gaussian_transforms import UpAxis, rotation_to_z_up

OTHER_UP_AXIS: dict[UpAxis, UpAxis] = {"+y": "+z", "+z": "+y"}
"""Of the two axes that programs point up, the one that is not taken."""
FLOOR_CONTACT_EXTENT_FRACTION = 0.01
"""What is no higher than this above the lowest point touches the floor [extents]."""
BASE_AT_ZERO_EXTENT_FRACTION = 0.005
"""A base so far from the origin's plane lies in it [extents]."""
CENTRED_SIDE_FRACTION = 0.05
"""A middle so far from the origin's plane is in it [sides]."""


def infer_up_axis(
    vertices: Float[np.ndarray, "V 3"], triangles: Int[np.ndarray, "T 3"], taken: UpAxis
) -> tuple[UpAxis, str] | None:
    """Return the axis that is likelier up, and why; None: the default is plausible.

    Args:
        vertices: In the file's axes and unit.
        triangles: Vertex numbers.
        taken: The axis that is taken, since the file states none.
    """
    other = OTHER_UP_AXIS.get(taken)
    if other is None:
        return None
    here, there = (vertices @ rotation_to_z_up(up).T for up in (taken, other))
    centre = _surface_centroid(vertices, triangles)
    if not _is_stable(there, rotation_to_z_up(other) @ centre):
        return None
    if not _is_stable(here, rotation_to_z_up(taken) @ centre):
        return other, f"so it would tip over, and with {other} up it stands"
    if _rests_on_zero(there[:, 2]) and not _rests_on_zero(here[:, 2]) and _is_centred(here[:, 2]):
        return other, f"yet it stands on the plane {other[1]} = 0, as if {other} were"
    return None


def _surface_centroid(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the middle (3,) of a surface."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return area @ (a + b + c) / (3 * max(float(area.sum()), 1e-300))


def _is_stable(points: np.ndarray, centre: np.ndarray) -> bool:
    """Return whether the middle is above what touches a floor below points, +z up."""
    low = points[:, 2].min()
    touching = points[points[:, 2] <= low + FLOOR_CONTACT_EXTENT_FRACTION * np.ptp(points, axis=0).max(), :2]
    if len(touching) < 3:
        return False
    try:
        hull = ConvexHull(touching)
    except QhullError:
        return False
    return bool((hull.equations @ (*centre[:2], 1.0) <= 0).all())


def _rests_on_zero(heights: np.ndarray) -> bool:
    return abs(float(heights.min())) <= BASE_AT_ZERO_EXTENT_FRACTION * float(np.ptp(heights))


def _is_centred(heights: np.ndarray) -> bool:
    return abs(float(heights.max() + heights.min())) <= 2 * CENTRED_SIDE_FRACTION * float(np.ptp(heights))
