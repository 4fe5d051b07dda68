"""A diagram of objects' centres: their paths, and their heights over time.

What pictures at a few instants alias, as bounces, it shows.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt8
from PIL import Image, ImageDraw, ImageFont

from corporeal.lab.evaluation.judge.filmed_motion import FilmedMotion
from corporeal.lab.evaluation.judge.staging import SIZE, Staging
from corporeal.render import colours
from corporeal.render.camera import Aim, axes

TICK = 0.05
"""Between two dots on a path [s]."""
STEP = 1.0 / 120
"""Between two corners of a line [s]."""
EDGE, SPLIT, TOP, FLOOR = 12, 200, 34, SIZE[1] - 24
"""Empty edges of the panels, where the right one begins, and their upper and lower ends [px]."""
LENGTHS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
"""Of the bar [m]."""
ROOM = 1.3
"""Extent of the diagram over that of the reference's motion."""
INK, FAINT = (40, 40, 40), (190, 190, 190)


@dataclass(frozen=True)
class Panel:
    """A rectangle of the picture, and what its lower left corner and a pixel stand for."""

    left: int
    """[px]"""
    right: int
    """[px]"""
    low: Float[np.ndarray, "2"]
    """Of the quantities along and up."""
    scale: Float[np.ndarray, "2"]
    """Pixels for a unit of either."""

    def pixels(self, flat: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
        """Return where points are in the picture; outside they stick to the panel's edge."""
        x = self.left + (flat[:, 0] - self.low[0]) * self.scale[0]
        y = FLOOR - (flat[:, 1] - self.low[1]) * self.scale[1]
        return np.stack([np.clip(x, self.left, self.right), np.clip(y, 2, SIZE[1] - 3)], axis=1)


def path_picture(film: FilmedMotion, staging: Staging, camera: Aim) -> UInt8[np.ndarray, "H W 3"]:
    """Draw where every object's centre of mass goes, and on the right its height over time.

    Args:
        film: What moves.
        staging: Whose reference sets the diagram's extent.
        camera: Gives the side from which the paths are seen, along a level line of sight.

    """
    right = axes(np.subtract(camera.eye, camera.target))[0]
    flatten = np.stack([right, [0.0, 0.0, 1.0]])
    fine = np.append(np.arange(0.0, staging.end, STEP), staging.end)
    ticks = np.searchsorted(fine, np.arange(0.0, staging.end + 1e-9, TICK))
    ticks = np.minimum(ticks, len(fine) - 1)
    centre = film.centres(fine)
    paths, heights = _panels(staging, flatten)
    image = Image.new("RGB", SIZE, "white")
    draw = ImageDraw.Draw(image)
    _axes(draw, paths, heights, staging.end)
    for k, thing in enumerate(film.prepared.scene.objects):
        shade = colours.OBJECTS[k % len(colours.OBJECTS)]
        _curve(draw, paths.pixels(centre[:, k] @ flatten.T), ticks, shade)
        over = np.stack([fine, centre[:, k, 2]], axis=1)
        _curve(draw, heights.pixels(over), ticks, shade)
        x, y = paths.pixels(centre[:1, k] @ flatten.T)[0].tolist()
        draw.ellipse((x - 6, y - 6, x + 6, y + 6), outline=shade, width=2)
        draw.text((8 + 130 * (k % 3), 4 + 13 * (k // 3)), thing.name, fill=shade, font=_font())
    return np.asarray(image)


def _curve(
    draw: ImageDraw.ImageDraw,
    corners: Float[np.ndarray, "N 2"],
    ticks: Int[np.ndarray, " K"],
    shade: str,
) -> None:
    draw.line([(x, y) for x, y in corners.tolist()], fill=shade, width=2)
    for x, y in corners[ticks].tolist():
        draw.ellipse((x - 2, y - 2, x + 2, y + 2), fill=shade)


def _panels(staging: Staging, flatten: Float[np.ndarray, "2 3"]) -> tuple[Panel, Panel]:
    """Fit the reference's boxes, with the floor, into the left panel; heights get its scale."""
    flat = staging.reel.boxes.reshape(-1, 3) @ flatten.T
    flat = flat[np.isfinite(flat).all(axis=1)]
    low, high = flat.min(axis=0), flat.max(axis=0)
    middle, wide = (low[0] + high[0]) / 2, ROOM * max(high[0] - low[0], 1e-6)
    tall = ROOM * max(high[1], 1e-6)
    scale = float(min((SPLIT - 2 * EDGE) / wide, (FLOOR - TOP) / tall))
    start = middle - (SPLIT - 2 * EDGE) / scale / 2
    paths = Panel(EDGE, SPLIT - EDGE, np.array([start, 0.0]), np.array([scale, scale]))
    time = (SIZE[0] - SPLIT - 2 * EDGE) / max(staging.end, 1e-9)
    upright = (FLOOR - TOP) / tall
    heights = Panel(SPLIT + EDGE, SIZE[0] - EDGE, np.zeros(2), np.array([time, upright]))
    return paths, heights


def _axes(draw: ImageDraw.ImageDraw, paths: Panel, heights: Panel, end: float) -> None:
    """Draw the floor, a bar of a round length, and the axis of time."""
    draw.line((0, FLOOR, SIZE[0], FLOOR), fill=FAINT, width=1)
    draw.line((SPLIT, TOP, SPLIT, SIZE[1]), fill=FAINT, width=1)
    length = next((s for s in LENGTHS if s * paths.scale[0] < SPLIT / 2), LENGTHS[-1])
    bar, level = length * float(paths.scale[0]), SIZE[1] - 8
    draw.line((8, level, 8 + bar, level), fill=INK, width=3)
    draw.text((14 + bar, level - 7), f"{length * 100:g} cm", fill=INK, font=_font())
    draw.text((SPLIT + 6, level - 7), f"height over time, 0 to {end:.2g} s", fill=INK, font=_font())
    top = heights.low[1] + (FLOOR - TOP) / heights.scale[1]
    draw.text((SPLIT + 6, TOP - 2), f"top: {100 * top:.3g} cm", fill=FAINT, font=_font())


def _font() -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size=11)
