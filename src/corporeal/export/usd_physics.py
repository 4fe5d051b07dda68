"""The layer ``physics.usda``: what simulates, over the shapes of another layer; made to be read.

Schemas: UsdPhysics. Readers take one friction a surface: ours, which belong to pairs, are fitted
(``friction.py``). The floor meets convex hulls and things meet one another with their convex
pieces, so that nothing is carried by a hollow's cover.
"""

from typing import Any

import numpy as np

from corporeal.export.few_corners import ON_CARD, ON_PROCESSOR
from corporeal.export.friction import ROLLING, SPINNING, Rule, SurfaceFriction, surface_friction
from corporeal.export.physical_scene import principal
from corporeal.export.solids import Matter, PhysicalScene, Solid
from corporeal.export.target import Engine, Soft
from corporeal.export.usd_geometry import WORLD, named_colliders, path_of, surface_name
from corporeal.export.usd_soft import bind, deformable, deformable_matter
from corporeal.io.usd_bodies import KEY
from corporeal.io.usd_text import Prim, custom_data, number, text, title, vector

RULES: dict[Engine, Rule] = {
    "physx": "multiply",
    "newton-vbd": "geometric",
    "newton-xpbd": "average",
    "mujoco": "larger",
}
"""How engines combine two coefficients; PhysX as ``frictionCombineMode`` tells it."""
MATTER = f"/{WORLD}/Matter"
FLOOR_PART = "floor"
CONVEX = (
    *("PhysicsCollisionAPI", "PhysicsMeshCollisionAPI", "NewtonMeshCollisionAPI"),
    *("PhysxConvexHullCollisionAPI", "MaterialBindingAPI"),
)
ALL_CORNERS = -1
"""Newton: all corners of a hull."""
GAP = 2e-3
"""What is farther apart than two of these is no contact yet [m]. By default Newton takes 0.1 m: a
scene then has more contacts than its solvers keep, and things fall through the floor."""
ROLLING_TOO = 6
"""Directions in which a contact resists: also against turning and rolling."""


def fitted(scene: PhysicalScene, engine: Engine) -> SurfaceFriction:
    """One friction per part and one of the floor, for an engine's rule."""
    solid = np.array([m.object for m in scene.matter], dtype=np.int64)
    return surface_friction(scene.friction, solid, RULES[engine])


def physics(scene: PhysicalScene, engine: Engine, soft: Soft) -> Prim:
    """Return all that simulates: materials, floor and walls, bodies, who meets whom."""
    found = fitted(scene, engine)
    about = {"friction_pairs": scene.friction.tolist(), "restitution": scene.restitution.tolist()}
    rows = {k: {f"row_{i}": row for i, row in enumerate(v)} for k, v in about.items()}
    rows |= {"unsaid": list(scene.unsaid), "scene": _scene(scene)}
    world = Prim("", WORLD, metadata=[custom_data(KEY, rows)])
    world.add(_simulation(scene, engine, found))
    matter = world.add(Prim("Scope", "Matter"))
    for k, part in enumerate(scene.matter):
        matter.add(_matter(k, part, float(found.coefficient[k]), engine))
    matter.add(_surface(FLOOR_PART, float(found.coefficient[-1]), 0.0, engine))
    grounds = [_floor(), *(_wall(k, scene) for k in range(len(scene.walls)))]
    for ground in grounds:
        world.add(ground)
    for group in _groups(scene, [g.name for g in grounds]):
        world.add(group)
    for solid in scene.solids:
        body = world.add(_rigid(solid) if solid.rigid else deformable(solid, MATTER, soft))
        body.metadata.append(custom_data(KEY, solid.provenance))
        for number_, part in zip(solid.surface_numbers, solid.part_of_surface, strict=True):
            bind(body.add(Prim("", surface_name(number_))), f"{MATTER}/part_{part}")
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


def _simulation(scene: PhysicalScene, engine: Engine, found: SurfaceFriction) -> Prim:
    size = float(np.linalg.norm(scene.gravity))
    down = np.asarray(scene.gravity) / size if size else np.array([0.0, 0.0, -1.0])
    about = {"friction_for": engine, "largest_error": found.misfit, "order": "parts, then floor"}
    prim = Prim("PhysicsScene", "Physics", ["NewtonMPMSceneAPI"], [custom_data(KEY, about)])
    prim.set("float", "newton:mpm:voxelSize", number(scene.cell))
    prim.set("vector3f", "physics:gravityDirection", vector(down))
    prim.set("float", "physics:gravityMagnitude", number(size))
    return prim


def _surface(name: str, friction: float, restitution: float, engine: Engine) -> Prim:
    prim = Prim("Material", name, ["PhysicsMaterialAPI", "NewtonMaterialAPI"])
    prim.set("float", "physics:dynamicFriction", number(friction))
    prim.set("float", "physics:restitution", number(restitution))
    prim.set("float", "physics:staticFriction", number(friction))
    prim.set("float", "newton:torsionalFriction", number(SPINNING))
    prim.set("float", "newton:rollingFriction", number(ROLLING))
    if engine == "physx":
        prim.schemas.append("PhysxMaterialAPI")
        prim.set("uniform token", "physxMaterial:frictionCombineMode", text("multiply"))
    return prim


def _matter(number_: int, matter: Matter, friction: float, engine: Engine) -> Prim:
    restitution = matter.material.restitution
    prim = _surface(f"part_{number_}", friction, restitution, engine)
    prim.metadata += [title(matter.name), custom_data(KEY, matter.provenance)]
    prim.set("float", "physics:density", number(matter.treatment.density))
    if matter.treatment.kind != "rigid":
        deformable_matter(prim, matter)
    return prim


# ---------------------------------------------------------------- floor and walls


def _floor() -> Prim:
    return _plane("floor")


def _wall(number_: int, scene: PhysicalScene) -> Prim:
    wall = scene.walls[number_]
    prim = _plane(f"wall_{number_}")
    prim.set("double3", "xformOp:translate", vector(wall.point))
    prim.set("quatf", "xformOp:orient", vector(_towards(np.asarray(wall.normal))))
    prim.set("uniform token[]", "xformOpOrder", '["xformOp:translate", "xformOp:orient"]')
    return prim


def _towards(normal: np.ndarray) -> np.ndarray:
    """Quaternion (w, x, y, z) that turns +Z to a unit normal."""
    across = np.cross([0.0, 0.0, 1.0], normal)
    quaternion = np.array([1.0 + normal[2], *across])
    size = float(np.linalg.norm(quaternion))
    return quaternion / size if size > 1e-9 else np.array([0.0, 1.0, 0.0, 0.0])


def _plane(name: str) -> Prim:
    applied = ["PhysicsCollisionAPI", "NewtonCollisionAPI", "MaterialBindingAPI"]
    prim = Prim("Plane", name, applied)
    prim.set("uniform token", "axis", text("Z"))
    prim.set("uniform token", "purpose", text("guide"))
    _touching(prim)
    bind(prim, f"{MATTER}/{FLOOR_PART}")
    return prim


def _touching(shape: Prim) -> None:
    """Say how Newton finds a shape's contacts, and in which directions they resist."""
    shape.set("float", "newton:contactGap", number(GAP))
    shape.set("uniform int", "mjc:condim", str(ROLLING_TOO))


def _keep_corners(shape: Prim, corners: int) -> None:
    """Let readers take a hull as it is: things stand on the corners that settling saw."""
    shape.set("uniform int", "newton:maxHullVertices", str(ALL_CORNERS))
    kept = int(np.clip(corners, ON_CARD, ON_PROCESSOR))
    shape.set("int", "physxConvexHullCollision:hullVertexLimit", str(kept))


def _groups(scene: PhysicalScene, grounds: list[str]) -> list[Prim]:
    """Hulls meet floor and walls only, pieces meet pieces and what is soft."""
    hulls, pieces = [], []
    for solid in scene.solids:
        for name, _ in named_colliders(solid):
            path = path_of(solid, "colliders", name)
            (hulls if name == "hull" else pieces).append(path)
    members = {
        "Floors": ([f"/{WORLD}/{g}" for g in grounds], []),
        "Hulls": (hulls, ["Hulls", "Pieces"]),
        "Pieces": (pieces, ["Floors", "Hulls"]),
    }
    return [_group(name, own, others) for name, (own, others) in members.items() if own]


def _group(name: str, members: list[str], apart: list[str]) -> Prim:
    prim = Prim("PhysicsCollisionGroup", name, ["CollectionAPI:colliders"])
    prim.set("uniform token", "collection:colliders:expansionRule", text("expandPrims"))
    prim.relate("collection:colliders:includes", members)
    if apart:
        prim.relate("physics:filteredGroups", [f"/{WORLD}/{n}" for n in apart])
    return prim


# ---------------------------------------------------------------- rigid bodies


def _rigid(solid: Solid) -> Prim:
    prim = Prim("", solid.name, ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    moments, axes = principal(solid.inertia)
    prim.set("vector3f", "physics:angularVelocity", vector(np.degrees(solid.spin)))
    prim.set("point3f", "physics:centerOfMass", vector(np.zeros(3)))
    prim.set("float3", "physics:diagonalInertia", vector(moments))
    prim.set("float", "physics:mass", number(solid.mass))
    prim.set("quatf", "physics:principalAxes", vector(axes))
    prim.set("vector3f", "physics:velocity", vector(solid.velocity))
    group = prim.add(Prim("", "colliders"))
    colliders = [*solid.pieces, *([solid.hull] if solid.hull else [])]
    for (name, _), collider in zip(named_colliders(solid), colliders, strict=True):
        shape = group.add(Prim("", name, list(CONVEX)))
        shape.set("uniform token", "physics:approximation", text("convexHull"))
        _keep_corners(shape, len(collider.shape.vertices))
        _touching(shape)
        bind(shape, f"{MATTER}/part_{collider.part}")
    return prim
