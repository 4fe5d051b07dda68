"""Principal points, which reveal cropped photographs.

Photographs that were cropped, each in another way, fit together as if their lenses were longer and stood elsewhere: 25
of 25 were placed, 6° wrong, with a reprojection error below 1 px. Where each may have a middle of its own, middles of
cropped ones move apart, and their points then agree much better. Of whole ones they stay, or move for nothing: then
points do not say where they are.
"""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from corporeal.multiview.point_cloud_geometry import SIGMA_PER_MEDIAN_DEVIATION
from corporeal.reconstruction.sfm.model_refinement import adjust_bundle
from corporeal.reconstruction.sfm.sfm_run import require_pycolmap

MAX_PRINCIPAL_POINT_POINTS = 1500
"""Points that are asked, those that most pictures show: enough for 150 in each picture."""
MAX_ERROR_RATIO = 0.9
"""Share of the error that is left where it is a gain: .71 to .87 where pictures were cropped; .94 to 1.0 in twenty sets
that were not; .73 in one of a phone, whose lens moves by 1.3 %.
"""
SLIGHT_SPREAD_FRACTION = 0.02
"""Spread of the middles, in the longer side, from which on it is reported: it turns a view by 1.3°."""
CROPPED_SPREAD_FRACTION = 0.05
"""The same, from which on poses are rejected: 3.3°."""
UNCROPPED_HINT = "Use the original photographs; crop none, or all in the same way."


def principal_point_spread(place: Path) -> float:
    """Return how far apart the middles of lenses lie, in the longer side; 0: pictures are whole."""
    pycolmap = require_pycolmap()
    model = _one_camera_per_picture(pycolmap, pycolmap.Reconstruction(str(place)))
    adjust_bundle(pycolmap, model, of_lens="nothing")  # as they are found, points on edges count less
    before = _median_error(model)
    adjust_bundle(pycolmap, model, of_lens="middle")
    spread = float(SIGMA_PER_MEDIAN_DEVIATION * _spread_of_points(_principal_points(model)).max())
    return spread if _median_error(model) < MAX_ERROR_RATIO * before else 0.0


def spread_clause(spread: float) -> str:
    """Describe what it means that middles lie so far apart."""
    return (
        "lenses would have looked past the middles of the pictures, each by another "
        f"{spread:.0%} of their width: the photographs were cropped, each in another way, or many "
        "were placed wrongly"
    )


def spread_sentence(spread: float) -> str:
    """Say the same of poses that are used all the same."""
    what = spread_clause(spread)
    return f"{what[0].upper()}{what[1:]}, and shapes are a little off. {UNCROPPED_HINT}"


def _spread_of_points(middles: Float[np.ndarray, "V 2"]) -> Float[np.ndarray, "2"]:
    return np.median(np.abs(middles - np.median(middles, axis=0)), axis=0)


def _principal_points(model: Any) -> Float[np.ndarray, "V 2"]:
    """Return where lenses look, off the middles of pictures, in their longer sides."""
    cameras = list(model.cameras.values())
    middle = np.array([(c.principal_point_x, c.principal_point_y) for c in cameras])
    size = np.array([(c.width, c.height) for c in cameras])
    return (middle - size / 2) / size.max(axis=1, keepdims=True)


def _median_error(model: Any) -> float:
    """Return the median reprojection error of points [px]."""
    model.update_point_3d_errors()
    return float(np.median([point.error for point in model.points3D.values()]))


def _one_camera_per_picture(pycolmap: Any, model: Any) -> Any:
    """Return a model with some of its points, and a camera for each picture."""
    made = pycolmap.Reconstruction()
    for number in sorted(model.reg_image_ids()):
        image = model.images[number]
        camera = pycolmap.Camera(model.cameras[image.camera_id].todict())
        camera.camera_id = number
        made.add_camera_with_trivial_rig(camera)
        seen = np.array([point.xy for point in image.points2D]).reshape(-1, 2)
        own = pycolmap.Image(name=image.name, keypoints=seen, camera_id=number, image_id=number)
        made.add_image_with_trivial_frame(own, image.cam_from_world())
    order = sorted(model.points3D, key=lambda k: (-model.points3D[k].track.length(), k))
    for number in order[:MAX_PRINCIPAL_POINT_POINTS]:
        point = model.points3D[number]
        made.add_point3D(point.xyz, point.track, point.color)
    return made
