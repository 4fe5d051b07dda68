"""The layer ``physics.usda``: physics as overrides of the geometry layer.

Schemas: UsdPhysics. Readers take one friction a surface: ours, which belong to pairs, are fitted (``friction.py``). The
floor meets convex hulls and objects meet one another with their convex pieces, so that nothing is carried by a hollow's
cover.
"""

from typing import Any

import numpy as np

from corporeal.export.export_target import SoftRepresentation, TargetEngine
from corporeal.export.exported_solids import ExportedSolid, PartMaterial, PhysicalScene
from corporeal.export.physical_scene import principal_axes
from corporeal.export.simplify_colliders import PHYSX_CPU_MAX_CORNERS, PHYSX_GPU_MAX_CORNERS
from corporeal.export.surface_friction import (
    ROLLING_FRICTION_M,
    TORSIONAL_FRICTION_M,
    FrictionRule,
    SurfaceFriction,
    surface_friction,
)
from corporeal.export.usd_deformables import bind_physics_material, make_deformable, set_deformable_material
from corporeal.export.usd_geometry import WORLD_PRIM, named_colliders, solid_path, surface_name
from corporeal.io.usd.usd_bodies import CUSTOM_DATA_KEY
from corporeal.io.usd.usda_writer import (
    UsdPrim,
    usda_custom_data,
    usda_display_name,
    usda_number,
    usda_string,
    usda_vector,
)

ENGINE_FRICTION_RULES: dict[TargetEngine, FrictionRule] = {
    "physx": "multiply",
    "newton-vbd": "geometric",
    "newton-xpbd": "average",
    "mujoco": "larger",
}
"""How engines combine two coefficients; PhysX as ``frictionCombineMode`` tells it."""
MATERIALS_PATH = f"/{WORLD_PRIM}/Matter"
FLOOR_MATERIAL_NAME = "floor"
CONVEX_COLLIDER_APIS = (
    *("PhysicsCollisionAPI", "PhysicsMeshCollisionAPI", "NewtonMeshCollisionAPI"),
    *("PhysxConvexHullCollisionAPI", "MaterialBindingAPI"),
)
ALL_HULL_CORNERS = -1
"""Newton: all corners of a hull."""
CONTACT_GAP_M = 2e-3
"""What is farther apart than two of these is no contact yet [m]. By default Newton takes 0.1 m: a scene then has more
contacts than its solvers keep, and objects fall through the floor.
"""
CONTACT_DIRECTIONS = 6
"""Directions in which a contact resists: also against turning and rolling."""


def fit_friction(scene: PhysicalScene, engine: TargetEngine) -> SurfaceFriction:
    """One friction per part and one of the floor, for an engine's rule."""
    solid = np.array([m.object for m in scene.matter], dtype=np.int64)
    return surface_friction(scene.friction, solid, ENGINE_FRICTION_RULES[engine])


def physics_prims(scene: PhysicalScene, engine: TargetEngine, soft: SoftRepresentation) -> UsdPrim:
    """Return all that simulates: materials, floor and walls, bodies, who meets whom."""
    found = fit_friction(scene, engine)
    about = {"friction_pairs": scene.friction.tolist(), "restitution": scene.restitution.tolist()}
    rows = {k: {f"row_{i}": row for i, row in enumerate(v)} for k, v in about.items()}
    rows |= {"unsaid": list(scene.unsaid), "scene": _scene(scene)}
    world = UsdPrim("", WORLD_PRIM, metadata=[usda_custom_data(CUSTOM_DATA_KEY, rows)])
    world.add(_simulation(scene, engine, found))
    matter = world.add(UsdPrim("Scope", "Matter"))
    for k, part in enumerate(scene.matter):
        matter.add(_matter(k, part, float(found.coefficient[k]), engine))
    matter.add(_surface(FLOOR_MATERIAL_NAME, float(found.coefficient[-1]), 0.0, engine))
    grounds = [_floor(), *(_wall(k, scene) for k in range(len(scene.walls)))]
    for ground in grounds:
        world.add(ground)
    for group in _groups(scene, [g.name for g in grounds]):
        world.add(group)
    for solid in scene.solids:
        body = world.add(_rigid(solid) if solid.rigid else make_deformable(solid, MATERIALS_PATH, soft))
        body.metadata.append(usda_custom_data(CUSTOM_DATA_KEY, solid.provenance))
        for number_, part in zip(solid.surface_numbers, solid.part_of_surface, strict=True):
            bind_physics_material(body.add(UsdPrim("", surface_name(number_))), f"{MATERIALS_PATH}/part_{part}")
    return world


def _scene(scene: PhysicalScene) -> dict[str, Any]:
    """Return what UsdPhysics has no word for, so that our own reader gets it back."""
    walls = [{"normal": list(w.normal), "point_m": list(w.point)} for w in scene.walls]
    return {
        "gravity_m_s2": [float(g) for g in scene.gravity],
        "duration_s": scene.duration,
        "fps": scene.fps,
        "settled": scene.settled,
        "walls": walls,
    }


def _simulation(scene: PhysicalScene, engine: TargetEngine, found: SurfaceFriction) -> UsdPrim:
    size = float(np.linalg.norm(scene.gravity))
    down = np.asarray(scene.gravity) / size if size else np.array([0.0, 0.0, -1.0])
    about = {"friction_for": engine, "largest_error": found.misfit, "order": "parts, then floor"}
    prim = UsdPrim("PhysicsScene", "Physics", ["NewtonMPMSceneAPI"], [usda_custom_data(CUSTOM_DATA_KEY, about)])
    prim.set("float", "newton:mpm:voxelSize", usda_number(scene.cell))
    prim.set("vector3f", "physics:gravityDirection", usda_vector(down))
    prim.set("float", "physics:gravityMagnitude", usda_number(size))
    return prim


def _surface(name: str, friction: float, restitution: float, engine: TargetEngine) -> UsdPrim:
    prim = UsdPrim("Material", name, ["PhysicsMaterialAPI", "NewtonMaterialAPI"])
    prim.set("float", "physics:dynamicFriction", usda_number(friction))
    prim.set("float", "physics:restitution", usda_number(restitution))
    prim.set("float", "physics:staticFriction", usda_number(friction))
    prim.set("float", "newton:torsionalFriction", usda_number(TORSIONAL_FRICTION_M))
    prim.set("float", "newton:rollingFriction", usda_number(ROLLING_FRICTION_M))
    if engine == "physx":
        prim.schemas.append("PhysxMaterialAPI")
        prim.set("uniform token", "physxMaterial:frictionCombineMode", usda_string("multiply"))
    return prim


def _matter(number_: int, matter: PartMaterial, friction: float, engine: TargetEngine) -> UsdPrim:
    restitution = matter.material.restitution
    prim = _surface(f"part_{number_}", friction, restitution, engine)
    prim.metadata += [usda_display_name(matter.name), usda_custom_data(CUSTOM_DATA_KEY, matter.provenance)]
    prim.set("float", "physics:density", usda_number(matter.treatment.density))
    if matter.treatment.kind != "rigid":
        set_deformable_material(prim, matter)
    return prim


def _floor() -> UsdPrim:
    return _plane("floor")


def _wall(number_: int, scene: PhysicalScene) -> UsdPrim:
    wall = scene.walls[number_]
    prim = _plane(f"wall_{number_}")
    prim.set("double3", "xformOp:translate", usda_vector(wall.point))
    prim.set("quatf", "xformOp:orient", usda_vector(_quaternion_from_z(np.asarray(wall.normal))))
    prim.set("uniform token[]", "xformOpOrder", '["xformOp:translate", "xformOp:orient"]')
    return prim


def _quaternion_from_z(normal: np.ndarray) -> np.ndarray:
    """Quaternion (w, x, y, z) that turns +Z to a unit normal."""
    across = np.cross([0.0, 0.0, 1.0], normal)
    quaternion = np.array([1.0 + normal[2], *across])
    size = float(np.linalg.norm(quaternion))
    return quaternion / size if size > 1e-9 else np.array([0.0, 1.0, 0.0, 0.0])


def _plane(name: str) -> UsdPrim:
    applied = ["PhysicsCollisionAPI", "NewtonCollisionAPI", "MaterialBindingAPI"]
    prim = UsdPrim("Plane", name, applied)
    prim.set("uniform token", "axis", usda_string("Z"))
    prim.set("uniform token", "purpose", usda_string("guide"))
    _set_contact_search(prim)
    bind_physics_material(prim, f"{MATERIALS_PATH}/{FLOOR_MATERIAL_NAME}")
    return prim


def _set_contact_search(shape: UsdPrim) -> None:
    """Return how Newton finds a shape's contacts, and in which directions they resist."""
    shape.set("float", "newton:contactGap", usda_number(CONTACT_GAP_M))
    shape.set("uniform int", "mjc:condim", str(CONTACT_DIRECTIONS))


def _keep_hull_corners(shape: UsdPrim, corners: int) -> None:
    """Let readers take a hull as it is: objects stand on the corners that settling saw."""
    shape.set("uniform int", "newton:maxHullVertices", str(ALL_HULL_CORNERS))
    kept = int(np.clip(corners, PHYSX_GPU_MAX_CORNERS, PHYSX_CPU_MAX_CORNERS))
    shape.set("int", "physxConvexHullCollision:hullVertexLimit", str(kept))


def _groups(scene: PhysicalScene, grounds: list[str]) -> list[UsdPrim]:
    """Hulls meet floor and walls only, pieces meet pieces and what is soft."""
    hulls, pieces = [], []
    for solid in scene.solids:
        for name, _ in named_colliders(solid):
            path = solid_path(solid, "colliders", name)
            (hulls if name == "hull" else pieces).append(path)
    members = {
        "Floors": ([f"/{WORLD_PRIM}/{g}" for g in grounds], []),
        "Hulls": (hulls, ["Hulls", "Pieces"]),
        "Pieces": (pieces, ["Floors", "Hulls"]),
    }
    return [_group(name, own, others) for name, (own, others) in members.items() if own]


def _group(name: str, members: list[str], apart: list[str]) -> UsdPrim:
    prim = UsdPrim("PhysicsCollisionGroup", name, ["CollectionAPI:colliders"])
    prim.set("uniform token", "collection:colliders:expansionRule", usda_string("expandPrims"))
    prim.relate("collection:colliders:includes", members)
    if apart:
        prim.relate("physics:filteredGroups", [f"/{WORLD_PRIM}/{n}" for n in apart])
    return prim


def _rigid(solid: ExportedSolid) -> UsdPrim:
    prim = UsdPrim("", solid.name, ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    moments, axes = principal_axes(solid.inertia)
    prim.set("vector3f", "physics:angularVelocity", usda_vector(np.degrees(solid.spin)))
    prim.set("point3f", "physics:centerOfMass", usda_vector(np.zeros(3)))
    prim.set("float3", "physics:diagonalInertia", usda_vector(moments))
    prim.set("float", "physics:mass", usda_number(solid.mass))
    prim.set("quatf", "physics:principalAxes", usda_vector(axes))
    prim.set("vector3f", "physics:velocity", usda_vector(solid.velocity))
    group = prim.add(UsdPrim("", "colliders"))
    colliders = [*solid.pieces, *([solid.hull] if solid.hull else [])]
    for (name, _), collider in zip(named_colliders(solid), colliders, strict=True):
        shape = group.add(UsdPrim("", name, list(CONVEX_COLLIDER_APIS)))
        shape.set("uniform token", "physics:approximation", usda_string("convexHull"))
        _keep_hull_corners(shape, len(collider.shape.vertices))
        _set_contact_search(shape)
        bind_physics_material(shape, f"{MATERIALS_PATH}/part_{collider.part}")
    return prim
