"""Points on objects from a radiance field that is learned beside Gaussians."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Int

from corporeal.core.types import Views
from corporeal.reconstruction.gaussians.foreground import pixels_covered, places_near_objects
from corporeal.reconstruction.gaussians.gaussian_scene import GaussianScene
from corporeal.reconstruction.gaussians.radiance_field import (
    FieldPoints,
    RadianceFieldConfig,
    TrainedField,
    field_surface_points,
    train_field,
)


def radiance_field_points(
    taken: GaussianScene,
    of_objects: Int[np.ndarray, " M"],
    most: int,
    config: RadianceFieldConfig,
    checkpoint: Path | None = None,
    progress: Callable[[float, str], None] = lambda fraction, words: None,
) -> tuple[TrainedField, FieldPoints]:
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
    masks = pixels_covered(gaussians, cameras, of_objects) if masks is None else masks
    views = Views(np.stack(taken.pictures()), cameras)
    learned = train_field(views, masks, config, checkpoint, progress)
    at = partial(places_near_objects, gaussians, of_objects)
    return learned, field_surface_points(learned.field, cameras, most, config.seed, at)
