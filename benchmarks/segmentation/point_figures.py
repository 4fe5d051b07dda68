"""Figures of many small points."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from corporeal.core.store import disk_errors
from corporeal.lab.evaluation.figure_files import save_figure

PALETTE_COLOURS = 256
"""Colours of a PNG that takes a byte for each pixel."""


def save_point_figure(figure: Figure, path: Path) -> None:
    """Save a figure of many small points: a PNG with a palette, a third of one without.

    Raises:
        DiskError: The disk refuses it.

    """
    if path.suffix.lower() != ".png":
        save_figure(figure, path)
        return
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    with disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        drawn.quantize(PALETTE_COLOURS, dither=Image.Dither.NONE).save(path, "PNG", optimize=True)
