"""Figures on disk, drawn without a screen."""

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from corporeal.core.store import disk_errors


def save_figure(figure: Figure, path: Path) -> None:
    """Save a figure, in the format that the file's name says.

    Raises:
        DiskError: The disk refuses it.
    """
    FigureCanvasAgg(figure)
    with disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)
