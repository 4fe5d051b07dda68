"""Holes in masks: openings are kept, painted areas are closed.

A label in the colour of the floor leaves a hole in the masks of the pictures that show it, and
enough of them carve a pit. Pictures from the other side tell: through a true hole they see what
is behind it, too; behind a label they see the object.
"""

import numpy as np
from jaxtyping import Bool, Float32, Int
from PIL import Image
from scipy.ndimage import binary_dilation, binary_fill_holes, label

from corporeal.core.types import Camera
from corporeal.reconstruction.masks.voxel_volume import VoxelVolume

MIN_COVERED_LOOKS_FRACTION = 0.8
"""Share of the looks from the other side that meet the object, from which on it is closed."""
MASK_THRESHOLD = 0.5
"""Of a pixel: from here on it is inside."""


def close_mask_holes(
    inside: Float32[np.ndarray, "V h w"], cameras: tuple[Camera, ...], room: VoxelVolume
) -> Float32[np.ndarray, "V h w"]:
    """Return masks without the holes that no view sees through.

    Args:
        inside: How far each pixel is inside, 0 to 1, at any size.
        cameras: Of the pictures.
        room: Cells, as these cameras see them in pictures of ``room.shape``.
    """
    size = room.shape[2], room.shape[1]
    rough = [np.asarray(Image.fromarray(one).resize(size, Image.Resampling.BOX)) for one in inside]
    masks = np.stack(rough) > MASK_THRESHOLD
    holes = _find_holes(masks)
    hull = room.carved(masks | holes)
    ahead = np.array([c.world_from_camera[:3, 2] for c in cameras])
    out = inside.copy()
    for k in range(len(inside)):
        against = np.flatnonzero(ahead @ ahead[k] < 0)
        through = _see_through_holes(k, holes[k], masks[against], room.pixel[:, hull], against)
        _fill_closed_holes(out[k], through)
    return out


def _find_holes(masks: Bool[np.ndarray, "V H W"]) -> Bool[np.ndarray, "V H W"]:
    return np.stack([binary_fill_holes(one) & ~one for one in masks])


def _see_through_holes(
    k: int,
    holes: Bool[np.ndarray, "H W"],
    masks: Bool[np.ndarray, "A H W"],
    pixel: Int[np.ndarray, "V M"],
    against: Int[np.ndarray, " A"],
) -> Bool[np.ndarray, "H W"]:
    """Return the holes of view ``k`` that views from the other side, ``against``, see through."""
    piece = _label_pieces(holes)
    open_ = np.zeros_like(holes)
    here = np.where(pixel[k] >= 0, piece.ravel()[pixel[k]], 0)
    for number in range(1, piece.max(initial=0) + 1):
        there = pixel[against][:, here == number]
        looks = there >= 0
        if not (here == number).any():
            continue  # smaller than a cell: noise
        met = np.take_along_axis(masks.reshape(len(masks), holes.size), np.maximum(there, 0), axis=1)
        if not looks.any() or met[looks].mean() < MIN_COVERED_LOOKS_FRACTION:
            open_ |= piece == number
    return open_


def _fill_closed_holes(inside: Float32[np.ndarray, "h w"], through: Bool[np.ndarray, "H W"]) -> None:
    """Fill the holes of one mask but those that are open, which ``through`` marks at its size."""
    wide = inside.shape[1], inside.shape[0]
    open_ = Image.fromarray(binary_dilation(through))
    kept = np.asarray(open_.resize(wide, Image.Resampling.NEAREST))
    piece = _label_pieces(_find_holes((inside > MASK_THRESHOLD)[None])[0])
    stays = np.zeros(piece.max(initial=0) + 1, bool)
    stays[piece[kept]] = True
    stays[0] = True
    inside[~stays[piece]] = 1.0


def _label_pieces(marked: Bool[np.ndarray, "H W"]) -> Int[np.ndarray, "H W"]:
    """Return the number of the piece that each pixel is of, from 1 on; 0: of none."""
    found = label(marked)
    assert isinstance(found, tuple)
    return np.asarray(found[0], np.int64)
