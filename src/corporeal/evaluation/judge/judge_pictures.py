"""What a judge is shown of a film in one look."""

import numpy as np
from jaxtyping import UInt8

from corporeal.evaluation.judge.filmed_motion import FilmedMotion
from corporeal.evaluation.judge.path_picture import path_picture
from corporeal.evaluation.judge.staging import CLOSE, DATED, SIZE, TURNS, Staging
from corporeal.machine import cores
from corporeal.render import key
from corporeal.render.camera import Aim
from corporeal.render.embree import Light, Stage, render

PICTURES = DATED + CLOSE + 1


def shown(
    film: FilmedMotion, staging: Staging, look: int
) -> tuple[UInt8[np.ndarray, "H W 3"], ...]:
    """Render a film: dated pictures, close-ups, and the diagram of its paths.

    Args:
        film: What moves.
        staging: When and from where.
        look: Which of ``TURNS``.

    """
    stage = Stage(film.prepared.scene, Light(front=staging.view))
    wide = staging.wide(look)

    def picture(time: float, camera: Aim, words: str) -> np.ndarray:
        posed = stage.posed(*film.cast.skin.pose(film.at(time)))
        return key.caption(render(posed, camera, "draft", cores()), words)

    dated = [
        picture(time, wide, f"{number}   t = {time:.3f} s")
        for number, time in enumerate(staging.times.tolist(), 1)
    ]
    close = [
        picture(c.time, staging.near(c, look), f"close   t = {c.time:.3f} s")
        for c in staging.closes
    ]
    return (*dated, *close, path_picture(film, staging, wide))


def how(look: int) -> str:
    """Say in words how the pictures of a look are taken; recordings compare this."""
    size = f"{SIZE[0]} x {SIZE[1]}"
    return f"{DATED} dated pictures, {CLOSE} close-ups, paths; {size}; turned {TURNS[look]:+g}°"
