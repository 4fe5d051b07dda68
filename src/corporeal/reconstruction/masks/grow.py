"""Masks grown from seeds: colours, edges and the visual hull, in turn.

What objects and what is around them look like is learned from seeds; every picture is cut in two
by it, along its edges; the cuts carve a volume; and its silhouettes say in the next round what
belongs to objects and what does not. So a colour that the floor has, too, is lost only where no
other picture knows better.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8
from PIL import Image
from scipy.ndimage import binary_dilation, label

from corporeal.core.types import Views
from corporeal.multiview.cropped import cropped
from corporeal.reconstruction.masks.beside import Beside, beside
from corporeal.reconstruction.masks.colour_likelihood import against, bins_of, histogram, overlap
from corporeal.reconstruction.masks.even_exposure import evenly_exposed
from corporeal.reconstruction.masks.floor_colour import shaded_floor
from corporeal.reconstruction.masks.floor_pattern import shows_floor
from corporeal.reconstruction.masks.floor_texture import floor_fit
from corporeal.reconstruction.masks.hanging import Hanging, hanging
from corporeal.reconstruction.masks.holes import closed
from corporeal.reconstruction.masks.left_over import before_the_floor, left_over
from corporeal.reconstruction.masks.outlines import faint, thinness
from corporeal.reconstruction.masks.parallax import standing
from corporeal.reconstruction.masks.reduced import reduced
from corporeal.reconstruction.masks.seeds import Seeds
from corporeal.reconstruction.masks.total_variation import Cutter
from corporeal.reconstruction.masks.volume import Volume, lowered, volume

Progress = Callable[[float, str], None]

ROUGH, FINE = 192, 384
"""Longer side of the pictures that rounds look at, and of the masks that come out [px]."""
ROUNDS, MOST = 4, 12
"""At least, and where masks still change from one to the next, at most."""
SETTLED = 0.95
"""Masks of two rounds that agree so well do not change any more."""
FLOOR = 6.0
"""Evidence against a pixel that shows the floor's pattern, or a shade of its colour: more than any
colour's for it."""
IN_HULL, BESIDE_HULL = -0.5, 2.0
"""Evidence against a pixel that is in the silhouette of the hull, and of one well beside it."""
MARGIN = 0.03
"""Width of the band around silhouettes in which only colours and edges count, in widths of the
picture."""
REACH = 0.06
"""How far beyond silhouettes masks are drawn, in the same widths: what the hull lacks may be a thin
leg that some pictures lost, but no wall of the same colour that touches outlines."""
NEARBY = 0.2
"""How far around silhouettes colours are learned that objects are told from, in the same widths:
what pictures show farther away, such as a wall of their colour, does not border on them."""
HALF = 0.5
"""Of a pixel: from here on it is inside."""
CRUMB = 0.02
"""Pieces of a mask that fill less of its silhouette, against the one that fills most, are noise."""


@dataclass(frozen=True)
class Grown:
    """Masks, and how they came about; V views of h × w."""

    inside: Float32[np.ndarray, "V h w"]
    """How far each pixel is inside, 0 to 1; ½ is the outline."""
    coherence: float
    """Intersection over union of masks and silhouettes of their hull, the median of all views."""
    settled: float
    """The same, of masks of the last round and the one before."""
    alike: float
    """Overlap of the colours inside and outside, 0 to 1, times the share of the pixels next to the
    outlines that colours alone tell."""
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
    """Height of their hull's lowest cell above the floor, in radii of the ball; 0 where nobody
    knows the floor, or what lies flat on it may be objects."""
    masks: Bool[np.ndarray, "V H W"]
    """The pixels that are inside, at ROUGH pixels."""
    hanging: Hanging | None = None
    """What stands on the floor beside these and borders on them."""
    beside: Beside | None = None
    """Something of other colours that stands on the floor beside them."""


@dataclass(frozen=True)
class Evidence:
    """What a cut is made by."""

    inside: Float[np.ndarray, " K"]
    """Histogram of the colours of objects."""
    outside: Float[np.ndarray, " K"]
    """The same, of what is around them."""
    prior: Float32[np.ndarray, "V H W"]
    """Evidence against pixels from where they are."""


class _Side:
    """Pictures of one size, ready to be cut in two again and again."""

    def __init__(self, views: Views, level: UInt8[np.ndarray, "V H W"]) -> None:
        self.bins, self.cutter = bins_of(views.rgb, level), Cutter(views.rgb)

    def cut(self, evidence: Evidence) -> Float32[np.ndarray, "V H W"]:
        """Return how far each pixel is inside."""
        colours = against(self.bins, evidence.inside, evidence.outside)
        return self.cutter.cut(colours + evidence.prior.astype(np.float32))


def grow(
    views: Views,
    seeds: Seeds,
    progress: Progress = lambda fraction, words: None,
    flat: bool = False,
    fitting: bool = False,
) -> Grown | None:
    """Grow masks; None: nothing is left.

    Args:
        views: Pictures of at most FINE pixels.
        seeds: For the same pictures at ROUGH pixels, as ``reduced`` returns them.
        progress: Told the fraction done and what is being done.
        flat: Whether what lies flat on the floor may be objects, too: only colours tell then.
        fitting: Whether colours count together with how well they fit the floor at their place.
            Outlines are then a pixel wide of the thing, since what is mixed does not fit.

    """
    views = evenly_exposed(views, seeds.floor, seeds.around, ROUGH)
    rough = reduced(views, ROUGH)
    bottom = lowered(seeds.floor, seeds.around) if flat else seeds.floor
    room = volume(rough.cameras, seeds.around, bottom, seeds.cone)
    shaded = shaded_floor(views, seeds.floor, seeds.around)
    floor = shaded if flat else shaded | shows_floor(views, seeds.floor, seeds.around)
    on_floor = _shrunk(floor, rough.rgb.shape[1:3])
    known = seeds.floor if fitting else None
    level = floor_fit(rough, known, seeds.around, on_floor >= HALF)
    on_floor, side = np.float32(FLOOR) * on_floor, _Side(rough, level)
    found = _rounds(side, room, seeds, on_floor, progress)
    if found is None:
        return None
    state, settled, on_floor = found
    progress(MOST / (MOST + 1), "drawing their outlines")
    middle = ~seeds.never & before_the_floor(rough.cameras, seeds.floor, seeds.around)
    middle &= ~widened(state.silhouettes) & (_shrunk(shaded, rough.rgb.shape[1:3]) < HALF)
    by_colour = side.cut(replace(state.evidence, prior=np.zeros_like(on_floor))) > HALF
    stands = standing(rough, state.masks, seeds.floor, seeds.around)
    near = widened(state.masks)
    inside = closed(_drawn(views, level, state, floor), rough.cameras, room)
    return Grown(
        inside=inside,
        coherence=_agreement(state.masks, state.silhouettes),
        settled=settled,
        alike=state.alike * (1 - _told(state.masks, on_floor)),
        outer=state.outer,
        cropped=float(cropped(state.masks).mean()),
        share=float(state.masks.mean()),
        left_over=left_over(by_colour, state.masks, middle),
        faint=faint(views.rgb, inside),
        thinness=thinness(inside),
        lowest=0.0 if flat else state.lowest,
        masks=state.masks,
        hanging=None if stands is None else hanging(stands, state.masks),
        beside=None if stands is None else beside(stands, state.masks, near),
    )


@dataclass(frozen=True)
class _Round:
    masks: Bool[np.ndarray, "V H W"]
    silhouettes: Bool[np.ndarray, "V H W"]
    """Of the hull that masks leave."""
    hiding: Bool[np.ndarray, "V H W"]
    """Of what of the hull is high above the floor, which is not seen there."""
    outer: float
    """As in ``Grown``."""
    lowest: float
    """Height of the hull's lowest cell, in radii of the ball."""
    alike: float
    """Overlap of the colours of objects with what is near them, or with all that is around them,
    whichever is less: either tells them apart. Outlines that contradict one another, of what was
    moved, leave some of the object in what is near."""
    evidence: Evidence
    """For the next round."""


def _round(side: _Side, room: Volume, evidence: Evidence, piece: float | None) -> _Round | None:
    """Cut all pictures, carve, and learn colours anew; None: nothing is left."""
    masks = side.cut(evidence) > HALF
    hull = room.carved(masks, piece)
    if not hull.any():
        return None
    seen = room.silhouettes(hull)
    band = widened(seen)
    masks &= band
    inside = histogram(side.bins, masks & seen)
    beside = ~band | ~(seen | masks)
    outside = histogram(side.bins, widened(seen, NEARBY) & beside)
    alike = min(overlap(inside, outside), overlap(inside, histogram(side.bins, beside)))
    prior = np.where(seen, IN_HULL, np.where(band, 0, BESIDE_HULL)).astype(np.float32)
    outer = float(room.outer[hull].mean())
    hiding = room.silhouettes(hull & room.tall)
    lowest = float(room.height[hull].min())
    return _Round(masks, seen, hiding, outer, lowest, alike, Evidence(inside, outside, prior))


def _rounds(
    side: _Side,
    room: Volume,
    seeds: Seeds,
    on_floor: Float32[np.ndarray, "V H W"],
    progress: Progress,
) -> tuple[_Round, float, Float32[np.ndarray, "V H W"]] | None:
    """Cut, carve and learn until masks settle; None: nothing is left.

    Returns the last round, how much of the one before it has, and evidence of the floor that is
    left where nothing tall hides it.
    """
    inside, outside = (histogram(side.bins, w) for w in (seeds.inside, seeds.outside))
    never = np.where(seeds.never, np.float32(BESIDE_HULL), np.float32(0)) + on_floor
    evidence, before = Evidence(inside, outside, never), seeds.never
    settled, turn = 0.0, 0
    while True:
        progress(turn / (MOST + 1), f"growing masks, round {turn + 1}")
        state = _round(side, room, evidence, seeds.piece)
        if state is None:
            return None
        settled, turn = _agreement(state.masks, before), turn + 1
        on_floor = np.where(state.hiding, np.float32(0), on_floor)
        if turn >= MOST or (turn >= ROUNDS and settled >= SETTLED):
            return state, settled, on_floor
        evidence = replace(state.evidence, prior=state.evidence.prior + on_floor)
        before = state.masks


def _drawn(
    views: Views,
    level: UInt8[np.ndarray, "V H W"],
    state: _Round,
    floor: Bool[np.ndarray, "V h w"],
) -> Float32[np.ndarray, "V h w"]:
    """Cut the pictures at their full size, and keep what hangs together about silhouettes."""
    size, seen = views.rgb.shape[1:3], state.silhouettes
    floor = floor & (_enlarged(state.hiding.astype(np.float32), size) <= HALF)
    prior = _enlarged(state.evidence.prior, size) + np.float32(FLOOR) * floor.astype(np.float32)
    fine = replace(state.evidence, prior=prior)
    wide = size[1], size[0]
    fit = [Image.fromarray(p).resize(wide, Image.Resampling.NEAREST) for p in level]
    inside = _Side(views, np.stack([np.asarray(p) for p in fit])).cut(fine)
    inside[_enlarged(widened(seen, REACH).astype(np.float32), size) <= HALF] = 0
    for one, hull in zip(inside, _enlarged(seen.astype(np.float32), size), strict=True):
        pieces = label(one > HALF)
        assert isinstance(pieces, tuple)
        share = np.bincount(pieces[0][hull > HALF], minlength=pieces[1] + 1)
        share[0] = 0
        kept = share >= CRUMB * max(share.max(), 1)
        one[~kept[pieces[0]]] = 0
    return inside


def _enlarged(
    pictures: Float32[np.ndarray, "V H W"], size: tuple[int, int]
) -> Float32[np.ndarray, "V h w"]:
    wide = size[1], size[0]
    made = [Image.fromarray(p).resize(wide, Image.Resampling.BILINEAR) for p in pictures]
    return np.stack([np.asarray(p) for p in made])


def _shrunk(
    pixels: Bool[np.ndarray, "V h w"], size: tuple[int, int]
) -> Float32[np.ndarray, "V H W"]:
    """Return which share of each larger pixel is marked."""
    wide = size[1], size[0]
    whole = pixels.astype(np.float32)
    made = [Image.fromarray(p).resize(wide, Image.Resampling.BOX) for p in whole]
    return np.stack([np.asarray(p) for p in made])


def widened(seen: Bool[np.ndarray, "V H W"], by: float = MARGIN) -> Bool[np.ndarray, "V H W"]:
    """Add what is within so many widths of the picture to silhouettes."""
    steps = max(1, round(by * seen.shape[2]))
    return np.stack([binary_dilation(one, iterations=steps) for one in seen])


def _told(masks: Bool[np.ndarray, "V H W"], on_floor: Float32[np.ndarray, "V H W"]) -> float:
    """Return the share of the pixels around masks that are on the floor for certain."""
    around = widened(masks) & ~masks
    return float((on_floor[around] > 0).mean()) if around.any() else 0.0


def _agreement(a: Bool[np.ndarray, "V H W"], b: Bool[np.ndarray, "V H W"]) -> float:
    both, either = (a & b).sum(axis=(1, 2)), (a | b).sum(axis=(1, 2))
    return float(np.median(both / np.maximum(either, 1)))
