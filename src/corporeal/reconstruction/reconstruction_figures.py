"""Figures of a reconstruction for the report."""

from pathlib import Path

from corporeal.reconstruction.masks_figure import MASKS_FIGURE_FILE as OBJECTS
from corporeal.reconstruction.sfm.find_poses import CAMERAS_FIGURE_FILE as CAMERAS
from corporeal.reconstruction.sfm.find_poses import POSES_FOLDER


def figures_of_reconstruction(folder: Path) -> dict[str, Path]:
    """Name what was drawn in a reconstruction's folder, by what it shows."""
    drawn = {
        "Masks of objects in some of the photographs": folder / OBJECTS,
        "Where the photographs were taken from": folder / POSES_FOLDER / CAMERAS,
    }
    return {caption: path for caption, path in drawn.items() if path.exists()}
