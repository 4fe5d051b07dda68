"""What can deform in USD: material points for MPM, and tetrahedra for finite elements.

Schemas: Newton's ``newton-usd-schemas`` (points, per-part subsets with MPM materials); the AOUSD
proposal for deformables under both names that readers look for, ``physics:`` (Newton) and
``omniphysics:`` (PhysX). OpenUSD itself does not know them yet; they are applied by name.
"""

import numpy as np

from corporeal.core.types import Law
from corporeal.export.solids import Matter, PhysicalScene, Solid, Tetrahedra
from corporeal.export.target import Soft
from corporeal.geometry.voxel_tetrahedra import outer_faces, voxel_tetrahedra
from corporeal.io.usd_text import (
    Prim,
    floats,
    inactive,
    integers,
    number,
    text,
    vectors,
    whole_vectors,
)

CELLS = 2.0
"""Edge of the cells that tetrahedra are cut from [dx]: what a particle mesh resolves."""
INFINITE = 1e12
"""What Newton's implicit MPM takes for a limit that is never met [Pa]."""
DIALECTS = ("physics", "omniphysics", "newton:mpm")
VOLUME = ("PhysicsVolumeDeformableSimAPI", "OmniPhysicsVolumeDeformableSimAPI")
BODY = ("PhysicsDeformableBodyAPI", "OmniPhysicsDeformableBodyAPI")
MATERIAL = (
    "PhysicsVolumeDeformableMaterialAPI",
    "OmniPhysicsDeformableMaterialAPI",
    "NewtonMPMMaterialAPI",
)


def tetrahedra_of(solid: Solid, cell: float) -> Tetrahedra:
    """Mesh the cells that a soft solid's points fill."""
    assert solid.grains is not None, "only soft solids are meshed"
    return Tetrahedra(*voxel_tetrahedra(solid.grains.position, CELLS * cell))


# ---------------------------------------------------------------- geometry


def grains_prim(solid: Solid) -> Prim:
    """Material points with mass, velocity, size and number."""
    grains = solid.grains
    assert grains is not None, "only soft solids have grains"
    prim = Prim("Points", "particles")
    side = np.cbrt(grains.volume)
    prim.set("float3[]", "extent", vectors(_box(grains.position, 0.5 * float(side.max()))))
    prim.set("int64[]", "ids", integers(grains.number))
    prim.set("float[]", "physics:masses", floats(grains.mass))
    prim.set("point3f[]", "points", vectors(grains.position))
    prim.set("uniform token", "purpose", text("guide"))
    prim.set("vector3f[]", "velocities", vectors(grains.velocity))
    prim.set("float[]", "widths", floats(side))
    return prim


def tetrahedra_prim(solid: Solid, scene: PhysicalScene) -> Prim:
    """Return the same matter as a volume mesh."""
    mesh = tetrahedra_of(solid, scene.cell)
    prim = Prim("TetMesh", "tetrahedra")
    prim.set("float3[]", "extent", vectors(_box(mesh.points, 0.0)))
    prim.set("point3f[]", "points", vectors(mesh.points))
    prim.set("uniform token", "purpose", text("guide"))
    prim.set("int3[]", "surfaceFaceVertexIndices", whole_vectors(outer_faces(mesh.corners)))
    prim.set("int4[]", "tetVertexIndices", whole_vectors(mesh.corners))
    return prim


def _box(points: np.ndarray, margin: float) -> np.ndarray:
    return np.array([points.min(axis=0) - margin, points.max(axis=0) + margin])


# ---------------------------------------------------------------- physics


def deformable(solid: Solid, materials: str, soft: Soft) -> Prim:
    """Make a soft solid simulated: by its points or by its tetrahedra, as a variant says.

    Args:
        solid: What.
        materials: Path of the scope of all materials.
        soft: Which of the two is simulated at first; readers take one geometry a body.

    """
    prim = Prim("", solid.name)
    if soft == "none":
        return prim
    prim.schemas += BODY
    for space in DIALECTS[:2]:
        prim.set("float", f"{space}:mass", number(solid.mass))
    prim.add(_grains_physics(solid, materials))
    mesh = prim.add(Prim("", "tetrahedra", [*VOLUME, "PhysicsCollisionAPI", "MaterialBindingAPI"]))
    bind(mesh, f"{materials}/part_{solid.heaviest}")
    prim.variant_set, prim.chosen = "simulated", soft
    prim.variants = {
        "particles": [Prim("", "tetrahedra", metadata=[inactive()])],
        "tetrahedra": [Prim("", "particles", metadata=[inactive()])],
    }
    return prim


def _grains_physics(solid: Solid, materials: str) -> Prim:
    assert solid.grains is not None, "only soft solids have grains"
    prim = Prim("", "particles", ["NewtonPointsDeformableSimAPI", "MaterialBindingAPI"])
    bind(prim, f"{materials}/part_{solid.heaviest}")
    prim.set("uniform token", "subsetFamily:materialBind:familyType", text("partition"))
    for part in sorted(solid.parts):
        subset = prim.add(Prim("GeomSubset", f"part_{part}", ["MaterialBindingAPI"]))
        subset.set("uniform token", "elementType", text("point"))
        subset.set("uniform token", "familyName", text("materialBind"))
        subset.set("int[]", "indices", integers(np.flatnonzero(solid.grains.part == part)))
        bind(subset, f"{materials}/part_{part}")
    return prim


def bind(prim: Prim, material: str) -> None:
    """Bind a material for physics only: one without a shader must not be what is seen."""
    prim.relate("material:binding:physics", [material], "strongerThanDescendants")


def deformable_matter(prim: Prim, matter: Matter) -> None:
    """Say E and ν as simulated in every dialect that is read today, and how it yields."""
    prim.schemas += MATERIAL
    for space in DIALECTS:
        prim.set("float", f"{space}:youngsModulus", number(matter.treatment.young))
        prim.set("float", f"{space}:poissonsRatio", number(matter.treatment.poisson))
    for name, value in yielding(matter).items():
        prim.set("float", f"newton:mpm:{name}", number(value))


def yielding(matter: Matter) -> dict[str, float]:
    """Parameters of Newton's yield surface for a law of ours.

    Newton: √J₂ ≤ yieldStress + internalFriction (p + tensileYieldRatio yieldPressure). Ours:
    √J₂ ≤ sin φ (p + c / tan φ) for grains (plane strain), √J₂ ≤ σ_y / √3 for metals, and no limit
    for what is elastic. The correspondence was derived from Newton's kernels.
    """
    material = matter.material
    values = {
        "internalFriction": 0.0,
        "yieldStress": INFINITE,
        "yieldPressure": INFINITE,
        "tensileYieldRatio": 1.0,
    }
    if material.law is Law.DRUCKER_PRAGER:
        angle, cohesion = material.friction_angle or 0.0, material.cohesion or 0.0
        tip = cohesion / np.tan(angle) / INFINITE
        grains = {"internalFriction": float(np.sin(angle)), "yieldStress": 0.0}
        return values | grains | {"tensileYieldRatio": float(tip)}
    if material.law is Law.VON_MISES and matter.treatment.yield_stress:
        return values | {"yieldStress": float(matter.treatment.yield_stress / np.sqrt(3))}
    return values
