"""Figures that a reconstruction from photographs leaves, for the report."""

from pathlib import Path

from corporeal.reconstruction.masks_figure import FIGURE as OBJECTS
from corporeal.reconstruction.sfm.pose import FIGURE as CAMERAS
from corporeal.reconstruction.sfm.pose import POSES


def figures_in(folder: Path) -> dict[str, Path]:
    """Name what was drawn in a reconstruction's folder, by what it shows."""
    drawn = {
        "What was taken for objects, in some of the photographs": folder / OBJECTS,
        "Where the photographs were taken from": folder / POSES / CAMERAS,
    }
    return {caption: path for caption, path in drawn.items() if path.exists()}
