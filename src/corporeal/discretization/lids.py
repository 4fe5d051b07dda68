"""Walls below soft matter that lies on them, where one surface is drawn of both.

Pictures show no border inside a thing: of a couch's base they show sides and underside, of its seat
the top. What is soft bridges no hollow, so that the base has a top below its seat. What is stiff
does, as a slab on a cabinet and the cork of a jar.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import GRAVITY, Material, MaterialField
from corporeal.discretization.bending import INVISIBLE_STRAIN, tip_shift
from corporeal.discretization.extent import oriented_size
from corporeal.discretization.make import decide, pieces_of, specified
from corporeal.discretization.pouring import meshed
from corporeal.discretization.room import corners_of, is_vessel
from corporeal.discretization.survey import Anatomy, Member
from corporeal.geometry.mesh import Mesh, joined, weld
from corporeal.geometry.shape import Shape
from corporeal.mpm.laws import MENU

ACROSS = 48
"""Samples along the longest side of the hollow part."""
LEVEL = 0.7
"""Cosine of the steepest border to the level on which something lies."""
SHALLOW = 0.1
"""What lies on a hollow is no less deep than this share of the hollow's width."""


@dataclass(frozen=True)
class Border:
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
        """Tell whether matter on it does not hold itself over it: the policy's test of flexing."""
        return _limp(material, self.span, self.depth)


def _limp(material: Material, span: float, depth: float) -> bool:
    """Tell whether a bar of some matter would visibly bend by its own weight, held at one end."""
    load = material.density * GRAVITY
    return tip_shift(load, material.young, span, depth) >= INVISIBLE_STRAIN


def all_lidded(anatomies: Sequence[Anatomy], field: MaterialField) -> list[Anatomy]:
    """Close every hollow wall of all objects below what is soft and lies on it.

    Args:
        anatomies: One per object.
        field: What all is made of, with walls as thick as in the scene.

    """
    return [lidded(a, lids_of(a, field, {})) for a in anatomies]


def lids_of(
    anatomy: Anatomy, field: MaterialField, known: dict[int, tuple[Border, ...]]
) -> dict[int, tuple[Border, ...]]:
    """Find the borders of each hollow part to what is soft and lies on it.

    Args:
        anatomy: The object.
        field: What it is made of.
        known: All borders of parts that were measured before; what is measured is added.

    """
    found = {}
    for member in anatomy.members:
        width = member.size[1]
        soft = {m.part for m in anatomy.members if _may_sag(m, field, width)} - {member.part}
        if not soft or not is_hollow(member, field):
            continue
        if member.part not in known:
            known[member.part] = borders_of(anatomy, member)
        on = (b for b in known[member.part] if b.upper in soft)
        lids = tuple(b for b in on if b.sags(field.materials[b.upper]))
        found |= {member.part: lids} if lids else {}
    return found


def lidded(anatomy: Anatomy, lids: Mapping[int, Sequence[Border]]) -> Anatomy:
    """Let walls go on along their borders; volumes and what is inside stay as they are."""
    if not lids:
        return anatomy
    # Triangles of all parts count the object's corners.
    vertices, rows = anatomy.vertices, {}
    for part, own in lids.items():
        lid = joined([b.mesh for b in own])
        rows[part] = lid.triangles + len(vertices)
        vertices = np.concatenate([vertices, lid.vertices])
    members = [_closed(m, vertices, rows[m.part]) if m.part in rows else m for m in anatomy.members]
    return replace(anatomy, members=tuple(members), vertices=vertices)


def _closed(
    member: Member, vertices: Float[np.ndarray, "V 3"], lid: Int[np.ndarray, "T 3"]
) -> Member:
    body = Mesh(vertices, np.concatenate([member.body.triangles, lid]))
    return replace(member, body=body, lid=Mesh(vertices, lid))


def is_hollow(member: Member, field: MaterialField) -> bool:
    """Whether a part is an empty wall of which one face is drawn, and that not all around."""
    if not member.volume > 0 or member.closed or len(pieces_of(member.part, field)) > 1:
        return False
    structure, made = field.structures[member.part], decide(member, specified(member.part, field))
    empty = structure.contents is None and not structure.holds
    return empty and made.thickness > 0 and not made.modelled and not is_vessel(member)


def _may_sag(member: Member, field: MaterialField, width: float) -> bool:
    """Whether a part is a body of one surface with others, neither loose nor stiff over a width."""
    material = field.materials[member.part]
    solid = field.structures[member.part].kind == "solid" and member.volume > 0
    one, flows = solid and not member.closed, MENU[material.law].loose
    return one and not flows and _limp(material, width, SHALLOW * width)


def borders_of(anatomy: Anatomy, member: Member) -> tuple[Border, ...]:
    """Find where other parts lie on one: where faces of both are equally near.

    That is meshed as where the difference of two distances changes its sign (marching cubes), and
    kept inside what the object encloses, where it faces up.
    """
    others, shape = [m for m in anatomy.members if m.part != member.part], anatomy.shape
    if not others or shape is None:
        return ()
    own, corners = corners_of(member), shape.mesh.corners.reshape(-1, 3)
    low = np.maximum(own.min(axis=0) - member.size[0], corners.min(axis=0))
    high = np.minimum(own.max(axis=0) + member.size[0], corners.max(axis=0))
    step = float((high - low).max()) / ACROSS
    axes = [np.arange(a - step, b + 2 * step, step) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    points = grid.reshape(-1, 3)
    farther = (_away([member], points) - _away(others, points)).reshape(grid.shape[:3])
    if not farther.min() < 0 < farther.max():
        return ()
    mesh = meshed(-farther, step, grid[0, 0, 0])
    mesh = mesh.only(mesh.area_vectors[:, 2] > LEVEL * mesh.areas)
    middles = mesh.corners.mean(axis=1)
    inside = shape.inside(middles)
    mesh, middles = mesh.only(inside), middles[inside]
    nearest = np.argmin([_away([m], middles) for m in others], axis=0)
    found = [_border(anatomy, member, m, mesh.only(nearest == k)) for k, m in enumerate(others)]
    return tuple(b for b in found if b is not None)


def _border(anatomy: Anatomy, lower: Member, upper: Member, mesh: Mesh) -> Border | None:
    """Lay a border on the plane through the line where faces of both meet: boards are flat.

    What is half way between faces dips and bulges, and counts as far as it covers that plane.
    Heights are fitted by least squares, z = a + b x + c y.
    """
    line = seam(anatomy, lower.part, upper.part)
    if anatomy.shape is None or not len(mesh.triangles) or len(line) < 3:
        return None
    plane = np.linalg.lstsq(_level(line), line[:, 2], rcond=None)[0]
    vertices = mesh.vertices.copy()
    vertices[:, 2] = _level(vertices) @ plane
    flat, _ = weld(vertices, mesh.triangles)
    middles = flat.corners.mean(axis=1)
    above = anatomy.shape.reach(middles, np.tile([0.0, 0.0, 1.0], (len(middles), 1)))
    if not np.isfinite(above).any():
        return None
    depth = float(np.median(above[np.isfinite(above)]))
    return Border(flat, upper.part, oriented_size(flat.corners.reshape(-1, 3))[1], depth)


def _away(members: Sequence[Member], points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
    """Distance to the nearest face of some parts [m]."""
    mesh = joined([part for m in members for part in (m.body, m.sheet)])
    return Shape(mesh).closest(points)[0]


def seam(anatomy: Anatomy, one: int, other: int) -> Float[np.ndarray, "N 3"]:
    """Corners that faces of two parts share [m]."""
    if anatomy.shape is None:
        return np.zeros((0, 3))
    mesh = anatomy.shape.mesh
    first, second = (mesh.triangles[anatomy.part_of_triangle == k] for k in (one, other))
    return mesh.vertices[np.intersect1d(first, second)]


def _level(points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    return np.column_stack([np.ones(len(points)), points[:, :2]])


def how_lidded(member: Member) -> str:
    """Say in words what of a wall is drawn nowhere; "" where all is."""
    if member.lid is None:
        return ""
    area = float(member.lid.areas.sum())
    return f": closed, though not shown, below what is soft and lies on it ({area:.2g} m²)"
