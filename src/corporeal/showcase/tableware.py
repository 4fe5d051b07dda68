"""Liquids and their vessels: a tumbler, honey, ketchup; and a wooden ball."""

from dataclasses import replace

import numpy as np

from corporeal.showcase import parametric_surfaces
from corporeal.showcase.prop_mesh import PropMesh, PropModel, PropPart, plain_finish


def tumbler() -> PropModel:
    """Model a glass, 10 cm tall and 7 cm across, wall 3 mm: three fifths full of water."""
    outside = [(0.0, 0.0), (0.030, 0.0), (0.034, 0.004), (0.035, 0.098), (0.0345, 0.1)]
    inside = [(0.0325, 0.1), (0.032, 0.098), (0.031, 0.012), (0.027, 0.008), (0.0, 0.008)]
    profile = np.concatenate(
        [
            parametric_surfaces.soften_corners(outside, 4),
            parametric_surfaces.soften_corners(inside, 4),
        ]
    )
    pale = plain_finish("clear glass", "#dcecf0", 0.05)
    look = replace(pale, colour=(*pale.colour[:3], 0.1), alpha_mode="BLEND")
    wall = PropPart(
        "glass",
        parametric_surfaces.lathe_surface(profile, 72),
        look,
        "glass",
        contents="water",
        fill=0.6,
    )
    return PropModel("tumbler", (wall,))


def honey() -> PropModel:
    """Model what leaves a jar at once: a column of honey, 4 cm across and 9 cm tall."""
    look = plain_finish("honey", "#d98a12", 0.1)
    return PropModel("honey", (PropPart("honey", _upright_cylinder(0.020, 0.09), look, "honey"),))


def ketchup() -> PropModel:
    """Model ketchup as a cup leaves it that is lifted off: 6 cm across and 6 cm tall."""
    look = plain_finish("ketchup", "#b3170f", 0.15)
    return PropModel(
        "ketchup", (PropPart("ketchup", _upright_cylinder(0.030, 0.06), look, "ketchup"),)
    )


def wooden_ball() -> PropModel:
    """Model a ball of beech, 5 cm across."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 37)
    profile = 0.025 * np.stack([np.cos(t), np.sin(t)], 1)
    profile[[0, -1], 0] = 0
    mesh = parametric_surfaces.lathe_surface(profile, 72).moved((0, 0, 0.025))
    return PropModel(
        "wooden_ball", (PropPart("ball", mesh, plain_finish("beech", "#c99a63", 0.5), "hardwood"),)
    )


def _upright_cylinder(radius: float, height: float) -> PropMesh:
    """Turn an upright cylinder with rounded edges."""
    edge = 0.1 * radius
    profile = [(0.0, 0.0), (radius - edge, 0.0), (radius, edge), (radius, height - edge)]
    profile += [(radius - edge, height), (0.0, height)]
    return parametric_surfaces.lathe_surface(parametric_surfaces.soften_corners(profile, 4), 64)
