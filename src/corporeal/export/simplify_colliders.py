"""Simplification of convex colliders."""

from dataclasses import replace

from corporeal.core.errors import UserError
from corporeal.export.exported_solids import ConvexCollider, ExportedSolid, PhysicalScene
from corporeal.geometry.convex_hull import simplify_convex
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh

PHYSX_GPU_MAX_CORNERS, PHYSX_CPU_MAX_CORNERS = 64, 255
"""Corners of a convex mesh that PhysX simulates on a GPU, and on a processor; it cooks
others anew.
"""
ENCLOSING_BOX_CORNERS = 8
"""Corners of the box that every hull is cut from."""


def solid_colliders(solid: ExportedSolid) -> tuple[ConvexCollider, ...]:
    """Return all convex shapes of a solid."""
    return (*solid.pieces, *([solid.hull] if solid.hull else []))


def simplify_colliders(scene: PhysicalScene, most: int) -> tuple[PhysicalScene, float]:
    """Enclose every collider of more corners in one of so many; 0: leave all as they are.

    Returns:
        The scene, and how far the farthest corner is from the hull that it stands for [m].

    Raises:
        UserError: There are too few corners to be had.
    """
    if most == 0:
        return scene, 0.0
    if most < ENCLOSING_BOX_CORNERS:
        raise UserError(f"--hull-vertices is {most}. A hull needs {ENCLOSING_BOX_CORNERS}; 0 leaves all as it is.")
    thickened = [0.0]

    def few(collider: ConvexCollider) -> ConvexCollider:
        made = simplify_convex(collider.shape, most)
        if made is not collider.shape:
            held = QueryMesh(Mesh(collider.shape.vertices, collider.shape.triangles))
            thickened.append(float(held.closest(made.vertices)[0].max()))
        return replace(collider, shape=made)

    solids = tuple(replace(s, pieces=tuple(map(few, s.pieces)), hull=s.hull and few(s.hull)) for s in scene.solids)
    return replace(scene, solids=solids), max(thickened)
