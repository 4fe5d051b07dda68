"""Growing of masks from a point or a box in one photograph."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.ndimage import binary_dilation, label

from corporeal.core.errors import UserError
from corporeal.core.types import Views
from corporeal.io.photos.image_loader import stored_size
from corporeal.io.photos.posed_photos import PosedPhotos, list_posed_photos
from corporeal.multiview.lens_distortion import undistort_points
from corporeal.multiview.viewed_region import ViewedRegion, find_viewed_region
from corporeal.reconstruction.masks.colour_likelihood import background_log_likelihood, colour_bins, colour_histogram
from corporeal.reconstruction.masks.mask_seeds import (
    FLOOR_SEARCH_RADII,
    MaskSeeds,
    floor_from_points,
    picture_distance_radii,
    points_near,
)
from corporeal.reconstruction.masks.total_variation import TotalVariationCutter
from corporeal.reconstruction.masks.voxel_volume import pixels_of

SURE_DISC_WIDTHS = 0.03
"""Radius around a point of what is surely inside, in widths of the picture."""
SURROUNDINGS_WIDTHS = 0.4
"""Beyond that distance from a point is what is around it, in the same widths."""
PROMPT_CUT_ROUNDS = 4
MASK_THRESHOLD = 0.5
"""Of a pixel: from here on it is inside."""
FIRST_MASK_BAND_WIDTHS = 0.03
"""Width of the band around the first mask in which objects may still be seen, in these widths."""
PROMPT_BALL_RATIO = 1.3
"""Radius of the ball around what was pointed at, in radii of its mask."""
MIN_POINTS_IN_MASK = 10
"""Points seen within the first mask that say how far away it is."""
PROMPT_EVIDENCE = 6.0
"""Evidence from a person's own hand."""


@dataclass(frozen=True)
class MaskPrompt:
    """What a person points at, in the pixels of one photograph; a point, or a box."""

    photograph: str = ""
    """Its name; "": the first."""
    at: tuple[float, float] | None = None
    """Column and row of a pixel on the object."""
    box: tuple[float, float, float, float] | None = None
    """Left, upper, right and lower end of what is around it."""


@dataclass(frozen=True)
class PicturePrompt:
    """The same in a reduced, straightened picture."""

    view: int
    corners: Float[np.ndarray, "M 2"]
    """A point, or the upper left and the lower right corner of a box: columns and rows."""


def picture_prompt(source: Path, shown: PosedPhotos, views: Views, pointed: MaskPrompt) -> PicturePrompt:
    """Find what a person points at in the pictures that are looked at.

    Raises:
        UserError: There is no such photograph, or the place is beside it.
    """
    view = _find_photograph(source, shown, pointed.photograph)
    shot = next(s for s in list_posed_photos(source).shots if s.name == shown.names[view])
    size = stored_size(shot)
    assert size is not None, "it was read"
    given = pointed.at if pointed.box is None else pointed.box
    corners = np.array(given, float).reshape(-1, 2)
    if (corners < 0).any() or (corners >= size).any() or (np.diff(corners, axis=0) <= 0).any():
        what = "The point" if pointed.box is None else "The box"
        raise UserError(
            f"{what} {' '.join(f'{n:g}' for n in corners.ravel())} does not lie in {shot.name}, "
            f"which has {size[0]} × {size[1]} pixels. Give columns from the left and rows from the "
            "top; of a box the upper left corner first."
        )
    lens = shot.lens(*size)
    stretch = np.array([lens.width / size[0], lens.height / size[1]])
    xy = undistort_points(lens, corners * stretch)
    K = views.cameras[view].K
    return PicturePrompt(view, xy @ K[:2, :2].T + K[:2, 2])


def _find_photograph(source: Path, shown: PosedPhotos, wanted: str) -> int:
    names = list(shown.names)
    found = [k for k, n in enumerate(names) if wanted in ("", n, Path(n).name, Path(n).stem)]
    if not found:
        some = ", ".join(names[:4])
        raise UserError(f"{source} has no photograph {wanted!r} with a pose. There are {some} …")
    return found[0]


def seeds_from_prompt(views: Views, points: Float[np.ndarray, "N 3"] | None, spot: PicturePrompt) -> MaskSeeds:
    """Cut one picture in two, and say where in space what is inside must be.

    Args:
        views: The pictures.
        points: On all that they show; None: there are none.
        spot: What is pointed at.

    Raises:
        UserError: Nothing there can be distinguished from its surroundings.
    """
    k, width = spot.view, views.rgb.shape[2]
    first = cut_at_prompt(views.rgb[k], spot.corners)
    if not first.any():
        raise UserError(
            "The selected object cannot be separated from its surroundings by its colours. Select "
            "another point of it, in another photograph, or give a --box around it."
        )
    around = _ball_of_mask(views, points, k, first)
    far = picture_distance_radii(views, around)
    all_around = find_viewed_region(views.cameras)
    known = np.zeros((0, 3)) if points is None else points_near(points, all_around, FLOOR_SEARCH_RADII)
    never, cone = far > 1, np.ones(far.shape, bool)
    cone[k] = binary_dilation(first, iterations=max(1, round(FIRST_MASK_BAND_WIDTHS * width)))
    never[k] = ~cone[k]
    inside, outside = np.zeros(far.shape, np.float32), never.astype(np.float32)
    inside[k], outside[k] = first, ~first
    floor = floor_from_points(views.cameras, known, all_around)
    return MaskSeeds(around, floor, inside, outside, never, cone)


def cut_at_prompt(rgb: UInt8[np.ndarray, "H W 3"], corners: Float[np.ndarray, "M 2"]) -> Bool[np.ndarray, "H W"]:
    """Return what is at a point, or in a box, of one picture (GrabCut's rounds)."""
    height, width = rgb.shape[:2]
    v, u = np.mgrid[:height, :width] + 0.5
    middle = corners.mean(axis=0)
    away = np.hypot(u - middle[0], v - middle[1]) / width
    prior = np.zeros((1, height, width), np.float32)
    if len(corners) == 1:
        inside, outside = away < SURE_DISC_WIDTHS, away > SURROUNDINGS_WIDTHS
        prior[0, inside] = -PROMPT_EVIDENCE
    else:
        (left, top), (right, bottom) = corners
        inside = (u >= left) & (u <= right) & (v >= top) & (v <= bottom)
        outside = ~inside
        prior[0, outside] = PROMPT_EVIDENCE
    bins, cutter = (colour_bins(rgb[None], np.zeros((1, *rgb.shape[:2]), np.uint8)), TotalVariationCutter(rgb[None]))
    fixed = outside
    for _ in range(PROMPT_CUT_ROUNDS):
        colours = background_log_likelihood(bins, *(colour_histogram(bins, w[None]) for w in (inside, outside)))
        inside = cutter.cut(colours + prior)[0] > MASK_THRESHOLD
        inside = _piece_at(inside, middle)
        outside = ~inside if len(corners) == 2 else fixed | ~inside
    return inside


def _piece_at(inside: Bool[np.ndarray, "H W"], middle: Float[np.ndarray, "2"]) -> np.ndarray:
    """Return the piece at a place, or the largest one where none is there."""
    pieces = label(inside)
    assert isinstance(pieces, tuple)
    if not pieces[1]:
        return inside
    column, row = np.minimum(middle.astype(int), np.array(inside.shape)[::-1] - 1)
    sizes = np.bincount(pieces[0].ravel())
    sizes[0] = 0
    return pieces[0] == (pieces[0][row, column] or int(np.argmax(sizes)))


def _ball_of_mask(
    views: Views, points: Float[np.ndarray, "N 3"] | None, k: int, first: Bool[np.ndarray, "H W"]
) -> ViewedRegion:
    """Return the ball that what one mask shows must be in."""
    camera = views.cameras[k]
    eye, axes = camera.world_from_camera[:3, 3], camera.world_from_camera[:3, :3]
    rows, columns = np.nonzero(first)
    middle = np.array([columns.mean(), rows.mean()]) + 0.5
    direction = axes @ np.linalg.solve(camera.K, [*middle, 1.0])
    ahead = axes[:, 2]
    seen = np.zeros((0, 3))
    if points is not None:
        pixel = pixels_of(points, camera)
        seen = points[(pixel >= 0) & first.ravel()[pixel]]
    target = np.array(find_viewed_region(views.cameras).centre)[None] if len(seen) < MIN_POINTS_IN_MASK else seen
    depth = float(np.median((target - eye) @ ahead))
    radius = max(np.ptp(columns), np.ptp(rows)) / 2 / camera.K[0, 0] * depth
    x, y, z = eye + depth * direction
    return ViewedRegion((float(x), float(y), float(z)), PROMPT_BALL_RATIO * float(radius))
