"""What a judge is shown of a film in one look."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import UInt8

from corporeal.core.machine import cores
from corporeal.lab.evaluation.judge.filmed_motion import FilmedMotion
from corporeal.lab.evaluation.judge.path_picture import path_picture
from corporeal.lab.evaluation.judge.staging import CLOSE, DATED, SIZE, TURNS, Staging
from corporeal.render import key
from corporeal.render.camera import Aim
from corporeal.render.embree import render
from corporeal.render.stage import Light, Stage

PICTURES = DATED + CLOSE + 1


class TakenSingly(Sequence[np.ndarray]):
    """Pictures each of which is rendered when somebody first looks at it."""

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


def shown(film: FilmedMotion, staging: Staging, look: int) -> Sequence[UInt8[np.ndarray, "H W 3"]]:
    """Show a film: dated pictures, close-ups, and the diagram of its paths.

    Args:
        film: What moves.
        staging: When and from where.
        look: Which of ``TURNS``.

    Returns:
        ``PICTURES`` pictures, each rendered when it is looked at.

    """
    stage = Stage(film.prepared.scene, Light(front=staging.view))
    wide = staging.wide(look)

    def picture(time: float, camera: Aim, words: str) -> np.ndarray:
        posed = stage.posed(*film.cast.skin.pose(film.at(time)))
        return key.caption(render(posed, camera, "draft", cores()), words)

    dated = [
        partial(picture, time, wide, f"{number}   t = {time:.3f} s")
        for number, time in enumerate(staging.times.tolist(), 1)
    ]
    close = [
        partial(picture, c.time, staging.near(c, look), f"close   t = {c.time:.3f} s")
        for c in staging.closes
    ]
    return TakenSingly([*dated, *close, partial(path_picture, film, staging, wide)])


def how(look: int) -> str:
    """Say in words how the pictures of a look are taken; recordings compare this."""
    size = f"{SIZE[0]} x {SIZE[1]}"
    return f"{DATED} dated pictures, {CLOSE} close-ups, paths; {size}; turned {TURNS[look]:+g}°"
