"""Free space along lines of sight from cameras to observed points.

Structure from motion says of each of its points which pictures show it. Labatut, Pons and Keriven, "Efficient
multi-view reconstruction of large-scale scenes using interest points, Delaunay triangulation and graph cuts" (ICCV
2007), carve space by that; here it empties what silhouettes cannot: the mouth of a vessel seen from above.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import binary_dilation
from scipy.spatial import Delaunay, QhullError

from corporeal.core.types import Camera

MIN_EMPTYING_VIEWS = 2
"""Views whose lines must pass through a cell for it to be empty."""
SAME_FACE_DISTANCE_CELLS = 8.0
"""Points that are nearer together [cells], and neighbours in a picture, are taken to be on one face: what is before it
is empty, too. Objects that stand on a face show points of their own.
"""


@dataclass(frozen=True)
class LinesOfSight:
    """Which view shows which point."""

    points: Float[np.ndarray, "N 3"]
    """In the frame and unit of the cameras."""
    view: Int[np.ndarray, " S"]
    point: Int[np.ndarray, " S"]

    def only(self, views: Sequence[int]) -> "LinesOfSight":
        """Return the lines of some views, numbered in their order."""
        number = {k: n for n, k in enumerate(views)}
        kept = np.isin(self.view, list(number))
        view = np.array([number[int(k)] for k in self.view[kept]], np.int64)
        return LinesOfSight(self.points, view, self.point[kept])

    def seen_by(self, view: int) -> Float[np.ndarray, "M 3"]:
        """Return the points that a view shows."""
        return self.points[self.point[self.view == view]]

    def emptied(
        self, cameras: Sequence[Camera], low: Float[np.ndarray, "3"], side: float, shape: tuple[int, ...]
    ) -> Bool[np.ndarray, "X Y Z"]:
        """Return which cubic cells lines of several views pass through, or next to.

        Args:
            cameras: Of the views.
            low: Middle of the first cell.
            side: Of a cell.
            shape: How many cells there are along x, y and z.
        """
        # numba takes a quarter of a second to import, and models have no lines of sight.
        from corporeal.multiview.kernels_lines_of_sight import march_lines

        votes = np.zeros(shape, np.int32)
        for k, camera in enumerate(cameras):
            ends = self.seen_by(k)
            if len(ends):
                ends = np.concatenate([ends, _places_between(ends, camera, SAME_FACE_DISTANCE_CELLS * side)])
                passed = np.zeros(shape, np.bool_)
                eye = camera.world_from_camera[:3, 3]
                march_lines((ends - low) / side, (eye - low) / side, passed)
                votes += binary_dilation(passed)
        return votes >= MIN_EMPTYING_VIEWS


def _places_between(ends: Float[np.ndarray, "M 3"], camera: Camera, apart: float) -> Float[np.ndarray, "T 3"]:
    """Return places between points that are neighbours in a picture, and near each other."""
    local = (ends - camera.world_from_camera[:3, 3]) @ camera.world_from_camera[:3, :3]
    ahead = local[:, 2] > 0
    ends, local = ends[ahead], local[ahead]
    try:
        corner = ends[Delaunay(local[:, :2] / local[:, 2:]).simplices]
    except (QhullError, ValueError):  # fewer than three points, or all on a line
        return np.zeros((0, 3))
    along = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)
    corner = corner[(along < apart).all(axis=1)]
    middles = (corner + np.roll(corner, 1, axis=1)) / 2
    return np.concatenate([corner.mean(axis=1), middles.reshape(-1, 3)])
