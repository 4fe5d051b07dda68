"""Measures of one object's mesh: the triangles, volumes and areas of its parts."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import ConvexHull, QhullError

from corporeal.core.errors import UserError
from corporeal.core.types import Parts, Scene
from corporeal.discretization.mesh_kind import (
    MeshKind,
    OuterSkin,
    inner_face_fraction,
    mesh_kind_of,
    open_sheets,
    outer_skin,
)
from corporeal.discretization.open_cavity import volume_below_rim
from corporeal.discretization.open_vessel_sheet import vessel_sheet_area
from corporeal.geometry.connected_components import connected_components, connected_pieces
from corporeal.geometry.mesh import (
    Mesh,
    inward_area_loss_rate,
    join_meshes,
    open_edge_ratio,
    orient_outward,
    signed_volume,
    weld_mesh,
)
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.point_sampling import scatter_points


def oriented_box_size(points: Float[np.ndarray, "N 3"]) -> tuple[float, float, float]:
    """Extents of the smallest box around the points, shortest first [m].

    The box of least volume over frames that stand on a face of the convex hull and are turned to one of that face's
    edges, beside the world's and the principal frame.
    """
    centred = points - points.mean(axis=0)
    _, _, principal = np.linalg.svd(centred[:: max(1, len(centred) // 20000)], full_matrices=False)
    frames = [np.eye(3)]
    if principal.shape == (3, 3):
        frames.append(principal)
    try:
        hull = ConvexHull(centred)
    except QhullError:  # flat or straight: the principal frame is the right one
        outline = centred
    else:
        outline = centred[hull.vertices]
        frames += _hull_frames(hull)
    sizes = np.ptp(np.einsum("fij,nj->fni", np.stack(frames), outline), axis=1)
    best = np.sort(sizes[np.argmin(np.prod(sizes + 1e-12, axis=1))])
    return float(best[0]), float(best[1]), float(best[2])


def _hull_frames(hull: ConvexHull, most: int = 80) -> list[np.ndarray]:
    corners = hull.points[hull.simplices]
    edge = corners[:, 1] - corners[:, 0]
    area = np.linalg.norm(np.cross(edge, corners[:, 2] - corners[:, 0]), axis=1)
    frames = []
    for k in np.argsort(area)[::-1][:most]:
        normal = hull.equations[k, :3]
        along = edge[k] / np.linalg.norm(edge[k])
        frames.append(np.stack([normal, along, np.cross(normal, along)]))
    return frames


OBJECT_PROBES_COUNT = 20_000
"""Points that measure an object's volume; the error of a ball's is about 0.2 %."""

MIN_ONE_FACE_FRACTION = 2 / 3
"""What has less of its surface outside is a wall with both faces."""
MIN_PROBES_PER_PART = 1000
"""Fewer of the object's probes say too little of a part."""
PART_PROBES_COUNT, MAX_PART_PROBES_ALONG = 5000, 64
"""So many a part gets of its own, but never more than so many along it."""


@dataclass(frozen=True)
class MeasuredPart:
    """One part of an object, measured."""

    part: int
    body: Mesh
    """Its triangles that enclose something, alone or with other parts."""
    sheet: Mesh
    """Its open sheets."""
    closed: bool
    """Whether ``body`` is closed by itself."""
    build: MeshKind
    volume: float
    """Enclosed by the object and belonging to this part [m³]."""
    size: tuple[float, float, float]
    """Extents of its smallest box, shortest first [m]."""
    whole: QueryMesh | None = None
    """All that encloses something, of the object."""
    drawn: Mesh | None = None
    """The surface of granular material that fills what holds it (``bed``); None: ``body`` is
    drawn.
    """
    holder: int = -1
    """The part that it fills; -1: none."""
    measured: float = 0.0
    """Area of the sheet that it is [m²], found before it was ``hollowed``; 0: not found."""
    lid: Mesh | None = None
    """What of ``body`` is drawn nowhere: the wall below what is soft and lies on it (``lids``)."""

    @cached_property
    def shape(self) -> QueryMesh:
        """``body``, ready to be asked."""
        return QueryMesh(self.body)

    @cached_property
    def body_area(self) -> float:
        """Of every face that encloses something [m²]."""
        return float(self.body.areas.sum())

    @cached_property
    def face_area(self) -> float:
        """Of one face of its wall, if it has one [m²]."""
        if self.build is MeshKind.WALL or self.whole is None or not len(self.body.triangles):
            return 0.5 * self.body_area
        rng = np.random.default_rng(self.part)
        return self.body_area * (1 - inner_face_fraction(self.whole, self.body, self.size[0], rng))

    @cached_property
    def outer_sheet(self) -> float:
        """Of the sheet that it is if it is open ware of which the outside alone is known [m²].

        A wall with two faces is no larger than their mean, as roughness inside adds to its outside.
        """
        if self.measured or self.whole is None or not len(self.body.triangles):
            return self.measured
        area = vessel_sheet_area(self.whole, self.body, np.random.default_rng(self.part))
        return min(area, 0.5 * self.body_area) if self.build is MeshKind.WALL else area

    @cached_property
    def closing(self) -> float:
        """How its outside closes in on its middle [-]: 1 a plate, 2 a rod, 3 a ball or a cube.

        That is n where (1 - A t / (n V))^n of the volume is deeper than t, to the second order.
        """
        if self.build is MeshKind.WALL or not self.volume > 0:
            return 1.0
        inward = 2 * inward_area_loss_rate(self.body) * self.volume / self.face_area**2
        return float(1 / (1 - np.clip(inward, 0, 2 / 3)))

    def narrowing(self, thickness: float) -> float:
        """Mean area of a wall's layers over its outside's [-]; its inside is smaller.

        Args:
            thickness: Of the wall [m].
        """
        n = self.closing
        if n == 1.0 or not thickness > 0:
            return 1.0
        depth = min(self.face_area * thickness / (n * self.volume), 1.0)
        return (1 - (1 - depth) ** n) * self.volume / (self.face_area * thickness)

    @cached_property
    def encloses(self) -> bool:
        """Whether its wall closes about something, alone or with the object's other parts."""
        closed = self.closed or (self.whole is not None and is_nearly_closed(self.whole.mesh))
        return closed and self.face_area > MIN_ONE_FACE_FRACTION * self.body_area

    @cached_property
    def hollow(self) -> float:
        """Volume that a level liquid could fill of it, up to its rim [m³]."""
        if not len(self.body.triangles):
            return 0.0
        rng = np.random.default_rng(self.part)
        return volume_below_rim(self.whole or self.shape, self.body, rng)

    @cached_property
    def sheet_area(self) -> float:
        """Of the open sheets, one side [m²]."""
        return float(self.sheet.areas.sum())


@dataclass(frozen=True)
class MeasuredObject:
    """One object, measured."""

    shape: QueryMesh | None
    """Everything that encloses something; None: only sheets."""
    skin: OuterSkin | None
    """Where it meets the outside."""
    part_of_triangle: Int[np.ndarray, " T"]
    """Of ``shape``."""
    members: tuple[MeasuredPart, ...]
    probes: Float[np.ndarray, "N 3"]
    """Points evenly inside [m]."""
    part_of_probe: Int[np.ndarray, " N"]
    vertices: Float[np.ndarray, "V 3"]
    """Every corner of the object [m]."""

    @property
    def everything(self) -> Mesh:
        """All triangles of the object."""
        meshes = [m for member in self.members for m in (member.body, member.sheet)]
        return Mesh(self.vertices, np.concatenate([m.triangles for m in meshes]))

    def only(self, parts: Collection[int]) -> "MeasuredObject":
        """Leave out the outside of all other parts; probes and enclosing shape stay whole."""
        members = tuple(m for m in self.members if m.part in parts)
        skin = self.skin
        if skin is not None:
            own = np.isin(self.part_of_triangle[skin.numbers], list(parts))
            skin = OuterSkin(QueryMesh(skin.shape.mesh.only(own)), skin.numbers[own])
        used = np.unique(np.concatenate([t for m in members for t in _part_triangles(m)]))
        return replace(self, members=members, skin=skin, vertices=self.vertices[used])

    def label(self, points: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
        """Part of each point inside: the smallest around it, else that of the nearest face."""
        if self.shape is None or not len(points):
            return np.zeros(len(points), dtype=np.int64)
        closed = [m for m in self.members if m.closed]
        return label_points(points, self.shape, self.part_of_triangle, closed)


def _part_triangles(member: MeasuredPart) -> list[np.ndarray]:
    return [member.body.triangles.ravel(), member.sheet.triangles.ravel()]


def measure_object(
    vertices: Float[np.ndarray, "V 3"],
    triangles: Int[np.ndarray, "T 3"],
    part_of_triangle: Int[np.ndarray, " T"],
    rng: np.random.Generator,
) -> MeasuredObject:
    """Weld an object's triangles, find what they enclose, and measure every part.

    Args:
        vertices: [m]
        triangles: All of the object's.
        part_of_triangle: Index into the catalogue of parts.
        rng: Source of the probes.
    """
    mesh, kept = weld_mesh(vertices, triangles, part_of_triangle)
    part = part_of_triangle[kept]
    mesh = orient_outward(mesh)
    piece = detach_open_pieces(mesh, part, connected_pieces(mesh)) if len(kept) else kept
    build = np.where(open_sheets(mesh, piece), MeshKind.SHEET, MeshKind.BODY) if len(kept) else kept
    for group in piece_group_masks(piece, part, build != MeshKind.SHEET):
        shape = QueryMesh(mesh.only(group))
        build[group] = mesh_kind_of(shape, oriented_box_size(shape.mesh.corners.reshape(-1, 3)), rng)
    solid = build != MeshKind.SHEET
    shape = QueryMesh(mesh.only(solid)) if solid.any() else None
    closed = {k: is_nearly_closed(mesh.only(solid & (part == k))) for k in np.unique(part)}
    alone = [
        MeasuredPart(int(k), mesh.only(solid & (part == k)), mesh.only(~solid & (part == k)), closed[k],
               MeshKind(int(build[part == k].min())), 0.0,
               oriented_box_size(mesh.corners[part == k].reshape(-1, 3)), shape)
        for k in np.unique(part)
    ]  # fmt: skip

    return measure_assembled(mesh.vertices, shape, part[solid], alone, rng)


def measure_assembled(
    vertices: Float[np.ndarray, "V 3"],
    shape: QueryMesh | None,
    part_of_triangle: Int[np.ndarray, " T"],
    alone: Sequence[MeasuredPart],
    rng: np.random.Generator,
) -> MeasuredObject:
    """Measure what an object's parts enclose, and where they meet the outside.

    Args:
        vertices: Every corner [m].
        shape: Everything that encloses something; None: only sheets.
        part_of_triangle: Of ``shape``.
        alone: The parts; those that have a volume keep it.
        rng: Source of the probes.
    """
    probes, spacing = probe_inside(shape, rng)

    def owner_of(points: np.ndarray) -> np.ndarray:
        if shape is None:
            return np.zeros(len(points), dtype=np.int64)
        return label_points(points, shape, part_of_triangle, [m for m in alone if m.closed])

    owner = owner_of(probes)
    members = tuple(m if m.volume else _with_probed_volume(m, owner, spacing, owner_of, rng) for m in alone)
    return MeasuredObject(
        shape=shape,
        skin=outer_skin(shape, rng) if shape is not None else None,
        part_of_triangle=part_of_triangle,
        members=members,
        probes=probes,
        part_of_probe=owner,
        vertices=vertices,
    )


def detach_open_pieces(mesh: Mesh, part: Int[np.ndarray, " T"], piece: Int[np.ndarray, " T"]) -> Int[np.ndarray, " T"]:
    """Take what is open off a part that is closed by itself and shares vertices with it.

    A disc of soil whose rim is one with a line on its pot's inside has three faces at each edge there, and would make
    an open sheet of both.
    """
    found = piece.copy()
    pairs = np.unique(np.column_stack([piece, part]), axis=0)
    for k in np.flatnonzero(np.bincount(pairs[:, 0]) > 1):
        if is_nearly_closed(mesh.only(piece == k)):
            continue
        for number in pairs[pairs[:, 0] == k, 1]:
            own = (piece == k) & (part == number)
            if is_nearly_closed(mesh.only(own)):
                found[own] = found.max() + 1
        rest = found == k
        if rest.any():
            found[rest] = found.max() + 1 + connected_pieces(mesh.only(rest))
    return np.unique(found, return_inverse=True)[1].reshape(-1)


def piece_group_masks(piece: np.ndarray, part: np.ndarray, among: np.ndarray) -> list[np.ndarray]:
    """Masks of the triangles that share pieces or parts, and so are read as one object."""
    if not among.any():
        return []
    _, p = np.unique(piece[among], return_inverse=True)
    _, q = np.unique(part[among], return_inverse=True)
    p, q = p.reshape(-1), q.reshape(-1) + p.max() + 1
    label = np.full(len(piece), -1)
    label[among] = connected_components(p, q, q.max() + 1)[p]
    return [label == k for k in range(label.max() + 1)]


def is_nearly_closed(mesh: Mesh) -> bool:
    """Whether a mesh is closed but for cracks, so that "inside it" has a meaning."""
    return len(mesh.triangles) >= 4 and open_edge_ratio(mesh) < 0.1


def probe_inside(shape: QueryMesh | None, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """About ``OBJECT_PROBES_COUNT`` points evenly inside, each standing for spacing³."""
    if shape is None:
        return np.zeros((0, 3)), 0.0
    used = shape.mesh.vertices[np.unique(shape.mesh.triangles)]
    low, high = used.min(axis=0), used.max(axis=0)
    span = np.maximum(high - low, 1e-3 * (high - low).max())
    guess = max(abs(signed_volume(shape.mesh)), 1e-4 * float(np.prod(span)))
    spacing = (min(guess, float(np.prod(span))) / OBJECT_PROBES_COUNT) ** (1 / 3)
    points = scatter_points(shape, spacing, rng)
    for _ in range(2):
        if len(points) > 0.7 * OBJECT_PROBES_COUNT:
            break
        # Too few to trust their number: grow by a bounded step.
        spacing *= max(len(points) / OBJECT_PROBES_COUNT, 1 / 40) ** (1 / 3)
        points = scatter_points(shape, spacing, rng)
    return points, spacing


def label_points(
    points: np.ndarray, shape: QueryMesh, part_of_triangle: np.ndarray, closed: list[MeasuredPart]
) -> np.ndarray:
    """Part of each point: the smallest closed part around it, else that of the nearest face."""
    if (part_of_triangle == part_of_triangle[0]).all():
        return np.full(len(points), part_of_triangle[0], dtype=np.int64)
    names = {m.part for m in closed}
    rest = np.flatnonzero(~np.isin(part_of_triangle, list(names)))
    result = np.full(len(points), -1, dtype=np.int64)
    for member in sorted(closed, key=lambda m: -abs(signed_volume(m.body))):
        used = member.body.vertices[np.unique(member.body.triangles)]
        low, high = used.min(axis=0), used.max(axis=0)
        near = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
        result[near[member.shape.inside(points[near])]] = member.part
    left = np.flatnonzero(result < 0)
    faces = rest if len(rest) else np.arange(len(part_of_triangle))
    result[left] = part_of_triangle[faces[QueryMesh(shape.mesh.only(faces)).closest(points[left])[1]]]
    return result


def _with_probed_volume(
    member: MeasuredPart,
    owner: np.ndarray,
    spacing: float,
    owner_of: Callable[[np.ndarray], np.ndarray],
    rng: np.random.Generator,
) -> MeasuredPart:
    """Count the probes; where the mesh is closed and agrees, its own exact volume is better.

    A closed part that few of the object's probes hit has some of its own: its mesh may overlap itself, or hold or share
    what is another's. Where it is too thin for many of those too, it agrees within three standard errors.
    """
    exact, margin = abs(signed_volume(member.body)) if member.closed else 0.0, 0.03
    if exact > 0 and (owner == member.part).sum() < MIN_PROBES_PER_PART:
        spacing = max((exact / PART_PROBES_COUNT) ** (1 / 3), member.body.extent / MAX_PART_PROBES_ALONG)
        # From a stream of its own: nothing else that is drawn depends on it.
        owner = owner_of(scatter_points(member.shape, spacing, rng.spawn(1)[0]))
        margin = max(margin, 3 * (spacing**3 / exact) ** 0.5)
    count = int((owner == member.part).sum())
    volume = count * spacing**3
    agrees = abs(exact - volume) < margin * exact or not count
    return replace(member, volume=exact if exact > 0 and agrees else volume)


def measure_objects(scene: Scene, parts: Parts, seed: int) -> list[MeasuredObject]:
    """Measure every object.

    Raises:
        UserError: A part has no surface.
    """
    whole = join_meshes(scene.surfaces)
    anatomies = []
    for number in range(len(scene.objects)):
        own = np.flatnonzero(parts.object_of_point == number)
        label = _without_unlabelled(parts.part_of_point[own])
        rng = np.random.default_rng([seed, number, 0])
        used, triangles = np.unique(whole.triangles[own], return_inverse=True)
        anatomies.append(measure_object(whole.vertices[used], triangles.reshape(-1, 3), label, rng))
    found = {m.part for a in anatomies for m in a.members}
    for k, part in enumerate(parts.catalogue):
        if k not in found:
            name = scene.objects[part.object].name
            raise UserError(
                f"Part {part.name!r} of object {name!r} has no surface: all of its triangles have "
                "no area. Remove it from the file, or give it another part's name."
            )
    return anatomies


def _without_unlabelled(label: np.ndarray) -> np.ndarray:
    """Give triangles that belong to no part to the object's most common part."""
    named = label[label >= 0]
    if len(named) == len(label) or not len(named):
        return label
    return np.where(label >= 0, label, np.bincount(named).argmax())


def refuse_flat_scene(scene: Scene, anatomies: list[MeasuredObject]) -> None:
    """Stop when nothing in the scene has a body.

    Raises:
        UserError: Every part is flat.
    """
    members = [m for a in anatomies for m in a.members]
    if all(m.volume == 0 and m.size[0] < 1e-6 * m.size[2] for m in members):
        raise UserError(
            f"{scene.source}: no object encloses a volume; every part is flat, so there is "
            "nothing to fill. Use a model of a solid object."
        )


def refuse_buried_objects(scene: Scene, anatomies: list[MeasuredObject], cell: float) -> None:
    """Stop when an object reaches more than one cell into the floor or a wall.

    Args:
        scene: The objects and the walls.
        anatomies: One per object.
        cell: Grid spacing [m].

    Raises:
        UserError: It names the object.
    """
    for obj, anatomy in zip(scene.objects, anatomies, strict=True):
        lowest = float(anatomy.vertices[:, 2].min())
        if lowest < -cell:
            raise UserError(
                f"Object {obj.name!r} reaches {-lowest:.3g} m below the floor. Raise its position by as much."
            )
        for k, wall in enumerate(scene.walls):
            depth = float(((np.array(wall.point) - anatomy.vertices) @ np.array(wall.normal)).max())
            if depth > cell:
                raise UserError(
                    f"Object {obj.name!r} reaches {depth:.3g} m into wall {k + 1}. "
                    "Move one of them, or flip the wall's normal."
                )
