"""Points on objects from a radiance field that is learned beside Gaussians."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Int

from corporeal.core.types import Views
from corporeal.reconstruction.gaussians.foreground import covered, near
from corporeal.reconstruction.gaussians.intake import Intake
from corporeal.reconstruction.gaussians.radiance import FieldConfig, Learned, Points, learn, points


def field_points(
    taken: Intake,
    of_objects: Int[np.ndarray, " M"],
    most: int,
    config: FieldConfig,
    checkpoint: Path | None = None,
    progress: Callable[[float, str], None] = lambda fraction, words: None,
) -> tuple[Learned, Points]:
    """Learn a field of the objects, and take points from where it is dense and Gaussians agree.

    Args:
        taken: Pictures, or a splat that is pictured; masks where there are any.
        of_objects: Its Gaussians that belong to objects.
        most: No more points than that.
        config: How to learn.
        checkpoint: Where what was learned is kept.
        progress: Called with the fraction done and what is being done.

    Raises:
        UserError: Cameras, pictures and masks do not belong together.

    """
    gaussians, cameras, masks = taken.gaussians, taken.cameras, taken.masks
    masks = covered(gaussians, cameras, of_objects) if masks is None else masks
    views = Views(np.stack(taken.pictures()), cameras)
    learned = learn(views, masks, config, checkpoint, progress)
    at = partial(near, gaussians, of_objects)
    return learned, points(learned.field, cameras, most, config.seed, at)
