"""Detection of mirrored photographs of front cameras.

A printed sheet that is seen in a mirror is a sheet that is seen from below: both fit one model,
with a low reprojection error, half of its cameras under the floor and what stands on it there
twice. But nobody sees one point of a surface from both of its sides.
"""

import numpy as np
from jaxtyping import Bool, Float

from corporeal.io.photos.colmap import ColmapModel

PLANE_SAMPLES = 300
"""Planes through three points that are tried."""
ON_PLANE_FRACTION = 0.01
"""Distance from a plane of what is on it, in the cameras' distance from the points' middle."""
MIN_POINTS_BOTH_SIDES = 30
"""Points on it that both sides see."""
MIN_BOTH_SIDES_FRACTION = 0.1
"""Of all points on it, how many these must be: .33 where half of the pictures are mirrored, .03 for
a thin axe head that was turned over, 0 for twenty other sets."""
ONE_CAMERA_HINT = (
    "Take all with one camera, and no mirrored pictures of a phone's front camera; or turn "
    "those back that are mirrored."
)


def describe_mirrored(model: ColmapModel) -> str | None:
    """Return in a clause that cameras stand on both sides of what they all see, if they do."""
    if len(model.points) < MIN_POINTS_BOTH_SIDES or not len(model.sightings):
        return None
    eyes = np.stack([image.world_from_camera[:3, 3] for image in model.images])
    away = float(np.median(np.linalg.norm(eyes - np.median(model.points, axis=0), axis=1)))
    normal, offset = _dominant_plane(model.points, ON_PLANE_FRACTION * away)
    on_plane = np.abs(model.points @ normal - offset) < ON_PLANE_FRACTION * away
    above = eyes @ normal > offset
    both = _points_seen_from(model, above) & _points_seen_from(model, ~above) & on_plane
    if both.sum() < max(MIN_POINTS_BOTH_SIDES, MIN_BOTH_SIDES_FRACTION * on_plane.sum()):
        return None
    sides = sorted((int(above.sum()), int((~above).sum())), reverse=True)
    return (
        f"{sides[0]} pictures would see one surface from one side and {sides[1]} the same points "
        "of it from the other: some of the pictures are mirrored"
    )


def _dominant_plane(
    points: Float[np.ndarray, "N 3"], near: float
) -> tuple[Float[np.ndarray, "3"], float]:
    """Return normal and offset of the plane through three points that most are on."""
    rng = np.random.default_rng(0)
    corners = points[rng.integers(0, len(points), (PLANE_SAMPLES, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.maximum(length, np.finfo(float).tiny)
    offsets = (normals * corners[:, 0]).sum(axis=1)
    counts = [(np.abs(points @ n - d) < near).sum() for n, d in zip(normals, offsets, strict=True)]
    best = int(np.argmax(np.where(length[:, 0] > 0, counts, 0)))
    return normals[best], float(offsets[best])


def _points_seen_from(model: ColmapModel, which: Bool[np.ndarray, " V"]) -> Bool[np.ndarray, " N"]:
    """Return which points some of the images show."""
    seen = np.zeros(len(model.points), bool)
    seen[model.sightings[which[model.sightings[:, 0]], 1]] = True
    return seen
