"""Downscaling of pictures with their cameras."""

from dataclasses import replace

import numpy as np
from PIL import Image

from corporeal.core.types import Camera, Views


def reduce_views(views: Views, longest: int) -> Views:
    """Return the views with no side longer than so many pixels."""
    height, width = views.rgb.shape[1:3]
    share = min(1.0, longest / max(height, width))
    size = max(1, round(width * share)), max(1, round(height * share))
    if size == (width, height):
        return views
    small = [Image.fromarray(p).resize(size, Image.Resampling.BOX) for p in views.rgb]
    cameras = tuple(_resize_camera(c, *size) for c in views.cameras)
    return Views(np.stack([np.asarray(p) for p in small]), cameras)


def _resize_camera(camera: Camera, width: int, height: int) -> Camera:
    stretch = np.diag([width / camera.width, height / camera.height, 1.0])
    return replace(camera, K=stretch @ camera.K, width=width, height=height)
