"""View directions without occlusion, tested by rays to every object.

Boxes cannot tell a bowl from a block. Where the usual direction leaves an object behind or inside of another one for
most of the time, others are tried, also from higher up.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import Vector
from corporeal.render.camera_placement import CameraAim, fit_camera
from corporeal.render.packed_scene import TRANSMIT
from corporeal.render.ray_scene import RayScene

MAX_HIDDEN_FRACTION = 0.6
"""Share of an object that the usual direction may hide, as a mean over time [-]."""
MIN_VISIBILITY_GAIN = 0.15
"""What another direction has to show more, as a mean over all objects [-]."""
TURNS_DEG = (0.0, -25.0, 25.0, -50.0, 50.0)
"""About the vertical [degrees]."""
ELEVATIONS_DEG = (20.0, 40.0, 55.0)
"""Above the horizon [degrees]."""
DEVIATION_COSTS = 0.04, 0.05
"""What 25° of turn and a step of height cost, so that the usual direction is kept [-]."""
MAX_POINTS_PER_OBJECT = 120
"""Places on each object that are looked for, at most."""


def unoccluded_view(
    stages: Sequence[RayScene],
    object_of_vertex: Int[np.ndarray, " V"],
    boxes: Float[np.ndarray, "F B 2 3"],
    size: tuple[int, int],
) -> Vector | None:
    """Return a view direction in place of the usual one; None: that one is good.

    Args:
        stages: The scene at a few instants.
        object_of_vertex: Which object each vertex of its surfaces belongs to.
        boxes: What the camera keeps in the picture [m].
        size: Of the picture [px].
    """
    places = _sample_vertices(object_of_vertex)
    if len(places) < 2:
        return None
    usual = fit_camera(boxes, size)
    hidden = _hidden_fractions(stages, object_of_vertex, places, usual)
    if hidden.max() <= MAX_HIDDEN_FRACTION:
        return None
    best, least = None, float(hidden.mean()) - MIN_VISIBILITY_GAIN
    for view, cost in _directions(usual):
        cost += float(_hidden_fractions(stages, object_of_vertex, places, fit_camera(boxes, size, view)).mean())
        if cost < least:
            best, least = view, cost
    return best


def _sample_vertices(object_of_vertex: np.ndarray) -> list[np.ndarray]:
    """Choose some vertices of each object."""
    members = [np.flatnonzero(object_of_vertex == k) for k in np.unique(object_of_vertex)]
    return [m[np.linspace(0, len(m) - 1, min(len(m), MAX_POINTS_PER_OBJECT)).astype(int)] for m in members]


def _directions(usual: CameraAim) -> list[tuple[Vector, float]]:
    """Directions about the usual one, and what each costs [-]."""
    back = np.subtract(usual.eye, usual.target)
    round_about = float(np.arctan2(back[1], back[0]))
    found = []
    for step, height in enumerate(np.radians(ELEVATIONS_DEG)):
        for turn in TURNS_DEG:
            angle = round_about + np.radians(turn)
            flat = np.cos(height)
            view = (flat * np.cos(angle), flat * np.sin(angle), np.sin(height))
            cost = DEVIATION_COSTS[0] * abs(turn) / 25.0 + DEVIATION_COSTS[1] * step
            found.append(((float(view[0]), float(view[1]), float(view[2])), cost))
    return found


def _hidden_fractions(
    stages: Sequence[RayScene], object_of_vertex: np.ndarray, places: list[np.ndarray], aim: CameraAim
) -> Float[np.ndarray, " B"]:
    """Share of each object that others hide from a camera, as a mean over instants [-]."""
    shares = [[_hidden_fraction(stage, object_of_vertex, mine, aim) for mine in places] for stage in stages]
    return np.mean(shares, axis=0)


def _hidden_fraction(stage: RayScene, object_of_vertex: np.ndarray, mine: np.ndarray, aim: CameraAim) -> float:
    eye = (np.asarray(aim.eye) - stage.origin).astype(np.float32)
    rays = np.ascontiguousarray(stage.vertices[mine] - eye)
    prim, _, _, far = stage.hit(np.tile(eye, (len(rays), 1)), rays)
    met = prim >= 0
    met[met] = far[met] < 1.0 - 1e-3  # at 1 a ray arrives
    look, struck = stage.look, prim[met]
    opaque = look.finish[look.finish_of_triangle[struck], TRANSMIT] <= 0.5
    owner = object_of_vertex[look.triangles[struck, 0]]
    return float((opaque & (owner != object_of_vertex[mine[0]])).sum() / len(mine))
