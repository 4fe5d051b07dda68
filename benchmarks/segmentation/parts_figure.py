"""Figure of part segmentation: colours, ground truth, clusters and prediction."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from segmentation.parts_evaluation import PartsResult
from segmentation.point_figures import save_point_figure

VIEW_DIRECTION = (0.75, -0.55, 0.38)
"""Direction from the object to who looks at it."""
CAPTION_CHARACTERS = 44
"""Letters below a picture."""
COLUMN_TITLES = ("points of photographs", "true parts", "clusters", "parts found by their names")


def draw_parts(found: Sequence[PartsResult], path: Path) -> None:
    """Draw one row per object."""
    figure = Figure(figsize=(11, 2.9 * len(found)), dpi=110, layout="constrained")
    grid = figure.subplots(len(found), len(COLUMN_TITLES), squeeze=False)
    for judged, axes in zip(found, grid, strict=True):
        row = judged.row
        place, order = project_points(judged.taken.cloud.position)
        shades = (
            np.clip(judged.taken.cloud.colour, 0, 1),
            number_colours(judged.truth, "tab10"),
            number_colours(judged.cluster_of_point, "tab20"),
            number_colours(judged.part_of_point, "tab10"),
        )
        for axis, shade in zip(axes, shades, strict=True):
            axis.scatter(*place[order].T, s=1.2, c=shade[order], lw=0)
            axis.set(aspect="equal", xticks=[], yticks=[], frame_on=False)
        labels = (
            "",
            fill(", ".join(row.parts), CAPTION_CHARACTERS),
            f"{row.clusters}",
            f"mean IoU {row.named_iou:.2f}",
        )
        for axis, text in zip(axes, labels, strict=True):
            axis.set_xlabel(text, fontsize=7)
        axes[0].set_ylabel(row.object, fontsize=9)
    for axis, title in zip(grid[0], COLUMN_TITLES, strict=True):
        axis.set_title(title, fontsize=9)
    save_point_figure(figure, path)


def project_points(position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where points are drawn, and which first: the far ones."""
    towards = np.array(VIEW_DIRECTION) / np.linalg.norm(VIEW_DIRECTION)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    return position @ np.stack([right, np.cross(towards, right)], axis=1), np.argsort(position @ towards)


def number_colours(number: np.ndarray, palette: str) -> np.ndarray:
    """Return a colour for every number, red, green and blue."""
    colours = np.asarray(colormaps[palette].colors)  # pyright: ignore[reportAttributeAccessIssue]
    return colours[number % len(colours)]
