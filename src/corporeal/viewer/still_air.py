"""Air about all objects of a scene, so that any can be blown at."""

from dataclasses import replace

from corporeal.types import Scene, Wind

CALM = 1e-3
"""Air that hardly moves [m/s]: it gives every object its faces for a wind to come."""


def in_air(scene: Scene) -> Scene:
    """Return a scene all of whose objects can be blown at."""
    air = Wind((CALM, 0.0, 0.0))
    return replace(
        scene, objects=tuple(o if o.wind else replace(o, wind=air) for o in scene.objects)
    )
