"""Construction of scenes in Python: balls, boxes, cylinders and closed meshes, each of one material.

The floor is always there, at z = 0; +Z is up. All lengths are in metres.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import trimesh
from jaxtyping import Float, Int

from corporeal.core.errors import UserError
from corporeal.core.types import GRAVITY_VECTOR, Finish, Keyframes, Push, Scene, SceneObject, Surface, Vector, Wind
from corporeal.geometry.crease_normals import add_crease_normals
from corporeal.geometry.scene_transforms import overlapping_objects
from corporeal.materials import MaterialEntry, find_material
from corporeal.materials.default_appearance import default_finish
from corporeal.recognition.readable_names import unique_names

ZERO_VELOCITY: Vector = (0.0, 0.0, 0.0)
BALL_SUBDIVISIONS = 3
"""How often the twenty triangles of a ball are divided: its volume is 0.9 % too small."""
CYLINDER_SIDES_COUNT = 48
"""Sides of a cylinder: its volume is 0.3 % too small."""
MAX_ROUNDOFF_DEPTH_M = 1e-6
"""Depth below the floor that is round-off [m]."""


@dataclass(frozen=True)
class Solid:
    """A closed body of one material, where it stands when the scene begins.

    Give it a push, a wind, a path or a colour with ``dataclasses.replace``.
    """

    name: str
    material: str
    """A name from the material library."""
    vertices: Float[np.ndarray, "V 3"]
    """World position [m]."""
    triangles: Int[np.ndarray, "T 3"]
    """Vertex numbers, anticlockwise seen from outside."""
    velocity: Vector = ZERO_VELOCITY
    """At the start [m/s]."""
    push: Push | None = None
    wind: Wind | None = None
    path: Keyframes | None = None
    """Prescribed motion, as one rigid body."""
    colour: tuple[float, float, float, float] | None = None
    """Linear RGBA; None: as the material looks."""
    finish: Finish = field(default=Finish("plain"), kw_only=True)
    """How the material looks."""


def ball(
    material: str | MaterialEntry,
    radius: float,
    at: Vector | None = None,
    velocity: Vector = ZERO_VELOCITY,
    name: str = "ball",
) -> Solid:
    """Return a ball.

    Args:
        material: A name from the default library, or an entry of any library.
        radius: [m]
        at: Its centre [m]; None: it lies on the floor at the origin.
        velocity: At the start [m/s].
        name: What it is, in words.

    Raises:
        UnknownChoiceError: The library has no such material.
        UserError: The radius is not positive, or a number is not finite.
    """
    _check_lengths(name, radius=radius)
    at = (0.0, 0.0, radius) if at is None else at
    shape = trimesh.creation.icosphere(BALL_SUBDIVISIONS, radius)
    return _placed_solid(material, shape, at, velocity, name)


def box(
    material: str | MaterialEntry,
    size: Vector,
    at: Vector | None = None,
    velocity: Vector = ZERO_VELOCITY,
    name: str = "box",
) -> Solid:
    """Return a box whose sides are along the axes.

    Args:
        material: A name from the default library, or an entry of any library.
        size: Along x, y and z [m].
        at: Its centre [m]; None: it stands on the floor at the origin.
        velocity: At the start [m/s].
        name: What it is, in words.

    Raises:
        UnknownChoiceError: The library has no such material.
        UserError: A side is not positive, or a number is not finite.
    """
    width, depth, height = _checked_vector(name, "size", size)
    _check_lengths(name, width=width, depth=depth, height=height)
    at = (0.0, 0.0, height / 2) if at is None else at
    return _placed_solid(material, trimesh.creation.box(size), at, velocity, name)


def cylinder(
    material: str | MaterialEntry,
    radius: float,
    height: float,
    at: Vector | None = None,
    velocity: Vector = ZERO_VELOCITY,
    name: str = "cylinder",
) -> Solid:
    """Return an upright cylinder.

    Args:
        material: A name from the default library, or an entry of any library.
        radius: [m]
        height: [m]
        at: Its centre [m]; None: it stands on the floor at the origin.
        velocity: At the start [m/s].
        name: What it is, in words.

    Raises:
        UnknownChoiceError: The library has no such material.
        UserError: A length is not positive, or a number is not finite.
    """
    _check_lengths(name, radius=radius, height=height)
    at = (0.0, 0.0, height / 2) if at is None else at
    shape = trimesh.creation.cylinder(radius, height, sections=CYLINDER_SIDES_COUNT)
    return _placed_solid(material, shape, at, velocity, name)


def solid(
    material: str | MaterialEntry,
    vertices: Float[np.ndarray, "V 3"],
    triangles: Int[np.ndarray, "T 3"],
    velocity: Vector = ZERO_VELOCITY,
    name: str = "solid",
) -> Solid:
    """Return the body inside a closed triangle mesh.

    Args:
        material: A name from the default library, or an entry of any library.
        vertices: (V, 3) world positions [m].
        triangles: (T, 3) vertex numbers, anticlockwise seen from outside.
        velocity: At the start [m/s].
        name: What it is, in words.

    Raises:
        UnknownChoiceError: The library has no such material.
        UserError: The mesh is not closed or inside out, or a number is not finite.
    """
    vertices, triangles = np.asarray(vertices, float), np.asarray(triangles, np.int64)
    if not np.isfinite(vertices).all():
        raise UserError(f"{name} has a vertex that is not finite.")
    shape = trimesh.Trimesh(vertices, triangles, process=False)
    if not shape.is_watertight or shape.volume <= 0:
        raise UserError(
            f"{name} is not closed, or its triangles face inwards. Give every edge two triangles, "
            "anticlockwise seen from outside."
        )
    return _placed_solid(material, shape, ZERO_VELOCITY, velocity, name)


def build_scene(
    *solids: Solid, name: str = "scene", duration: float = 1.0, fps: int = 60, gravity: Vector = GRAVITY_VECTOR
) -> Scene:
    """Put solids into a scene above the floor.

    Args:
        solids: At least one; later doubles of a name are counted up ("ball", "ball_1").
        name: The scene's.
        duration: How long to watch [s].
        fps: Frames per second that are kept.
        gravity: [m/s²]

    Returns:
        A scene of one object per solid, in their order. Solids that stand in each other are named in its ``warnings``.

    Raises:
        UserError: There is no solid, one reaches below the floor, or a number makes no sense.
    """
    if not solids:
        raise UserError("A scene needs at least one solid: corporeal.ball('rubber', 0.03).")
    _check_lengths(name, duration=duration, fps=fps)
    gravity = _checked_vector(name, "gravity", gravity)
    for one in solids:
        _refuse_below_floor(one)
    names = unique_names([one.name for one in solids])
    made = Scene(
        name=name,
        source="built in Python",
        objects=tuple(_scene_object_of(one, called) for one, called in zip(solids, names, strict=True)),
        surfaces=tuple(_surface_of(one, k) for k, one in enumerate(solids)),
        finishes=tuple(_finish_of(one) for one in solids),
        gravity=gravity,
        duration=float(duration),
        fps=fps,
    )
    return _with_overlap_warnings(made)


def _placed_solid(
    material: str | MaterialEntry, shape: trimesh.Trimesh, at: Vector, velocity: Vector, name: str
) -> Solid:
    entry = material if isinstance(material, MaterialEntry) else find_material(material)
    return Solid(
        name=name,
        material=entry.name,
        vertices=np.array(shape.vertices, float) + _checked_vector(name, "at", at),
        triangles=np.array(shape.faces, np.int64),
        velocity=_checked_vector(name, "velocity", velocity),
        finish=default_finish(*entry.kin),
    )


def _finish_of(one: Solid) -> Finish:
    return replace(one.finish, name=one.name) if one.colour is None else Finish(one.name, one.colour)


def _scene_object_of(one: Solid, name: str) -> SceneObject:
    return SceneObject(
        name=name,
        class_name=one.name.replace("_", " "),
        real_extent=float(np.ptp(one.vertices, axis=0).max()),
        velocity=one.velocity,
        push=one.push,
        wind=one.wind,
        path=one.path,
        source="built in Python",
    )


def _surface_of(one: Solid, number: int) -> Surface:
    stated = {"substance": one.material}
    bare = Surface(one.name, number, number, one.vertices, one.triangles, extras=stated)
    return add_crease_normals(bare)


def _with_overlap_warnings(scene: Scene) -> Scene:
    names = [obj.name for obj in scene.objects]
    pairs = overlapping_objects(scene)
    overlaps = tuple(f"{names[a]} and {names[b]} overlap at the start." for a, b in pairs)
    return replace(scene, warnings=scene.warnings + overlaps)


def _check_lengths(name: str, **given: float) -> None:
    for what, value in given.items():
        if not (math.isfinite(value) and value > 0):
            raise UserError(f"The {what} of {name} is {value}. Give a positive number.")


def _checked_vector(name: str, what: str, given: Sequence[float]) -> Vector:
    numbers = tuple(map(float, given))
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise UserError(f"{what} of {name} is {given!r}. Give three finite numbers (x, y, z).")
    return numbers[0], numbers[1], numbers[2]


def _refuse_below_floor(one: Solid) -> None:
    depth = -float(one.vertices[:, 2].min())
    if depth > MAX_ROUNDOFF_DEPTH_M:
        raise UserError(
            f"{one.name} reaches {depth:.3g} m below the floor, which is at z = 0. Raise it with at=(x, y, z)."
        )
