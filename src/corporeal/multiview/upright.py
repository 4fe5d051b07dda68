"""The frame of a reconstruction: +z up, the floor at z = 0, what the cameras look at above it.

Poses from pictures have no up, and trained splats neither. It is taken from what the file says,
else from the cameras, which people hold level, else from what programs usually write and how
objects would rest; a plane that objects stand on corrects it.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Camera, Note, NoteKind, Vector
from corporeal.geometry.resting_pose import rest, together
from corporeal.multiview.ground_plane import Plane, Search, ground_plane
from corporeal.multiview.level import Level, level
from corporeal.multiview.region import Region, region
from corporeal.multiview.similarity import moved_points, similarity

STRONG = 0.6
"""From here on a direction is believed unless something stronger speaks."""
TILTS = {True: np.radians(12), False: np.radians(35)}
"""How far a floor's normal may be from an up that is strong, or not."""
AGAINST = np.radians(20)
"""Angle from which on cameras that agree speak against the file."""
LEVEL = np.radians(0.3)
"""Standard error of an up that knows better than a plane nearby."""
NEARBY = np.radians(1.0)
"""Angle between that plane's normal and up."""
MOST = 50_000
"""Points that are looked at."""
WITHIN = 2.0
"""Points farther from the middle are not looked at, in radii of what the cameras look at."""
LOWEST = 0.5
"""Percentile of heights that is the underside of objects, where no point is astray."""
UNUSUAL = np.radians(10)
"""How much farther objects may roll from the usual axis than from another to be believed there."""
STANDS = np.radians(12)
"""Objects that roll less were, and their frame was a little tilted."""
WEAK = 0.3
"""An up less sure than this says nothing of where a floor is, if there are cameras above it."""
Z: Vector = (0.0, 0.0, 1.0)
AXIS = "the axis that programs usually write as up"
LOOK = "No camera and no file says what is up: look at the result, and say it with --up."


@dataclass(frozen=True)
class Upright:
    """How a file's frame becomes the world's, and how that was found."""

    world_from_file: Float[np.ndarray, "4 4"]
    """Rotation and shift; lengths stay."""
    found_by: str
    """Who said what is up: "person", "file", "cameras", "floor", "rest" or "custom"."""
    confidence: float
    """In up: 0 (a guess) to 1."""
    floor_by: str
    """"plane": it is in the pictures; "person": somebody said it; "objects": their lowest points;
    "nothing": there are none."""
    radius: float
    """Of the scene, in the file's unit."""
    reason: str
    """In a sentence or two, for the report."""
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Stated:
    """What somebody says of the frame; it goes before all else."""

    up: Vector | None = None
    floor: float | None = None
    """Its height along up, in the file's frame and unit."""


NOTHING = Stated()


@dataclass(frozen=True)
class _Up:
    up: np.ndarray
    found_by: str
    sure: float
    error: float
    reason: str
    warnings: tuple[str, ...]


def upright(
    cameras: tuple[Camera, ...],
    points: Float[np.ndarray, "N 3"],
    z_up: bool = False,
    of_objects: Float[np.ndarray, "M 3"] | None = None,
    usual: Vector | None = None,
    stated: Stated = NOTHING,
) -> Upright:
    """Find the frame of a reconstruction.

    Args:
        cameras: Posed, in the file's frame; () for a splat without any.
        points: On all that is in the pictures, in the file's frame and unit; a floor is looked for
            among them.
        z_up: Whether the file says that its +z is up.
        of_objects: Points that are on objects for sure, as masks tell; None: unknown.
        usual: What is up in such files as a rule; for want of cameras.
        stated: What somebody says.

    """
    points, of_objects = _fewer(points), None if of_objects is None else _fewer(of_objects)
    around = _around(cameras, points if of_objects is None else of_objects)
    near = points[np.linalg.norm(points - around.centre, axis=1) < WITHIN * around.radius]
    if stated.up is not None:
        told = _Up(_unit(stated.up), "person", 1.0, 0.0, "Up is what was stated.", ())
    elif z_up or cameras:
        told = _told(cameras, z_up)
    else:
        told = _Up(_unit(usual or Z), "custom", 0.4, np.inf, f"Up is {AXIS}.", (_looked(""),))
    plane = _floor(told, cameras, near, around)
    if plane is None and told.found_by == "custom":
        told = _rested(told, near)
    if plane is not None:
        told = _corrected(told, plane)
    floor = plane if stated.floor is None else stated.floor
    return _framed(told, floor, around, near if of_objects is None else of_objects)


def _fewer(points: np.ndarray) -> np.ndarray:
    return points[:: -(-len(points) // MOST) or 1].astype(np.float64)


def turned_up(up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Return the smallest rotation that takes a direction to +z."""
    x, y, z = up / np.linalg.norm(up)
    if z < -1 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    k = 1 / (1 + z)
    return np.array([[1 - k * x * x, -k * x * y, -x], [-k * x * y, 1 - k * y * y, -y], [x, y, z]])


# ---------------------------------------------------------------- up


def _told(cameras: tuple[Camera, ...], z_up: bool) -> _Up:
    """Return what is up as the file or its cameras say."""
    seen = level(cameras) if cameras else None
    if seen is None or z_up:
        return _by_file(seen)
    many = f"{len(cameras)} cameras"
    reason = f"Up is what {many} agree on, which people hold level (to {_degrees(seen.error)})."
    if not np.isfinite(seen.error):
        reason = "Up is the mean of what is up in the pictures."
    return _Up(seen.up, "cameras", seen.sure, seen.error, reason, seen.warnings)


def _rested(told: _Up, points: np.ndarray) -> _Up:
    """Return what is up as objects would rest, for want of cameras and of a floor.

    Near the usual axis, unless they would fall over, and there is another along which they stand.
    """
    usual, body = told.up, together(points)
    rests = [(axis, rest(body, axis)) for axis in (usual, -usual, *_others(usual))]
    found = [(axis, stood) for axis, stood in rests if stood is not None]
    if not found:
        return told
    axis, stood = min(found, key=lambda f: f[1].tilt + (f[0] is not usual) * UNUSUAL)
    if stood.tilt > STANDS:
        return told
    fell = "" if axis is usual else f" Up is not {AXIS}: the objects would fall over."
    reason = f"Up is as the objects would rest on a floor, {_degrees(stood.tilt)} from an axis."
    return _Up(stood.up, "rest", 0.5, np.inf, reason + fell, (_looked(fell),))


def _looked(more: str) -> Note:
    """Say that nobody said what is up, and more of it."""
    return Note(LOOK + more, NoteKind.ASSUMED)


def _others(up: np.ndarray) -> list[np.ndarray]:
    """Return the axes beside one, both ways."""
    first = np.argmax(np.abs(up))
    return [sign * np.eye(3)[k] for k in range(3) if k != first for sign in (1.0, -1.0)]


def _by_file(seen: Level | None) -> _Up:
    z = _unit(Z)
    said = _Up(z, "file", 0.9, 0.0, "Up is +z, as such files have it.", ())
    if seen is None or seen.sure < 0.8:
        return said
    angle = _angle(seen.up, z)
    if angle < AGAINST:
        return said
    words = (
        f"Such files have +z up, but the cameras, which agree with each other, were held level "
        f"about a direction {np.degrees(angle):.0f}° from it. The cameras were believed."
    )
    reason = f"Up is what the cameras agree on (to {_degrees(seen.error)})."
    return _Up(seen.up, "cameras", seen.sure * 0.8, seen.error, reason, (*seen.warnings, words))


def _floor(
    told: _Up, cameras: tuple[Camera, ...], points: np.ndarray, around: Region
) -> Plane | None:
    eyes = np.array([c.world_from_camera[:3, 3] for c in cameras]).reshape(-1, 3)
    lost = told.sure < WEAK and len(eyes) > 0
    tilt = np.pi if lost else TILTS[told.sure >= STRONG]
    search = Search(told.up, tilt, around.radius, eyes)
    return ground_plane(points, search, np.random.default_rng(0))


def _corrected(told: _Up, plane: Plane) -> _Up:
    """Let a plane that objects stand on correct what is up."""
    angle = _angle(told.up, plane.normal)
    if told.sure >= STRONG and told.error < LEVEL and angle < NEARBY:
        return told
    reason = f"{told.reason} The floor, {np.degrees(angle):.1f}° from it, corrected that."
    by = told.found_by if told.sure >= STRONG else "floor"
    sure = max(told.sure, min(0.9, 0.5 + plane.share))
    return replace(told, up=plane.normal, found_by=by, sure=sure, reason=reason)


def _unit(vector: Vector | np.ndarray) -> np.ndarray:
    return np.asarray(vector, dtype=float) / np.linalg.norm(vector)


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle):.1f}°"


# ---------------------------------------------------------------- the frame


def _around(cameras: tuple[Camera, ...], points: np.ndarray) -> Region:
    """Return the ball that matters: what the cameras look at, else where most points are."""
    if cameras:
        return region(cameras, points)
    low, high = np.percentile(points, [2, 98], axis=0)
    x, y, z = ((low + high) / 2).tolist()
    return Region((x, y, z), float(np.linalg.norm(high - low)) / 2)


def _framed(told: _Up, floor: Plane | float | None, around: Region, lowest: np.ndarray) -> Upright:
    rotation = turned_up(told.up)
    centre = rotation @ np.array(around.centre)
    warnings = list(told.warnings)
    if isinstance(floor, Plane):
        # Where the plane is below the middle: it may be tilted against up by a little.
        below = (floor.offset - floor.normal @ np.array(around.centre)) / (floor.normal @ told.up)
        height, by = float(centre[2] + below), "plane"
        reason = f"The floor is a plane with {floor.share:.0%} of the points."
    elif floor is not None:
        height, by, reason = floor, "person", "The floor is where it was stated to be."
    elif len(lowest):
        heights = moved_points(together(lowest), similarity(rotation))[:, 2]
        height, by = float(np.percentile(heights, LOWEST)), "objects"
        reason = "No floor was found: it is put below the lowest points."
        warnings.append(f"{reason} Things that float above it will fall.")
    else:
        height, by, reason = (
            float(centre[2]),
            "nothing",
            "There are no points to put a floor below.",
        )
    shift = -np.array([centre[0], centre[1], height])
    return Upright(
        world_from_file=similarity(rotation, 1.0, shift),
        found_by=told.found_by,
        confidence=float(told.sure),
        floor_by=by,
        radius=around.radius,
        reason=f"{told.reason} {reason}",
        warnings=tuple(warnings),
    )
