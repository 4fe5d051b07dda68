"""A diagram of the paths of objects' centres: what pictures at a few instants alias, it shows."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw, ImageFont

from corporeal.evaluation.judge.filmed_motion import FilmedMotion
from corporeal.evaluation.judge.staging import SIZE, Staging
from corporeal.render import colours
from corporeal.render.camera import Aim, axes

TICK = 0.05
"""Between two dots on a path [s]."""
STEP = 1.0 / 120
"""Between two corners of a line [s]."""
MARGIN = 26
"""[px]"""
ROOM = 1.3
"""Extent of the diagram over that of the reference's motion."""
INK, FAINT = (40, 40, 40), (190, 190, 190)


@dataclass(frozen=True)
class Frame2d:
    """A rectangle of the plane that the camera faces: along its right, and upwards [m]."""

    low: Float[np.ndarray, "2"]
    scale: float
    """[px/m]"""

    def pixels(self, flat: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
        """Return where points are in the picture; outside they stick to its edge."""
        x = MARGIN + (flat[:, 0] - self.low[0]) * self.scale
        y = SIZE[1] - MARGIN - (flat[:, 1] - self.low[1]) * self.scale
        return np.stack([np.clip(x, 2, SIZE[0] - 3), np.clip(y, 2, SIZE[1] - 3)], axis=1)


def path_picture(film: FilmedMotion, staging: Staging, camera: Aim) -> UInt8[np.ndarray, "H W 3"]:
    """Draw where every object's centre of mass goes, as seen along a level line of sight.

    Args:
        film: What moves.
        staging: Whose reference sets the diagram's extent.
        camera: Gives the side from which it is seen.

    """
    right = axes(np.subtract(camera.eye, camera.target))[0]
    flatten = np.stack([right, [0.0, 0.0, 1.0]])
    fine = np.append(np.arange(0.0, staging.end, STEP), staging.end)
    centre = film.centres(fine) @ flatten.T
    frame = _frame(staging, flatten)
    image = Image.new("RGB", SIZE, "white")
    draw = ImageDraw.Draw(image)
    _floor(draw, frame)
    font = ImageFont.load_default(size=11)
    for k, thing in enumerate(film.prepared.scene.objects):
        shade = colours.OBJECTS[k % len(colours.OBJECTS)]
        corners = frame.pixels(centre[:, k])
        draw.line([tuple(c) for c in corners.tolist()], fill=shade, width=2)
        ticks = np.searchsorted(fine, np.arange(0.0, staging.end + 1e-9, TICK))
        for x, y in corners[np.minimum(ticks, len(fine) - 1)].tolist():
            draw.ellipse((x - 3, y - 3, x + 3, y + 3), fill=shade)
        x, y = corners[0].tolist()
        draw.ellipse((x - 6, y - 6, x + 6, y + 6), outline=shade, width=2)
        draw.text((8 + 130 * (k % 3), 4 + 13 * (k // 3)), thing.name, fill=shade, font=font)
    return np.asarray(image)


def _frame(staging: Staging, flatten: Float[np.ndarray, "2 3"]) -> Frame2d:
    """Fit the reference's boxes, with the floor, into the picture."""
    flat = staging.reel.boxes.reshape(-1, 3) @ flatten.T
    flat = flat[np.isfinite(flat).all(axis=1)]
    low, high = flat.min(axis=0), flat.max(axis=0)
    middle, half = (low + high) / 2, ROOM * np.maximum((high - low) / 2, 1e-6)
    low, high = middle - half, middle + half
    low[1], high[1] = 0.0, max(high[1], 1e-6)
    inner = np.subtract(SIZE, 2 * MARGIN)
    scale = float((inner / (high - low)).min())
    low[0] -= (inner[0] / scale - (high[0] - low[0])) / 2
    return Frame2d(low, scale)


def _floor(draw: ImageDraw.ImageDraw, frame: Frame2d) -> None:
    """Draw the floor and a bar of a round length."""
    level = SIZE[1] - MARGIN
    draw.line((0, level, SIZE[0], level), fill=FAINT, width=1)
    length = next(s for s in (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.0) if s * frame.scale < 130)
    draw.line((10, SIZE[1] - 8, 10 + length * frame.scale, SIZE[1] - 8), fill=INK, width=3)
    words = f"{length * 100:g} cm; floor: grey line; a dot every {TICK:g} s"
    font = ImageFont.load_default(size=11)
    draw.text((18 + length * frame.scale, SIZE[1] - 15), words, fill=INK, font=font)
