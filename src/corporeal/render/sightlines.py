"""From where a film shows what happens: rays from the camera to every object, against surfaces.

Boxes cannot tell a bowl from a block. Where the usual direction leaves an object behind or inside
of another one for most of the time, others are tried, also from higher up.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import Vector
from corporeal.render.camera import Aim, place
from corporeal.render.look import TRANSMIT
from corporeal.render.stage import Stage

HIDDEN = 0.6
"""Share of an object that the usual direction may hide, as a mean over time [-]."""
GAIN = 0.15
"""What another direction has to show more, as a mean over all objects [-]."""
TURNS = (0.0, -25.0, 25.0, -50.0, 50.0)
"""About the vertical [degrees]."""
HEIGHTS = (20.0, 40.0, 55.0)
"""Above the horizon [degrees]."""
DEAR = 0.04, 0.05
"""What 25° of turn and a step of height cost, so that the usual direction is kept [-]."""
POINTS = 120
"""Places on each object that are looked for, at most."""


def clear_view(
    stages: Sequence[Stage],
    object_of_vertex: Int[np.ndarray, " V"],
    boxes: Float[np.ndarray, "F B 2 3"],
    size: tuple[int, int],
) -> Vector | None:
    """Return a direction to film from in place of the usual one; None: that one is good.

    Args:
        stages: The scene at a few instants.
        object_of_vertex: Which object each vertex of its surfaces belongs to.
        boxes: What the camera keeps in the picture [m].
        size: Of the picture [px].

    """
    places = _places(object_of_vertex)
    if len(places) < 2:
        return None
    usual = place(boxes, size)
    hidden = _hidden(stages, object_of_vertex, places, usual)
    if hidden.max() <= HIDDEN:
        return None
    best, least = None, float(hidden.mean()) - GAIN
    for view, cost in _directions(usual):
        cost += float(_hidden(stages, object_of_vertex, places, place(boxes, size, view)).mean())
        if cost < least:
            best, least = view, cost
    return best


def _places(object_of_vertex: np.ndarray) -> list[np.ndarray]:
    """Choose some vertices of each object."""
    members = [np.flatnonzero(object_of_vertex == k) for k in np.unique(object_of_vertex)]
    return [m[np.linspace(0, len(m) - 1, min(len(m), POINTS)).astype(int)] for m in members]


def _directions(usual: Aim) -> list[tuple[Vector, float]]:
    """Directions about the usual one, and what each costs [-]."""
    back = np.subtract(usual.eye, usual.target)
    round_about = float(np.arctan2(back[1], back[0]))
    found = []
    for step, height in enumerate(np.radians(HEIGHTS)):
        for turn in TURNS:
            angle = round_about + np.radians(turn)
            flat = np.cos(height)
            view = (flat * np.cos(angle), flat * np.sin(angle), np.sin(height))
            cost = DEAR[0] * abs(turn) / 25.0 + DEAR[1] * step
            found.append(((float(view[0]), float(view[1]), float(view[2])), cost))
    return found


def _hidden(
    stages: Sequence[Stage], object_of_vertex: np.ndarray, places: list[np.ndarray], aim: Aim
) -> Float[np.ndarray, " B"]:
    """Share of each object that others hide from a camera, as a mean over instants [-]."""
    shares = [[_share(stage, object_of_vertex, mine, aim) for mine in places] for stage in stages]
    return np.mean(shares, axis=0)


def _share(stage: Stage, object_of_vertex: np.ndarray, mine: np.ndarray, aim: Aim) -> float:
    eye = (np.asarray(aim.eye) - stage.origin).astype(np.float32)
    rays = np.ascontiguousarray(stage.vertices[mine] - eye)
    prim, _, _, far = stage.hit(np.tile(eye, (len(rays), 1)), rays)
    met = prim >= 0
    met[met] = far[met] < 1.0 - 1e-3  # at 1 a ray arrives
    look, struck = stage.look, prim[met]
    opaque = look.finish[look.finish_of_triangle[struck], TRANSMIT] <= 0.5
    owner = object_of_vertex[look.triangles[struck, 0]]
    return float((opaque & (owner != object_of_vertex[mine[0]])).sum() / len(mine))
