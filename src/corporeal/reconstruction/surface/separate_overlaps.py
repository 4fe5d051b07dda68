"""Separation of overlapping surfaces of touching objects.

Each was carved on its own grid and moved on its own, so that some end up a cell or two inside each other. What lies
inside another goes half of the way out, again and again, as the other does: both give way alike, and what is clear of
all others stays where it is. Meanwhile vertices spread along their surface, as what is pushed back far would fold
otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from corporeal.geometry.box_placement import overlapping_boxes
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.reconstruction.surface.fairing import FLOOR_TOLERANCE_M, neighbour_mean_matrix

INSIDE_WINDING_NUMBER = 0.5
"""Winding number, of either sign, from which on a place is inside."""
TOUCH_DEPTH_CELLS = 1e-3
"""What lies no deeper in another only touches it [cells]."""
MAX_OVERLAP_DEPTH_CELLS = 6.0
"""Where one lies deeper in another, that is no seam between them, and both stay [cells]."""
SEPARATION_ITERATIONS = 14
"""How often what is inside goes half of the way out."""
SMOOTHING_ITERATIONS = 7
"""In how many of them vertices spread,"""
SMOOTHING_WEIGHT = 0.5
"""and how much of the way to the middle of their neighbours."""
MAX_REMAINING_OVERLAP_FRACTION = 0.1
"""Where more of an overlap is left, one goes through the other, and both stay."""


@dataclass(frozen=True)
class _MovableSurface:
    """An object's surface, and the part of it that may move."""

    mesh: Mesh
    near: Int[np.ndarray, "N 3"]
    """Triangles that may move."""
    far: QueryMesh
    """The others: they only say what is inside."""
    mean: csr_array
    lies: Bool[np.ndarray, " V"]
    """Vertices on the floor."""
    floor: float

    @cached_property
    def _near(self) -> QueryMesh:
        return QueryMesh(_mirror_at_floor(self.mesh, self.near, self.floor))

    def way_out(self, points: Float[np.ndarray, "P 3"]) -> tuple[Float[np.ndarray, " P"], Float[np.ndarray, "P 3"]]:
        """How deep inside points are, 0: outside [m], and the way to the surface [m]."""
        depth, way = np.zeros(len(points)), np.zeros((len(points), 3))
        winding = _winding_numbers(self.far, points) + _winding_numbers(self._near, points)
        held = np.flatnonzero(np.abs(winding) > INSIDE_WINDING_NUMBER)
        depth[held], _, on = self._near.closest(points[held])
        way[held] = on - points[held]
        return depth, way

    def moved(self, way: Float[np.ndarray, "V 3"], spread: Bool[np.ndarray, " V"]) -> "_MovableSurface":
        """Move vertices, then spread some; what lies on the floor stays on it."""
        v = self.mesh.vertices + way
        own = np.flatnonzero(spread)
        if len(own):
            standing = self.near[~self.lies[self.near].all(axis=1)]
            normal = Mesh(v, standing).vertex_normals[own]
            pull = self.mean[own] @ v - v[own]
            pull -= np.einsum("ij,ij->i", pull, normal)[:, None] * normal
            v[own] += SMOOTHING_WEIGHT * pull
        v[self.lies, 2] = self.floor
        v[:, 2] = np.maximum(v[:, 2], self.floor)
        return replace(self, mesh=Mesh(v, self.mesh.triangles))


def separate_overlaps(meshes: Sequence[Mesh], cells: Sequence[float], floor: float) -> tuple[Mesh, ...]:
    """Return surfaces that hardly overlap; triangles stay the same, and what touches nothing.

    Where one goes through another, or deep into it, both stay as they are.

    Args:
        meshes: Closed, one for each object.
        cells: Of the grids that they were carved from [m].
        floor: What lies on it stays on it, whatever else is there [m].
    """
    seams = _overlaps(meshes, cells, floor)
    while seams:
        skins = _pull_back(meshes, seams, TOUCH_DEPTH_CELLS * min(cells), floor)
        mended = [s for s in seams if _remaining_overlap(skins, s) <= MAX_REMAINING_OVERLAP_FRACTION * s.volume]
        if len(mended) == len(seams):
            return tuple(skins[k].mesh if k in skins else mesh for k, mesh in enumerate(meshes))
        seams = mended
    return tuple(meshes)


@dataclass(frozen=True)
class _Overlap:
    """Where two objects overlap."""

    of: tuple[int, int]
    points: Float[np.ndarray, "P 3"]
    """Vertices and middles of triangles of either, inside the other [m]."""
    depth: Float[np.ndarray, " P"]
    """How far inside [m]."""
    volume: float
    """Depths of triangles times their areas: twice the volume that both have, about [m³]."""


def _overlaps(meshes: Sequence[Mesh], cells: Sequence[float], floor: float) -> list[_Overlap]:
    shapes, found = [QueryMesh(_mirror_at_floor(m, m.triangles, floor)) for m in meshes], []
    boxes = np.stack([[m.vertices.min(axis=0), m.vertices.max(axis=0)] for m in meshes])
    for pair in overlapping_boxes(boxes):
        sides = [_points_inside(meshes[k], shapes[j]) for k, j in (pair, pair[::-1])]
        points, depth, area = (np.concatenate(part) for part in zip(*sides, strict=True))
        finer, coarser = sorted(cells[k] for k in pair)
        if TOUCH_DEPTH_CELLS * finer < depth.max(initial=0) < MAX_OVERLAP_DEPTH_CELLS * coarser:
            found.append(_Overlap(pair, points, depth, float(depth @ area)))
    return found


def _points_inside(mesh: Mesh, other: QueryMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of a surface inside another (P, 3), how deep they are, and areas of triangles."""
    points = np.concatenate([mesh.vertices, mesh.corners.mean(axis=1)])
    area = np.concatenate([np.zeros(len(mesh.vertices)), mesh.areas])
    low, high = other.mesh.vertices.min(axis=0), other.mesh.vertices.max(axis=0)
    inside = np.all((points > low) & (points < high), axis=1)
    inside[inside] = other.inside(points[inside])
    return points[inside], other.closest(points[inside])[0], area[inside]


def _movable_surface(mesh: Mesh, seams: list[_Overlap], k: int, floor: float) -> _MovableSurface:
    near, tree = np.zeros(len(mesh.vertices), bool), KDTree(mesh.vertices)
    edges = mesh.corners - np.roll(mesh.corners, 1, axis=1)
    longest = float(np.linalg.norm(edges, axis=2).max())
    for seam in (s for s in seams if k in s.of):
        # A triangle that is nearest to a point has a corner no farther away than this.
        found = tree.query_ball_point(seam.points, seam.depth + longest)
        near[np.concatenate([np.array(f, dtype=int) for f in found])] = True
    chosen = near[mesh.triangles].any(axis=1)
    far = QueryMesh(_mirror_at_floor(mesh, mesh.triangles[~chosen], floor))
    lies = mesh.vertices[:, 2] < floor + FLOOR_TOLERANCE_M
    return _MovableSurface(mesh, mesh.triangles[chosen], far, neighbour_mean_matrix(mesh), lies, floor)


def _pull_back(meshes: Sequence[Mesh], seams: list[_Overlap], still: float, floor: float) -> dict[int, _MovableSurface]:
    """Draw objects back where they meet; still: what is no deeper stays [m]."""
    skins = {k: _movable_surface(meshes[k], seams, k, floor) for k in sorted({k for s in seams for k in s.of})}
    others = {k: [j for s in seams if k in s.of for j in s.of if j != k] for k in skins}
    ever = {k: np.zeros(len(meshes[k].vertices), bool) for k in skins}
    for r in range(SEPARATION_ITERATIONS):
        # Vertices first: beside a rim the middle of a triangle may be inside only until then.
        ways = {k: _ways_out(skins, k, others[k], middles=r > 0) for k in skins}
        if all(depth.max() <= still for depth, _ in ways.values()):
            break
        for k, (depth, way) in ways.items():
            held = depth > still
            ever[k] |= held
            skins[k] = skins[k].moved(np.where(held[:, None], way / 2, 0), ever[k] & (r < SMOOTHING_ITERATIONS))
    return skins


def _ways_out(
    skins: dict[int, _MovableSurface], k: int, others: list[int], middles: bool
) -> tuple[Float[np.ndarray, " V"], Float[np.ndarray, "V 3"]]:
    """How deep vertices of an object are in others [m], and the way out of where they are deepest.

    middles: A triangle's corners are as deep as its middle, if that is deeper.
    """
    v, near = skins[k].mesh.vertices, skins[k].near
    depth, way = np.zeros(len(v)), np.zeros_like(v)
    for j in others:
        for who in (np.unique(near)[:, None], near)[: 1 + middles]:
            deep, out = skins[j].way_out(v[who].mean(axis=1))
            order = np.argsort(deep, kind="stable")  # the deepest comes last, and stays
            for one in who.T:
                deeper = order[deep[order] > depth[one[order]]]
                depth[one[deeper]], way[one[deeper]] = deep[deeper], out[deeper]
    return depth, way


def _remaining_overlap(skins: dict[int, _MovableSurface], seam: _Overlap) -> float:
    """Return what is left of ``_Seam.volume`` [m³]."""
    total = 0.0
    for k, j in (seam.of, seam.of[::-1]):
        mesh = Mesh(skins[k].mesh.vertices, skins[k].near)
        total += float(skins[j].way_out(mesh.corners.mean(axis=1))[0] @ mesh.areas)
    return total


def _mirror_at_floor(mesh: Mesh, triangles: Int[np.ndarray, "N 3"], floor: float) -> Mesh:
    """Return a surface and its image below the floor instead of what lies on the floor.

    So what stands on the floor goes on below it: nothing leaves it that way.
    """
    v = mesh.vertices
    lies = v[:, 2] < floor + FLOOR_TOLERANCE_M
    if not lies.any():
        return Mesh(v, triangles)
    standing = triangles[~lies[triangles].all(axis=1)]
    image = v * (1, 1, -1) + (0, 0, 2 * floor)
    both = np.concatenate([standing, standing[:, ::-1] + len(v)])
    return Mesh(np.concatenate([v, image]), both)


def _winding_numbers(shape: QueryMesh, points: np.ndarray) -> Float[np.ndarray, " P"]:
    return shape.winding(points) if len(shape.mesh.triangles) else np.zeros(len(points))
