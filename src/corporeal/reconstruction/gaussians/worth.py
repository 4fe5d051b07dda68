"""Whether what was found in pictures is worth simulating, or a film of the room."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from corporeal.core.types import Camera
from corporeal.geometry.mesh import Mesh
from corporeal.multiview.cropped import cropped
from corporeal.multiview.region import region
from corporeal.multiview.silhouette_overlap import compared
from corporeal.multiview.silhouettes import FILLED
from corporeal.multiview.unseen_side import HALF, hardly_round, mostly_unseen
from corporeal.reconstruction.gaussians.quality import Quality

HELD = 0.1
"""Share of the cameras that stand in a thing's box, from which on the thing is the room."""
FILLS = 2.0
"""Longest side of a thing's box over the radius of the ball that cameras look at, from which on,
where nobody gave masks, it is all that is in the ball."""
CROPPED = 0.5
"""Share of the photographs whose border may cut through what was taken for objects. Objects that
right masks show reach it in a fifth, a pot from near above in .43, a bed and a wall in .60."""
GREY = 14.0
"""Held-out photographs agree with a plain grey picture as well as this [dB]."""
DIFFERS = 0.5
"""Median overlap of what was cut out by height above the floor and what colours tell, below which
more is in dispute than agreed on: wrong cuts have .05 to .5, right ones .64 to .9."""
UNLIKE = 0.35
"""Median overlap of surfaces with masks below which they are no shape of what masks show: 0.9 for
most objects; foliage and wires, whose gaps close, have less."""
COMPARED = 12
"""Views in which that is compared."""
GO_ON = "--force goes on all the same."
SAY_WHAT = (
    "What the thing is was not told from the room: give masks (a folder 'masks' with the names of "
    "the pictures), or grow them with 'corporeal masks' from a point or a box and correct them, or "
    f"say where the floor is with --floor-at. {GO_ON}"
)


def not_worth(
    boxes: Float[np.ndarray, "K 2 3"],
    cameras: Sequence[Camera],
    masked: bool,
    quality: Quality | None = None,
) -> str | None:
    """Return in a sentence or two why things are not worth simulating; None: they may be.

    Args:
        boxes: Low and high corner of each thing, in the cameras' frame and unit.
        cameras: That took the photographs; (): nobody knows, and nothing is said.
        masked: Whether somebody said which pixels are things.
        quality: How well pictures agree with photographs held back; None: none was.

    """
    if not cameras:
        return None
    if (why := hardly_round(cameras)) is not None:
        return f"The shape would be made up: {why}. Photograph it from all sides. {GO_ON}"
    if quality is not None and quality.psnr < GREY:
        return (
            f"The shapes would be made up: photographs that were not learned from look otherwise "
            f"({quality.psnr:.1f} dB, as a plain grey picture has). Look at poses and lenses, at "
            f"what moved, and take more photographs. {GO_ON}"
        )
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    radius = region(tuple(cameras)).radius
    for low, high in boxes:
        inside = int(((eyes > low) & (eyes < high)).all(axis=1).sum())
        if inside >= HELD * len(cameras):
            what = f"its box holds {inside} of {len(cameras)} cameras"
            return f"The thing would be as large as the room: {what}. {SAY_WHAT}"
        longest = float((high - low).max())
        if not masked and longest > FILLS * radius:
            what = f"{longest / radius / 2:.1f} times as long as the ball that the cameras look at"
            return f"The thing would be all that is in the pictures, {what}. {SAY_WHAT}"
    return None


def falls_apart(pieces: int, cameras: Sequence[Camera]) -> str | None:
    """Return in a sentence or two why surfaces that nobody masked are not to be believed; None.

    One object is in one piece. Where half of the circle around it was not seen, nothing but colours
    told it from what stands behind it.

    Args:
        pieces: That all came out in where nobody said of how many objects, else the most of one.
        cameras: That took the photographs; (): nobody knows, and nothing is said.

    """
    if pieces < 2 or not cameras or (unseen := mostly_unseen(cameras)) < HALF:
        return None
    return (
        f"The shape contradicts itself: what was looked at came out in {pieces} pieces, and from "
        f"{unseen:.0f}° of the circle around it nobody looked. Photograph it from there, too; or, "
        f"if these are several objects, say how many with --count. {SAY_WHAT}"
    )


def goes_beyond(masks: Bool[np.ndarray, "V H W"]) -> str | None:
    """Return in a sentence or two why what was cut out is no object; None: it may be.

    Args:
        masks: Which pixels show what was taken for objects, as nobody said.

    """
    count = int(cropped(masks).sum())
    if count <= CROPPED * len(masks):
        return None
    what = f"{count} of {len(masks)} photographs show but a part of it"
    return f"The thing would go on beyond the pictures: {what}. {SAY_WHAT}"


def told_otherwise(
    masks: Bool[np.ndarray, "V H W"], coloured: Bool[np.ndarray, "V H W"] | None
) -> str | None:
    """Return in a sentence or two why what was cut out is not to be believed; None: it may be.

    Colours say something else of what the thing is. Either may be wrong, and neither is sure.

    Args:
        masks: Which pixels show what was taken for objects, by where it is.
        coloured: The same, by its colours, which are not to be believed alone; None: nobody knows.

    """
    if coloured is None or not coloured.any():
        return None
    either = np.maximum((masks | coloured).sum(axis=(1, 2)), 1)
    overlap = float(np.median((masks & coloured).sum(axis=(1, 2)) / either))
    if overlap >= DIFFERS:
        return None
    what = f"what either sets apart overlaps by {overlap:.0%} only"
    return f"Colours and heights above the floor contradict each other: {what}. {SAY_WHAT}"


def unlike_masks(
    meshes: Sequence[Mesh],
    cameras: Sequence[Camera],
    masks: Bool[np.ndarray, "V H W"],
    given: bool = True,
) -> str | None:
    """Return in a sentence or two why surfaces are not worth simulating; None: they may be.

    Args:
        meshes: Closed, of all things, in the cameras' frame and unit.
        cameras: That took the photographs.
        masks: Which pixels show things, as somebody said or was found.
        given: Whether somebody, or a model that knows things, said it.

    """
    shown = [k for k in range(len(cameras)) if masks[k].any()]
    chosen = shown[:: -(-len(shown) // COMPARED)] if shown else []
    if not chosen:
        return None
    drawn = [np.uint8(255) * masks[k] for k in chosen]
    seen = [cameras[k] for k in chosen]
    found = compared(meshes, seen, drawn, np.random.default_rng(0))
    overlap, filled = float(np.median(found.overlap)), float(np.median(found.filled))
    if overlap < UNLIKE:
        return (
            "The closed surfaces are not what masks show: their silhouettes overlap by "
            f"{overlap:.0%} only. Look whether masks and poses belong to the pictures, and take "
            f"more photographs from more sides. {GO_ON}"
        )
    if given or filled >= FILLED:
        return None
    return (
        f"The shape contradicts the photographs: it fills {filled:.0%} of what was taken for the "
        "thing in them. The rest is something else, such as what is behind it, or some were placed "
        "wrongly. Correct the masks, or photograph the thing from all sides, where nothing else "
        f"stands close behind it. {GO_ON}"
    )
