"""Whether camera poses agree with the pictures, and under which convention they would.

Points that pictures share, found without the poses, must meet under them (epipolar geometry). Where
pictures share too few, because they were taken far apart or of smooth objects, silhouettes must
belong to one object. Where there are none either, nothing can be said.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import UInt8

from corporeal.core.types import Camera, Note, NoteKind, Views
from corporeal.multiview.epipolar import consensus, depths, fundamental, sampson
from corporeal.multiview.matching import SIDE, features, likeness, matches
from corporeal.multiview.silhouettes import coherence

SEEDS = 5
"""Pictures whose neighbours are looked at."""
TOLERANCE = 2.0
"""Error of a match that agrees, in pixels of a picture of 320 × 320 or less."""
FEW, ENOUGH = 20, 40
"""Matches of a pair, and of all pairs, from which on something can be said."""
AGREES = 0.2
"""Share of matches: right poses give 0.3 to 0.9, wrong ones 0 to 0.1."""
HOPELESS = 0.1
"""Share of good matches below which the poses are certainly wrong, whether or not it is known what
would put them right."""
BETTER = 1.4
"""A change must raise the share by this factor; right poses cannot be bettered by 1.1 …"""
SURE = 3.0
"""… and the number of matches that agree by this many of its standard deviations: of few matches
several agree with any poses by chance, and nine changes are tried."""
LIKELY = 0.45
"""Share of a pair's matches that some cameras explain: then they are good matches, whatever the
poses. Of random ones some cameras explain 0.1 to 0.4."""
COHERENT, INCOHERENT = 0.9, 0.8
"""Shares of silhouettes that their hull fills."""
FLIP = np.diag([1.0, -1.0, -1.0, 1.0])
FACTORS = (0.5, 2 / 3, 0.8, 1.25, 1.5, 2.0)
"""Of the focal length: what comes of pictures resized without their cameras."""
SHIFTS = (-0.2, -0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15, 0.2)
"""Of the principal point, in widths and heights of a picture: what comes of cropped pictures."""
MANY = 100
"""Good matches from which on single numbers of a lens can be told."""
CLOSER_FOCAL, CLOSER_MIDDLE = 1.15, 1.25
"""Factors by which matches must meet more closely under another lens; 1.3 and 2 for focal lengths
off by a half and principal points off by a tenth, at most 0.93 and 1.0 for right ones."""
CLOSE = 0.25
"""Error at which a match counts half, in tolerances."""

Change = Callable[[Camera], Camera]


@dataclass(frozen=True)
class Agreement:
    """What the pictures say of the poses."""

    by: str
    """What was compared: "matches", "silhouettes" or "nothing"."""
    matches: int
    """Points that pairs of pictures share."""
    share: float
    """Of the matches that agree with the poses, or of silhouettes that their hull fills."""
    error: float
    """Median error of all matches under the poses, to first order their reprojection error [px];
    NaN where there are none."""
    doubt: str | None
    """What seems wrong, in a sentence or two; None: nothing does."""
    hopeless: bool = False
    """Nothing can be learned under these poses: good matches do not agree, or all is seen from one
    place."""


@dataclass(frozen=True)
class _Pair:
    a: int
    b: int
    x: np.ndarray
    y: np.ndarray


def pose_doubt(views: Views, masks: UInt8[np.ndarray, "V H W"] | None = None) -> str | None:
    """Return what seems wrong with the poses, in words; None: nothing does, or none can tell."""
    return agreement(views, masks).doubt


def agreement(views: Views, masks: UInt8[np.ndarray, "V H W"] | None = None) -> Agreement:
    """Compare poses with pictures: some seconds at most, whatever their number and size."""
    eyes = np.array([c.world_from_camera[:3, 3] for c in views.cameras])
    if np.ptp(eyes, axis=0).max(initial=0) == 0:
        words = "All cameras stand at one place: turning a camera shows no depth."
        return Agreement("nothing", 0, 0.0, float("nan"), words, hopeless=True)
    if words := _other_size(views.cameras):
        return Agreement("nothing", 0, 0.0, float("nan"), words, hopeless=True)
    pairs = _pairs(views)
    proven = _proven(pairs, views.cameras)
    pairs = proven or pairs
    errors = _errors(pairs, views.cameras)
    count, share = len(errors), _share(errors, views.cameras)
    error = float(np.median(errors)) if count else float("nan")
    change = _better(pairs, views, share) if count >= ENOUGH else None
    if proven or change or (count >= ENOUGH and share >= AGREES):
        found = f"{share:.0%} of {count} points agree with them"
        if share < AGREES or change is not None:
            hopeless = share < HOPELESS or (share < AGREES and change is not None)
            hopeless |= change in dict(_conventions())  # one of two is right, nothing between
            doubt = _words(found, error, change)
            return Agreement("matches", count, share, error, doubt, bool(proven) and hopeless)
        doubt = _behind(pairs, views.cameras)
        if proven and count >= MANY:
            doubt = doubt or _lens_doubt(pairs, views.cameras)
        if masks is not None:
            doubt = doubt or _masks_doubt(masks, views.cameras)
        return Agreement("matches", count, share, error, doubt)
    if masks is not None:
        return _by_silhouettes(views.cameras, masks, count, error)
    return Agreement("nothing", count, share, error, None)


def _other_size(cameras: tuple[Camera, ...]) -> str | None:
    """Say at which scale matrices would agree that were made for larger pictures.

    A lens's axis meets its picture near the middle: where it misses every picture, the numbers
    were measured in pixels of another size.
    """
    middle = np.array([[c.K[0, 2] / c.width, c.K[1, 2] / c.height] for c in cameras])
    if not (middle >= 1.0).any(axis=1).all():
        return None
    scale, first = float(0.5 / np.median(middle)), cameras[0]
    return (
        f"The matrices are for pictures of another size: the principal point "
        f"({first.K[0, 2]:.0f}, {first.K[1, 2]:.0f}) lies outside pictures of {first.width} x "
        f"{first.height}. They would agree at a scale of {scale:.3g}: multiply the focal lengths "
        "and the principal point by it, or give the pictures that they were made for, about "
        f"{first.width / scale:.0f} x {first.height / scale:.0f}."
    )


# ---------------------------------------------------------------- matches


def _behind(pairs: list[_Pair], cameras: tuple[Camera, ...]) -> str | None:
    ahead = _ahead(pairs, cameras)
    if ahead >= 0.5:
        return None
    return (
        f"The poses put {1 - ahead:.0%} of what the pictures share behind the cameras. Look along "
        "which axis the cameras look in the file's convention, and at the signs of their places."
    )


def _better(pairs: list[_Pair], views: Views, share: float) -> str | None:
    """Return the change under which clearly more matches would agree."""
    shares = {}
    for name, change in _changes():
        cameras = tuple(change(c) for c in views.cameras)
        shares[name] = _share(_errors(pairs, cameras), cameras)
    best = max(shares, key=lambda name: shares[name])
    count = sum(len(p.x) for p in pairs)
    spread = np.sqrt((shares[best] + share) / count)
    needed = max(AGREES, BETTER * share, share + SURE * spread)
    return best if shares[best] >= needed else None


def _changes() -> list[tuple[str, Change]]:
    """Return what people get wrong, in words and as what would put it right."""
    changes = _conventions()
    for factor in FACTORS:
        words = f"the focal lengths were {factor:.2g} times as long (pictures of another size?)"
        changes.append((words, lambda c, f=factor: _lensed((c,), f)[0]))
    return changes


def _conventions() -> list[tuple[str, Change]]:
    """Return in which ways matrices are written, in words and as what would put them right."""

    def posed(change: Callable[[np.ndarray], np.ndarray]) -> Change:
        return lambda c: replace(c, world_from_camera=change(c.world_from_camera))

    opposite = "the cameras' y and z axes were opposite (OpenGL's convention against OpenCV's)"
    inverse = "the matrices were inverted (world-from-camera against camera-from-world)"
    return [
        (opposite, posed(lambda W: W @ FLIP)),
        (f"{inverse}, the cameras' axes OpenCV's", posed(np.linalg.inv)),
        (f"{inverse}, the cameras' axes OpenGL's", posed(lambda W: np.linalg.inv(W) @ FLIP)),
    ]


def _pairs(views: Views) -> list[_Pair]:
    """Return neighbours, by how alike the pictures are and by where the poses look, and matches."""
    V = len(views.cameras)
    alike = likeness(views.rgb)
    ahead = np.array([c.world_from_camera[:3, 2] for c in views.cameras])
    aligned = ahead @ ahead.T
    np.fill_diagonal(aligned, -np.inf)
    chosen = set()
    for k in np.unique(np.linspace(0, V - 1, min(V, SEEDS)).round().astype(int)):
        for score in (alike, aligned):
            chosen |= {(min(k, j), max(k, j)) for j in np.argsort(-score[k])[:2] if j != k}
    found = {k: features(views.rgb[k]) for k in sorted({k for pair in chosen for k in pair})}
    pairs = []
    for a, b in sorted(chosen):
        x, y = matches(found[a], found[b])
        pairs.append(_Pair(int(a), int(b), x, y))
    return pairs


def _errors(pairs: list[_Pair], cameras: tuple[Camera, ...]) -> np.ndarray:
    every = [sampson(fundamental(cameras[p.a], cameras[p.b]), p.x, p.y) for p in pairs]
    return np.concatenate([np.zeros(0), *every])


def _share(errors: np.ndarray, cameras: tuple[Camera, ...]) -> float:
    return float((errors < _tolerance(cameras)).mean()) if len(errors) else 0.0


def _tolerance(cameras: tuple[Camera, ...]) -> float:
    return TOLERANCE * max(1.0, max(cameras[0].width, cameras[0].height) / SIDE)


def _proven(pairs: list[_Pair], cameras: tuple[Camera, ...]) -> list[_Pair]:
    """Return the pairs whose matches are good, whatever the poses: some cameras explain them."""
    rng = np.random.default_rng(0)
    near = _tolerance(cameras)
    several = [p for p in pairs if len(p.x) >= FEW]
    good = [p for p in several if consensus(p.x, p.y, near, rng) > LIKELY]
    return good if sum(len(p.x) for p in good) >= ENOUGH else []


def _ahead(pairs: list[_Pair], cameras: tuple[Camera, ...]) -> float:
    """Return which share of the matches that agree lies ahead of both cameras."""
    signs = []
    for p in pairs:
        a, b = cameras[p.a], cameras[p.b]
        good = sampson(fundamental(a, b), p.x, p.y) < _tolerance(cameras)
        if good.any():
            signs.append((depths(a, b, p.x[good], p.y[good]) > 0).all(axis=1))
    return float(np.concatenate(signs).mean()) if signs else 1.0


# ---------------------------------------------------------------- lenses


def _lens_doubt(pairs: list[_Pair], cameras: tuple[Camera, ...]) -> str | None:
    """Say under which other lens good matches would meet clearly more closely.

    Cameras that look at one place nearly agree whatever their focal length: only how closely
    matches meet tells, not how many do.
    """
    now = _closeness(pairs, cameras)
    focal = {f: _closeness(pairs, _lensed(cameras, f)) / now for f in FACTORS}
    middle = {
        (x, y): _closeness(pairs, _lensed(cameras, 1.0, x, y)) / now for x in SHIFTS for y in SHIFTS
    }
    factor, shift = max(focal, key=focal.__getitem__), max(middle, key=middle.__getitem__)
    if middle[shift] >= max(CLOSER_MIDDLE, focal[factor]):
        width, height = cameras[0].width, cameras[0].height
        found = f"the principal points lay about {shift[0] * width:+.0f} and "
        found += f"{shift[1] * height:+.0f} pixels further right and down (cropped pictures?)"
    elif focal[factor] >= CLOSER_FOCAL:
        found = f"the focal lengths were about {factor:.2g} times as long (pictures of another "
        found += "size?)"
    else:
        return None
    return (
        f"What the pictures share would meet more closely if {found}. Correct the file, or take "
        "shapes and sizes for distorted."
    )


def _closeness(pairs: list[_Pair], cameras: tuple[Camera, ...]) -> float:
    """Return how closely matches meet, from 0 to 1: the mean of 1 / (1 + (error / close)²)."""
    off = _errors(pairs, cameras) / (CLOSE * _tolerance(cameras))
    return max(float(np.mean(1 / (1 + off**2))), 1e-9)


def _lensed(
    cameras: tuple[Camera, ...], factor: float, x: float = 0.0, y: float = 0.0
) -> tuple[Camera, ...]:
    """Return cameras with a longer focal length, and the principal point elsewhere."""
    stretch = np.array([[factor, factor, 1], [1, factor, 1], [1, 1, 1.0]])
    shift = [np.array([[0, 0, x * c.width], [0, 0, y * c.height], [0, 0, 0]]) for c in cameras]
    return tuple(replace(c, K=c.K * stretch + s) for c, s in zip(cameras, shift, strict=True))


# ---------------------------------------------------------------- silhouettes


def _masks_doubt(masks: np.ndarray, cameras: tuple[Camera, ...]) -> str | None:
    """Say where masks do not belong to pictures that agree with their poses."""
    share = coherence(masks, cameras)
    if share >= INCOHERENT:
        return None
    return (
        f"The poses agree with the pictures, but only {share:.0%} of the masks fit together. Look "
        "whether they belong to these pictures, and are white where the objects are."
    )


def _by_silhouettes(
    cameras: tuple[Camera, ...], masks: np.ndarray, count: int, error: float
) -> Agreement:
    share = coherence(masks, cameras)
    doubt = None
    if share < INCOHERENT:
        shares = {
            n: coherence(masks, tuple(change(c) for c in cameras)) for n, change in _changes()
        }
        best = max(shares, key=lambda name: shares[name])
        change = best if shares[best] >= COHERENT else None
        doubt = _words(f"{share:.0%} of the silhouettes fit together", float("nan"), change)
    return Agreement("silhouettes", count, share, error, doubt)


def _words(found: str, error: float, change: str | None) -> str:
    median = "" if np.isnan(error) else f" (median error {error:.1f} px)"
    first = f"The poses do not agree with the pictures: only {found}{median}. "
    if change:
        return Note(
            f"{first}They would if {change}: is the file in the wrong convention?", NoteKind.GRAVE
        )
    return Note(
        f"{first}Look at the order of the pictures, the focal length and the poses.", NoteKind.GRAVE
    )
