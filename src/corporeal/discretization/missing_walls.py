"""Missing walls below soft material, where one surface is drawn of both.

Pictures show no border inside an object: of a couch's base they show sides and underside, of its seat the top. What is
soft bridges no hollow, so that the base has a top below its seat. What is stiff does, as a slab on a cabinet and the
cork of a jar.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import GRAVITY_M_S2, Material, MaterialField
from corporeal.discretization.cavity import is_vessel, part_corners
from corporeal.discretization.fill_level import sample_isosurface
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart, oriented_box_size
from corporeal.discretization.part_model import infer_structure, part_specification, piece_specifications
from corporeal.discretization.rigidity import MAX_INVISIBLE_STRAIN, cantilever_tip_deflection_ratio
from corporeal.geometry.mesh import Mesh, join_meshes, weld_mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

BORDER_SAMPLES_ALONG_SIDE = 48
"""Samples along the longest side of the hollow part."""
MIN_BORDER_NORMAL_Z = 0.7
"""Cosine of the steepest border to the level on which something lies."""
MIN_LOAD_DEPTH_FRACTION = 0.1
"""What lies on a hollow is no less deep than this share of the hollow's width."""


@dataclass(frozen=True)
class MissingWall:
    """Where one part of an object lies on another inside what the object encloses."""

    mesh: Mesh
    """Normals up, out of the lower part."""
    upper: int
    """The part that lies on it."""
    span: float
    """Its shorter side [m]."""
    depth: float
    """Of what lies on it, up to the object's face [m]."""

    def sags(self, material: Material) -> bool:
        """Return whether material on it does not hold itself over it: the policy's test of flexing."""
        return _is_limp_over_span(material, self.span, self.depth)


def _is_limp_over_span(material: Material, span: float, depth: float) -> bool:
    """Return whether a bar of some material would visibly bend by its own weight, held at one end."""
    load = material.density * GRAVITY_M_S2
    return cantilever_tip_deflection_ratio(load, material.young_pa, span, depth) >= MAX_INVISIBLE_STRAIN


def close_all_missing_walls(anatomies: Sequence[MeasuredObject], field: MaterialField) -> list[MeasuredObject]:
    """Close every hollow wall of all objects below what is soft and lies on it.

    Args:
        anatomies: One per object.
        field: What all is made of, with walls as thick as in the scene.
    """
    return [with_missing_walls(a, find_missing_walls(a, field, {})) for a in anatomies]


def find_missing_walls(
    anatomy: MeasuredObject, field: MaterialField, known: dict[int, tuple[MissingWall, ...]]
) -> dict[int, tuple[MissingWall, ...]]:
    """Find the borders of each hollow part to what is soft and lies on it.

    Args:
        anatomy: The object.
        field: What it is made of.
        known: All borders of parts that were measured before; what is measured is added.
    """
    found = {}
    for member in anatomy.members:
        width = member.size[1]
        soft = {m.part for m in anatomy.members if _may_sag_over(m, field, width)} - {member.part}
        if not soft or not is_one_faced_wall(member, field):
            continue
        if member.part not in known:
            known[member.part] = find_borders(anatomy, member)
        on = (b for b in known[member.part] if b.upper in soft)
        lids = tuple(b for b in on if b.sags(field.materials[b.upper]))
        found |= {member.part: lids} if lids else {}
    return found


def with_missing_walls(anatomy: MeasuredObject, lids: Mapping[int, Sequence[MissingWall]]) -> MeasuredObject:
    """Let walls go on along their borders; volumes and what is inside stay as they are."""
    if not lids:
        return anatomy
    # Triangles of all parts count the object's corners.
    vertices, rows = anatomy.vertices, {}
    for part, own in lids.items():
        lid = join_meshes([b.mesh for b in own])
        rows[part] = lid.triangles + len(vertices)
        vertices = np.concatenate([vertices, lid.vertices])
    members = [_closed_part(m, vertices, rows[m.part]) if m.part in rows else m for m in anatomy.members]
    return replace(anatomy, members=tuple(members), vertices=vertices)


def _closed_part(member: MeasuredPart, vertices: Float[np.ndarray, "V 3"], lid: Int[np.ndarray, "T 3"]) -> MeasuredPart:
    body = Mesh(vertices, np.concatenate([member.body.triangles, lid]))
    return replace(member, body=body, lid=Mesh(vertices, lid))


def is_one_faced_wall(member: MeasuredPart, field: MaterialField) -> bool:
    """Whether a part is an empty wall of which one face is drawn, and that not all around."""
    if not member.volume > 0 or member.closed or len(piece_specifications(member.part, field)) > 1:
        return False
    structure, made = (field.structures[member.part], infer_structure(member, part_specification(member.part, field)))
    empty = structure.contents is None and not structure.holds
    return empty and made.thickness > 0 and not made.modelled and not is_vessel(member)


def _may_sag_over(member: MeasuredPart, field: MaterialField, width: float) -> bool:
    """Whether a part is a body of one surface with others, neither loose nor stiff over a width."""
    material = field.materials[member.part]
    solid = field.structures[member.part].kind == "solid" and member.volume > 0
    one, flows = solid and not member.closed, CONSTITUTIVE_LAWS[material.law].loose
    return one and not flows and _is_limp_over_span(material, width, MIN_LOAD_DEPTH_FRACTION * width)


def find_borders(anatomy: MeasuredObject, member: MeasuredPart) -> tuple[MissingWall, ...]:
    """Find where other parts lie on one: where faces of both are equally near.

    That is meshed as where the difference of two distances changes its sign (marching cubes), and kept inside what the
    object encloses, where it faces up.
    """
    others, shape = [m for m in anatomy.members if m.part != member.part], anatomy.shape
    if not others or shape is None:
        return ()
    own, corners = part_corners(member), shape.mesh.corners.reshape(-1, 3)
    low = np.maximum(own.min(axis=0) - member.size[0], corners.min(axis=0))
    high = np.minimum(own.max(axis=0) + member.size[0], corners.max(axis=0))
    step = float((high - low).max()) / BORDER_SAMPLES_ALONG_SIDE
    axes = [np.arange(a - step, b + 2 * step, step) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    points = grid.reshape(-1, 3)
    farther = (_distance_to_parts([member], points) - _distance_to_parts(others, points)).reshape(grid.shape[:3])
    if not farther.min() < 0 < farther.max():
        return ()
    mesh = sample_isosurface(-farther, step, grid[0, 0, 0])
    mesh = mesh.only(mesh.area_vectors[:, 2] > MIN_BORDER_NORMAL_Z * mesh.areas)
    middles = mesh.corners.mean(axis=1)
    inside = shape.inside(middles)
    mesh, middles = mesh.only(inside), middles[inside]
    nearest = np.argmin([_distance_to_parts([m], middles) for m in others], axis=0)
    found = [_border_mesh(anatomy, member, m, mesh.only(nearest == k)) for k, m in enumerate(others)]
    return tuple(b for b in found if b is not None)


def _border_mesh(anatomy: MeasuredObject, lower: MeasuredPart, upper: MeasuredPart, mesh: Mesh) -> MissingWall | None:
    """Lay a border on the plane through the line where faces of both meet: boards are flat.

    What is half way between faces dips and bulges, and counts as far as it covers that plane. Heights are fitted by
    least squares, z = a + b x + c y.
    """
    line = shared_seam(anatomy, lower.part, upper.part)
    if anatomy.shape is None or not len(mesh.triangles) or len(line) < 3:
        return None
    plane = np.linalg.lstsq(_level_directions(line), line[:, 2], rcond=None)[0]
    vertices = mesh.vertices.copy()
    vertices[:, 2] = _level_directions(vertices) @ plane
    flat, _ = weld_mesh(vertices, mesh.triangles)
    middles = flat.corners.mean(axis=1)
    above = anatomy.shape.reach(middles, np.tile([0.0, 0.0, 1.0], (len(middles), 1)))
    if not np.isfinite(above).any():
        return None
    depth = float(np.median(above[np.isfinite(above)]))
    return MissingWall(flat, upper.part, oriented_box_size(flat.corners.reshape(-1, 3))[1], depth)


def _distance_to_parts(members: Sequence[MeasuredPart], points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
    """Distance to the nearest face of some parts [m]."""
    mesh = join_meshes([part for m in members for part in (m.body, m.sheet)])
    return QueryMesh(mesh).closest(points)[0]


def shared_seam(anatomy: MeasuredObject, one: int, other: int) -> Float[np.ndarray, "N 3"]:
    """Corners that faces of two parts share [m]."""
    if anatomy.shape is None:
        return np.zeros((0, 3))
    mesh = anatomy.shape.mesh
    first, second = (mesh.triangles[anatomy.part_of_triangle == k] for k in (one, other))
    return mesh.vertices[np.intersect1d(first, second)]


def _level_directions(points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    return np.column_stack([np.ones(len(points)), points[:, :2]])


def describe_missing_wall(member: MeasuredPart) -> str:
    """Describe in words what of a wall is drawn nowhere; "" where all is."""
    if member.lid is None:
        return ""
    area = float(member.lid.areas.sum())
    return f": closed below the soft part on it, though not drawn ({area:.2g} m²)"
