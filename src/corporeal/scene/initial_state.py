"""Initial states of objects from the command line: lift and velocity."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import Scene, Vector
from corporeal.geometry.scene_transforms import move_scene

MAX_LIFT_M = 100.0
"""[m]"""
MAX_INITIAL_SPEED_M_S = 100.0
"""[m/s]"""


def parse_lift(text: str) -> tuple[str, float]:
    """Return name and metres of "duck=0.5".

    Raises:
        UserError: It says something else.
    """
    name, _, number = text.rpartition("=")
    (metres,) = _parse_numbers(number, 1) or (math.nan,)
    if not name or not 0.0 <= metres <= MAX_LIFT_M:
        raise UserError(f"--lift {text!r}: write NAME=METRES, for example duck=0.5.")
    return name, metres


def parse_initial_velocity(text: str) -> tuple[str, Vector]:
    """Return name and velocity [m/s] of "duck=1,0,-2".

    Raises:
        UserError: It says something else.
    """
    name, _, numbers = text.rpartition("=")
    said = _parse_numbers(numbers, 3)
    if not name or said is None or math.hypot(*said) > MAX_INITIAL_SPEED_M_S:
        raise UserError(
            f"--velocity {text!r}: write NAME=X,Y,Z in m/s, for example duck=1,0,-2; at most "
            f"{MAX_INITIAL_SPEED_M_S:g} m/s."
        )
    x, y, z = said
    return name, (x, y, z)


def with_initial_state(scene: Scene, lifts: Sequence[str], velocities: Sequence[str]) -> Scene:
    """Return a scene with the stated initial state of its objects.

    Args:
        scene: As it stands.
        lifts: Such as "duck=0.5": how far an object is raised [m].
        velocities: Such as "duck=1,0,-2" [m/s].

    Raises:
        UserError: There is no object of such a name.
    """
    for name, metres in map(parse_lift, lifts):
        scene = move_scene(scene, np.array([0.0, 0.0, metres]), _object_number(scene, name, "--lift"))
    for name, velocity in map(parse_initial_velocity, velocities):
        k = _object_number(scene, name, "--velocity")
        objects = list(scene.objects)
        objects[k] = replace(objects[k], velocity=velocity)
        scene = replace(scene, objects=tuple(objects))
    return scene


def _object_number(scene: Scene, name: str, option: str) -> int:
    names = [o.name for o in scene.objects]
    if name not in names:
        raise UserError(f"{option}: no object {name!r}. Choose one of: {', '.join(names)}.")
    return names.index(name)


def _parse_numbers(text: str, count: int) -> tuple[float, ...] | None:
    try:
        said = tuple(float(number) for number in text.split(","))
    except ValueError:
        return None
    return said if len(said) == count and all(map(math.isfinite, said)) else None
