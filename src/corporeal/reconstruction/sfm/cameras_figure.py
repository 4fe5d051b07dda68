"""Figure of cameras and points, from above and from the side."""

from pathlib import Path

import numpy as np

from corporeal.core.store import disk_errors
from corporeal.io.photos.posed_photos import PosedPhotos
from corporeal.multiview.up_direction import estimate_up_direction
from corporeal.multiview.viewed_region import find_viewed_region

MAX_DRAWN_POINTS = 20_000
"""Points that are drawn."""
DRAWN_RADII = 3.0
"""Radii of the cameras' places within which points are drawn."""


def cameras_figure(seen: PosedPhotos, path: Path) -> None:
    """Draw where photographs were taken from."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # takes long to import
    from matplotlib.figure import Figure

    cameras = seen.views.cameras
    up = estimate_up_direction(cameras).up
    across = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    across /= np.linalg.norm(across)
    frame = np.stack([across, np.cross(up, across), up])
    centre = np.array(find_viewed_region(cameras).centre)
    eyes = (np.stack([c.world_from_camera[:3, 3] for c in cameras]) - centre) @ frame.T
    ahead = np.stack([c.world_from_camera[:3, 2] for c in cameras]) @ frame.T
    reach = DRAWN_RADII * float(np.linalg.norm(eyes, axis=1).mean())
    points = np.zeros((0, 3)) if seen.points is None else (seen.points - centre) @ frame.T
    colours = np.zeros((0, 3)) if seen.colours is None else seen.colours / 255
    near = np.flatnonzero(np.linalg.norm(points, axis=1) < reach)
    near = near[:: max(1, len(near) // MAX_DRAWN_POINTS)]
    figure = Figure(figsize=(10, 5), layout="constrained")
    FigureCanvasAgg(figure)
    for place, (x, y, title) in enumerate(((0, 1, "from above"), (0, 2, "from the side"))):
        axes = figure.add_subplot(1, 2, place + 1)
        axes.scatter(points[near, x], points[near, y], s=1, c=colours[near], linewidths=0)
        arrows = 0.15 * reach / DRAWN_RADII * ahead
        axes.quiver(
            eyes[:, x], eyes[:, y], arrows[:, x], arrows[:, y],
            angles="xy", scale_units="xy", scale=1, width=0.004, color="#c0392b",
        )  # fmt: skip
        axes.plot(eyes[:, x], eyes[:, y], "o", markersize=3, color="#c0392b")
        axes.set_title(f"{len(cameras)} photographs {title}")
        axes.set_aspect("equal")
        axes.set_axis_off()
    with disk_errors(path):
        figure.savefig(path, dpi=110)
