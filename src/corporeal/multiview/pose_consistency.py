"""Whether camera poses agree with the pictures, and under which convention they would.

Points that pictures share, found without the poses, must meet under them (epipolar geometry). Where pictures share too
few, because they were taken far apart or of smooth objects, silhouettes must belong to one object. Where there are none
either, the result is unknown.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import UInt8

from corporeal.core.types import Camera, Note, NoteKind, Views
from corporeal.multiview.epipolar import consensus_fraction, depths_of_match, fundamental_matrix, sampson_distance
from corporeal.multiview.feature_matching import FEATURE_IMAGE_SIDE_PX, detect_features, image_likeness, match_features
from corporeal.multiview.silhouette_coherence import silhouette_coherence

SEED_PICTURES_COUNT = 5
"""Pictures whose neighbours are looked at."""
MATCH_TOLERANCE_PX = 2.0
"""Error of a match that agrees, in pixels of a picture of 320 × 320 or less."""
MIN_MATCHES_PER_PAIR, MIN_MATCHES_OF_ALL_PAIRS = 20, 40
"""Matches of a pair, and of all pairs, from which on there is a result."""
MIN_AGREEING_FRACTION = 0.2
"""Share of matches: right poses give 0.3 to 0.9, wrong ones 0 to 0.1."""
HOPELESS_AGREEING_FRACTION = 0.1
"""Share of good matches below which the poses are certainly wrong, whether or not it is known what would put them
right."""
MIN_IMPROVEMENT_FACTOR = 1.4
"""A change must raise the share by this factor; right poses cannot be bettered by 1.1 …"""
MIN_IMPROVEMENT_SIGMAS = 3.0
"""… and the number of matches that agree by this many of its standard deviations: of few matches several agree with any
poses by chance, and nine changes are tried."""
MIN_CONSENSUS_FRACTION = 0.45
"""Share of a pair's matches that some cameras explain: then they are good matches, whatever the poses. Of random ones
some cameras explain 0.1 to 0.4."""
COHERENT_HULL_FRACTION, INCOHERENT_HULL_FRACTION = 0.9, 0.8
"""Shares of silhouettes that their hull fills."""
OPENGL_FROM_OPENCV_AXES = np.diag([1.0, -1.0, -1.0, 1.0])
FOCAL_LENGTH_FACTORS = (0.5, 2 / 3, 0.8, 1.25, 1.5, 2.0)
"""Of the focal length: what comes of pictures resized without their cameras."""
PRINCIPAL_POINT_SHIFTS_FRACTION = (-0.2, -0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15, 0.2)
"""Of the principal point, in widths and heights of a picture: what comes of cropped pictures."""
MIN_MATCHES_FOR_LENS = 100
"""Good matches from which on single parameters of a lens can be determined."""
MIN_FOCAL_GAIN_FACTOR, MIN_PRINCIPAL_POINT_GAIN_FACTOR = 1.15, 1.25
"""Factors by which matches must meet more closely under another lens; 1.3 and 2 for focal lengths off by a half and
principal points off by a tenth, at most 0.93 and 1.0 for right ones."""
HALF_WEIGHT_ERROR_TOLERANCES = 0.25
"""Error at which a match counts half, in tolerances."""

CameraChange = Callable[[Camera], Camera]


@dataclass(frozen=True)
class PoseConsistency:
    """Agreement of poses with the pictures."""

    by: str
    """What was compared: "matches", "silhouettes" or "nothing"."""
    matches: int
    """Points that pairs of pictures share."""
    share: float
    """Of the matches that agree with the poses, or of silhouettes that their hull fills."""
    error: float
    """Median error of all matches under the poses, to first order their reprojection error [px]; NaN where there are
    none."""
    doubt: str | None
    """What seems wrong, in a sentence or two; None: nothing does."""
    hopeless: bool = False
    """Nothing can be learned under these poses: good matches do not agree, or all is seen from one place."""


@dataclass(frozen=True)
class _MatchedPair:
    a: int
    b: int
    x: np.ndarray
    y: np.ndarray


def check_pose_consistency(views: Views, masks: UInt8[np.ndarray, "V H W"] | None = None) -> PoseConsistency:
    """Compare poses with pictures: some seconds at most, whatever their number and size."""
    eyes = np.array([c.world_from_camera[:3, 3] for c in views.cameras])
    if np.ptp(eyes, axis=0).max(initial=0) == 0:
        words = "All cameras are at one place: rotation alone gives no depth."
        return PoseConsistency("nothing", 0, 0.0, float("nan"), words, hopeless=True)
    if words := _image_size_doubt(views.cameras):
        return PoseConsistency("nothing", 0, 0.0, float("nan"), words, hopeless=True)
    pairs = _pairs(views)
    proven = _consistent_pairs(pairs, views.cameras)
    pairs = proven or pairs
    errors = _match_errors_px(pairs, views.cameras)
    count, share = len(errors), _agreeing_fraction(errors, views.cameras)
    error = float(np.median(errors)) if count else float("nan")
    change = _better_convention(pairs, views, share) if count >= MIN_MATCHES_OF_ALL_PAIRS else None
    if proven or change or (count >= MIN_MATCHES_OF_ALL_PAIRS and share >= MIN_AGREEING_FRACTION):
        found = f"{share:.0%} of {count} points agree with them"
        if share < MIN_AGREEING_FRACTION or change is not None:
            hopeless = share < HOPELESS_AGREEING_FRACTION or (share < MIN_AGREEING_FRACTION and change is not None)
            hopeless |= change in dict(_matrix_conventions())  # one of two is right, nothing between
            doubt = _doubt_text(found, error, change)
            return PoseConsistency("matches", count, share, error, doubt, bool(proven) and hopeless)
        doubt = _points_behind_doubt(pairs, views.cameras)
        if proven and count >= MIN_MATCHES_FOR_LENS:
            doubt = doubt or _lens_doubt(pairs, views.cameras)
        if masks is not None:
            doubt = doubt or _masks_doubt(masks, views.cameras)
        return PoseConsistency("matches", count, share, error, doubt)
    if masks is not None:
        return _check_by_silhouettes(views.cameras, masks, count, error)
    return PoseConsistency("nothing", count, share, error, None)


def _image_size_doubt(cameras: tuple[Camera, ...]) -> str | None:
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


def _points_behind_doubt(pairs: list[_MatchedPair], cameras: tuple[Camera, ...]) -> str | None:
    ahead = _fraction_in_front(pairs, cameras)
    if ahead >= 0.5:
        return None
    return (
        f"The poses put {1 - ahead:.0%} of what the pictures share behind the cameras. Check the "
        "viewing axis of the file's convention, and the signs of the positions."
    )


def _better_convention(pairs: list[_MatchedPair], views: Views, share: float) -> str | None:
    """Return the change under which clearly more matches would agree."""
    shares = {}
    for name, change in _camera_changes():
        cameras = tuple(change(c) for c in views.cameras)
        shares[name] = _agreeing_fraction(_match_errors_px(pairs, cameras), cameras)
    best = max(shares, key=lambda name: shares[name])
    count = sum(len(p.x) for p in pairs)
    spread = np.sqrt((shares[best] + share) / count)
    needed = max(MIN_AGREEING_FRACTION, MIN_IMPROVEMENT_FACTOR * share, share + MIN_IMPROVEMENT_SIGMAS * spread)
    return best if shares[best] >= needed else None


def _camera_changes() -> list[tuple[str, CameraChange]]:
    """Return what people get wrong, in words and as what would put it right."""
    changes = _matrix_conventions()
    for factor in FOCAL_LENGTH_FACTORS:
        words = f"the focal lengths were {factor:.2g} times as long (pictures of another size?)"
        changes.append((words, lambda c, f=factor: _with_other_lens((c,), f)[0]))
    return changes


def _matrix_conventions() -> list[tuple[str, CameraChange]]:
    """Return in which ways matrices are written, in words and as what would put them right."""

    def posed(change: Callable[[np.ndarray], np.ndarray]) -> CameraChange:
        return lambda c: replace(c, world_from_camera=change(c.world_from_camera))

    opposite = "the cameras' y and z axes were opposite (OpenGL's convention against OpenCV's)"
    inverse = "the matrices were inverted (world-from-camera against camera-from-world)"
    return [
        (opposite, posed(lambda W: W @ OPENGL_FROM_OPENCV_AXES)),
        (f"{inverse}, the cameras' axes OpenCV's", posed(np.linalg.inv)),
        (f"{inverse}, the cameras' axes OpenGL's", posed(lambda W: np.linalg.inv(W) @ OPENGL_FROM_OPENCV_AXES)),
    ]


def _pairs(views: Views) -> list[_MatchedPair]:
    """Return neighbours, by how alike the pictures are and by where the poses look, and matches."""
    V = len(views.cameras)
    alike = image_likeness(views.rgb)
    ahead = np.array([c.world_from_camera[:3, 2] for c in views.cameras])
    aligned = ahead @ ahead.T
    np.fill_diagonal(aligned, -np.inf)
    chosen = set()
    for k in np.unique(np.linspace(0, V - 1, min(V, SEED_PICTURES_COUNT)).round().astype(int)):
        for score in (alike, aligned):
            chosen |= {(min(k, j), max(k, j)) for j in np.argsort(-score[k])[:2] if j != k}
    found = {k: detect_features(views.rgb[k]) for k in sorted({k for pair in chosen for k in pair})}
    pairs = []
    for a, b in sorted(chosen):
        x, y = match_features(found[a], found[b])
        pairs.append(_MatchedPair(int(a), int(b), x, y))
    return pairs


def _match_errors_px(pairs: list[_MatchedPair], cameras: tuple[Camera, ...]) -> np.ndarray:
    every = [sampson_distance(fundamental_matrix(cameras[p.a], cameras[p.b]), p.x, p.y) for p in pairs]
    return np.concatenate([np.zeros(0), *every])


def _agreeing_fraction(errors: np.ndarray, cameras: tuple[Camera, ...]) -> float:
    return float((errors < _match_tolerance_px(cameras)).mean()) if len(errors) else 0.0


def _match_tolerance_px(cameras: tuple[Camera, ...]) -> float:
    return MATCH_TOLERANCE_PX * max(1.0, max(cameras[0].width, cameras[0].height) / FEATURE_IMAGE_SIDE_PX)


def _consistent_pairs(pairs: list[_MatchedPair], cameras: tuple[Camera, ...]) -> list[_MatchedPair]:
    """Return the pairs whose matches are good, whatever the poses: some cameras explain them."""
    rng = np.random.default_rng(0)
    near = _match_tolerance_px(cameras)
    several = [p for p in pairs if len(p.x) >= MIN_MATCHES_PER_PAIR]
    good = [p for p in several if consensus_fraction(p.x, p.y, near, rng) > MIN_CONSENSUS_FRACTION]
    return good if sum(len(p.x) for p in good) >= MIN_MATCHES_OF_ALL_PAIRS else []


def _fraction_in_front(pairs: list[_MatchedPair], cameras: tuple[Camera, ...]) -> float:
    """Return which share of the matches that agree lies ahead of both cameras."""
    signs = []
    for p in pairs:
        a, b = cameras[p.a], cameras[p.b]
        good = sampson_distance(fundamental_matrix(a, b), p.x, p.y) < _match_tolerance_px(cameras)
        if good.any():
            signs.append((depths_of_match(a, b, p.x[good], p.y[good]) > 0).all(axis=1))
    return float(np.concatenate(signs).mean()) if signs else 1.0


def _lens_doubt(pairs: list[_MatchedPair], cameras: tuple[Camera, ...]) -> str | None:
    """Say under which other lens good matches would meet clearly more closely.

    Cameras that look at one place nearly agree whatever their focal length: only how closely matches meet tells, not
    how many do.
    """
    now = _match_closeness(pairs, cameras)
    focal = {f: _match_closeness(pairs, _with_other_lens(cameras, f)) / now for f in FOCAL_LENGTH_FACTORS}
    middle = {
        (x, y): _match_closeness(pairs, _with_other_lens(cameras, 1.0, x, y)) / now
        for x in PRINCIPAL_POINT_SHIFTS_FRACTION
        for y in PRINCIPAL_POINT_SHIFTS_FRACTION
    }
    factor, shift = max(focal, key=focal.__getitem__), max(middle, key=middle.__getitem__)
    if middle[shift] >= max(MIN_PRINCIPAL_POINT_GAIN_FACTOR, focal[factor]):
        width, height = cameras[0].width, cameras[0].height
        found = f"the principal points lay about {shift[0] * width:+.0f} and "
        found += f"{shift[1] * height:+.0f} pixels further right and down (cropped pictures?)"
    elif focal[factor] >= MIN_FOCAL_GAIN_FACTOR:
        found = f"the focal lengths were about {factor:.2g} times as long (pictures of another "
        found += "size?)"
    else:
        return None
    return (
        f"What the pictures share would meet more closely if {found}. Correct the file, or expect "
        "distorted shapes and sizes."
    )


def _match_closeness(pairs: list[_MatchedPair], cameras: tuple[Camera, ...]) -> float:
    """Return how closely matches meet, from 0 to 1: the mean of 1 / (1 + (error / close)²)."""
    off = _match_errors_px(pairs, cameras) / (HALF_WEIGHT_ERROR_TOLERANCES * _match_tolerance_px(cameras))
    return max(float(np.mean(1 / (1 + off**2))), 1e-9)


def _with_other_lens(cameras: tuple[Camera, ...], factor: float, x: float = 0.0, y: float = 0.0) -> tuple[Camera, ...]:
    """Return cameras with a longer focal length, and the principal point elsewhere."""
    stretch = np.array([[factor, factor, 1], [1, factor, 1], [1, 1, 1.0]])
    shift = [np.array([[0, 0, x * c.width], [0, 0, y * c.height], [0, 0, 0]]) for c in cameras]
    return tuple(replace(c, K=c.K * stretch + s) for c, s in zip(cameras, shift, strict=True))


def _masks_doubt(masks: np.ndarray, cameras: tuple[Camera, ...]) -> str | None:
    """Return where masks do not belong to pictures that agree with their poses."""
    share = silhouette_coherence(masks, cameras)
    if share >= INCOHERENT_HULL_FRACTION:
        return None
    return (
        f"The poses agree with the pictures, but only {share:.0%} of the masks fit together. Check "
        "that they belong to these pictures, and are white where the objects are."
    )


def _check_by_silhouettes(cameras: tuple[Camera, ...], masks: np.ndarray, count: int, error: float) -> PoseConsistency:
    share = silhouette_coherence(masks, cameras)
    doubt = None
    if share < INCOHERENT_HULL_FRACTION:
        shares = {n: silhouette_coherence(masks, tuple(change(c) for c in cameras)) for n, change in _camera_changes()}
        best = max(shares, key=lambda name: shares[name])
        change = best if shares[best] >= COHERENT_HULL_FRACTION else None
        doubt = _doubt_text(f"{share:.0%} of the silhouettes fit together", float("nan"), change)
    return PoseConsistency("silhouettes", count, share, error, doubt)


def _doubt_text(found: str, error: float, change: str | None) -> str:
    median = "" if np.isnan(error) else f" (median error {error:.1f} px)"
    first = f"The poses do not agree with the pictures: only {found}{median}. "
    if change:
        return Note(f"{first}They would if {change}: is the file in the wrong convention?", NoteKind.GRAVE)
    return Note(f"{first}Check the order of the pictures, the focal length and the poses.", NoteKind.GRAVE)
