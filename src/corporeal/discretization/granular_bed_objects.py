"""Granular beds of objects of which only the surface is drawn.

Granular beds: material below a drawn surface, down to the walls of its container.

Models and pictures show only the top surface of contents. Grains and liquids do not rest on air, so they fill the space
between that surface and the container.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import binary_dilation
from scipy.spatial import KDTree
from skimage.measure import label

from corporeal.core.types import MaterialField, Parts, Scene
from corporeal.discretization.cavity import is_vessel, part_corners
from corporeal.discretization.fill_level import (
    VESSEL_SAMPLES_ALONG_SIDE,
    limit_to_thin_wall,
    positive_volume,
    sample_isosurface,
)
from corporeal.discretization.mesh_kind import MeshKind
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart, measure_assembled, oriented_box_size
from corporeal.discretization.open_cavity import HORIZONTAL_DIRECTIONS_COUNT, blocked_direction_count, is_blocked
from corporeal.discretization.part_model import infer_structure, part_specification
from corporeal.geometry.mesh import Mesh, join_meshes, open_edge_ratio, signed_volume, weld_mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

MIN_BED_VOLUME_RATIO = 1.25
"""What could hold no more than this many times what is drawn is drawn whole."""
MIN_LID_NORMAL_Z = 0.7
"""Cosine of the steepest face of a lid to the level."""
MAX_HOLDER_REACH_WIDTHS = 1.5
"""What holds it reaches no farther beyond its surface than this many times its width."""


@dataclass(frozen=True)
class GranularBed:
    """Granular material from its drawn surface down to what holds it."""

    mesh: Mesh
    """Closed; normals outward."""
    holder: int
    """The part that most of it lies against."""


@dataclass(frozen=True)
class HoldingWall:
    """Another part of the object, which may hold it."""

    member: MeasuredPart
    hollow: bool
    """Whether it is a wall of which only the outside is drawn."""
    thickness: float
    """Of that wall [m]."""
    half: float
    """Half the thickness of its open sheets [m]."""

    @cached_property
    def body(self) -> QueryMesh | None:
        """What of it encloses something."""
        return self.member.shape if len(self.member.body.triangles) else None

    @cached_property
    def sheet(self) -> QueryMesh | None:
        """Its open sheets."""
        return QueryMesh(self.member.sheet) if len(self.member.sheet.triangles) else None

    def room(self, points: Float[np.ndarray, "N 3"], inside: Bool[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        """Distance from its material [m].

        Args:
            points: [m]
            inside: Which are behind what the object's faces enclose.
        """
        found = np.full(len(points), np.inf)
        if self.body is not None:
            found = self.body.closest(points)[0] - np.where(inside, self.thickness, 0.0)
        if self.sheet is not None:
            found = np.minimum(found, self.sheet.closest(points)[0] - self.half)
        return found


def holding_wall_of(member: MeasuredPart, field: MaterialField, top: QueryMesh) -> HoldingWall:
    """Return where a part's material is.

    A hollow body that is drawn by its outside has no lid where granular material lies on it.
    """
    made = infer_structure(member, part_specification(member.part, field))
    if made.thickness == 0 or made.modelled or is_vessel(member):
        return HoldingWall(member, hollow=False, thickness=0.0, half=0.5 * made.sheet)
    up = np.tile([0.0, 0.0, 1.0], (len(member.body.triangles), 1))
    above = top.reach(member.body.corners.mean(axis=1) - made.thickness * up, up)
    lid = (member.body.normals[:, 2] > MIN_LID_NORMAL_Z) & (above < 2 * made.thickness)
    bare = replace(member, body=member.body.only(~lid))
    return HoldingWall(bare, hollow=True, thickness=made.thickness, half=0.5 * made.sheet)


def find_granular_bed(anatomy: MeasuredObject, member: MeasuredPart, field: MaterialField) -> GranularBed | None:
    """Find what a part of granular material fills; None: it is drawn whole, or nothing holds it.

    That is what is free of other parts' material, hangs together below the drawn surface, and has their faces below
    and, but for one crack, all around. Beside the surface its nearest height counts.
    """
    others = [m for m in anatomy.members if m is not member]
    if not others or any(field.structures[m.part].contents for m in others):
        return None
    top = QueryMesh(join_meshes([member.body, member.sheet]))
    ground = _BedSearch(anatomy, member, top, [holding_wall_of(m, field, top) for m in others])
    box, found = ground.box, None
    for across in (
        VESSEL_SAMPLES_ALONG_SIDE // 2,
        VESSEL_SAMPLES_ALONG_SIDE,
    ):  # at first where it may be, then where it is
        found = None if box is None else ground.sampled(*box, across)
        box = None if found is None else found.box
        if found is None or box is None or found.volume < MIN_BED_VOLUME_RATIO * member.volume:
            return None
    assert found is not None
    cut = sample_isosurface(found.inside, found.step, found.first)
    mesh, _ = weld_mesh(cut.vertices, cut.triangles)
    if signed_volume(mesh) < MIN_BED_VOLUME_RATIO * member.volume:
        return None
    middles = mesh.corners.mean(axis=1)
    inside = np.ones(len(middles), dtype=bool)
    near = np.argmin([w.room(middles, inside) for w in ground.walls], axis=0)
    against = np.bincount(near, mesh.areas, len(others))
    return GranularBed(mesh, others[int(against.argmax())].part)


@dataclass(frozen=True)
class _BedSamples:
    """How deep inside of a bed points of a grid are."""

    inside: Float[np.ndarray, "X Y Z"]
    """[m]; negative outside."""
    step: float
    """[m]"""
    first: Float[np.ndarray, "3"]
    """[m]"""

    @property
    def volume(self) -> float:
        """Of the bed [m³]."""
        return positive_volume(self.inside, self.step)

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Where it is inside [m]; None: nowhere."""
        where = np.argwhere(self.inside > 0)
        if not len(where):
            return None
        low, high = where.min(axis=0), where.max(axis=0)
        return self.first + (low - 1) * self.step, self.first + (high + 1) * self.step


@dataclass(frozen=True)
class _BedSearch:
    """What a bed is looked for in."""

    anatomy: MeasuredObject
    member: MeasuredPart
    top: QueryMesh
    """All that is drawn of the granular material."""
    walls: Sequence[HoldingWall]

    @cached_property
    def faces(self) -> QueryMesh:
        """All faces of other parts, and what they stand on."""
        meshes = [m for w in self.walls for m in (w.member.body, w.member.sheet)]
        corners = join_meshes(meshes).corners.reshape(-1, 3)
        a, c, z = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0), self.floor
        floor = np.array([[*a, z], [c[0], a[1], z], [*c, z], [a[0], c[1], z]])
        return QueryMesh(join_meshes([*meshes, Mesh(floor, np.array([[0, 1, 2], [0, 2, 3]]))]))

    @cached_property
    def floor(self) -> float:
        """Height of what they stand on [m]."""
        return min(float(part_corners(w.member)[:, 2].min()) for w in self.walls)

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Where it may be [m]; None: nothing is lower than it."""
        own = part_corners(self.member)
        corners = np.concatenate([part_corners(w.member) for w in self.walls])
        corners = corners[corners[:, 2] < own[:, 2].max()]
        if not len(corners):
            return None
        wide = MAX_HOLDER_REACH_WIDTHS * np.ptp(own, axis=0)
        low = np.maximum(corners.min(axis=0), own.min(axis=0) - wide)
        high = np.minimum(corners.max(axis=0), own.max(axis=0) + wide)
        low[2], high[2] = corners[:, 2].min(), own[:, 2].max()
        return (low, high) if (high > low).all() else None

    def sampled(self, low: np.ndarray, high: np.ndarray, across: int) -> _BedSamples:
        """Ask the points of a grid in a box [m], ``across`` of them along its longest side."""
        step = float((high - low).max()) / across
        axes = [np.arange(a - step, b + 2 * step, step) for a, b in zip(low, high, strict=True)]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        below = self.heights(axes[0], axes[1])[:, :, None] - axes[2]
        below = np.minimum(below, axes[2] - self.floor)
        held = below > 0
        held[held] = self.held(grid[held])
        # Of what is about it, too, to find the wall between.
        asked = np.asarray(binary_dilation(held, np.ones((3, 3, 3), bool)), dtype=bool)
        room = np.full(held.shape, -2 * step)
        room[asked] = self.room(grid[asked])
        free = self.together(grid, room, held & (room > 0), step) | (below <= 0)
        depth = limit_to_thin_wall(np.where(free, room, -np.abs(room)), free, step)
        first = np.array([axis[0] for axis in axes])
        return _BedSamples(np.maximum(np.minimum(depth, below), -2 * step), step, first)

    def heights(self, x: np.ndarray, y: np.ndarray) -> Float[np.ndarray, "X Y"]:
        """Height of the drawn surface over each column, beside it the nearest one [m]."""
        columns = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        high = float(self.top.mesh.corners[..., 2].max()) + 0.1 * self.top.mesh.extent
        down = np.tile([0.0, 0.0, -1.0], (len(columns), 1))
        fall = self.top.reach(np.column_stack([columns, np.full(len(columns), high)]), down)
        hit = np.isfinite(fall)
        found = high - fall
        if hit.any() and not hit.all():
            nearest = KDTree(columns[hit]).query(columns[~hit])[1]
            found[~hit] = found[hit][nearest]
        return np.where(np.isfinite(found), found, -np.inf).reshape(len(x), len(y))

    def room(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Distance from other parts' material [m]; negative in it."""
        shape = self.anatomy.shape
        inside = np.zeros(len(points), bool) if shape is None else shape.inside(points)
        found = np.min([w.room(points, inside) for w in self.walls], axis=0)
        hollow = [w.member.part for w in self.walls if w.hollow]
        free = ~inside
        free[inside] = np.isin(self.anatomy.label(points[inside]), [self.member.part, *hollow])
        return np.where(free, found, -np.abs(found))

    def held(self, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """Whether there are faces below and, but for one crack, all around."""
        found = is_blocked([self.faces], points, np.array([0.0, 0.0, -1.0]))
        found[found] = blocked_direction_count([self.faces, self.top], points[found]) >= HORIZONTAL_DIRECTIONS_COUNT - 1
        return found

    def together(self, grid: np.ndarray, room: np.ndarray, held: np.ndarray, step: float) -> Bool[np.ndarray, "X Y Z"]:
        """Keep what hangs together below the drawn surface, without going through a face."""
        core = held & (room > 0.5 * step)
        pieces = np.asarray(label(core, connectivity=1))
        near = core.copy()
        near[core] = self.seen(grid[core], 2.5 * step)
        kept = np.isin(pieces, np.unique(pieces[near])) & core
        for axis in range(3):
            for way in (-1, 1):
                kept |= self._beside(grid, kept, held & ~kept, (axis, way))
        return kept

    def seen(self, points: Float[np.ndarray, "N 3"], reach: float) -> Bool[np.ndarray, " N"]:
        """Whether the drawn surface is within reach [m], with no face between."""
        away, _, foot = self.top.closest(points)
        near = np.flatnonzero((away > 0) & (away < reach))
        way = (foot - points)[near] / away[near, None]
        found = np.zeros(len(points), dtype=bool)
        found[near] = self.faces.reach(points[near], way) > away[near] * (1 - 1e-6)
        return found

    def _beside(
        self, grid: np.ndarray, kept: np.ndarray, asked: np.ndarray, side: tuple[int, int]
    ) -> Bool[np.ndarray, "X Y Z"]:
        """Find asked points next to kept ones, on one side, with no face between."""
        axis, way = side
        one = np.zeros((3, 3, 3), bool)
        place = [1, 1, 1]
        place[axis] += way
        one[tuple(place)] = True
        found = asked & np.asarray(binary_dilation(kept, one), dtype=bool)
        back = np.zeros(3)
        back[axis] = -way
        points = grid[found]
        step = float(np.linalg.norm(grid[1, 0, 0] - grid[0, 0, 0]))
        free = self.faces.reach(points, np.tile(back, (len(points), 1))) > step
        found[found] = free
        return found


BED_PROBE_SEED = 9
"""Of the probes of an object with a bed."""


def loose_matter_parts(field: MaterialField) -> set[int]:
    """Parts of grains or of a liquid, which lie over no air."""
    return {k for k, m in enumerate(field.materials) if CONSTITUTIVE_LAWS[m.law].loose}


def fill_all_beds(anatomies: Sequence[MeasuredObject], field: MaterialField) -> list[MeasuredObject]:
    """Let the granular material of every object fill what holds it.

    Args:
        anatomies: One per object.
        field: What all is made of, with walls as thick as in the scene.
    """
    loose = loose_matter_parts(field)
    return [with_beds(a, find_beds(a, field, loose)) for a in anatomies]


def find_beds(anatomy: MeasuredObject, field: MaterialField, loose: Collection[int]) -> dict[int, GranularBed]:
    """Find the bed of each part of granular material that has one."""
    found = {m.part: find_granular_bed(anatomy, m, field) for m in anatomy.members if m.part in loose}
    return {part: bed for part, bed in found.items() if bed is not None}


def with_beds(anatomy: MeasuredObject, beds: Mapping[int, GranularBed]) -> MeasuredObject:
    """Put beds in place of what is drawn of them.

    What is drawn stays a face of the object where it closes it; all other parts stay as they are: a bed takes up air.
    """
    if not beds:
        return anatomy
    starts = len(anatomy.vertices) + np.cumsum([0, *(len(b.mesh.vertices) for b in beds.values())])
    vertices = np.concatenate([anatomy.vertices, *(b.mesh.vertices for b in beds.values())])
    body = {
        part: Mesh(vertices, bed.mesh.triangles + start)
        for (part, bed), start in zip(beds.items(), starts, strict=False)
    }
    faces, of_face = _without_parts(anatomy, body)
    triangles = np.concatenate([faces, *(m.triangles for m in body.values())])
    shape = QueryMesh(Mesh(vertices, triangles))
    added = [np.full(len(m.triangles), part) for part, m in body.items()]
    alone = [
        _part_as_bed(m, beds[m.part].holder, body[m.part], shape) if m.part in body else m for m in anatomy.members
    ]
    of_triangle = np.concatenate([of_face, *added])
    return measure_assembled(vertices, shape, of_triangle, alone, np.random.default_rng(BED_PROBE_SEED))


def _without_parts(
    anatomy: MeasuredObject, parts: Collection[int]
) -> tuple[Int[np.ndarray, "T 3"], Int[np.ndarray, " T"]]:
    """Return the faces of an object, and whose they are, less those of parts that close nothing."""
    if anatomy.shape is None:
        return np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
    mesh, of_face = anatomy.shape.mesh, anatomy.part_of_triangle
    for part in parts:
        rest = mesh.only(of_face != part)
        if not len(rest.triangles) or open_edge_ratio(rest) <= open_edge_ratio(mesh):
            mesh, of_face = rest, of_face[of_face != part]
    return mesh.triangles, of_face


def _part_as_bed(member: MeasuredPart, holder: int, body: Mesh, shape: QueryMesh) -> MeasuredPart:
    return replace(
        member,
        body=body,
        sheet=body.only(np.zeros(len(body.triangles), dtype=bool)),
        closed=True,
        build=MeshKind.BODY,
        volume=0.0,
        size=oriented_box_size(body.corners.reshape(-1, 3)),
        whole=shape,
        drawn=join_meshes([member.body, member.sheet]),
        holder=holder,
    )


def describe_beds(member: MeasuredPart, parts: Parts) -> str:
    """Describe in words what granular material fills; "" where it is as it is drawn."""
    if member.drawn is None:
        return ""
    return f": it fills {parts.catalogue[member.holder].name} below its surface"


def warn_of_loose_sheets(
    scene: Scene, parts: Parts, anatomies: Sequence[MeasuredObject], field: MaterialField
) -> tuple[str, ...]:
    """Warn of granular material of which only a surface is drawn, and that nothing holds."""
    loose = loose_matter_parts(field)
    found = [m for a in anatomies for m in a.members if m.part in loose and m.volume == 0]
    return tuple(
        f"{scene.objects[parts.catalogue[m.part].object].name}: {parts.catalogue[m.part].name} of "
        f"{field.materials[m.part].name} is drawn as an open sheet, and nothing of the same object "
        "holds it: its depth and mass are a guess. Model its volume or its container."
        for m in found
    )
