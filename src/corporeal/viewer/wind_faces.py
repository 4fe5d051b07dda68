"""Surface faces of all objects, for wind in live simulations."""

from dataclasses import replace

from corporeal.core.types import Scene, Wind

CALM_AIR = Wind((1e-3, 0.0, 0.0), start=float("inf"))
"""Gives every object its faces for a wind to come, and acts at no time: what air at rest takes from what moves is not
in the run either, and costs half of a step where meshes have many faces."""


def with_wind_faces(scene: Scene) -> Scene:
    """Return a scene all of whose objects can be blown at."""
    return replace(scene, objects=tuple(o if o.wind else replace(o, wind=CALM_AIR) for o in scene.objects))
