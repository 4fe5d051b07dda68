"""Final robust bundle adjustment of a COLMAP model.

Position uncertainty of image points across and along edges.

A point on a straight edge, such as the gap between two planks, is found again anywhere along it. How exactly a point
lies in each direction, the gradients around it say: the structure tensor (Förstner and Gülch 1987, "A fast operator for
detection and precise location of distinct points, corners and centres of circular features"). That points of scale and
affine shape have errors like that, and that adjustments gain by it: Zeisl et al., "Estimation of location uncertainty
for scale invariant feature points", BMVC 2009.
"""

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from PIL import Image
from scipy.ndimage import gaussian_filter

from corporeal.core.process_resources import usable_cores
from corporeal.reconstruction.sfm.bundle_adjustment import Bundle, solve_bundle

EDGE_GRADIENT_SIGMA_PX, TENSOR_SIGMA_PX = 1.0, 3.0
"""Gaussians before gradients are taken, and over which they are gathered [px]."""
WINDOW_SIGMAS = 3.0
"""Of the Gaussians, in standard deviations."""
EIGENVALUE_POWER = 0.25
"""Of the ratio of the tensor's eigenvalues. By least squares of white noise it would be a half. Measured on a chair, a
bin and a hammer under true poses: points on the straightest edges (ratio .01) are 1.8 times as far off along as across
in the median and 2.0 at the 80th percentile, at .03 1.5, from .4 on 1.2; with one half a box on a table is turned by
.12° more than without."""
MIN_EIGENVALUE_RATIO = 1e-3
"""Least ratio: pictures have noise."""


def whitening_matrices(grey: Float[np.ndarray, "H W"], points: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2 2"]:
    """Return what turns errors of points into errors that are alike in all directions.

    Args:
        grey: A picture.
        points: Where they lie in it [px].

    Returns:
        Matrices: across an edge an error keeps its length, along it it becomes shorter.
    """
    smooth = gaussian_filter(grey, EDGE_GRADIENT_SIGMA_PX, truncate=WINDOW_SIGMAS)
    down, across = np.gradient(smooth)
    xx, xy, yy = (
        gaussian_filter(product, TENSOR_SIGMA_PX, truncate=WINDOW_SIGMAS)
        for product in (across * across, across * down, down * down)
    )
    height, width = grey.shape
    x = np.clip(points[:, 0].astype(int), 0, width - 1)
    y = np.clip(points[:, 1].astype(int), 0, height - 1)
    tensor = np.array([[xx[y, x], xy[y, x]], [xy[y, x], yy[y, x]]]).transpose(2, 0, 1)
    values, directions = np.linalg.eigh(tensor)
    flat = values[:, 1] <= 0
    ratio = np.where(flat, 1.0, values[:, 0] / np.where(flat, 1.0, values[:, 1]))
    along = np.clip(ratio, MIN_EIGENVALUE_RATIO, 1.0) ** EIGENVALUE_POWER
    # Columns of directions: along the edge, where gradients are least; across it.
    return np.stack([directions[:, :, 0] * along[:, None], directions[:, :, 1]], axis=1)


ROBUST_SCALE_PX = 0.5
"""Reprojection error [px] from which on a point counts for less (Cauchy's loss)."""
MIN_PICTURES_PER_SIZE = 3
"""Pictures of one size, either way up, below which they were cropped to it: a camera writes few sizes, and has its lens
before the middle of each."""
REFINEMENT_ROUNDS = 3
"""Of finding the middles of cropped pictures, and the lens that all were taken through."""


@dataclass(frozen=True)
class LensPrior:
    """What is known of how a picture was taken, before COLMAP looks at it."""

    lens: float
    """Focal length as on 35 mm film [mm] that it states; 0: none. Equal ones are one lens."""
    reduced: float
    """Its length over that of the photograph [-]."""


def refine_model(pycolmap: Any, model: Any, taken: Mapping[str, LensPrior], images: Path) -> Any:
    """Adjust cameras and points once more, so that wrong matches count for little.

    COLMAP's last adjustment is one of least squares, which points that are 4 px off pull with 64 times the weight of
    those that are half a pixel off.

    The principal points of cropped pictures are unknown: taken for their middles, it turns and moves
    cameras, and gives each another lens. One lens before middles of their own takes as many numbers, and is accepted
    where it fits better.

    In the end points on edges count along these for less.

    Args:
        pycolmap: The library.
        model: Is changed.
        taken: How pictures were taken, by their names.
        images: Where they lie.

    Returns:
        The model, or another one in its place.
    """
    adjust_bundle(pycolmap, model)
    model = _free_principal_points(pycolmap, model, taken)
    adjust_bundle_by_edges(pycolmap, model, images)
    return model


def _free_principal_points(pycolmap: Any, model: Any, taken: Mapping[str, LensPrior]) -> Any:
    """Return the model, or one with middles for its cropped pictures, where that fits better."""
    loose = cropped_cameras(model)
    if not loose:
        return model
    other = pycolmap.Reconstruction(model)
    for again in range(REFINEMENT_ROUNDS):
        if again:
            adjust_bundle(pycolmap, other, loose)
        _share_lens_parameters(other, loose, taken)
        adjust_bundle(pycolmap, other, loose, "middle")
    error = [m.compute_mean_reprojection_error() for m in (other, model)]
    return other if error[0] < error[1] else model


def cropped_cameras(model: Any) -> set[int]:
    """Return the numbers of cameras whose pictures have a size that hardly any others have."""
    size = {number: tuple(sorted((c.width, c.height))) for number, c in model.cameras.items()}
    placed = [model.images[number].camera_id for number in model.reg_image_ids()]
    count = Counter(size[camera] for camera in placed)
    return {camera for camera in placed if count[size[camera]] < MIN_PICTURES_PER_SIZE}


def _share_lens_parameters(model: Any, loose: Collection[int], taken: Mapping[str, LensPrior]) -> None:
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


def adjust_bundle(
    pycolmap: Any, model: Any, loose: Collection[int] = (), of_lens: Literal["shape", "middle", "nothing"] = "shape"
) -> None:
    """Adjust poses and points, and of lenses focal length and distortion, the middle, or nothing.

    Args:
        pycolmap: The library.
        model: Is changed.
        loose: Numbers of the cameras of which this is adjusted; none: of all.
        of_lens: What of lenses is adjusted.
    """
    options = pycolmap.BundleAdjustmentOptions()
    options.print_summary = False
    options.refine_focal_length = options.refine_extra_params = of_lens == "shape"
    options.refine_principal_point = of_lens == "middle"
    options.ceres.solver_options.num_threads = usable_cores()
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = ROBUST_SCALE_PX
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


def adjust_bundle_by_edges(pycolmap: Any, model: Any, images: Path) -> None:
    """Adjust the same, points being less exact along the edges that they lie on than across.

    Args:
        pycolmap: The library.
        model: Is changed.
        images: Where its pictures lie.
    """
    shown = [model.images[number] for number in model.reg_image_ids()]
    lenses, numbers = sorted({image.camera_id for image in shown}), sorted(model.points3D)
    place = {number: k for k, number in enumerate(numbers)}
    seen, white, view, point = [], [], [], []
    for k, image in enumerate(shown):
        own = [p for p in image.points2D if p.has_point3D()]
        pixel = np.array([p.xy for p in own]).reshape(-1, 2)
        with Image.open(images / image.name) as picture:
            grey = np.asarray(picture.convert("L"), np.float64)
        seen.append(pixel)
        white.append(whitening_matrices(grey, pixel))
        view.append(np.full(len(own), k))
        point.append(np.array([place[p.point3D_id] for p in own], np.int64))
    poses = [image.cam_from_world() for image in shown]
    found = solve_bundle(
        Bundle(
            rotation=np.stack([pose.rotation.matrix() for pose in poses]),
            shift=np.stack([pose.translation for pose in poses]),
            lens=np.stack([model.cameras[number].params for number in lenses]),
            points=np.stack([model.points3D[number].xyz for number in numbers]),
            lens_of=np.array([lenses.index(image.camera_id) for image in shown]),
            view=np.concatenate(view),
            point=np.concatenate(point),
            seen=np.concatenate(seen),
            white=np.concatenate(white),
        ),
        ROBUST_SCALE_PX,
    )
    for image, turn, shift in zip(shown, found.rotation, found.shift, strict=True):
        pose = pycolmap.Rigid3d(np.column_stack([turn, shift]))
        model.frames[image.frame_id].set_cam_from_world(image.camera_id, pose)
    for number, numbers_of in zip(lenses, found.lens, strict=True):
        model.cameras[number].params = numbers_of
    for number, where in zip(numbers, found.points, strict=True):
        model.points3D[number].xyz = where
    # Points may have passed behind a camera, of which a reprojection error says nothing.
    pycolmap.ObservationManager(model).filter_observations_with_negative_depth()
    model.update_point_3d_errors()
