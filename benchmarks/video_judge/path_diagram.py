"""A diagram of objects' centres: their paths, and their heights over time.

What pictures at a few instants alias, as bounces, it shows.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt8
from PIL import Image, ImageDraw, ImageFont

from corporeal.render import colours
from corporeal.render.camera_placement import CameraAim, camera_axes
from video_judge.camera_staging import PICTURE_SIZE_PX, Staging
from video_judge.video_motion import VideoMotion

DOT_INTERVAL_S = 0.05
"""Between two dots on a path [s]."""
CORNER_INTERVAL_S = 1.0 / 120
"""Between two corners of a line [s]."""
PANEL_MARGIN_PX, RIGHT_PANEL_LEFT_PX, PANEL_TOP_PX, PANEL_BOTTOM_PX = (12, 200, 34, PICTURE_SIZE_PX[1] - 24)
"""Empty edges of the panels, where the right one begins, and their upper and lower ends [px]."""
SCALE_BAR_LENGTHS_M = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
"""Of the bar [m]."""
EXTENT_MARGIN_RATIO = 1.3
"""Extent of the diagram over that of the reference's motion."""
INK_RGB, FAINT_RGB = (40, 40, 40), (190, 190, 190)


@dataclass(frozen=True)
class DiagramPanel:
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
        y = PANEL_BOTTOM_PX - (flat[:, 1] - self.low[1]) * self.scale[1]
        return np.stack([np.clip(x, self.left, self.right), np.clip(y, 2, PICTURE_SIZE_PX[1] - 3)], axis=1)


def path_diagram(video: VideoMotion, staging: Staging, camera: CameraAim) -> UInt8[np.ndarray, "H W 3"]:
    """Draw where every object's centre of mass goes, and on the right its height over time.

    Args:
        video: What moves.
        staging: Whose reference sets the diagram's extent.
        camera: Gives the side from which the paths are seen, along a level line of sight.

    """
    right = camera_axes(np.subtract(camera.eye, camera.target))[0]
    flatten = np.stack([right, [0.0, 0.0, 1.0]])
    fine = np.append(np.arange(0.0, staging.end, CORNER_INTERVAL_S), staging.end)
    ticks = np.searchsorted(fine, np.arange(0.0, staging.end + 1e-9, DOT_INTERVAL_S))
    ticks = np.minimum(ticks, len(fine) - 1)
    centre = video.centres(fine)
    paths, heights = _panels(staging, flatten)
    image = Image.new("RGB", PICTURE_SIZE_PX, "white")
    draw = ImageDraw.Draw(image)
    _axes(draw, paths, heights, staging.end)
    for k, thing in enumerate(video.prepared.scene.objects):
        shade = colours.OBJECT_COLOURS[k % len(colours.OBJECT_COLOURS)]
        _curve(draw, paths.pixels(centre[:, k] @ flatten.T), ticks, shade)
        over = np.stack([fine, centre[:, k, 2]], axis=1)
        _curve(draw, heights.pixels(over), ticks, shade)
        x, y = paths.pixels(centre[:1, k] @ flatten.T)[0].tolist()
        draw.ellipse((x - 6, y - 6, x + 6, y + 6), outline=shade, width=2)
        draw.text((8 + 130 * (k % 3), 4 + 13 * (k // 3)), thing.name, fill=shade, font=_font())
    return np.asarray(image)


def _curve(
    draw: ImageDraw.ImageDraw, corners: Float[np.ndarray, "N 2"], ticks: Int[np.ndarray, " K"], shade: str
) -> None:
    draw.line([(x, y) for x, y in corners.tolist()], fill=shade, width=2)
    for x, y in corners[ticks].tolist():
        draw.ellipse((x - 2, y - 2, x + 2, y + 2), fill=shade)


def _panels(staging: Staging, flatten: Float[np.ndarray, "2 3"]) -> tuple[DiagramPanel, DiagramPanel]:
    """Fit the reference's boxes, with the floor, into the left panel; heights get its scale."""
    flat = staging.reel.boxes.reshape(-1, 3) @ flatten.T
    flat = flat[np.isfinite(flat).all(axis=1)]
    low, high = flat.min(axis=0), flat.max(axis=0)
    middle, wide = (low[0] + high[0]) / 2, EXTENT_MARGIN_RATIO * max(high[0] - low[0], 1e-6)
    tall = EXTENT_MARGIN_RATIO * max(high[1], 1e-6)
    scale = float(min((RIGHT_PANEL_LEFT_PX - 2 * PANEL_MARGIN_PX) / wide, (PANEL_BOTTOM_PX - PANEL_TOP_PX) / tall))
    start = middle - (RIGHT_PANEL_LEFT_PX - 2 * PANEL_MARGIN_PX) / scale / 2
    paths = DiagramPanel(
        PANEL_MARGIN_PX, RIGHT_PANEL_LEFT_PX - PANEL_MARGIN_PX, np.array([start, 0.0]), np.array([scale, scale])
    )
    time = (PICTURE_SIZE_PX[0] - RIGHT_PANEL_LEFT_PX - 2 * PANEL_MARGIN_PX) / max(staging.end, 1e-9)
    upright = (PANEL_BOTTOM_PX - PANEL_TOP_PX) / tall
    heights = DiagramPanel(
        RIGHT_PANEL_LEFT_PX + PANEL_MARGIN_PX,
        PICTURE_SIZE_PX[0] - PANEL_MARGIN_PX,
        np.zeros(2),
        np.array([time, upright]),
    )
    return paths, heights


def _axes(draw: ImageDraw.ImageDraw, paths: DiagramPanel, heights: DiagramPanel, end: float) -> None:
    """Draw the floor, a bar of a round length, and the axis of time."""
    draw.line((0, PANEL_BOTTOM_PX, PICTURE_SIZE_PX[0], PANEL_BOTTOM_PX), fill=FAINT_RGB, width=1)
    draw.line((RIGHT_PANEL_LEFT_PX, PANEL_TOP_PX, RIGHT_PANEL_LEFT_PX, PICTURE_SIZE_PX[1]), fill=FAINT_RGB, width=1)
    length = next(
        (s for s in SCALE_BAR_LENGTHS_M if s * paths.scale[0] < RIGHT_PANEL_LEFT_PX / 2), SCALE_BAR_LENGTHS_M[-1]
    )
    bar, level = length * float(paths.scale[0]), PICTURE_SIZE_PX[1] - 8
    draw.line((8, level, 8 + bar, level), fill=INK_RGB, width=3)
    draw.text((14 + bar, level - 7), f"{length * 100:g} cm", fill=INK_RGB, font=_font())
    draw.text((RIGHT_PANEL_LEFT_PX + 6, level - 7), f"height over time, 0 to {end:.2g} s", fill=INK_RGB, font=_font())
    top = heights.low[1] + (PANEL_BOTTOM_PX - PANEL_TOP_PX) / heights.scale[1]
    draw.text((RIGHT_PANEL_LEFT_PX + 6, PANEL_TOP_PX - 2), f"top: {100 * top:.3g} cm", fill=FAINT_RGB, font=_font())


def _font() -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size=11)
