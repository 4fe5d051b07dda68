"""Settings of the video: camera, size and quality."""

import math
from dataclasses import dataclass
from typing import Literal

from corporeal.core.errors import UserError, check_range
from corporeal.core.types import Vector
from corporeal.render.video_choices import CameraShot, ColourQuantity

MIN_SPEED_RATIO, MAX_SPEED_RATIO = 0.01, 100.0
MAX_SLOW_MOTION_RATIO = 100.0


@dataclass(frozen=True)
class VideoConfig:
    """Camera, size and quality of the video."""

    width: int = 1280
    """Width of the video [px]."""
    height: int = 720
    """Height of the video [px]."""
    quality: Literal["draft", "normal", "fine"] = "draft"
    """Rays per pixel; draft reuses the background where no object affects it, and supersamples edges."""
    speed: float = 1.0
    """Playback speed; 1: real time, 0.25: quarter speed."""
    view: Vector | None = None
    """Direction from the scene to the camera; by default one in which objects hide little of each other."""
    stills: bool = False
    """Also keep every frame as PNG."""
    look: Literal["surfaces", "gaussians"] | None = None
    """What is rendered; by default Gaussians where the scene was reconstructed, else surfaces."""
    colour_by: Literal["itself", "speed"] | ColourQuantity = "itself"
    """Quantity shown by colour, with a colour bar; itself: the objects' own colours."""
    shot: CameraShot = "wide"
    """wide: everything within 2.5 sizes of the scene; close: the first contact or the largest motion; follow: the
    camera tracks what moves.
    """
    slow: float = 1.0
    """Slow-motion factor around the first contact: 1 is none, 4 is four times slower."""
    caption: bool = True
    """Overlay the simulated time."""


def validate(config: VideoConfig) -> None:
    """Raise UserError where a setting is invalid for any scene."""
    from corporeal.render.video_file import (
        check_size,  # imports the encoder, which the help does not need
    )

    check_size(config.width, config.height)
    check_range("--speed", config.speed, MIN_SPEED_RATIO, MAX_SPEED_RATIO)
    check_range("--slow", config.slow, 1.0, MAX_SLOW_MOTION_RATIO)
    if config.view is not None and not 0 < math.hypot(*config.view) < math.inf:
        given = " ".join(f"{x:g}" for x in config.view)
        raise UserError(f"--view is {given}, which is not a direction. For example: --view 1 -1 0.5.")
