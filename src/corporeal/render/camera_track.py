"""Camera of a video: wide, close or following.

Boxes are those of objects over time, nan where an object is absent or went far away.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from corporeal.core.types import Ledger, Vector
from corporeal.render.camera_placement import CameraAim, fit_camera
from corporeal.render.video_choices import CameraShot

SMOOTHING_STD_S = 0.12
"""A camera that moves with something follows a mean over this time [s, standard deviation]."""
MOVING_SIZE_RATIO = 0.1
"""What travels farther than this share of its own size moves."""
CONTACT_WINDOW_S = 0.5
"""Before and after a contact, what a close shot chooses its direction by [s]."""
CLOSE_UP_MARGIN_RATIO = 1.25
"""Share of an object's largest box that a close shot keeps in the picture."""


@dataclass(frozen=True)
class FirstContact:
    """The first time that two bodies touched."""

    time: float
    """[s]"""
    objects: tuple[int, ...]
    """Two, or the one that touched the floor or a wall."""


def first_contact(ledger: Ledger, objects: int) -> FirstContact | None:
    """Return the first contact of two objects after the start, or else that of one with a plane.

    None: nothing touched anything that it did not touch from the start.
    """
    when = np.array(ledger.first_contact[-1], dtype=float)
    start = float(ledger.time[0])
    when[~(when > start)] = np.inf
    between = when[:objects, :objects]
    if between.size and np.isfinite(between.min()):
        i, j = np.unravel_index(int(between.argmin()), between.shape)
        return FirstContact(float(between.min()), (int(min(i, j)), int(max(i, j))))
    planes = when[:objects, objects:]
    if planes.size and np.isfinite(planes.min()):
        i, _ = np.unravel_index(int(planes.argmin()), planes.shape)
        return FirstContact(float(planes.min()), (int(i),))
    return None


@dataclass(frozen=True)
class MotionBounds:
    """What moves, for whoever places a camera; F instants, B objects."""

    time: Float[np.ndarray, " F"]
    """[s]"""
    boxes: Float[np.ndarray, "F B 2 3"]
    """[m]"""
    contact: FirstContact | None


@dataclass(frozen=True)
class CameraTrack:
    """A camera that keeps its distance and direction, and looks where something goes."""

    aim: CameraAim
    """As it would stand if nothing moved."""
    time: Float[np.ndarray, " F"]
    """[s]"""
    shift: Float[np.ndarray, "F 3"]
    """[m]"""

    def at(self, time: float) -> CameraAim:
        """Return where it stands at a time [s]."""
        x, y, z = (float(np.interp(time, self.time, self.shift[:, k])) for k in range(3))
        (a, b, c), (p, q, r) = self.aim.eye, self.aim.target
        return replace(self.aim, eye=(a + x, b + y, c + z), target=(p + x, q + y, r + z))


def camera_track(shot: CameraShot, reel: MotionBounds, size: tuple[int, int], view: Vector | None) -> CameraTrack:
    """Place the camera.

    Args:
        shot: wide: everything, all the time; close: the object that is struck first, or else that moves most; follow:
            all that moves.
        reel: What moves.
        size: Of the picture [px].
        view: Direction from the scene to the camera; None: where objects hide each other least.
    """
    seen = {"wide": [], "close": _struck_object(reel), "follow": _moving(reel)}[shot]
    if not seen:
        still = np.zeros((len(reel.time), 3))
        return CameraTrack(fit_camera(reel.boxes, size, view), reel.time, still)
    return _follow_moving(reel, seen, size, view)


def _struck_object(reel: MotionBounds) -> list[int]:
    """Return the lower of the two that touch first, or else what moves most."""
    if reel.contact is not None:
        k = int(np.argmin(np.abs(reel.time - reel.contact.time)))
        height = {b: reel.boxes[k, b, :, 2].mean() for b in reel.contact.objects}
        there = [b for b, z in height.items() if np.isfinite(z)]
        return sorted(there, key=lambda b: height[b])[:1]
    travel = _travel(reel)
    return [int(np.argmax(travel))] if travel.size and travel.max() > 0 else []


def _moving(reel: MotionBounds) -> list[int]:
    return np.flatnonzero(_travel(reel) > MOVING_SIZE_RATIO).tolist()


def _travel(reel: MotionBounds) -> Float[np.ndarray, " B"]:
    """How far each object's box went or stretched, over the box's size [-]."""
    size = np.linalg.norm(_extent(reel.boxes[:1])[0], axis=-1)
    way = np.nan_to_num(np.abs(reel.boxes - reel.boxes[:1])).max(axis=(0, 2, 3), initial=0.0)
    return way / np.where(size > 0, size, np.inf)


def _extent(boxes: np.ndarray) -> np.ndarray:
    return np.nan_to_num(boxes[:, :, 1] - boxes[:, :, 0])


def _follow_moving(reel: MotionBounds, seen: list[int], size: tuple[int, int], view: Vector | None) -> CameraTrack:
    """Move along with some objects, in the direction in which they are hidden least."""
    # Pieces have no boxes before something breaks.
    low, high = reel.boxes[:, seen, 0], reel.boxes[:, seen, 1]
    union = np.stack([np.fmin.reduce(low, axis=1), np.fmax.reduce(high, axis=1)], 1)
    centre = _fill_gaps(union.mean(axis=1))
    steps = np.diff(reel.time)
    spread = SMOOTHING_STD_S / float(np.median(steps)) if len(steps) else 0.0
    smooth = gaussian_filter1d(centre, max(spread, 1e-6), axis=0, mode="nearest")
    # The direction is chosen at the contact, by those that touch.
    pair, near = list(range(reel.boxes.shape[1])), np.ones(len(reel.time), bool)
    if reel.contact is not None:
        pair = sorted({*reel.contact.objects, *seen})
        near = np.abs(reel.time - reel.contact.time) <= CONTACT_WINDOW_S
        near |= np.arange(len(near)) == int(np.argmin(np.abs(reel.time - reel.contact.time)))
    chosen = fit_camera(reel.boxes[near][:, pair], size, view)
    direction = np.subtract(chosen.eye, chosen.target)
    # The distance is that at which the largest box fits, wherever it is.
    half = CLOSE_UP_MARGIN_RATIO / 2 * np.nanmax(union[:, 1] - union[:, 0], axis=0)
    box = np.stack([smooth[0] - half, smooth[0] + half])
    aim = fit_camera(box[None, None], size, (direction[0], direction[1], direction[2]))
    shift = smooth - smooth[0]
    # The eye stays above the floor.
    shift[:, 2] = np.maximum(shift[:, 2], 0.1 * half.max() - aim.eye[2])
    return CameraTrack(aim, reel.time, shift)


def _fill_gaps(path: np.ndarray) -> np.ndarray:
    """Stay where the last place is known."""
    out = path.copy()
    for k in range(3):
        good = np.flatnonzero(np.isfinite(out[:, k]))
        if len(good):
            out[:, k] = np.interp(np.arange(len(out)), good, out[good, k])
    return np.nan_to_num(out)
