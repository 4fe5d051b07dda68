"""Acceptance tests of reconstructions before simulation."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from corporeal.core.types import Camera
from corporeal.geometry.mesh import Mesh
from corporeal.multiview.silhouette_coherence import MIN_MASK_FILLED_FRACTION
from corporeal.multiview.silhouette_outliers import find_cropped_masks
from corporeal.multiview.silhouette_overlap import compare_silhouettes
from corporeal.multiview.view_coverage import UNSEEN_HALF_GAP_DEG, depth_doubt_text, widest_unseen_angle
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.gaussians.heldout_quality import HeldOutQuality

CAMERAS_IN_BOX_FRACTION = 0.1
"""Share of the cameras that stand in an object's box, from which on the object is the room."""
BOX_TO_REGION_RATIO = 2.0
"""Longest side of an object's box over the radius of the ball that cameras look at, from which on, without
masks, it is all that is in the ball.
"""
MAX_CROPPED_FRACTION = 0.5
"""Share of the photographs whose border may cut through what was taken for objects. Objects that right masks show reach
it in a fifth, a pot from near above in .43, a bed and a wall in .60."""
GREY_PICTURE_PSNR_DB = 14.0
"""Held-out photographs agree with a plain grey picture as well as this [dB]."""
MIN_COLOUR_OVERLAP = 0.5
"""Median overlap of what was cut out by height above the floor and what colours tell, below which more is in dispute
than agreed on: wrong cuts have .05 to .5, right ones .64 to .9."""
MIN_MASK_OVERLAP = 0.35
"""Median overlap of surfaces with masks below which they are no shape of what masks show: 0.9 for most objects; foliage
and wires, whose gaps close, have less."""
COMPARED_VIEWS = 12
"""Views in which that is compared."""
FORCE_HINT = "--force continues anyway."
MASKS_HINT = (
    "The object was not separated from the background: give masks (a folder 'masks' with the "
    "names of the pictures), or grow them with 'corporeal masks' from a point or a box and correct "
    f"them, or give the height of the floor with --floor-at. {FORCE_HINT}"
)


def boxes_rejection_reason(
    boxes: Float[np.ndarray, "K 2 3"], cameras: Sequence[Camera], masked: bool, quality: HeldOutQuality | None = None
) -> str | None:
    """Return in a sentence or two why objects are not worth simulating; None: they may be.

    Args:
        boxes: Low and high corner of each object, in the cameras' frame and unit.
        cameras: That took the photographs; (): unknown, and no result.
        masked: Whether masks were given or made by a model.
        quality: How well pictures agree with photographs held back; None: none was.
    """
    if not cameras:
        return None
    if (why := depth_doubt_text(cameras)) is not None:
        return f"The shape would be invented: {why}. Photograph it from all sides. {FORCE_HINT}"
    if quality is not None and quality.psnr < GREY_PICTURE_PSNR_DB:
        return (
            f"The shapes would be invented: held-out photographs differ from their rendering "
            f"({quality.psnr:.1f} dB, as a plain grey picture has). Check poses, lenses and moving "
            f"objects, and take more photographs. {FORCE_HINT}"
        )
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    radius = find_viewed_region(tuple(cameras)).radius
    for low, high in boxes:
        inside = int(((eyes > low) & (eyes < high)).all(axis=1).sum())
        if inside >= CAMERAS_IN_BOX_FRACTION * len(cameras):
            what = f"its box holds {inside} of {len(cameras)} cameras"
            return f"The object would be as large as the surroundings: {what}. {MASKS_HINT}"
        longest = float((high - low).max())
        if not masked and longest > BOX_TO_REGION_RATIO * radius:
            what = f"{longest / radius / 2:.1f} times as long as the ball that the cameras look at"
            return f"The object would be all that is in the pictures, {what}. {MASKS_HINT}"
    return None


def pieces_rejection_reason(pieces: int, cameras: Sequence[Camera]) -> str | None:
    """Return in a sentence or two why surfaces without given masks are unreliable; None.

    One object is in one piece. Where half of the circle around it was not seen, nothing but colours distinguished it
    from what stands behind it.

    Args:
        pieces: Of all objects where their number was not stated, else the most of one.
        cameras: That took the photographs; (): unknown, and no result.
    """
    if pieces < 2 or not cameras or (unseen := widest_unseen_angle(cameras)) < UNSEEN_HALF_GAP_DEG:
        return None
    return (
        f"The shape contradicts itself: the object came out in {pieces} pieces, and from "
        f"{unseen:.0f}° of the circle around it there are no photographs. Photograph it from "
        "there, too; or, if these are several objects, give their number with --count. "
        f"{MASKS_HINT}"
    )


def cropping_rejection_reason(masks: Bool[np.ndarray, "V H W"]) -> str | None:
    """Return in a sentence or two why what was cut out is no object; None: it may be.

    Args:
        masks: Pixels that were taken for objects, as no masks were given.
    """
    count = int(find_cropped_masks(masks).sum())
    if count <= MAX_CROPPED_FRACTION * len(masks):
        return None
    what = f"{count} of {len(masks)} photographs show but a part of it"
    return f"The object would extend beyond the pictures: {what}. {MASKS_HINT}"


def colour_rejection_reason(masks: Bool[np.ndarray, "V H W"], coloured: Bool[np.ndarray, "V H W"] | None) -> str | None:
    """Return in a sentence or two why what was cut out is unreliable; None: it may be.

    Colours say something else of what the object is. Either may be wrong, and neither is sure.

    Args:
        masks: Which pixels show what was taken for objects, by where it is.
        coloured: The same, by its colours, which are unreliable alone; None: unknown.
    """
    if coloured is None or not coloured.any():
        return None
    either = np.maximum((masks | coloured).sum(axis=(1, 2)), 1)
    overlap = float(np.median((masks & coloured).sum(axis=(1, 2)) / either))
    if overlap >= MIN_COLOUR_OVERLAP:
        return None
    what = f"what either sets apart overlaps by {overlap:.0%} only"
    return f"Colours and heights above the floor contradict each other: {what}. {MASKS_HINT}"


def overlap_rejection_reason(
    meshes: Sequence[Mesh], cameras: Sequence[Camera], masks: Bool[np.ndarray, "V H W"], given: bool = True
) -> str | None:
    """Return in a sentence or two why surfaces are not worth simulating; None: they may be.

    Args:
        meshes: Closed, of all objects, in the cameras' frame and unit.
        cameras: That took the photographs.
        masks: Pixels of objects, given or found.
        given: Whether a person or a model of objects gave them.
    """
    shown = [k for k in range(len(cameras)) if masks[k].any()]
    chosen = shown[:: -(-len(shown) // COMPARED_VIEWS)] if shown else []
    if not chosen:
        return None
    drawn = [np.uint8(255) * masks[k] for k in chosen]
    seen = [cameras[k] for k in chosen]
    found = compare_silhouettes(meshes, seen, drawn, np.random.default_rng(0))
    overlap, filled = float(np.median(found.overlap)), float(np.median(found.filled))
    if overlap < MIN_MASK_OVERLAP:
        return (
            "The closed surfaces are not what masks show: their silhouettes overlap by "
            f"{overlap:.0%} only. Check that masks and poses belong to the pictures, and take "
            f"more photographs from more sides. {FORCE_HINT}"
        )
    if given or filled >= MIN_MASK_FILLED_FRACTION:
        return None
    return (
        f"The shape contradicts the photographs: it fills {filled:.0%} of the object's masks in "
        "them. The rest is something else, such as what is behind it, or some were "
        "placed "
        "wrongly. Correct the masks, or photograph the object from all sides, where nothing else "
        f"stands close behind it. {FORCE_HINT}"
    )
