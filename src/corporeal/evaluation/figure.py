"""Figures on disk, drawn without a screen."""

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from corporeal.store import writing


def keep(figure: Figure, path: Path) -> None:
    """Save a figure, in the format that the file's name says.

    Raises:
        DiskError: The disk refuses it.

    """
    FigureCanvasAgg(figure)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)
