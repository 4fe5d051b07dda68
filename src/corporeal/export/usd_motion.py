"""The layer ``motion.usda``: time samples only; one time code is one frame of the video."""

from functools import partial

from corporeal.export.exported_solids import ExportedSolid, PhysicalScene
from corporeal.export.scene_motion import PosedSurfaces, SceneMotion
from corporeal.export.usd_geometry import WORLD_PRIM, surface_name
from corporeal.io.usd.usda_writer import UsdPrim, usda_string, usda_vector, usda_vectors

write_points = partial(usda_vectors, digits=6)
"""Vertices to a millionth of the solid's size."""
write_normals = partial(usda_vectors, digits=3)
"""Normals to a thousandth of a radian."""


def motion_prims(scene: PhysicalScene, motion: SceneMotion) -> UsdPrim:
    """Return where rigid objects are, and the shapes of soft ones, at every frame."""
    world = UsdPrim("", WORLD_PRIM)
    shapes = motion.shapes([s for s in scene.solids if not s.rigid])
    for solid in scene.solids:
        world.add(_poses(solid, motion) if solid.rigid else _shapes(solid, shapes))
    return world


def _poses(solid: ExportedSolid, motion: SceneMotion) -> UsdPrim:
    prim, poses = UsdPrim("", solid.name), motion.poses(solid)
    prim.sample("double3", "xformOp:translate", map(usda_vector, poses.position))
    prim.sample("quatf", "xformOp:orient", map(usda_vector, poses.quaternion))
    return prim


def _shapes(solid: ExportedSolid, shapes: PosedSurfaces) -> UsdPrim:
    prim = UsdPrim("", solid.name)
    for number, surface in zip(solid.surface_numbers, solid.surfaces, strict=True):
        vertices, normals = shapes.of(number)
        mesh = prim.add(UsdPrim("", surface_name(number)))
        mesh.sample("point3f[]", "points", (write_points(v - solid.origin) for v in vertices))
        corners = ([v.min(axis=0), v.max(axis=0)] for v in vertices)
        mesh.sample("float3[]", "extent", (write_points(c - solid.origin) for c in corners))
        if surface.normals is not None:
            mesh.lines.append(
                f"normal3f[] normals (\n    interpolation = {usda_string('vertex')}\n)"
            )
            mesh.sample("normal3f[]", "normals", map(write_normals, normals))
    return prim
