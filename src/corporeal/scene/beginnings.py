"""How objects begin: raised above where they stand, and with a velocity, as a person says."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import Scene, Vector
from corporeal.geometry.arrangement import moved

HIGHEST = 100.0
"""[m]"""
FASTEST = 100.0
"""[m/s]"""


def said_lift(text: str) -> tuple[str, float]:
    """Return name and metres of "duck=0.5".

    Raises:
        UserError: It says something else.

    """
    name, _, number = text.rpartition("=")
    (metres,) = _numbers(number, 1) or (math.nan,)
    if not name or not 0.0 <= metres <= HIGHEST:
        raise UserError(f"--lift {text!r}: write NAME=METRES, for example duck=0.5.")
    return name, metres


def said_velocity(text: str) -> tuple[str, Vector]:
    """Return name and velocity [m/s] of "duck=1,0,-2".

    Raises:
        UserError: It says something else.

    """
    name, _, numbers = text.rpartition("=")
    said = _numbers(numbers, 3)
    if not name or said is None or math.hypot(*said) > FASTEST:
        raise UserError(
            f"--velocity {text!r}: write NAME=X,Y,Z in m/s, for example duck=1,0,-2; at most "
            f"{FASTEST:g} m/s."
        )
    x, y, z = said
    return name, (x, y, z)


def begun(scene: Scene, lifts: Sequence[str], velocities: Sequence[str]) -> Scene:
    """Return a scene whose objects begin as was said of them.

    Args:
        scene: As it stands.
        lifts: Such as "duck=0.5": how far an object is raised [m].
        velocities: Such as "duck=1,0,-2" [m/s].

    Raises:
        UserError: There is no object of such a name.

    """
    for name, metres in map(said_lift, lifts):
        scene = moved(scene, np.array([0.0, 0.0, metres]), _numbered(scene, name, "--lift"))
    for name, velocity in map(said_velocity, velocities):
        k = _numbered(scene, name, "--velocity")
        objects = list(scene.objects)
        objects[k] = replace(objects[k], velocity=velocity)
        scene = replace(scene, objects=tuple(objects))
    return scene


def _numbered(scene: Scene, name: str, option: str) -> int:
    names = [o.name for o in scene.objects]
    if name not in names:
        raise UserError(f"{option}: no object {name!r}. Choose one of: {', '.join(names)}.")
    return names.index(name)


def _numbers(text: str, count: int) -> tuple[float, ...] | None:
    try:
        said = tuple(float(number) for number in text.split(","))
    except ValueError:
        return None
    return said if len(said) == count and all(map(math.isfinite, said)) else None
