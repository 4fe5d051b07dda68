"""Deformable bodies in USD: material points for MPM, and tetrahedra for finite elements.

Schemas: Newton's ``newton-usd-schemas`` (points, per-part subsets with MPM materials); the AOUSD proposal for
deformables under both names that readers look for, ``physics:`` (Newton) and ``omniphysics:`` (PhysX). OpenUSD itself
does not know them yet; they are applied by name.

Tetrahedral mesh of the volume filled by points: grid cells cut into six tetrahedra (Kuhn 1960).

All cells are cut alike, along the diagonal from (0, 0, 0) to (1, 1, 1), so that neighbours share whole faces.
"""

from itertools import permutations

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import Law
from corporeal.export.export_target import SoftRepresentation
from corporeal.export.exported_solids import ExportedSolid, PartMaterial, PhysicalScene, TetrahedralMesh
from corporeal.io.usd.usda_writer import (
    UsdPrim,
    usda_floats,
    usda_inactive,
    usda_integer_vectors,
    usda_integers,
    usda_number,
    usda_string,
    usda_vectors,
)

CELL_CORNERS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])


def _kuhn_tetrahedra() -> np.ndarray:
    """Corner numbers of the six tetrahedra of a cell, all of positive volume."""
    found = []
    for order in permutations((1, 2, 4)):
        path = np.cumsum([0, *order])
        a, b, c, d = CELL_CORNERS[path]
        positive = np.dot(np.cross(b - a, c - a), d - a) > 0
        found.append(path if positive else path[[0, 2, 1, 3]])
    return np.array(found)


KUHN_TETRAHEDRA = _kuhn_tetrahedra()


def voxel_tetrahedra(
    points: Float[np.ndarray, "P 3"], side: float
) -> tuple[Float[np.ndarray, "V 3"], Int[np.ndarray, "T 4"]]:
    """Cut the cells that hold points into tetrahedra.

    Args:
        points: [m]
        side: Of a cell [m].

    Returns:
        Vertices [m], and four vertex numbers a tetrahedron: (b - a) × (c - a) · (d - a) > 0.
    """
    low = points.min(axis=0) - 1e-3 * side
    cell = np.unique(np.floor((points - low) / side).astype(np.int64), axis=0)
    corners, number = np.unique((cell[:, None] + CELL_CORNERS).reshape(-1, 3), axis=0, return_inverse=True)
    return low + side * corners, number.reshape(-1, 8)[:, KUHN_TETRAHEDRA].reshape(-1, 4)


def tetrahedra_outer_faces(corners: Int[np.ndarray, "T 4"]) -> Int[np.ndarray, "F 3"]:
    """Return the faces that belong to one tetrahedron only, anticlockwise seen from outside."""
    faces = corners[:, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]


TETRAHEDRON_CELL_DX = 2.0
"""Edge of the cells that tetrahedra are cut from [dx]: what a particle mesh resolves."""
NEWTON_INFINITE_PA = 1e12
"""What Newton's implicit MPM takes for a limit that is never met [Pa]."""
USD_DIALECTS = ("physics", "omniphysics", "newton:mpm")
VOLUME_APIS = ("PhysicsVolumeDeformableSimAPI", "OmniPhysicsVolumeDeformableSimAPI")
DEFORMABLE_BODY_APIS = ("PhysicsDeformableBodyAPI", "OmniPhysicsDeformableBodyAPI")
DEFORMABLE_MATERIAL_APIS = (
    "PhysicsVolumeDeformableMaterialAPI",
    "OmniPhysicsDeformableMaterialAPI",
    "NewtonMPMMaterialAPI",
)


def tetrahedra_of(solid: ExportedSolid, cell: float) -> TetrahedralMesh:
    """Mesh the cells that a soft solid's points fill."""
    assert solid.grains is not None, "only soft solids are meshed"
    return TetrahedralMesh(*voxel_tetrahedra(solid.grains.position, TETRAHEDRON_CELL_DX * cell))


def material_points_prim(solid: ExportedSolid) -> UsdPrim:
    """Material points with mass, velocity, size and number."""
    grains = solid.grains
    assert grains is not None, "only soft solids have grains"
    prim = UsdPrim("Points", "particles")
    side = np.cbrt(grains.volume)
    prim.set("float3[]", "extent", usda_vectors(_box(grains.position, 0.5 * float(side.max()))))
    prim.set("int64[]", "ids", usda_integers(grains.number))
    prim.set("float[]", "physics:masses", usda_floats(grains.mass))
    prim.set("point3f[]", "points", usda_vectors(grains.position))
    prim.set("uniform token", "purpose", usda_string("guide"))
    prim.set("vector3f[]", "velocities", usda_vectors(grains.velocity))
    prim.set("float[]", "widths", usda_floats(side))
    return prim


def tetrahedra_prim(solid: ExportedSolid, scene: PhysicalScene) -> UsdPrim:
    """Return the same material as a volume mesh."""
    mesh = tetrahedra_of(solid, scene.cell)
    prim = UsdPrim("TetMesh", "tetrahedra")
    prim.set("float3[]", "extent", usda_vectors(_box(mesh.points, 0.0)))
    prim.set("point3f[]", "points", usda_vectors(mesh.points))
    prim.set("uniform token", "purpose", usda_string("guide"))
    prim.set("int3[]", "surfaceFaceVertexIndices", usda_integer_vectors(tetrahedra_outer_faces(mesh.corners)))
    prim.set("int4[]", "tetVertexIndices", usda_integer_vectors(mesh.corners))
    return prim


def _box(points: np.ndarray, margin: float) -> np.ndarray:
    return np.array([points.min(axis=0) - margin, points.max(axis=0) + margin])


def make_deformable(solid: ExportedSolid, materials: str, soft: SoftRepresentation) -> UsdPrim:
    """Make a soft solid simulated: by its points or by its tetrahedra, as a variant says.

    Args:
        solid: What.
        materials: Path of the scope of all materials.
        soft: Which of the two is simulated at first; readers take one geometry a body.
    """
    prim = UsdPrim("", solid.name)
    if soft == "none":
        return prim
    prim.schemas += DEFORMABLE_BODY_APIS
    for space in USD_DIALECTS[:2]:
        prim.set("float", f"{space}:mass", usda_number(solid.mass))
    prim.add(_material_points_physics(solid, materials))
    mesh = prim.add(UsdPrim("", "tetrahedra", [*VOLUME_APIS, "PhysicsCollisionAPI", "MaterialBindingAPI"]))
    bind_physics_material(mesh, f"{materials}/part_{solid.heaviest}")
    prim.variant_set, prim.chosen = "simulated", soft
    prim.variants = {
        "particles": [UsdPrim("", "tetrahedra", metadata=[usda_inactive()])],
        "tetrahedra": [UsdPrim("", "particles", metadata=[usda_inactive()])],
    }
    return prim


def _material_points_physics(solid: ExportedSolid, materials: str) -> UsdPrim:
    assert solid.grains is not None, "only soft solids have grains"
    prim = UsdPrim("", "particles", ["NewtonPointsDeformableSimAPI", "MaterialBindingAPI"])
    bind_physics_material(prim, f"{materials}/part_{solid.heaviest}")
    prim.set("uniform token", "subsetFamily:materialBind:familyType", usda_string("partition"))
    for part in sorted(solid.parts):
        subset = prim.add(UsdPrim("GeomSubset", f"part_{part}", ["MaterialBindingAPI"]))
        subset.set("uniform token", "elementType", usda_string("point"))
        subset.set("uniform token", "familyName", usda_string("materialBind"))
        subset.set("int[]", "indices", usda_integers(np.flatnonzero(solid.grains.part == part)))
        bind_physics_material(subset, f"{materials}/part_{part}")
    return prim


def bind_physics_material(prim: UsdPrim, material: str) -> None:
    """Bind a material for physics only: one without a shader must not be what is seen."""
    prim.relate("material:binding:physics", [material], "strongerThanDescendants")


def set_deformable_material(prim: UsdPrim, matter: PartMaterial) -> None:
    """Say E and ν as simulated in every dialect that is read today, and how it yields."""
    prim.schemas += DEFORMABLE_MATERIAL_APIS
    for space in USD_DIALECTS:
        prim.set("float", f"{space}:youngsModulus", usda_number(matter.treatment.simulated_young_pa))
        prim.set("float", f"{space}:poissonsRatio", usda_number(matter.treatment.poisson))
    for name, value in newton_yield_parameters(matter).items():
        prim.set("float", f"newton:mpm:{name}", usda_number(value))


def newton_yield_parameters(matter: PartMaterial) -> dict[str, float]:
    """Parameters of Newton's yield surface for a law of ours.

    Newton: √J₂ ≤ yieldStress + internalFriction (p + tensileYieldRatio yieldPressure). Ours:
    √J₂ ≤ sin φ (p + c / tan φ) for grains (plane strain), √J₂ ≤ σ_y / √3 for metals, and no limit
    for what is elastic. The correspondence was derived from Newton's kernels.
    """
    material = matter.material
    values = {
        "internalFriction": 0.0,
        "yieldStress": NEWTON_INFINITE_PA,
        "yieldPressure": NEWTON_INFINITE_PA,
        "tensileYieldRatio": 1.0,
    }
    if material.law is Law.DRUCKER_PRAGER:
        angle, cohesion = material.friction_angle or 0.0, material.cohesion or 0.0
        tip = cohesion / np.tan(angle) / NEWTON_INFINITE_PA
        grains = {"internalFriction": float(np.sin(angle)), "yieldStress": 0.0}
        return values | grains | {"tensileYieldRatio": float(tip)}
    if material.law is Law.VON_MISES and matter.treatment.yield_stress:
        return values | {"yieldStress": float(matter.treatment.yield_stress / np.sqrt(3))}
    return values
