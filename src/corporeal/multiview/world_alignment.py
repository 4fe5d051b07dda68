"""World alignment of a reconstruction: +z up, floor at z = 0.

Poses from pictures have no up, and trained splats neither. It is taken from what the file says, else from the cameras,
which people hold level, else from what programs usually write and how objects would rest; a plane that objects stand on
corrects it.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Camera, Note, NoteKind, Vector
from corporeal.geometry.convex_hull import find_resting_pose, remove_outliers
from corporeal.multiview.ground_plane import GroundPlane, GroundSearch, find_ground_plane
from corporeal.multiview.similarity_transform import apply_similarity_to_points, similarity_matrix
from corporeal.multiview.up_direction import UpDirection, estimate_up_direction
from corporeal.multiview.viewed_region import ViewedRegion, find_viewed_region

MIN_STRONG_CONFIDENCE = 0.6
"""From here on a direction is accepted unless something stronger speaks."""
MAX_FLOOR_TILTS_RAD = {True: np.radians(12), False: np.radians(35)}
"""How far a floor's normal may be from an up that is strong, or not."""
FILE_UP_CONFLICT_RAD = np.radians(20)
"""Angle from which on cameras that agree speak against the file."""
MAX_SURE_UP_ERROR_RAD = np.radians(0.3)
"""Standard error of an up that knows better than a plane nearby."""
NEAR_PLANE_ANGLE_RAD = np.radians(1.0)
"""Angle between that plane's normal and up."""
MAX_ALIGNMENT_POINTS = 50_000
"""Points that are looked at."""
MAX_POINT_DISTANCE_RADII = 2.0
"""Points farther from the middle are not looked at, in radii of what the cameras look at."""
UNDERSIDE_PERCENTILE = 0.5
"""Percentile of heights that is the underside of objects, where no point is astray."""
UNUSUAL_AXIS_EXTRA_ROLL_RAD = np.radians(10)
"""How much farther objects may roll from the usual axis than from another to be accepted there."""
MAX_STANDING_ROLL_RAD = np.radians(12)
"""Objects that roll less were, and their frame was a little tilted."""
MIN_UP_CONFIDENCE = 0.3
"""An up less sure than this says nothing of where a floor is, if there are cameras above it."""
UNIT_Z: Vector = (0.0, 0.0, 1.0)
USUAL_UP_AXIS_WORDS = "the axis that programs usually write as up"
UNKNOWN_UP_NOTE = "The up direction is unknown: check the result, and set it with --up."


@dataclass(frozen=True)
class WorldAlignment:
    """How a file's frame becomes the world's, and how that was found."""

    world_from_file: Float[np.ndarray, "4 4"]
    """Rotation and shift; lengths stay."""
    found_by: str
    """Source of the up direction: "person", "file", "cameras", "floor", "rest" or "custom"."""
    confidence: float
    """In up: 0 (a guess) to 1."""
    floor_by: str
    """"plane": it is in the pictures; "person": stated by the user; "objects": their lowest points; "nothing": there
    are none.
    """
    radius: float
    """Of the scene, in the file's unit."""
    reason: str
    """In a sentence or two, for the report."""
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class StatedFrame:
    """The frame stated by the user, which has priority."""

    up: Vector | None = None
    floor: float | None = None
    """Its height along up, in the file's frame and unit."""


NOTHING_STATED = StatedFrame()


@dataclass(frozen=True)
class _UpEvidence:
    up: np.ndarray
    found_by: str
    sure: float
    error: float
    reason: str
    warnings: tuple[str, ...]


def align_world(
    cameras: tuple[Camera, ...],
    points: Float[np.ndarray, "N 3"],
    z_up: bool = False,
    of_objects: Float[np.ndarray, "M 3"] | None = None,
    usual: Vector | None = None,
    stated: StatedFrame = NOTHING_STATED,
) -> WorldAlignment:
    """Find the frame of a reconstruction.

    Args:
        cameras: Posed, in the file's frame; () for a splat without any.
        points: On all that is in the pictures, in the file's frame and unit; a floor is looked for among them.
        z_up: Whether the file says that its +z is up.
        of_objects: Points that are on objects for sure, as masks tell; None: unknown.
        usual: What is up in such files as a rule; for want of cameras.
        stated: Stated by the user.
    """
    points, of_objects = (_fewer_points(points), None if of_objects is None else _fewer_points(of_objects))
    around = _scene_ball(cameras, points if of_objects is None else of_objects)
    near = points[np.linalg.norm(points - around.centre, axis=1) < MAX_POINT_DISTANCE_RADII * around.radius]
    if stated.up is not None:
        evidence = _UpEvidence(_unit_vector(stated.up), "person", 1.0, 0.0, "Up is what was stated.", ())
    elif z_up or cameras:
        evidence = _up_from_file_or_cameras(cameras, z_up)
    else:
        evidence = _UpEvidence(
            _unit_vector(usual or UNIT_Z),
            "custom",
            0.4,
            np.inf,
            f"Up is {USUAL_UP_AXIS_WORDS}.",
            (_unknown_up_note(""),),
        )
    plane = _find_floor(evidence, cameras, near, around)
    if plane is None and evidence.found_by == "custom":
        evidence = _up_from_resting(evidence, near)
    if plane is not None:
        evidence = _corrected_up(evidence, plane)
    floor = plane if stated.floor is None else stated.floor
    return _world_alignment(evidence, floor, around, near if of_objects is None else of_objects)


def _fewer_points(points: np.ndarray) -> np.ndarray:
    return points[:: -(-len(points) // MAX_ALIGNMENT_POINTS) or 1].astype(np.float64)


def rotation_to_z(up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Return the smallest rotation that takes a direction to +z."""
    x, y, z = up / np.linalg.norm(up)
    if z < -1 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    k = 1 / (1 + z)
    return np.array([[1 - k * x * x, -k * x * y, -x], [-k * x * y, 1 - k * y * y, -y], [x, y, z]])


def _up_from_file_or_cameras(cameras: tuple[Camera, ...], z_up: bool) -> _UpEvidence:
    """Return what is up as the file or its cameras say."""
    seen = estimate_up_direction(cameras) if cameras else None
    if seen is None or z_up:
        return _up_by_file(seen)
    many = f"{len(cameras)} cameras"
    reason = f"Up is the consensus of {many}, which people hold level (to {_degrees_text(seen.error)})."
    if not np.isfinite(seen.error):
        reason = "Up is the mean of the pictures' up directions."
    return _UpEvidence(seen.up, "cameras", seen.sure, seen.error, reason, seen.warnings)


def _up_from_resting(evidence: _UpEvidence, points: np.ndarray) -> _UpEvidence:
    """Return what is up as objects would rest, for want of cameras and of a floor.

    Near the usual axis, unless they would fall over, and there is another along which they stand.
    """
    usual, body = evidence.up, remove_outliers(points)
    rests = [(axis, find_resting_pose(body, axis)) for axis in (usual, -usual, *_other_axes(usual))]
    found = [(axis, stood) for axis, stood in rests if stood is not None]
    if not found:
        return evidence
    axis, stood = min(found, key=lambda f: f[1].tilt + (f[0] is not usual) * UNUSUAL_AXIS_EXTRA_ROLL_RAD)
    if stood.tilt > MAX_STANDING_ROLL_RAD:
        return evidence
    fell = "" if axis is usual else f" Up is not {USUAL_UP_AXIS_WORDS}: the objects would fall over."
    reason = f"Up is by the resting pose of the objects, {_degrees_text(stood.tilt)} from an axis."
    return _UpEvidence(stood.up, "rest", 0.5, np.inf, reason + fell, (_unknown_up_note(fell),))


def _unknown_up_note(more: str) -> Note:
    """Note that the up direction is unknown."""
    return Note(UNKNOWN_UP_NOTE + more, NoteKind.ASSUMED)


def _other_axes(up: np.ndarray) -> list[np.ndarray]:
    """Return the axes beside one, both ways."""
    first = np.argmax(np.abs(up))
    return [sign * np.eye(3)[k] for k in range(3) if k != first for sign in (1.0, -1.0)]


def _up_by_file(seen: UpDirection | None) -> _UpEvidence:
    z = _unit_vector(UNIT_Z)
    said = _UpEvidence(z, "file", 0.9, 0.0, "Up is +z, as usual for such files.", ())
    if seen is None or seen.sure < 0.8:
        return said
    angle = _angle_between(seen.up, z)
    if angle < FILE_UP_CONFLICT_RAD:
        return said
    words = (
        f"Such files have +z up, but the cameras, which agree with each other, were held level "
        f"about a direction {np.degrees(angle):.0f}° from it. The cameras were used."
    )
    reason = f"Up is the consensus of the cameras (to {_degrees_text(seen.error)})."
    return _UpEvidence(seen.up, "cameras", seen.sure * 0.8, seen.error, reason, (*seen.warnings, words))


def _find_floor(
    evidence: _UpEvidence, cameras: tuple[Camera, ...], points: np.ndarray, around: ViewedRegion
) -> GroundPlane | None:
    eyes = np.array([c.world_from_camera[:3, 3] for c in cameras]).reshape(-1, 3)
    lost = evidence.sure < MIN_UP_CONFIDENCE and len(eyes) > 0
    tilt = np.pi if lost else MAX_FLOOR_TILTS_RAD[evidence.sure >= MIN_STRONG_CONFIDENCE]
    search = GroundSearch(evidence.up, tilt, around.radius, eyes)
    return find_ground_plane(points, search, np.random.default_rng(0))


def _corrected_up(evidence: _UpEvidence, plane: GroundPlane) -> _UpEvidence:
    """Let a plane that objects stand on correct what is up."""
    angle = _angle_between(evidence.up, plane.normal)
    if (
        evidence.sure >= MIN_STRONG_CONFIDENCE
        and evidence.error < MAX_SURE_UP_ERROR_RAD
        and angle < NEAR_PLANE_ANGLE_RAD
    ):
        return evidence
    reason = f"{evidence.reason} The floor, {np.degrees(angle):.1f}° from it, corrected that."
    by = evidence.found_by if evidence.sure >= MIN_STRONG_CONFIDENCE else "floor"
    sure = max(evidence.sure, min(0.9, 0.5 + plane.share))
    return replace(evidence, up=plane.normal, found_by=by, sure=sure, reason=reason)


def _unit_vector(vector: Vector | np.ndarray) -> np.ndarray:
    return np.asarray(vector, dtype=float) / np.linalg.norm(vector)


def _angle_between(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def _degrees_text(angle: float) -> str:
    return f"{np.degrees(angle):.1f}°"


def _scene_ball(cameras: tuple[Camera, ...], points: np.ndarray) -> ViewedRegion:
    """Return the ball that matters: what the cameras look at, else where most points are."""
    if cameras:
        return find_viewed_region(cameras, points)
    low, high = np.percentile(points, [2, 98], axis=0)
    x, y, z = ((low + high) / 2).tolist()
    return ViewedRegion((x, y, z), float(np.linalg.norm(high - low)) / 2)


def _world_alignment(
    evidence: _UpEvidence, floor: GroundPlane | float | None, around: ViewedRegion, lowest: np.ndarray
) -> WorldAlignment:
    rotation = rotation_to_z(evidence.up)
    centre = rotation @ np.array(around.centre)
    warnings = list(evidence.warnings)
    if isinstance(floor, GroundPlane):
        # Where the plane is below the middle: it may be tilted against up by a little.
        below = (floor.offset - floor.normal @ np.array(around.centre)) / (floor.normal @ evidence.up)
        height, by = float(centre[2] + below), "plane"
        reason = f"The floor is a plane with {floor.share:.0%} of the points."
    elif floor is not None:
        height, by, reason = floor, "person", "The floor is where it was stated to be."
    elif len(lowest):
        heights = apply_similarity_to_points(remove_outliers(lowest), similarity_matrix(rotation))[:, 2]
        height, by = float(np.percentile(heights, UNDERSIDE_PERCENTILE)), "objects"
        reason = "No floor was found: it was placed below the lowest points."
        warnings.append(f"{reason} Objects that float above it will fall.")
    else:
        height, by, reason = (float(centre[2]), "nothing", "There are no points to place a floor below.")
    shift = -np.array([centre[0], centre[1], height])
    return WorldAlignment(
        world_from_file=similarity_matrix(rotation, 1.0, shift),
        found_by=evidence.found_by,
        confidence=float(evidence.sure),
        floor_by=by,
        radius=around.radius,
        reason=f"{evidence.reason} {reason}",
        warnings=tuple(warnings),
    )
