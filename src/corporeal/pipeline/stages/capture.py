"""Capture: posed views of a scene at rest, with depth, normals and object ids.

The cameras are spread evenly over a hemisphere, each as near as possible with every object in view. Deterministic.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from corporeal.core.errors import UserError
from corporeal.core.process_resources import usable_cores
from corporeal.core.progress import Progress, no_progress
from corporeal.core.types import Camera, Scene, Views
from corporeal.geometry.scene_transforms import object_boxes
from corporeal.render.camera_placement import VIEW_DIRECTION, CameraAim, camera_from_aim, fit_cameras_around
from corporeal.render.embree import first_seen, render_image
from corporeal.render.kernels_hits import HIT_NOTHING
from corporeal.render.ray_scene import RayScene, StudioLight

PICTURE_FILL_FRACTION = 0.9
"""Maximum share of the picture that objects cover."""
MAX_TOTAL_PIXELS = 2**28
"""Pixels of all views together."""


@dataclass(frozen=True)
class CaptureConfig:
    """Number, size and quality of pictures."""

    views: int = 24
    """Number of cameras around the scene."""
    size: tuple[int, int] = (256, 256)
    """Width and height [px]."""
    quality: Literal["draft", "normal", "fine"] = "draft"
    """Rays per pixel for colour; depth, normals and object ids are exact at any quality."""
    threads: int | None = None
    """Threads; None: one per core."""


DEFAULT_CONFIG = CaptureConfig()


def capture(scene: Scene, config: CaptureConfig = DEFAULT_CONFIG, progress: Progress = no_progress) -> Views:
    """Render views of a scene and its floor from a hemisphere.

    Raises:
        UserError: The scene is empty, or a setting is out of range.
    """
    _check(scene, config)
    progress(0.0, "placing the cameras")
    aims = fit_cameras_around(object_boxes(scene)[None], config.views, config.size, PICTURE_FILL_FRACTION)
    return render_views(scene, aims, config, progress)


def render_views(
    scene: Scene,
    aims: Sequence[CameraAim],
    config: CaptureConfig = DEFAULT_CONFIG,
    progress: Progress = no_progress,
) -> Views:
    """Render views of a scene from given cameras; all have one size.

    Args:
        scene: At rest.
        aims: Of the cameras, which take the place of ``views`` and ``size`` of the configuration.
        config: Quality and threads.
        progress: Called with the fraction done and a description.
    """
    stage = RayScene(scene, StudioLight(front=VIEW_DIRECTION))  # shadows are the same in all views
    shape = (len(aims), aims[0].height, aims[0].width)
    views = Views(
        rgb=np.empty((*shape, 3), np.uint8),
        cameras=tuple(camera_from_aim(aim) for aim in aims),
        depth=np.empty(shape, np.float32),
        normals=np.empty((*shape, 3), np.float32),
        object_of_pixel=np.empty(shape, np.int32),
        part_of_pixel=np.empty(shape, np.int32),
    )

    def take(k: int) -> None:
        # One thread a picture: the renderer's bands depend on how many there are.
        views.rgb[k] = render_image(stage, aims[k], config.quality, threads=1)
        _measure(scene, stage, aims[k], views, k)

    with ThreadPoolExecutor(config.threads or usable_cores()) as pool:
        for k, _ in enumerate(pool.map(take, range(len(aims)))):
            progress((k + 1) / len(aims), f"view {k + 1} of {len(aims)}")
    return views


def ray_length_per_depth(camera: Camera) -> Float[np.ndarray, "H W"]:
    """Return the length of each pixel's ray per metre of depth [-]."""
    u, v = np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5
    K = camera.K
    x, y = (u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1]
    return np.sqrt(1 + x[None] ** 2 + y[:, None] ** 2)


def _measure(scene: Scene, stage: RayScene, aim: CameraAim, views: Views, k: int) -> None:
    """Fill in what is not colour."""
    seen = first_seen(stage, aim)
    shape = aim.height, aim.width
    nothing = (seen.kind == HIT_NOTHING).reshape(shape)
    depth = seen.depth.reshape(shape) / ray_length_per_depth(views.cameras[k])
    counts = [len(s.triangles) for s in scene.surfaces]
    surface_of_triangle = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
    part = np.where(seen.triangle < 0, -1, surface_of_triangle[seen.triangle]).reshape(shape)
    owner = np.array([*(s.object for s in scene.surfaces), -1], np.int32)
    assert views.depth is not None and views.normals is not None
    assert views.object_of_pixel is not None and views.part_of_pixel is not None
    views.depth[k] = np.where(nothing, np.inf, depth)
    views.normals[k] = np.where(nothing[..., None], 0, seen.flat.reshape(*shape, 3))
    views.part_of_pixel[k] = part
    views.object_of_pixel[k] = owner[part]


def _check(scene: Scene, config: CaptureConfig) -> None:
    if not any(len(s.triangles) for s in scene.surfaces):
        raise UserError(f"{scene.name} holds no surface to render.")
    width, height = config.size
    if config.views < 1 or min(width, height) < 8:
        raise UserError("Ask for at least 1 view, and for pictures of at least 8 × 8 pixels.")
    if config.views * width * height > MAX_TOTAL_PIXELS:
        raise UserError(
            f"{config.views} views of {width} × {height} pixels do not fit into memory. "
            f"Ask for at most {MAX_TOTAL_PIXELS >> 20} million pixels in all."
        )
