"""Plain shapes that stand for things: closed bodies as they look from outside, and open vessels."""

from collections.abc import Callable

import numpy as np
import trimesh
from trimesh.creation import box, icosphere, revolve, torus

SECTIONS = 40
"""Sides of what is round."""
LEG = 0.045
"""Legs of tables and chairs are so thick [m]."""


def shape(text: str) -> trimesh.Trimesh:
    """Make the mesh that a line of the list describes.

    Args:
        text: Bodies, separated by semicolons: a kind, its sizes, and where it stands along x, up
            and along y; all in metres. "turned" has the outline of a whole body of revolution
            instead: radius and height of each of its points.

    """
    return trimesh.util.concatenate([_body(one.split()) for one in text.split(";")])


def _body(words: list[str]) -> trimesh.Trimesh:
    numbers = [float(w) for w in words[1:]]
    if words[0] == "turned":
        return _turned(*zip(numbers[::2], numbers[1::2], strict=True))
    make, count = KINDS[words[0]]
    if words[0] == "ball" and len(numbers) == 1:
        numbers *= 3
    x, up, y = ([*numbers[count:], 0.0, 0.0, 0.0])[:3]
    return make(*numbers[:count]).apply_translation((x, y, up))


def block(length: float, width: float, height: float) -> trimesh.Trimesh:
    """Return a box that stands on the floor [m]."""
    return box((length, width, height)).apply_translation((0, 0, height / 2))


def _turned(*profile: tuple[float, float]) -> trimesh.Trimesh:
    return revolve(np.array(profile), sections=SECTIONS)


def _cone(low: float, high: float, height: float) -> trimesh.Trimesh:
    return _turned((0, 0), (low, 0), (high, height), (0, height))


def _drum(radius: float, height: float) -> trimesh.Trimesh:
    return _cone(radius, radius, height)


def _cup(radius: float, height: float, wall: float) -> trimesh.Trimesh:
    inner = radius - wall
    outside = [(0.0, 0.0), (radius, 0.0), (radius, height)]
    return _turned(*outside, (inner, height), (inner, wall), (0.0, wall))


def _ball(a: float, b: float, c: float) -> trimesh.Trimesh:
    return icosphere(3).apply_scale((a, b, c)).apply_translation((0, 0, c))


def _ring(radius: float, tube: float) -> trimesh.Trimesh:
    return torus(radius, tube).apply_translation((0, 0, tube))


def _table(length: float, width: float, height: float, top: float) -> trimesh.Trimesh:
    x, y = 0.45 * length, 0.45 * width
    legs = [block(LEG, LEG, height - top).apply_translation((i * x, j * y, 0)) for i in (-1, 1) for j in (-1, 1)]
    board = block(length, width, top).apply_translation((0, 0, height - top))
    return trimesh.util.concatenate([*legs, board])


def _chair(width: float, height: float) -> trimesh.Trimesh:
    back = block(width, 0.025, height / 2).apply_translation((0, 0.45 * width, height / 2))
    return trimesh.util.concatenate([_table(width, width, height / 2, 0.025), back])


KINDS: dict[str, tuple[Callable[..., trimesh.Trimesh], int]] = {
    "box": (block, 3),
    "drum": (_drum, 2),
    "cone": (_cone, 3),
    "ball": (_ball, 3),
    "cup": (_cup, 3),
    "ring": (_ring, 2),
    "table": (_table, 4),
    "chair": (_chair, 2),
}
"""Word → how to make it, and how many sizes it has."""
