"""What no object can change, so that no ray need be cast for it."""

import numpy as np
from jaxtyping import Float, Float32

from corporeal.render import kernels, kernels_ask
from corporeal.render.kernels_ask import WAYS
from corporeal.render.kernels_light import Lamps

LOWEST = 1e-3
"""Sine of the lowest sun whose shadows are followed."""
NEAREST = 1e-3
"""Of the way to a box: a corner that is nearer to the eye, or behind it, may be seen anywhere."""


def outlines(
    boxes: Float[np.ndarray, "B 2 3"],
    eye: Float[np.ndarray, "3"],
    frame: Float[np.ndarray, "3 3"],
    tangent: float,
    size: tuple[int, int],
) -> list[tuple[int, int, int, int]]:
    """Rows and columns of a picture that each box could be seen at: first, last, first, last.

    Args:
        boxes: Corners [m].
        eye: Where from [m].
        frame: Right, up and back of the camera, as rows.
        tangent: Of half the vertical field of view.
        size: Width and height [px].

    """
    width, height = size
    found = []
    for low, high in boxes.astype(np.float64):
        corners = np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(-1, 3)
        right, up, back = frame @ (corners - eye).T
        if (-back).min() <= NEAREST * np.abs(back).max():
            found.append((0, height, 0, width))
            continue
        row = (1 - up / -back / tangent) * height / 2
        column = (1 + right / -back / tangent * height / width) * width / 2
        rows, columns = np.clip(row, -1, height + 1), np.clip(column, -1, width + 1)
        top, left = max(int(rows.min()) - 1, 0), max(int(columns.min()) - 1, 0)
        found.append((top, int(rows.max()) + 2, left, int(columns.max()) + 2))
    return found


def ways(lamps: Lamps, sky: int) -> Float32[np.ndarray, "ways 3"]:
    """Where pixels of the floor look: to the sky, and last to the sun."""
    s = kernels.samples(1)
    s.normal[:, 2] = s.flat[:, 2] = 1.0
    up = np.empty((WAYS * sky, 3), np.float32)
    kernels_ask.look_up(s, sky, up)
    return np.concatenate([up, lamps.sun[None]])


def blur(lamps: Lamps, boxes: np.ndarray) -> float:
    """How much farther than along the middle of the sun a shadow may go on the floor [m]."""
    across, up = float(np.hypot(*lamps.sun[:2])), float(lamps.sun[2])
    lowest = max(up - lamps.softness, LOWEST)
    tall = float(boxes[:, 1, 2].max(initial=0.0)) - float(lamps.floor[3])
    return max(tall, 0.0) * lamps.softness * (1 + across / up) / lowest
