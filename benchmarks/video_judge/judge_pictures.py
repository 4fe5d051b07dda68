"""Pictures of a video for one look of a judge."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import UInt8

from corporeal.core.process_resources import usable_cores
from corporeal.render import video_overlay
from corporeal.render.camera_placement import CameraAim
from corporeal.render.embree import render_image
from corporeal.render.ray_scene import RayScene, StudioLight
from video_judge.camera_staging import (
    CLOSE_UP_PICTURES,
    DATED_PICTURES,
    LOOK_TURNS_DEG,
    PICTURE_SIZE_PX,
    Staging,
)
from video_judge.path_diagram import path_diagram
from video_judge.video_motion import VideoMotion

PICTURES_PER_LOOK = DATED_PICTURES + CLOSE_UP_PICTURES + 1


class SequentialPictures(Sequence[np.ndarray]):
    """Pictures that are rendered on first access."""

    def __init__(self, takes: Sequence[Callable[[], np.ndarray]]) -> None:
        self._takes = takes
        self._taken: dict[int, np.ndarray] = {}

    def __len__(self) -> int:
        return len(self._takes)

    def __getitem__(self, index) -> Any:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        number = range(len(self))[index]
        if number not in self._taken:
            self._taken[number] = self._takes[number]()
        return self._taken[number]


def judge_pictures(video: VideoMotion, staging: Staging, look: int) -> Sequence[UInt8[np.ndarray, "H W 3"]]:
    """Show a video: dated pictures, close-ups, and the diagram of its paths.

    Args:
        video: What moves.
        staging: When and from where.
        look: Which of ``LOOK_TURNS_DEG``.

    Returns:
        ``PICTURES_PER_LOOK`` pictures, each rendered when it is looked at.

    """
    stage = RayScene(video.prepared.scene, StudioLight(front=staging.view))
    wide = staging.wide(look)

    def picture(time: float, camera: CameraAim, words: str) -> np.ndarray:
        posed = stage.posed(*video.cast.skin.pose(video.at(time)))
        return video_overlay.draw_caption(render_image(posed, camera, "draft", usable_cores()), words)

    dated = [
        partial(picture, time, wide, f"{number}   t = {time:.3f} s")
        for number, time in enumerate(staging.times.tolist(), 1)
    ]
    close = [partial(picture, c.time, staging.near(c, look), f"close   t = {c.time:.3f} s") for c in staging.closes]
    return SequentialPictures([*dated, *close, partial(path_diagram, video, staging, wide)])


def pictures_description(look: int) -> str:
    """Describe in words how the pictures of a look are taken; recordings compare this."""
    size = f"{PICTURE_SIZE_PX[0]} x {PICTURE_SIZE_PX[1]}"
    turned = f"turned {LOOK_TURNS_DEG[look]:+g}°"
    return f"{DATED_PICTURES} dated pictures, {CLOSE_UP_PICTURES} close-ups, paths; {size}; {turned}"
