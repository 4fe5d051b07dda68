"""What liquids are held by, and liquids: a tumbler, honey, ketchup; and a wooden ball."""

from dataclasses import replace

import numpy as np

from corporeal.showcase import shape
from corporeal.showcase.mesh import Mesh, Model, Part, plain


def tumbler() -> Model:
    """Model a glass, 10 cm tall and 7 cm across, wall 3 mm: three fifths full of water."""
    outside = [(0.0, 0.0), (0.030, 0.0), (0.034, 0.004), (0.035, 0.098), (0.0345, 0.1)]
    inside = [(0.0325, 0.1), (0.032, 0.098), (0.031, 0.012), (0.027, 0.008), (0.0, 0.008)]
    profile = np.concatenate([shape.soften(outside, 4), shape.soften(inside, 4)])
    pale = plain("clear glass", "#dcecf0", 0.05)
    look = replace(pale, colour=(*pale.colour[:3], 0.1), alpha_mode="BLEND")
    wall = Part("glass", shape.lathe(profile, 72), look, "glass", contents="water", fill=0.6)
    return Model("tumbler", (wall,))


def honey() -> Model:
    """Model what leaves a jar at once: a column of honey, 4 cm across and 9 cm tall."""
    look = plain("honey", "#d98a12", 0.1)
    return Model("honey", (Part("honey", _column(0.020, 0.09), look, "honey"),))


def ketchup() -> Model:
    """Model ketchup as a cup leaves it that is lifted off: 6 cm across and 6 cm tall."""
    look = plain("ketchup", "#b3170f", 0.15)
    return Model("ketchup", (Part("ketchup", _column(0.030, 0.06), look, "ketchup"),))


def wooden_ball() -> Model:
    """Model a ball of beech, 5 cm across."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 37)
    profile = 0.025 * np.stack([np.cos(t), np.sin(t)], 1)
    profile[[0, -1], 0] = 0
    mesh = shape.lathe(profile, 72).moved((0, 0, 0.025))
    return Model("wooden_ball", (Part("ball", mesh, plain("beech", "#c99a63", 0.5), "hardwood"),))


def _column(radius: float, height: float) -> Mesh:
    """Turn an upright cylinder with rounded edges."""
    edge = 0.1 * radius
    profile = [(0.0, 0.0), (radius - edge, 0.0), (radius, edge), (radius, height - edge)]
    profile += [(radius - edge, height), (0.0, height)]
    return shape.lathe(shape.soften(profile, 4), 64)
