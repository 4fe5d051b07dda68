"""Boxes of flat Gaussians, for tests that need a splat of known shape."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from corporeal.core.types import Gaussians
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT

SPACING = 0.014
"""Of Gaussians on their faces [m]."""
DOWN = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
"""Turns +z to -y, which is up in most files."""


def box(sides, middle, colour):
    """Flat Gaussians all over the faces of a box."""
    mean, rotation = [], []
    for axis in range(3):
        u, v = (a for a in range(3) if a != axis)
        inner = (sides[u] / 2 - SPACING, sides[v] / 2 - SPACING)  # their edges are soft
        grid = [np.linspace(-half, half, round(2 * half / SPACING) + 1) for half in inner]
        a, b = (x.ravel() for x in np.meshgrid(*grid))
        turn = Rotation.align_vectors([np.eye(3)[axis]], [[0, 0, 1]])[0].as_quat(scalar_first=True)
        for side in (-1, 1):
            place = np.zeros((len(a), 3))
            place[:, u], place[:, v], place[:, axis] = a, b, side * sides[axis] / 2
            mean.append(place + middle)
            rotation.append(np.tile(turn, (len(a), 1)))
    mean, rotation = np.concatenate(mean), np.concatenate(rotation)
    count = len(mean)
    return Gaussians(
        mean=mean.astype(np.float32),
        rotation=rotation.astype(np.float32),
        scale=np.tile(np.float32([0.6, 0.6, 0.1]) * np.float32(SPACING), (count, 1)),
        opacity=np.full(count, 0.98, np.float32),
        sh=np.tile(((np.float32(colour) - np.float32(0.5)) / np.float32(SH_DC_COEFFICIENT)), (count, 1, 1)),
    )


def together(*some):
    """Return several sets of Gaussians as one."""
    names = ("mean", "rotation", "scale", "opacity", "sh")
    return replace(some[0], **{n: np.concatenate([getattr(g, n) for g in some]) for n in names})
