"""Masks grown from seeds: colours, edges and the visual hull, in turn.

What objects and what is around them look like is learned from seeds; every picture is cut in two
by it, along its edges; the cuts carve a volume; and its silhouettes say in the next round what
belongs to objects and what does not. So a colour that the floor has, too, is lost only where no
other picture knows better.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8
from PIL import Image
from scipy.ndimage import binary_dilation, label

from corporeal.core.progress import Progress, no_progress
from corporeal.core.types import Views
from corporeal.multiview.silhouette_outliers import find_cropped_masks
from corporeal.reconstruction.masks.colour_likelihood import (
    background_log_likelihood,
    colour_bins,
    colour_histogram,
    colour_overlap,
)
from corporeal.reconstruction.masks.equalise_exposure import equalise_exposure
from corporeal.reconstruction.masks.floor_colour import shaded_floor
from corporeal.reconstruction.masks.floor_parallax import find_standing_regions
from corporeal.reconstruction.masks.floor_pattern import shows_floor_pattern
from corporeal.reconstruction.masks.floor_texture import floor_fit
from corporeal.reconstruction.masks.mask_attachments import MaskAttachments, find_mask_attachments
from corporeal.reconstruction.masks.mask_holes import close_mask_holes
from corporeal.reconstruction.masks.mask_seeds import MaskSeeds
from corporeal.reconstruction.masks.object_beside_masks import ObjectBesideMasks, find_object_beside_masks
from corporeal.reconstruction.masks.outline_quality import faint_outline_fraction, rim_fraction
from corporeal.reconstruction.masks.reduce_views import reduce_views
from corporeal.reconstruction.masks.residual_pixels import pixels_before_floor, residual_fraction
from corporeal.reconstruction.masks.total_variation import TotalVariationCutter
from corporeal.reconstruction.masks.voxel_volume import VoxelVolume, lower_floor, voxel_volume

ROUND_PICTURE_PX, MASK_PICTURE_PX = 192, 384
"""Longer side of the pictures that rounds look at, and of the masks that come out [px]."""
MIN_GROW_ROUNDS, MAX_GROW_ROUNDS = 4, 12
"""At least, and where masks still change from one to the next, at most."""
SETTLED_AGREEMENT = 0.95
"""Masks of two rounds that agree so well do not change any more."""
FLOOR_EVIDENCE = 6.0
"""Evidence against a pixel that shows the floor's pattern, or a shade of its colour: more than any colour's for it."""
IN_HULL_EVIDENCE, BESIDE_HULL_EVIDENCE = -0.5, 2.0
"""Evidence against a pixel that is in the silhouette of the hull, and of one well beside it."""
SILHOUETTE_BAND_WIDTHS = 0.03
"""Width of the band around silhouettes in which only colours and edges count, in widths of the picture."""
MAX_MASK_OVERHANG_WIDTHS = 0.06
"""How far beyond silhouettes masks are drawn, in the same widths: what the hull lacks may be a thin leg that some
pictures lost, but no wall of the same colour that touches outlines."""
COLOUR_BAND_WIDTHS = 0.2
"""How far around silhouettes colours are learned that objects are distinguished from, in the same widths: what pictures
show farther away, such as a wall of their colour, does not border on them."""
MASK_THRESHOLD = 0.5
"""Of a pixel: from here on it is inside."""
MIN_PIECE_FILL_RATIO = 0.02
"""Pieces of a mask that fill less of its silhouette, against the one that fills most, are noise."""


@dataclass(frozen=True)
class RegionGrowingResult:
    """Masks, and how they came about; V views of h × w."""

    inside: Float32[np.ndarray, "V h w"]
    """How far each pixel is inside, 0 to 1; ½ is the outline."""
    coherence: float
    """Intersection over union of masks and silhouettes of their hull, the median of all views."""
    settled: float
    """The same, of masks of the last round and the one before."""
    alike: float
    """Overlap of the colours inside and outside, 0 to 1, times the share of the pixels next to the outlines that
    colours alone tell."""
    outer: float
    """Share of the hull's cells at the edge of the ball that cameras look at."""
    cropped: float
    """Share of the pictures in which masks reach the border."""
    share: float
    """Share of the pictures' pixels that is inside."""
    left_over: float
    """What has their colours on the floor in the middle, but is none of them, over what is."""
    faint: float
    """Share of the outlines along which pictures show no edge."""
    thinness: float
    """Share of masks that their outermost pixels are."""
    lowest: float
    """Height of their hull's lowest cell above the floor, in radii of the ball; 0 where the
    floor is unknown, or what lies flat on it may be objects.
    """
    masks: Bool[np.ndarray, "V H W"]
    """The pixels that are inside, at ROUGH pixels."""
    hanging: MaskAttachments | None = None
    """What stands on the floor beside these and borders on them."""
    beside: ObjectBesideMasks | None = None
    """Something of other colours that stands on the floor beside them."""


@dataclass(frozen=True)
class CutEvidence:
    """What a cut is made by."""

    inside: Float[np.ndarray, " K"]
    """Histogram of the colours of objects."""
    outside: Float[np.ndarray, " K"]
    """The same, of what is around them."""
    prior: Float32[np.ndarray, "V H W"]
    """Evidence against pixels from where they are."""


class _CutPictures:
    """Pictures of one size, ready to be cut in two again and again."""

    def __init__(self, views: Views, level: UInt8[np.ndarray, "V H W"]) -> None:
        self.bins, self.cutter = colour_bins(views.rgb, level), TotalVariationCutter(views.rgb)

    def cut(self, evidence: CutEvidence) -> Float32[np.ndarray, "V H W"]:
        """Return how far each pixel is inside."""
        colours = background_log_likelihood(self.bins, evidence.inside, evidence.outside)
        return self.cutter.cut(colours + evidence.prior.astype(np.float32))


def grow_masks(
    views: Views,
    seeds: MaskSeeds,
    progress: Progress = no_progress,
    flat: bool = False,
    fitting: bool = False,
) -> RegionGrowingResult | None:
    """Grow masks; None: nothing is left.

    Args:
        views: Pictures of at most FINE pixels.
        seeds: For the same pictures at ROUGH pixels, as ``reduce_views`` returns them.
        progress: Called with the fraction done and a description.
        flat: Whether what lies flat on the floor may be objects, too: only colours tell then.
        fitting: Whether colours count together with how well they fit the floor at their place. Outlines are then a
            pixel wide of the object, since what is mixed does not fit.
    """
    views = equalise_exposure(views, seeds.floor, seeds.around, ROUND_PICTURE_PX)
    rough = reduce_views(views, ROUND_PICTURE_PX)
    bottom = lower_floor(seeds.floor, seeds.around) if flat else seeds.floor
    room = voxel_volume(rough.cameras, seeds.around, bottom, seeds.cone)
    shaded = shaded_floor(views, seeds.floor, seeds.around)
    floor = shaded if flat else shaded | shows_floor_pattern(views, seeds.floor, seeds.around)
    on_floor = _shrink_marks(floor, rough.rgb.shape[1:3])
    known = seeds.floor if fitting else None
    level = floor_fit(rough, known, seeds.around, on_floor >= MASK_THRESHOLD)
    on_floor, side = np.float32(FLOOR_EVIDENCE) * on_floor, _CutPictures(rough, level)
    found = _grow_until_settled(side, room, seeds, on_floor, progress)
    if found is None:
        return None
    state, settled, on_floor = found
    progress(MAX_GROW_ROUNDS / (MAX_GROW_ROUNDS + 1), "drawing their outlines")
    middle = ~seeds.never & pixels_before_floor(rough.cameras, seeds.floor, seeds.around)
    middle &= ~widen_silhouettes(state.silhouettes) & (_shrink_marks(shaded, rough.rgb.shape[1:3]) < MASK_THRESHOLD)
    by_colour = side.cut(replace(state.evidence, prior=np.zeros_like(on_floor))) > MASK_THRESHOLD
    stands = find_standing_regions(rough, state.masks, seeds.floor, seeds.around)
    near = widen_silhouettes(state.masks)
    inside = close_mask_holes(_draw_masks(views, level, state, floor), rough.cameras, room)
    return RegionGrowingResult(
        inside=inside,
        coherence=_mask_agreement(state.masks, state.silhouettes),
        settled=settled,
        alike=state.alike * (1 - _told_by_floor(state.masks, on_floor)),
        outer=state.outer,
        cropped=float(find_cropped_masks(state.masks).mean()),
        share=float(state.masks.mean()),
        left_over=residual_fraction(by_colour, state.masks, middle),
        faint=faint_outline_fraction(views.rgb, inside),
        thinness=rim_fraction(inside),
        lowest=0.0 if flat else state.lowest,
        masks=state.masks,
        hanging=None if stands is None else find_mask_attachments(stands, state.masks),
        beside=None if stands is None else find_object_beside_masks(stands, state.masks, near),
    )


@dataclass(frozen=True)
class _GrowRound:
    masks: Bool[np.ndarray, "V H W"]
    silhouettes: Bool[np.ndarray, "V H W"]
    """Of the hull that masks leave."""
    hiding: Bool[np.ndarray, "V H W"]
    """Of what of the hull is high above the floor, which is not seen there."""
    outer: float
    """As in ``RegionGrowingResult``."""
    lowest: float
    """Height of the hull's lowest cell, in radii of the ball."""
    alike: float
    """Overlap of the colours of objects with what is near them, or with all that is around them, whichever is less:
    either tells them apart. Outlines that contradict one another, of what was moved, leave some of the object in what
    is near."""
    evidence: CutEvidence
    """For the next round."""


def _grow_round(side: _CutPictures, room: VoxelVolume, evidence: CutEvidence, piece: float | None) -> _GrowRound | None:
    """Cut all pictures, carve, and learn colours anew; None: nothing is left."""
    masks = side.cut(evidence) > MASK_THRESHOLD
    hull = room.carved(masks, piece)
    if not hull.any():
        return None
    seen = room.silhouettes(hull)
    band = widen_silhouettes(seen)
    masks &= band
    inside = colour_histogram(side.bins, masks & seen)
    beside = ~band | ~(seen | masks)
    outside = colour_histogram(side.bins, widen_silhouettes(seen, COLOUR_BAND_WIDTHS) & beside)
    alike = min(colour_overlap(inside, outside), colour_overlap(inside, colour_histogram(side.bins, beside)))
    prior = np.where(seen, IN_HULL_EVIDENCE, np.where(band, 0, BESIDE_HULL_EVIDENCE)).astype(np.float32)
    outer = float(room.outer[hull].mean())
    hiding = room.silhouettes(hull & room.tall)
    lowest = float(room.height[hull].min())
    return _GrowRound(masks, seen, hiding, outer, lowest, alike, CutEvidence(inside, outside, prior))


def _grow_until_settled(
    side: _CutPictures, room: VoxelVolume, seeds: MaskSeeds, on_floor: Float32[np.ndarray, "V H W"], progress: Progress
) -> tuple[_GrowRound, float, Float32[np.ndarray, "V H W"]] | None:
    """Cut, carve and learn until masks settle; None: nothing is left.

    Returns the last round, how much of the one before it has, and evidence of the floor that is left where nothing tall
    hides it.
    """
    inside, outside = (colour_histogram(side.bins, w) for w in (seeds.inside, seeds.outside))
    never = np.where(seeds.never, np.float32(BESIDE_HULL_EVIDENCE), np.float32(0)) + on_floor
    evidence, before = CutEvidence(inside, outside, never), seeds.never
    settled, turn = 0.0, 0
    while True:
        progress(turn / (MAX_GROW_ROUNDS + 1), f"growing masks, round {turn + 1}")
        state = _grow_round(side, room, evidence, seeds.piece)
        if state is None:
            return None
        settled, turn = _mask_agreement(state.masks, before), turn + 1
        on_floor = np.where(state.hiding, np.float32(0), on_floor)
        if turn >= MAX_GROW_ROUNDS or (turn >= MIN_GROW_ROUNDS and settled >= SETTLED_AGREEMENT):
            return state, settled, on_floor
        evidence = replace(state.evidence, prior=state.evidence.prior + on_floor)
        before = state.masks


def _draw_masks(
    views: Views, level: UInt8[np.ndarray, "V H W"], state: _GrowRound, floor: Bool[np.ndarray, "V h w"]
) -> Float32[np.ndarray, "V h w"]:
    """Cut the pictures at their full size, and keep what hangs together about silhouettes."""
    size, seen = views.rgb.shape[1:3], state.silhouettes
    floor = floor & (_enlarge_pictures(state.hiding.astype(np.float32), size) <= MASK_THRESHOLD)
    prior = _enlarge_pictures(state.evidence.prior, size) + np.float32(FLOOR_EVIDENCE) * floor.astype(np.float32)
    fine = replace(state.evidence, prior=prior)
    wide = size[1], size[0]
    fit = [Image.fromarray(p).resize(wide, Image.Resampling.NEAREST) for p in level]
    inside = _CutPictures(views, np.stack([np.asarray(p) for p in fit])).cut(fine)
    inside[
        _enlarge_pictures(widen_silhouettes(seen, MAX_MASK_OVERHANG_WIDTHS).astype(np.float32), size) <= MASK_THRESHOLD
    ] = 0
    for one, hull in zip(inside, _enlarge_pictures(seen.astype(np.float32), size), strict=True):
        pieces = label(one > MASK_THRESHOLD)
        assert isinstance(pieces, tuple)
        share = np.bincount(pieces[0][hull > MASK_THRESHOLD], minlength=pieces[1] + 1)
        share[0] = 0
        kept = share >= MIN_PIECE_FILL_RATIO * max(share.max(), 1)
        one[~kept[pieces[0]]] = 0
    return inside


def _enlarge_pictures(pictures: Float32[np.ndarray, "V H W"], size: tuple[int, int]) -> Float32[np.ndarray, "V h w"]:
    wide = size[1], size[0]
    made = [Image.fromarray(p).resize(wide, Image.Resampling.BILINEAR) for p in pictures]
    return np.stack([np.asarray(p) for p in made])


def _shrink_marks(pixels: Bool[np.ndarray, "V h w"], size: tuple[int, int]) -> Float32[np.ndarray, "V H W"]:
    """Return which share of each larger pixel is marked."""
    wide = size[1], size[0]
    whole = pixels.astype(np.float32)
    made = [Image.fromarray(p).resize(wide, Image.Resampling.BOX) for p in whole]
    return np.stack([np.asarray(p) for p in made])


def widen_silhouettes(seen: Bool[np.ndarray, "V H W"], by: float = SILHOUETTE_BAND_WIDTHS) -> Bool[np.ndarray, "V H W"]:
    """Add what is within so many widths of the picture to silhouettes."""
    steps = max(1, round(by * seen.shape[2]))
    return np.stack([binary_dilation(one, iterations=steps) for one in seen])


def _told_by_floor(masks: Bool[np.ndarray, "V H W"], on_floor: Float32[np.ndarray, "V H W"]) -> float:
    """Return the share of the pixels around masks that are on the floor for certain."""
    around = widen_silhouettes(masks) & ~masks
    return float((on_floor[around] > 0).mean()) if around.any() else 0.0


def _mask_agreement(a: Bool[np.ndarray, "V H W"], b: Bool[np.ndarray, "V H W"]) -> float:
    both, either = (a & b).sum(axis=(1, 2)), (a | b).sum(axis=(1, 2))
    return float(np.median(both / np.maximum(either, 1)))
