"""A scene as OpenUSD in text: ``sim.usda`` to simulate, ``video.usda`` to show.

``geometry.usda`` has the shapes, ``physics.usda`` what simulates, ``motion.usda`` the samples. Never samples and
physics in one stage: a simulated body with samples contradicts itself, and readers of physics take defaults.
"""

from functools import partial
from pathlib import Path

from corporeal.core.version import __version__
from corporeal.export.export_target import ExportRequest, WrittenTarget
from corporeal.export.exported_solids import ExportedSolid, PhysicalScene
from corporeal.export.scene_motion import PosedSurfaces, SceneMotion
from corporeal.export.simplify_colliders import PHYSX_GPU_MAX_CORNERS, simplify_colliders, solid_colliders
from corporeal.export.usd_geometry import WORLD_PRIM, geometry_prims, surface_name
from corporeal.export.usd_physics import fit_friction, physics_prims
from corporeal.io.usd.usda_writer import UsdLayer, UsdPrim, usda_string, usda_vector, usda_vectors

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
            mesh.lines.append(f"normal3f[] normals (\n    interpolation = {usda_string('vertex')}\n)")
            mesh.sample("normal3f[]", "normals", map(write_normals, normals))
    return prim


GEOMETRY_FILE_NAME, PHYSICS_FILE_NAME, MOTION_FILE_NAME = ("geometry.usda", "physics.usda", "motion.usda")
SIMULATION_FILE_NAME, VIDEO_FILE_NAME = "sim.usda", "video.usda"


def write_usd(asked: ExportRequest, folder: Path) -> WrittenTarget:
    """Write the layers and the stages that are made of them."""
    config = asked.config
    scene, thickened = simplify_colliders(asked.scene, config.hull_vertices)
    _write(folder / GEOMETRY_FILE_NAME, scene, geometry_prims(scene, folder, config.soft))
    _write(folder / PHYSICS_FILE_NAME, scene, physics_prims(scene, config.friction_for, config.soft))
    _compose(folder / SIMULATION_FILE_NAME, scene, (PHYSICS_FILE_NAME, GEOMETRY_FILE_NAME), 0)
    if asked.motion.moves:
        last = len(asked.motion.time) - 1
        _write(folder / MOTION_FILE_NAME, scene, motion_prims(scene, asked.motion), last)
        _compose(folder / VIDEO_FILE_NAME, scene, (MOTION_FILE_NAME, GEOMETRY_FILE_NAME), last)
    misfit = fit_friction(scene, config.friction_for).misfit
    measured = {"friction_misfit": misfit, "hull_corners": float(_most_corners(scene))}
    if thickened:
        measured["hull_thickened_m"] = thickened
    return WrittenTarget(tuple(_not_written(asked, _most_corners(scene))), measured)


def _most_corners(scene: PhysicalScene) -> int:
    """Return how many corners the collider of most corners has."""
    return max((len(c.shape.vertices) for s in scene.solids for c in solid_colliders(s)), default=0)


def _not_written(asked: ExportRequest, corners: int) -> list[str]:
    sentences = ["Friction of pairs is fitted by one coefficient a part; all pairs are in the customData of /World."]
    soft = [s.title for s in asked.scene.solids if not s.rigid]
    if soft and asked.config.soft == "none":
        sentences.append(f"{', '.join(soft)} can deform and is not simulated.")
    elif soft:
        sentences.append(
            f"{', '.join(soft)} can deform: Newton reads it; PhysX on the CPU and MuJoCo do not, "
            "and objects on it fall through."
        )
    if corners > PHYSX_GPU_MAX_CORNERS:
        sentences.append(
            f"A convex collider has {corners} corners; PhysX on a GPU takes "
            f"{PHYSX_GPU_MAX_CORNERS}: "
            f"--hull-vertices {PHYSX_GPU_MAX_CORNERS}."
        )
    return sentences


def _write(path: Path, scene: PhysicalScene, world: UsdPrim, last: int = 0) -> None:
    _save(path, UsdLayer(WORLD_PRIM, float(scene.fps), last, comment=_scene_comment(scene), prims=[world]))


def _compose(path: Path, scene: PhysicalScene, layers: tuple[str, ...], last: int) -> None:
    below = tuple(f"./{name}" for name in layers)
    _save(path, UsdLayer(WORLD_PRIM, float(scene.fps), last, below, comment=_scene_comment(scene)))


def _save(path: Path, layer: UsdLayer) -> None:
    with path.open("w", encoding="utf-8", newline="\n") as file:
        layer.write(file)


def _scene_comment(scene: PhysicalScene) -> str:
    credits = f" Contains: {'; '.join(scene.credits)}." if scene.credits else ""
    return f"Written by corporeal {__version__}.{credits}"
