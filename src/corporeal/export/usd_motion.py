"""The layer ``motion.usda``: time samples only; one time code is one frame of the film."""

from functools import partial

from corporeal.export.motion import Motion, Shapes
from corporeal.export.solids import PhysicalScene, Solid
from corporeal.export.usd_geometry import WORLD, surface_name
from corporeal.io.usd_text import Prim, text, vector, vectors

POINT = partial(vectors, digits=6)
"""Vertices to a millionth of the solid's size."""
NORMAL = partial(vectors, digits=3)
"""Normals to a thousandth of a radian."""


def motion_prims(scene: PhysicalScene, motion: Motion) -> Prim:
    """Return where rigid things are, and the shapes of soft ones, at every frame."""
    world = Prim("", WORLD)
    shapes = motion.shapes([s for s in scene.solids if not s.rigid])
    for solid in scene.solids:
        world.add(_poses(solid, motion) if solid.rigid else _shapes(solid, shapes))
    return world


def _poses(solid: Solid, motion: Motion) -> Prim:
    prim, poses = Prim("", solid.name), motion.poses(solid)
    prim.sample("double3", "xformOp:translate", map(vector, poses.position))
    prim.sample("quatf", "xformOp:orient", map(vector, poses.quaternion))
    return prim


def _shapes(solid: Solid, shapes: Shapes) -> Prim:
    prim = Prim("", solid.name)
    for number, surface in zip(solid.surface_numbers, solid.surfaces, strict=True):
        vertices, normals = shapes.of(number)
        mesh = prim.add(Prim("", surface_name(number)))
        mesh.sample("point3f[]", "points", (POINT(v - solid.origin) for v in vertices))
        corners = ([v.min(axis=0), v.max(axis=0)] for v in vertices)
        mesh.sample("float3[]", "extent", (POINT(c - solid.origin) for c in corners))
        if surface.normals is not None:
            mesh.lines.append(f"normal3f[] normals (\n    interpolation = {text('vertex')}\n)")
            mesh.sample("normal3f[]", "normals", map(NORMAL, normals))
    return prim
