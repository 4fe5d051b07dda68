"""Convex colliders of few corners, for engines that take no more."""

from dataclasses import replace

from corporeal.core.errors import UserError
from corporeal.export.solids import Collider, PhysicalScene, Solid
from corporeal.geometry.convex_thinning import thinned
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.shape import Shape

ON_CARD, ON_PROCESSOR = 64, 255
"""Corners of a convex mesh that PhysX simulates on a graphics card, and on a processor; it cooks
others anew."""
LEAST = 8
"""Corners of the box that every hull is cut from."""


def colliders(solid: Solid) -> tuple[Collider, ...]:
    """Return all convex shapes of a solid."""
    return (*solid.pieces, *([solid.hull] if solid.hull else []))


def with_few_corners(scene: PhysicalScene, most: int) -> tuple[PhysicalScene, float]:
    """Enclose every collider of more corners in one of so many; 0: leave all as they are.

    Returns:
        The scene, and how far the farthest corner is from the hull that it stands for [m].

    Raises:
        UserError: There are too few corners to be had.

    """
    if most == 0:
        return scene, 0.0
    if most < LEAST:
        raise UserError(f"--hull-vertices is {most}. A hull needs {LEAST}; 0 leaves all as it is.")
    thickened = [0.0]

    def few(collider: Collider) -> Collider:
        made = thinned(collider.shape, most)
        if made is not collider.shape:
            held = Shape(Mesh(collider.shape.vertices, collider.shape.triangles))
            thickened.append(float(held.closest(made.vertices)[0].max()))
        return replace(collider, shape=made)

    solids = tuple(
        replace(s, pieces=tuple(map(few, s.pieces)), hull=s.hull and few(s.hull))
        for s in scene.solids
    )
    return replace(scene, solids=solids), max(thickened)
