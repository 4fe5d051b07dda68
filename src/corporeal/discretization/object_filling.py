"""Material points of one object, part by part."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.discretization.cavity import vessel_points
from corporeal.discretization.mesh_kind import outer_wall_side
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart
from corporeal.discretization.middle_surface import middle_surface
from corporeal.discretization.point_filling import PointFilling, fill_body, fill_wall
from corporeal.discretization.rods import Rod, rod_section_points
from corporeal.geometry.connected_components import connected_pieces
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.point_sampling import sample_surface, scatter_points
from corporeal.mpm.shells.assemble import vertex_volume

FULL_FILL_DEPTH_SPACINGS = 4
"""Below so many spacings under its surface, a rigid object is filled coarsely."""


@dataclass(frozen=True)
class FillRecipe:
    """Where one part's material lies."""

    depth: float
    """How far below the surface there is material [m]; inf: all through; 0: see ``wall``."""
    wall: float
    """Thickness of layers below the outer face of a wall that is modelled thinner [m]."""
    sheet: float
    """Thickness of open sheets [m]."""
    rod: Rod | None = None
    """Centreline of a part that stands on rings of points."""
    thick: float = 0.0
    """Diameter that these stand for [m]."""
    level: float = np.inf
    """Above this height [m] there is material in the wall only."""
    vessel: bool = False
    """Whether there is material between the faces of the mesh too, up to its rim."""
    shell: float = 0.0
    """Thickness of a triangle shell, whose vertices are all its points [m]; 0: it is none."""


@dataclass(frozen=True)
class ObjectFilling:
    """Points of one object; N points."""

    points: Float[np.ndarray, "N 3"]
    """[m]"""
    volumes: Float[np.ndarray, " N"]
    """Relative within a part's body and within its sheets [m³]."""
    part: Int[np.ndarray, " N"]
    sheet: Bool[np.ndarray, " N"]
    """Whether the point belongs to an open sheet."""
    triangle: Int[np.ndarray, "T 3"] = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    """Points that are the vertices of each triangle of a shell …"""
    wall: Float[np.ndarray, " T"] = field(default_factory=lambda: np.zeros(0))
    """… and its thickness there [m]."""

    def only(self, chosen: np.ndarray) -> "ObjectFilling":
        """Return the chosen points; triangles stay that have all of theirs."""
        number = np.cumsum(chosen) - 1
        whole = chosen[self.triangle].all(axis=1)
        return ObjectFilling(
            self.points[chosen],
            self.volumes[chosen],
            self.part[chosen],
            self.sheet[chosen],
            number[self.triangle[whole]],
            self.wall[whole],
        )

    @property
    def is_vertex(self) -> Bool[np.ndarray, " N"]:
        """Which points are vertices of shells."""
        found = np.zeros(len(self.points), dtype=bool)
        found[self.triangle] = True
        return found


def fill_object(
    anatomy: MeasuredObject,
    recipes: dict[int, FillRecipe],
    spacing: float,
    rng: np.random.Generator,
    *,
    coarse: bool = False,
) -> ObjectFilling:
    """Fill every part of an object; every part gets at least one point.

    Args:
        anatomy: The object.
        recipes: One per part.
        spacing: Between points [m].
        rng: Source of all randomness.
        coarse: Whether the deep inside may have points twice as far apart.
    """
    lumps = [_fill_bodies(anatomy, recipes, spacing, rng, coarse=coarse)]
    for member in anatomy.members:
        recipe = recipes[member.part]
        if recipe.shell > 0.0:
            lumps[0] = lumps[0].only(lumps[0].part != member.part)
            lumps.append(_lay_shell(member, recipe.shell, spacing))
            continue
        face = member.body
        if recipe.rod is not None:
            points = rod_section_points(recipe.rod, recipe.thick, spacing)
            lumps.append(_lump_point(PointFilling(points, np.ones(len(points))), member, sheet=False))
        elif recipe.depth == 0 and len(face.triangles):
            outer = outer_wall_face(anatomy, member)
            lumps.append(
                _lump_point(fill_wall(outer, spacing, _fitting_face(outer, recipe.wall), rng), member, sheet=False)
            )
        elif len(face.triangles) and not (lumps[0].part == member.part).any():
            lumps.append(_lump_point(fill_wall(face, spacing, 0.0, rng), member, sheet=False))
        if recipe.vessel:
            lumps.append(_fill_vessel(anatomy, member, recipe, spacing * (1 + coarse), rng))
        lumps += _fill_lid_and_sheets(member, recipe, spacing, rng)
    firsts = np.cumsum([0, *(len(p.points) for p in lumps[:-1])])
    return ObjectFilling(
        np.concatenate([p.points for p in lumps]),
        np.concatenate([p.volumes for p in lumps]),
        np.concatenate([p.part for p in lumps]),
        np.concatenate([p.sheet for p in lumps]),
        np.concatenate([p.triangle + first for p, first in zip(lumps, firsts, strict=True)]),
        np.concatenate([p.wall for p in lumps]),
    )


def _fill_lid_and_sheets(
    member: MeasuredPart, recipe: FillRecipe, spacing: float, rng: np.random.Generator
) -> list[ObjectFilling]:
    """Fill the wall that is drawn nowhere, and open sheets."""
    lumps = []
    if member.lid is not None and 0 < recipe.depth < np.inf:
        lumps.append(_lump_point(fill_wall(member.lid, spacing, recipe.depth, rng), member, sheet=False))
    if member.sheet_area > 1e-3 * member.body_area:
        filling = fill_wall(member.sheet, spacing, _fitting_face(member.sheet, recipe.sheet), rng)
        lumps.append(_lump_point(filling, member, sheet=True))
    return lumps


def _lay_shell(member: MeasuredPart, thickness: float, spacing: float) -> ObjectFilling:
    """Mesh the middle surface of a thin part; its vertices are the points."""
    body, sheet = member.body, member.sheet
    whole = Mesh(
        np.concatenate([body.vertices, sheet.vertices]),
        np.concatenate([body.triangles, sheet.triangles + len(body.vertices)]),
    )
    shell = middle_surface(whole, thickness, spacing)
    volume = vertex_volume(shell.vertices, shell.triangles, shell.thickness)
    count = len(volume)
    return ObjectFilling(
        shell.vertices,
        np.maximum(volume, 1e-300),
        np.full(count, member.part),
        np.zeros(count, dtype=bool),
        shell.triangles,
        np.full(len(shell.triangles), thickness),
    )


def _fitting_face(face: Mesh, thickness: float) -> float:
    """Give leaves one layer: a thickness is for pieces that are wider than it is twice."""
    count = int(connected_pieces(face).max()) + 1
    return thickness if face.areas.sum() / count > (2 * thickness) ** 2 else 0.0


def _lump_point(filling: PointFilling, member: MeasuredPart, *, sheet: bool) -> ObjectFilling:
    n = len(filling.points)
    volumes = np.maximum(filling.volumes, 1e-300)
    return ObjectFilling(filling.points, volumes, np.full(n, member.part), np.full(n, sheet))


def _fill_vessel(
    anatomy: MeasuredObject, member: MeasuredPart, recipe: FillRecipe, spacing: float, rng: np.random.Generator
) -> ObjectFilling:
    points = vessel_points(anatomy, member, spacing, rng)
    points = points[points[:, 2] <= recipe.level]
    return _lump_point(PointFilling(points, np.full(len(points), spacing**3)), member, sheet=False)


def _fill_bodies(
    anatomy: MeasuredObject, recipes: dict[int, FillRecipe], spacing: float, rng: np.random.Generator, *, coarse: bool
) -> ObjectFilling:
    nothing = np.zeros(0, dtype=np.int64)
    if anatomy.shape is None or anatomy.skin is None or not len(anatomy.skin.numbers):
        return ObjectFilling(np.zeros((0, 3)), np.zeros(0), nothing, nothing.astype(bool))
    shape, skin = anatomy.shape, anatomy.skin.shape
    full = FULL_FILL_DEPTH_SPACINGS * spacing
    depth_of = {m.part: recipes[m.part].depth for m in anatomy.members}
    wall_of = {m.part: recipes[m.part].wall for m in anatomy.members}
    level_of = {m.part: recipes[m.part].level for m in anatomy.members}

    def allowed(points: np.ndarray) -> np.ndarray:
        part = anatomy.label(points)
        limit, void = _lookup_label(part, depth_of), points[:, 2] > _lookup_label(part, level_of)
        return np.where(void, _lookup_label(part, wall_of), limit)

    def deepest(points: np.ndarray) -> np.ndarray:
        limit = allowed(points)
        return np.minimum(limit, full) if coarse else limit

    near = fill_body(shape, skin, spacing, deepest, rng)
    points, volumes = near.points, near.volumes
    if coarse:
        deep = scatter_points(shape, 2 * spacing, rng)
        distance = skin.closest(deep)[0]
        deep = deep[(distance > full) & (distance < allowed(deep))]
        points = np.concatenate([points, deep])
        volumes = np.concatenate([volumes, np.full(len(deep), 8 * spacing**3)])
    return ObjectFilling(points, volumes, anatomy.label(points), np.zeros(len(points), dtype=bool))


def _lookup_label(label: np.ndarray, table: dict[int, float]) -> np.ndarray:
    values = np.zeros(max([*table, 0]) + 1)
    values[list(table)] = list(table.values())
    return values[label]


def outer_wall_face(anatomy: MeasuredObject, member: MeasuredPart) -> Mesh:
    """Of a wall modelled with both faces, the outer one; normals outward."""
    if anatomy.shape is None or anatomy.skin is None:
        return member.body
    own = anatomy.part_of_triangle[anatomy.skin.numbers] == member.part
    face = anatomy.skin.shape.mesh.only(own)
    if not own.any():
        return member.body
    outer = face.only(outer_wall_side(QueryMesh(face)))
    return outer if len(outer.triangles) else face


def reference_points(
    anatomy: MeasuredObject, member: MeasuredPart, wall: float, rng: np.random.Generator, count: int = 20_000
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "M 3"]]:
    """Points spread as a part's material truly is, for its centre and inertia.

    Args:
        anatomy: The object.
        member: The part.
        wall: True wall thickness of a shell whose mesh shows one face only [m]; 0: a solid, or a wall with both faces.
        rng: Source of the samples.
        count: How many on each surface.

    Returns:
        Points for the body and points for the sheets.
    """
    body = anatomy.probes[anatomy.part_of_probe == member.part]
    if len(member.body.triangles) and (wall > 0 or not len(body)):
        body, triangle = sample_surface(member.body, count, rng)
        body = body - 0.5 * wall * member.body.normals[triangle]
    sheet = np.zeros((0, 3))
    if len(member.sheet.triangles):
        sheet, _ = sample_surface(member.sheet, count, rng)
    return body, sheet
