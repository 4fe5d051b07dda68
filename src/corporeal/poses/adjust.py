"""The last adjustment of a model that COLMAP found: cameras and points, by robust least squares."""

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from corporeal.machine import cores

EXACT = 0.5
"""Reprojection error [px] from which on a point counts for less (Cauchy's loss)."""
LONE = 3
"""Pictures of one size, either way up, below which somebody cut them to it: a camera writes few
sizes, and has its lens before the middle of each."""
ROUNDS = 3
"""Of finding the middles of cropped pictures, and the lens that all were taken through."""


@dataclass(frozen=True)
class Taken:
    """What is known of how a picture was taken, before COLMAP looks at it."""

    lens: float
    """Focal length as on 35 mm film [mm] that it states; 0: none. Equal ones are one lens."""
    reduced: float
    """Its length over that of the photograph [-]."""


def adjusted(pycolmap: Any, model: Any, taken: Mapping[str, Taken]) -> Any:
    """Adjust cameras and points once more, so that wrong matches count for little.

    COLMAP's last adjustment is one of least squares, which points that are 4 px off pull with 64
    times the weight of those that are half a pixel off.

    Where the lens was in pictures that somebody cropped nobody knows: taken for their middles, it
    turns and moves cameras, and gives each another lens. One lens before middles of their own takes
    as many numbers, and is believed where it fits better.

    Args:
        pycolmap: The library.
        model: Is changed.
        taken: How pictures were taken, by their names.

    Returns:
        The model, or another one in its place.

    """
    adjust(pycolmap, model)
    loose = cropped(model)
    if not loose:
        return model
    other = pycolmap.Reconstruction(model)
    for again in range(ROUNDS):
        if again:
            adjust(pycolmap, other, loose)
        _share_lenses(other, loose, taken)
        adjust(pycolmap, other, loose, middles_alone=True)
    error = [m.compute_mean_reprojection_error() for m in (other, model)]
    return other if error[0] < error[1] else model


def cropped(model: Any) -> set[int]:
    """Return the numbers of cameras whose pictures have a size that hardly any others have."""
    size = {number: tuple(sorted((c.width, c.height))) for number, c in model.cameras.items()}
    placed = [model.images[number].camera_id for number in model.reg_image_ids()]
    count = Counter(size[camera] for camera in placed)
    return {camera for camera in placed if count[size[camera]] < LONE}


def _share_lenses(model: Any, loose: Collection[int], taken: Mapping[str, Taken]) -> None:
    """Give cropped pictures the focal length and distortion that most of their lens have."""
    images = [model.images[number] for number in model.reg_image_ids()]
    for lens in {taken[image.name].lens for image in images}:
        own = [image for image in images if taken[image.name].lens == lens]
        found = np.stack([model.cameras[image.camera_id].params for image in own])
        scale = np.array([taken[image.name].reduced for image in own])
        focal, bent = np.median(found[:, 0] / scale), np.median(found[:, 3])
        for image, reduced in zip(own, scale, strict=True):
            if image.camera_id in loose:
                camera = model.cameras[image.camera_id]
                _, x, y, _ = camera.params
                camera.params = [focal * reduced, x, y, bent]


def adjust(
    pycolmap: Any, model: Any, loose: Collection[int] = (), middles_alone: bool = False
) -> None:
    """Adjust poses, points, and focal lengths and distortions, or the middles of pictures.

    Args:
        pycolmap: The library.
        model: Is changed.
        loose: Numbers of the cameras of which this is adjusted; none: of all.
        middles_alone: Whether of lenses the middle is adjusted, and nothing else.

    """
    options = pycolmap.BundleAdjustmentOptions()
    options.print_summary = False
    options.refine_focal_length = options.refine_extra_params = not middles_alone
    options.refine_principal_point = middles_alone
    options.ceres.solver_options.num_threads = cores()
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = EXACT
    chosen = pycolmap.BundleAdjustmentConfig()
    for number in model.reg_image_ids():
        chosen.add_image(number)
    if loose:
        for camera in set(model.cameras) - set(loose):
            chosen.set_constant_cam_intrinsics(camera)
    chosen.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    # Not pycolmap.bundle_adjustment, which writes to the terminal whatever the level.
    pycolmap.create_default_bundle_adjuster(options, chosen, model).solve()
    model.update_point_3d_errors()
