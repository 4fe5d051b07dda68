"""Figure of object segmentation: colours, ground truth and prediction of points."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from corporeal.reconstruction.segment.optimal_assignment import optimal_assignment
from segmentation.objects_evaluation import ObjectsResult
from segmentation.parts_figure import number_colours, project_points
from segmentation.point_figures import save_point_figure
from segmentation.segmentation_scores import iou_matrix

COLUMN_TITLES = ("points of photographs", "identity", "superpoints", "components")

MAX_DRAWN_POINTS = 5000
"""Points of a scene that are drawn, about."""


def draw_objects(found: Sequence[ObjectsResult], path: Path) -> None:
    """Draw one row per scene."""
    figure = Figure(figsize=(10, 2.6 * len(found)), dpi=72, layout="constrained")
    grid = figure.subplots(len(found), len(COLUMN_TITLES), squeeze=False)
    for judged, axes in zip(found, grid, strict=True):
        row = judged.row
        truth = judged.taken.object_of_point
        place, order = project_points(judged.taken.cloud.position)
        order = order[:: max(1, len(order) // MAX_DRAWN_POINTS)]
        tints = (
            np.clip(judged.taken.cloud.colour, 0, 1),
            number_colours(truth, "tab10"),
            number_colours(_match_numbers(truth, judged.ours.object_of_point), "tab10"),
            number_colours(_match_numbers(truth, judged.components), "tab10"),
        )
        for axis, tint in zip(axes, tints, strict=True):
            axis.scatter(*place[order].T, s=2.0, c=tint[order], lw=0)
            axis.set(aspect="equal", xticks=[], yticks=[], frame_on=False)
        scores = ("", *(f"mean IoU {v:.2f}" for v in (row.identity, row.ours, row.components)))
        for axis, text in zip(axes, scores, strict=True):
            axis.set_xlabel(text, fontsize=8)
        axes[0].set_ylabel(row.scene.replace("_", " "), fontsize=9)
    for axis, title in zip(grid[0], COLUMN_TITLES, strict=True):
        axis.set_title(title, fontsize=9)
    save_point_figure(figure, path)


def _match_numbers(truth: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Return what was found the number of what it fits best; what fits nothing comes after."""
    count, known = int(found.max()) + 1, int(truth.max()) + 1
    number = optimal_assignment(iou_matrix(truth, found, known, count).T)
    left = number < 0
    number[left] = known + np.arange(left.sum())
    return number[found]
