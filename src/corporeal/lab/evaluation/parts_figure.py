"""Objects as points: what they look like, their parts, the clusters, and the parts found."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from corporeal.lab.evaluation.figure import keep_points
from corporeal.lab.evaluation.parts import Judged

FROM = (0.75, -0.55, 0.38)
"""Direction from the object to who looks at it."""
WIDE = 44
"""Letters below a picture."""
COLUMNS = ("points of photographs", "true parts", "clusters", "parts found by their names")


def draw(found: Sequence[Judged], path: Path) -> None:
    """Draw one row per object."""
    figure = Figure(figsize=(11, 2.9 * len(found)), dpi=110, layout="constrained")
    grid = figure.subplots(len(found), len(COLUMNS), squeeze=False)
    for judged, axes in zip(found, grid, strict=True):
        row = judged.row
        place, order = seen(judged.taken.cloud.position)
        shades = (
            np.clip(judged.taken.cloud.colour, 0, 1),
            tinted(judged.truth, "tab10"),
            tinted(judged.cluster_of_point, "tab20"),
            tinted(judged.part_of_point, "tab10"),
        )
        for axis, shade in zip(axes, shades, strict=True):
            axis.scatter(*place[order].T, s=1.2, c=shade[order], lw=0)
            axis.set(aspect="equal", xticks=[], yticks=[], frame_on=False)
        labels = (
            "",
            fill(", ".join(row.parts), WIDE),
            f"{row.clusters}",
            f"mean IoU {row.named_iou:.2f}",
        )
        for axis, text in zip(axes, labels, strict=True):
            axis.set_xlabel(text, fontsize=7)
        axes[0].set_ylabel(row.object, fontsize=9)
    for axis, title in zip(grid[0], COLUMNS, strict=True):
        axis.set_title(title, fontsize=9)
    keep_points(figure, path)


def seen(position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where points are drawn, and which first: the far ones."""
    towards = np.array(FROM) / np.linalg.norm(FROM)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    return position @ np.stack([right, np.cross(towards, right)], axis=1), np.argsort(
        position @ towards
    )


def tinted(number: np.ndarray, palette: str) -> np.ndarray:
    """Return a colour for every number, red, green and blue."""
    colours = np.asarray(colormaps[palette].colors)  # pyright: ignore[reportAttributeAccessIssue]
    return colours[number % len(colours)]
