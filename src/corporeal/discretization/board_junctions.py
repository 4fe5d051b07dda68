"""Joins the middle surfaces of boards that meet: T and L junctions share vertices and edges."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import igl
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from corporeal.geometry.mesh import Mesh, join_meshes
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.remeshing import (
    FeaturePatches,
    find_patches,
    remesh,
    split_edges,
    unique_edges,
    unit_rows,
    without_turned_triangles,
)

JUNCTION_REACH_THICKNESSES = 0.6
"""How far the rim of a board ends from the middle of one that it touches; half a thickness, and some room."""
JUNCTION_REACH_SPACINGS = 0.02
MIN_JUNCTION_CONORMAL_COS = 0.5
"""Boards that meet at less than 30° lie on one another."""
JUNCTION_SNAP_SPACINGS = 0.3
"""Vertices as near to a junction are moved onto it."""
JUNCTION_BAND_SPACINGS = 2.5
"""Edges are cut by a junction up to this distance."""
MAX_JOINED_BOARDS, MAX_JUNCTION_TRIANGLES = 60, 10_000_000
"""Boards, and pairs of them times all triangles: more are foliage, pages of a book or loose triangles, and are left as
they are."""
MIN_SOURCE_AREA_SPACINGS2, MIN_TRIANGLE_AREA_SPACINGS2 = 1e-10, 1e-4
"""Smaller triangles of junctions are left out, before and after they are remeshed."""
JUNCTION_WELD_SPACINGS = 0.8
"""Distance up to which the rim's vertices become those on the face."""


@dataclass(frozen=True)
class Board:
    """The middle surface of one wall, or of several that are joined."""

    mesh: Mesh
    thickness: Float[np.ndarray, " T"]
    """[m]"""
    drawn: Float[np.ndarray, " T"]
    """Distance between the faces of the mesh [m]."""


@dataclass(frozen=True)
class _Assembly:
    """All boards on common vertices."""

    vertices: Float[np.ndarray, "V 3"]
    triangles: Int[np.ndarray, "T 3"]
    owner: Int[np.ndarray, " T"]
    source: Int[np.ndarray, " T"]
    """Triangle that it was at first."""

    def only(self, board: int) -> Mesh:
        """Return the triangles of one board."""
        return Mesh(self.vertices, np.ascontiguousarray(self.triangles[self.owner == board]))


def join_boards(boards: Sequence[Board], spacing: float) -> Board:
    """Return all boards as one mesh.

    Where the rim of a board ends at the face of another one, within its thickness, it is continued (or cut back) to the
    middle of that one, which gets vertices and edges along the junction, and the two are welded. Where that is as near
    to a rim of the other one, this rim is moved to it: what one board gains at a corner the other one loses.

    Args:
        boards: Each remeshed to edges of ``spacing``.
        spacing: [m]
    """
    mesh = join_meshes([b.mesh for b in boards])
    thickness, drawn = (np.concatenate([getattr(b, k) for b in boards]) for k in ("thickness", "drawn"))
    owner = _vertex_components(mesh)
    whole = Board(mesh, thickness, drawn)
    count = int(owner.max(initial=-1)) + 1
    state = _Assembly(mesh.vertices, mesh.triangles, owner, np.arange(len(owner)))
    if not 2 <= count <= MAX_JOINED_BOARDS:
        return whole
    reach = JUNCTION_REACH_THICKNESSES * drawn + JUNCTION_REACH_SPACINGS * spacing
    pairs = _pairs_near(state, reach)
    if len(pairs) * len(owner) > MAX_JUNCTION_TRIANGLES:
        return whole
    attached = set()
    for one, other in pairs:
        before, state = state, _attach_rim(state, one, other, reach, spacing)
        attached |= set() if state is before else {(one, other), (other, one)}
    for one, other in pairs:
        if one < other and (one, other) not in attached:
            state = _attach_crossing(state, one, other, spacing)
    if len(state.vertices) == len(mesh.vertices) and (state.vertices == mesh.vertices).all():
        return whole
    return _remeshed(state, whole, spacing)


def _pairs_near(state: _Assembly, reach: Float[np.ndarray, " S"]) -> list[tuple[int, int]]:
    """Return the boards of which an edge ends at, or goes through, another one."""
    edges, number, _ = unique_edges(state.triangles)
    owner = np.zeros(len(edges), dtype=np.int64)
    owner[number] = state.owner[:, None]
    a, b = state.vertices[edges[:, 0]], state.vertices[edges[:, 1]]
    pairs = []
    for other in range(int(state.owner.max()) + 1):
        face, most = QueryMesh(state.only(other)), reach[state.owner == other].max()
        corners = face.mesh.corners.reshape(-1, 3)
        low, high = corners.min(axis=0) - most, corners.max(axis=0) + most
        some = np.flatnonzero(
            (owner != other) & (np.minimum(a, b) < high).all(axis=1) & (np.maximum(a, b) > low).all(axis=1)
        )
        distance = face.closest(0.5 * (a[some] + b[some]))[0]
        near = distance <= most
        way = b[some] - a[some]
        length = np.linalg.norm(way, axis=1)
        far = np.flatnonzero(~near & (distance <= 0.5 * length))
        near[far] = face.reach(a[some[far]], way[far]) < length[far]
        pairs += [(int(one), other) for one in np.unique(owner[some[near]])]
    return sorted(pairs)


def _vertex_components(mesh: Mesh) -> Int[np.ndarray, " T"]:
    t, size = mesh.triangles, len(mesh.vertices)
    links = coo_matrix((np.ones(2 * len(t)), (t[:, [0, 1]].ravel(), t[:, [1, 2]].ravel())), shape=(size, size))
    return np.unique(connected_components(links, directed=False)[1][t[:, 0]], return_inverse=True)[1].reshape(-1)


def _remeshed(state: _Assembly, whole: Board, spacing: float) -> Board:
    real = Mesh(state.vertices, state.triangles).areas > MIN_SOURCE_AREA_SPACINGS2 * spacing**2
    state = _Assembly(state.vertices, state.triangles[real], state.owner[real], state.source[real])
    used, triangles = np.unique(state.triangles, return_inverse=True)
    mesh = Mesh(state.vertices[used], np.ascontiguousarray(triangles.reshape(-1, 3)))
    source = find_patches(mesh, spacing, state.owner)
    now, projection = remesh(source, spacing)
    nearest = projection.onto_patches(now.mesh.corners.mean(axis=1), now.patch)[1]
    original, real = state.source[nearest], now.mesh.areas > MIN_TRIANGLE_AREA_SPACINGS2 * spacing**2
    return Board(now.mesh.only(real), whole.thickness[original][real], whole.drawn[original][real])


@dataclass(frozen=True)
class _Junction:
    """Edges of one board that lie in the face of another one."""

    edges: Int[np.ndarray, "E 2"]
    across: Float[np.ndarray, "E 3"]
    """Unit vectors across the edges, in the face or nearly."""


def _attach_rim(state: _Assembly, one: int, other: int, reach: Float[np.ndarray, " S"], spacing: float) -> _Assembly:
    """Weld the rim of one board to the face of another one, as far as it ends there."""
    rim = _rim_of(state, one)
    if not len(rim.edges) or not (state.owner == other).any():
        return state
    face = QueryMesh(state.only(other))
    most = reach[state.source[state.owner == other]]
    ends, nearest = _ends_at_face(state, rim, face, most)
    seam = ~ends & _is_seam(state, rim, other, JUNCTION_REACH_SPACINGS * spacing)
    if seam.any():
        state = _weld_at_face(state, one, other, _Junction(rim.edges[seam], rim.conormals[seam]), spacing)
    if not ends.any():
        return state
    rim, towards = rim.only(ends), face.mesh.normals[nearest[ends]]
    towards *= np.sign(np.einsum("ij,ij->i", towards, rim.conormals))[:, None]
    state, edges, normals = _trimmed_at_face(state, one, rim, towards, face, most)
    return _weld_at_face(state, one, other, _Junction(edges, normals), spacing) if len(edges) else state


@dataclass(frozen=True)
class _Rim:
    """Edges of a board that have one triangle."""

    edges: Int[np.ndarray, "E 2"]
    normals: Float[np.ndarray, "E 3"]
    conormals: Float[np.ndarray, "E 3"]
    """In the board, outward."""

    def only(self, chosen: Bool[np.ndarray, " E"]) -> "_Rim":
        """Return the chosen edges."""
        return _Rim(self.edges[chosen], self.normals[chosen], self.conormals[chosen])


def _rim_of(state: _Assembly, one: int) -> _Rim:
    mine = state.owner == one
    own = np.ascontiguousarray(state.triangles[mine])
    _, number, count = unique_edges(own)
    shared = np.zeros(len(state.vertices), dtype=bool)
    shared[state.triangles[~mine]] = True
    triangle, k = np.nonzero((count[number] == 1) & ~(shared[own] & shared[np.roll(own, -1, axis=1)]))
    t = own[triangle]
    edges = np.column_stack([t[np.arange(len(t)), k], t[np.arange(len(t)), (k + 1) % 3]])
    normals = unit_rows(Mesh(state.vertices, t).area_vectors)
    along = state.vertices[edges[:, 1]] - state.vertices[edges[:, 0]]
    return _Rim(edges, normals, unit_rows(np.cross(along, normals)))


def _ends_at_face(
    state: _Assembly, rim: _Rim, face: QueryMesh, most: Float[np.ndarray, " F"]
) -> tuple[Bool[np.ndarray, " E"], Int[np.ndarray, " E"]]:
    """Return which edges of a rim end at a face, and the triangle next to each."""
    a, b = state.vertices[rim.edges[:, 0]], state.vertices[rim.edges[:, 1]]
    near = np.ones(len(a), dtype=bool)
    for points, room in ((a, 1.3), (b, 1.3), (0.5 * (a + b), 1.0)):
        distance, nearest, _ = face.closest(points)
        near &= distance <= room * most[nearest]
    steep = np.abs(np.einsum("ij,ij->i", rim.conormals, face.mesh.normals[nearest])) > MIN_JUNCTION_CONORMAL_COS
    return near & steep, nearest


def _is_seam(state: _Assembly, rim: _Rim, other: int, most: float) -> Bool[np.ndarray, " E"]:
    """Return which edges of a rim lie on the rim of another board, which goes on beyond."""
    far = _rim_of(state, other)
    if not len(far.edges):
        return np.zeros(len(rim.edges), dtype=bool)
    tree = igl.AABB()
    tree.init(state.vertices, far.edges)
    ends = state.vertices[rim.edges]
    asked = np.ascontiguousarray(np.concatenate([ends, ends.mean(axis=1, keepdims=True)], axis=1).reshape(-1, 3))
    squared, nearest, _ = (np.asarray(k) for k in tree.squared_distance(state.vertices, far.edges, asked))
    near = (squared.reshape(-1, 3) <= most**2).all(axis=1)
    return near & (np.einsum("ij,ij->i", rim.conormals, far.conormals[nearest.reshape(-1, 3)[:, 2]]) < 0)


def _trimmed_at_face(
    state: _Assembly, one: int, rim: _Rim, towards: Float[np.ndarray, "E 3"], face: QueryMesh, most: np.ndarray
) -> tuple[_Assembly, Int[np.ndarray, "J 2"], Float[np.ndarray, "J 3"]]:
    """Move a rim, and what of its board lies beyond a face, onto it; return the edges that lie in it and normals."""
    own = np.unique(state.triangles[state.owner == one])
    points = state.vertices[own]
    distance, nearest, foot = face.closest(points)
    side = KDTree(state.vertices[rim.edges].mean(axis=1)).query(points)[1]
    beyond = np.einsum("ij,ij->i", points - foot, towards[side]) > 0
    moved = own[np.isin(own, rim.edges) | (beyond & (distance <= 1.3 * most[nearest]))]
    vertices = state.vertices.copy()
    vertices[moved] = foot[np.isin(own, moved)]
    kept = (state.owner != one) | ~np.isin(state.triangles, moved).all(axis=1)
    state = _Assembly(vertices, state.triangles[kept], state.owner[kept], state.source[kept])
    left = _rim_of(state, one)
    left = left.only(np.asarray(np.isin(left.edges, moved).all(axis=1)))
    return state, left.edges, left.normals


def _attach_crossing(state: _Assembly, one: int, other: int, spacing: float) -> _Assembly:
    """Weld two boards along the line where they go through one another."""
    edges, number, _ = unique_edges(state.triangles)
    asked = np.unique(number[state.owner == one])
    face = state.only(other)
    if not len(face.triangles):
        return state
    asked = asked[~np.isin(edges[asked], face.triangles).any(axis=1)]
    x = state.vertices
    middle, length = x[edges[asked]].mean(axis=1), np.linalg.norm(np.diff(x[edges[asked]], axis=1)[:, 0], axis=1)
    asked = asked[QueryMesh(face).closest(middle)[0] <= 0.5 * length]
    a, b = edges[asked].T
    way = x[b] - x[a]
    length = np.linalg.norm(way, axis=1)
    gone = QueryMesh(face).reach(x[a], way)
    met = np.flatnonzero(gone < length)
    if not len(met):
        return state
    # Vertices near the face are moved onto it, and only edges between others are cut.
    ends = np.where(gone < 0.5 * length, a, b)[met]
    onto = np.unique(ends[np.minimum(gone, length - gone)[met] < JUNCTION_SNAP_SPACINGS * spacing])
    x = x.copy()
    x[onto] = QueryMesh(face).closest(x[onto])[2]
    met = met[~np.isin(edges[asked[met]], onto).any(axis=1)]
    places = x[a[met]] + (gone / length)[met, None] * way[met]
    cut = np.zeros(len(edges), dtype=bool)
    cut[asked[met]] = True
    before = len(x)
    state = _split(state, x, cut, places)
    new = state.triangles[state.owner == one]
    ends = np.stack([new, np.roll(new, -1, axis=1)], axis=-1)
    triangle, k = np.nonzero(((ends >= before) | np.isin(ends, onto)).all(axis=-1))
    chain, place = np.unique(np.sort(ends[triangle, k], axis=1), axis=0, return_index=True)
    normals = unit_rows(Mesh(state.vertices, new[triangle[place]]).area_vectors)
    return _weld_at_face(state, one, other, _Junction(chain, normals), spacing) if len(chain) else state


def _split(
    state: _Assembly,
    vertices: Float[np.ndarray, "V 3"],
    cut: Bool[np.ndarray, " E"],
    places: Float[np.ndarray, "C 3"],
) -> _Assembly:
    """Split the edges that are cut, as numbered by ``unique_edges``, at places."""
    start = FeaturePatches(
        Mesh(vertices, state.triangles), np.arange(len(state.triangles)), np.zeros(len(vertices), dtype=bool)
    )
    after = split_edges(start, cut)
    moved = after.mesh.vertices.copy()
    moved[len(vertices) :] = places
    return _Assembly(moved, after.mesh.triangles, state.owner[after.patch], state.source[after.patch])


def _weld_at_face(state: _Assembly, one: int, other: int, found: _Junction, spacing: float) -> _Assembly:
    state, line = _cut_face(state, other, found, spacing)
    return _weld_line(state, one, found, line, spacing) if len(line) else state


def _cut_face(
    state: _Assembly, other: int, found: _Junction, spacing: float
) -> tuple[_Assembly, Int[np.ndarray, " L"]]:
    """Give a face vertices and edges along a junction; return the vertices."""
    mine = state.owner == other
    own = np.unique(state.triangles[mine])
    offset, inside, foot = _offsets_from(state.vertices, found, state.vertices[own], spacing)
    height = np.full(len(state.vertices), np.nan)
    height[own] = np.where(inside, offset, np.nan)
    # What is near is moved onto the junction, unless that turned a triangle.
    snap = own[inside & (np.abs(offset) < JUNCTION_SNAP_SPACINGS * spacing)]
    moved = state.vertices.copy()
    moved[own] = np.where(np.isin(own, snap)[:, None], foot, moved[own])
    moved = without_turned_triangles(Mesh(state.vertices, state.triangles[mine]), moved)
    snap = snap[(moved[snap] == foot[np.searchsorted(own, snap)]).all(axis=1)]
    height[snap] = 0.0
    edges, number, _ = unique_edges(state.triangles)
    a, b = edges.T
    cut = (height[a] * height[b] < 0) & np.isin(np.arange(len(edges)), number[mine])
    share = height[a] / np.where(cut, height[a] - height[b], 1.0)
    places = moved[a] + share[:, None] * (moved[b] - moved[a])
    at = np.flatnonzero(cut)
    _, within, _ = _offsets_from(moved, found, places[at], spacing)
    cut[at[~within]] = False
    state = _split(state, moved, cut, places[cut])
    return state, np.concatenate([snap, np.arange(len(moved), len(state.vertices))])


def _offsets_from(
    x: Float[np.ndarray, "V 3"], found: _Junction, points: Float[np.ndarray, "N 3"], spacing: float
) -> tuple[Float[np.ndarray, " N"], Bool[np.ndarray, " N"], Float[np.ndarray, "N 3"]]:
    """Return points' distances from the plane of a rim [m], whether they are beside it, and their feet on it."""
    tree = igl.AABB()
    tree.init(x, np.ascontiguousarray(found.edges))
    squared, nearest, foot = (
        np.asarray(k) for k in tree.squared_distance(x, found.edges, np.ascontiguousarray(points))
    )
    nearest, foot = nearest.reshape(-1), foot.reshape(-1, 3)
    away = points - foot
    along = x[found.edges[nearest, 1]] - x[found.edges[nearest, 0]]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    beyond = np.abs(np.einsum("ij,ij->i", away, along)) > JUNCTION_SNAP_SPACINGS * spacing
    inside = ~beyond & (np.sqrt(squared.reshape(-1)) < JUNCTION_BAND_SPACINGS * spacing)
    return np.einsum("ij,ij->i", away, found.across[nearest]), inside, foot


def _weld_line(state: _Assembly, one: int, found: _Junction, line: Int[np.ndarray, " L"], spacing: float) -> _Assembly:
    """Make a board's vertices on a junction those of the line, and give its triangles there all of them."""
    x, chain = state.vertices, np.unique(found.edges)
    distance = np.linalg.norm(x[chain][:, None] - x[line][None], axis=2)
    nearest = distance.argmin(axis=1)
    near = distance[np.arange(len(chain)), nearest] < JUNCTION_WELD_SPACINGS * spacing
    becomes = np.arange(len(x))
    becomes[chain[near]] = line[nearest[near]]
    a, b, c = becomes[state.triangles].T
    flat = (state.owner == one) & np.isin(np.column_stack([a, b, c]), line).all(axis=1)
    kept = ~flat & (a != b) & (b != c) & (c != a)
    triangles, owner, source = becomes[state.triangles][kept], state.owner[kept], state.source[kept]
    meeting = np.isin(triangles, line) & np.isin(np.roll(triangles, -1, axis=1), line) & (owner == one)[:, None]
    pieces, origin = [], []
    whole = np.ones(len(triangles), dtype=bool)
    for t, k in zip(*np.nonzero(meeting), strict=True):
        a, b, c = (int(v) for v in np.roll(triangles[t], -k))
        path = [a, *_vertices_between(x, a, b, line), b]
        if len(path) > 2 and whole[t]:
            whole[t] = False
            pieces += [(p, q, c) for p, q in pairwise(path)]
            origin += [t] * (len(path) - 1)
    origin = np.concatenate([np.flatnonzero(whole), np.array(origin, dtype=np.int64)])
    triangles = np.concatenate([triangles[whole], np.array(pieces, dtype=np.int64).reshape(-1, 3)])
    return _Assembly(x, np.ascontiguousarray(triangles), owner[origin], source[origin])


def _vertices_between(x: Float[np.ndarray, "V 3"], a: int, b: int, line: Int[np.ndarray, " L"]) -> list[int]:
    """Return the vertices of a line from one of them to another one, in order."""
    along = x[b] - x[a]
    squared = float(along @ along)
    share = (x[line] - x[a]) @ along / max(squared, 1e-300)
    away = np.linalg.norm(x[line] - x[a] - share[:, None] * along, axis=1)
    some = (share > 1e-6) & (share < 1 - 1e-6) & (away < 0.1 * np.sqrt(squared)) & (line != a) & (line != b)
    return [int(v) for v in line[some][np.argsort(share[some], kind="stable")]]
