"""Moving a reconstruction to the poses of its objects in a scene."""

from dataclasses import replace

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import Reconstruction, Scene
from corporeal.geometry.scene_transforms import object_boxes


def repose_reconstruction(found: Reconstruction, scene: Scene) -> Reconstruction:
    """Return Gaussians and points where a scene's objects stand now, by the scene's numbers.

    Objects may have been moved and resized, but not turned. Floor and background stay. Others may stand beside those
    that were found.

    Raises:
        UserError: Not all that were found are in the scene.
    """
    names = [o.name for o in scene.objects]
    if not set(found.names) <= set(names):
        raise UserError(
            f"The scene has {', '.join(names)}, the reconstruction {', '.join(found.names)}. Reconstruct it again."
        )
    number = np.array([names.index(name) for name in found.names])
    before, after = found.boxes, object_boxes(scene)[number]
    factor = np.ptp(after, axis=1).max(axis=1) / np.ptp(before, axis=1).max(axis=1)
    shift = after[:, 0] - factor[:, None] * before[:, 0]
    # The last row is for what is no object's: -1.
    factor, shift = np.append(factor, 1.0), np.concatenate([shift, np.zeros((1, 3))])
    gaussians, cloud = found.gaussians, found.cloud
    of_gaussian, of_point = found.object_of_gaussian, found.object_of_point
    mean = factor[of_gaussian, None] * gaussians.mean + shift[of_gaussian]
    scale = factor[of_gaussian, None] * gaussians.scale
    kind = gaussians.mean.dtype
    position = factor[of_point, None] * cloud.position + shift[of_point]
    owner = np.append(number, -1)
    return replace(
        found,
        object_of_gaussian=owner[of_gaussian],
        object_of_point=owner[of_point],
        gaussians=replace(gaussians, mean=mean.astype(kind), scale=scale.astype(kind)),
        cloud=replace(cloud, position=position),
        boxes=after,
    )
