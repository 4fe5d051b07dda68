"""Isotropic remeshing: triangles with edges of about one length, on the same surface, with its features.

After Botsch and Kobbelt, *A remeshing approach to multiresolution modeling* (SGP 2004): long edges are split, short
ones collapsed, edges flipped, and vertices moved in the surface to the middle of their neighbours. Creases, rims, and
edges of three or more triangles (non-manifold) are lines that stay: vertices on them move along them only.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import igl
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from corporeal.geometry import kernels_remeshing as kernels
from corporeal.geometry.mesh import Mesh

REMESH_CREASE_ANGLE_DEG = 40.0
"""Triangles that meet at a larger angle have a crease between them: a prism of sixteen sides is round."""
CORNER_ANGLE_DEG = 50.0
"""Lines of features that turn by more have a corner there, which stays where it is."""
CORNER_REACH_LENGTHS = 0.5
"""Of chords between which the turn is measured, in wanted edge lengths."""
REMESHING_ITERATIONS, DELAUNAY_ITERATIONS = 8, 3
"""Rounds of all steps; in the last of them edges are flipped for large angles, not for the number of neighbours."""
MAX_SPLIT_ROUNDS = 24
"""Halvings of an edge; 2^24 edges along one side are more than memory holds."""
SPLIT_RATIO = 4.0 / 3.0
"""Edges longer than so many wanted lengths are split."""
FINE_EDGE_LENGTHS = 0.4
"""What is noisy is simplified to such edges before it is smoothed; in wanted lengths."""
MAX_SMALL_PATCH_AREA_LENGTHS2 = 0.5
"""Patches between creases of a smaller area are joined to a neighbour: noise, and what is finer than the mesh."""
MAX_CREASE_DENSITY = 1.0
"""Length of creases per area, times the wanted length [-], above which they are noise: of a cube it is 2 h / side."""
TAUBIN_FACTORS, TAUBIN_STEPS, MAX_TAUBIN_ROUNDS = (0.5, -0.53), 5, 10
"""Of smoothing that does not shrink (Taubin 1995); pairs of steps in a round, and rounds at most."""
FITTING_ITERATIONS = 6
"""Of the distance between triangles and a curved surface."""
MAX_MOVED_NORMAL_COS = 0.3
"""A vertex that would turn a triangle by more than this cosine stays."""


def unique_edges(
    triangles: Int[np.ndarray, "T 3"],
) -> tuple[Int[np.ndarray, "E 2"], Int[np.ndarray, "T 3"], Int[np.ndarray, " E"]]:
    """Return the edges of a mesh, numbered.

    Returns:
        Ends of each edge, smaller number first; edge k of each triangle, from its corner k to the next; and how many
        triangles each edge has.
    """
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    size = int(triangles.max(initial=0)) + 1
    key = ends.min(axis=1) * size + ends.max(axis=1)
    found, number, count = np.unique(key, return_inverse=True, return_counts=True)
    return np.column_stack([found // size, found % size]), number.reshape(-1, 3), count


def unit_rows(rows: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    """Return unit vectors; what has no length stays 0."""
    return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)


@dataclass(frozen=True)
class FeaturePatches:
    """A mesh whose triangles belong to patches; between patches, and on rims, there are feature edges."""

    mesh: Mesh
    patch: Int[np.ndarray, " T"]
    corner: Bool[np.ndarray, " V"]
    """Vertices that stay where they are."""

    @cached_property
    def edges(self) -> tuple[Int[np.ndarray, "E 2"], Int[np.ndarray, "T 3"], Int[np.ndarray, " E"]]:
        """As of ``unique_edges``."""
        return unique_edges(self.mesh.triangles)

    @cached_property
    def feature_edges(self) -> Bool[np.ndarray, " E"]:
        """Which edges have not two triangles, or triangles of two patches."""
        edges, number, count = self.edges
        low, high = np.full(len(edges), np.iinfo(np.int64).max), np.full(len(edges), -1)
        np.minimum.at(low, number.ravel(), np.repeat(self.patch, 3))
        np.maximum.at(high, number.ravel(), np.repeat(self.patch, 3))
        return (count != 2) | (low != high)

    @cached_property
    def kind(self) -> Int[np.ndarray, " V"]:
        """0: a vertex on no feature, 1: on a line of feature edges, 2: fixed."""
        degree = np.bincount(self.edges[0][self.feature_edges].ravel(), minlength=len(self.mesh.vertices))
        return np.where(self.corner | ~np.isin(degree, (0, 2)), 2, np.minimum(degree, 1)).astype(np.int64)

    def moved(self, vertices: Float[np.ndarray, "V 3"]) -> "FeaturePatches":
        """Return the same triangles with other positions."""
        return FeaturePatches(Mesh(vertices, self.mesh.triangles), self.patch, self.corner)


class PatchProjection:
    """Projects points onto the patches and feature lines of a mesh."""

    def __init__(self, source: FeaturePatches) -> None:
        self.source = source
        order = np.argsort(source.patch, kind="stable")
        cuts = np.searchsorted(source.patch[order], np.arange(source.patch.max(initial=-1) + 2))
        self._members = [order[a:b] for a, b in pairwise(cuts)]
        self._trees: dict[int, igl.AABB] = {}
        self._lines = np.ascontiguousarray(source.edges[0][source.feature_edges])
        self._line_tree = igl.AABB()
        if len(self._lines):
            self._line_tree.init(source.mesh.vertices, self._lines)

    def onto_lines(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Return the nearest points on feature edges."""
        if not len(points) or not len(self._lines):
            return points
        return np.asarray(
            self._line_tree.squared_distance(self.source.mesh.vertices, self._lines, np.ascontiguousarray(points))[2]
        ).reshape(-1, 3)

    def onto_patches(
        self, points: Float[np.ndarray, "N 3"], patch: Int[np.ndarray, " N"]
    ) -> tuple[Float[np.ndarray, "N 3"], Int[np.ndarray, " N"]]:
        """Return the nearest point of its patch to each point, and the triangle that it is on."""
        found, triangle = points.copy(), np.zeros(len(points), dtype=np.int64)
        order = np.argsort(patch, kind="stable")
        cuts = np.searchsorted(patch[order], np.arange(len(self._members) + 1))
        for number in np.unique(patch):
            own, some = self._members[number], order[cuts[number] : cuts[number + 1]]
            faces = np.ascontiguousarray(self.source.mesh.triangles[own])
            vertices = self.source.mesh.vertices
            if number not in self._trees:
                self._trees[number] = igl.AABB()
                self._trees[number].init(vertices, faces)
            answer = self._trees[number].squared_distance(vertices, faces, np.ascontiguousarray(points[some]))
            triangle[some], found[some] = own[np.asarray(answer[1]).reshape(-1)], np.asarray(answer[2]).reshape(-1, 3)
        return found, triangle


def _crease_edges(mesh: Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the two triangles of each edge that has two, the edge's length [m], and whether it is a crease."""
    edges, number, count = unique_edges(mesh.triangles)
    owner = np.argsort(number.ravel(), kind="stable") // 3
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    pairs = np.flatnonzero(count == 2)
    one, other = owner[first[pairs]], owner[first[pairs] + 1]
    along = np.linalg.norm(np.diff(mesh.vertices[edges[pairs]], axis=1)[:, 0], axis=1)
    normals = mesh.area_vectors / np.maximum(mesh.areas, 1e-300)[:, None]
    flat = np.einsum("ij,ij->i", normals[one], normals[other]) > np.cos(np.radians(REMESH_CREASE_ANGLE_DEG))
    return one, other, along, ~flat


def smooth_rim(mesh: Mesh) -> Mesh:
    """Smooth the rims of a mesh, as those of a scan."""
    edges, _, count = unique_edges(mesh.triangles)
    rim, size = edges[count == 1], len(mesh.vertices)
    links = coo_matrix((np.ones(2 * len(rim)), (rim.ravel(), rim[:, ::-1].ravel())), shape=(size, size)).tocsr()
    degree = np.asarray(links.sum(axis=1)).reshape(-1, 1)
    x = mesh.vertices
    for factor in TAUBIN_FACTORS * (2 * TAUBIN_STEPS):
        x = x + np.where(degree == 2, factor * (links @ x / np.maximum(degree, 1) - x), 0.0)
    return Mesh(without_turned_triangles(mesh, x), mesh.triangles)


def _is_noisy(mesh: Mesh, length: float) -> bool:
    _, _, along, crease = _crease_edges(mesh)
    return bool(along[crease].sum() * length > MAX_CREASE_DENSITY * mesh.areas.sum())


def smooth_noise(mesh: Mesh, length: float) -> Mesh:
    """Smooth a mesh with creases all over, as scans have, until they are few.

    Args:
        mesh: Any.
        length: Edge length wanted [m].
    """
    if not _is_noisy(mesh, length):
        return mesh
    whole = FeaturePatches(
        mesh, np.zeros(len(mesh.triangles), dtype=np.int64), np.zeros(len(mesh.vertices), dtype=bool)
    )
    mesh = _collapse_short_edges(whole, FINE_EDGE_LENGTHS * length).mesh
    edges, _, count = unique_edges(mesh.triangles)
    size = len(mesh.vertices)
    rim = np.unique(edges[count != 2])
    links = coo_matrix((np.ones(2 * len(edges)), (edges.ravel(), edges[:, ::-1].ravel())), shape=(size, size)).tocsr()
    degree = np.maximum(np.asarray(links.sum(axis=1)).reshape(-1, 1), 1)
    for _ in range(MAX_TAUBIN_ROUNDS):
        if not _is_noisy(mesh, length):
            break
        x = mesh.vertices
        for factor in TAUBIN_FACTORS * TAUBIN_STEPS:
            change = factor * (links @ x / degree - x)
            change[rim] = 0.0
            x = x + change
        mesh = Mesh(x, mesh.triangles)
    return mesh


def find_patches(mesh: Mesh, length: float, label: Int[np.ndarray, " T"] | None = None) -> FeaturePatches:
    """Divide a mesh at its creases, rims, and where more than two triangles meet.

    Args:
        mesh: Wound consistently.
        length: Edge length wanted [m]; what is finer makes no patch.
        label: Triangles of different labels belong to different patches.
    """
    one, other, along, crease = _crease_edges(mesh)
    same = np.ones(len(one), dtype=bool) if label is None else label[one] == label[other]
    patch = _components(one[~crease & same], other[~crease & same], len(mesh.triangles))
    patch = _join_small_patches(patch, mesh.areas, (one[same], other[same], along[same]), length)
    found = FeaturePatches(mesh, patch, np.zeros(len(mesh.vertices), dtype=bool))
    return FeaturePatches(mesh, patch, _line_corners(found, length))


def _components(one: np.ndarray, other: np.ndarray, size: int) -> Int[np.ndarray, " N"]:
    links = coo_matrix((np.ones(len(one)), (one, other)), shape=(size, size))
    return connected_components(links, directed=False)[1].astype(np.int64)


def _join_small_patches(
    patch: Int[np.ndarray, " T"], areas: np.ndarray, across: tuple[np.ndarray, np.ndarray, np.ndarray], length: float
) -> Int[np.ndarray, " T"]:
    """Join each small patch to the neighbour with which it shares the longest border, until there is none."""
    one, other, along = across
    for _ in range(MAX_SPLIT_ROUNDS):
        count = int(patch.max(initial=0)) + 1
        small = np.bincount(patch, areas, count) < MAX_SMALL_PATCH_AREA_LENGTHS2 * length**2
        a, b = np.concatenate([patch[one], patch[other]]), np.concatenate([patch[other], patch[one]])
        some = (a != b) & small[a]
        if not some.any():
            return patch
        border = coo_matrix((np.tile(along, 2)[some], (a[some], b[some])), shape=(count, count)).tocsr()
        border.sum_duplicates()
        lonely = np.flatnonzero(np.diff(border.indptr))
        best = np.asarray(border[lonely].argmax(axis=1)).reshape(-1)
        patch = _components(lonely, best, count)[patch]
    return patch


def _line_corners(found: FeaturePatches, length: float) -> Bool[np.ndarray, " V"]:
    """Return which vertices of feature lines are corners of theirs."""
    lines = found.edges[0][found.feature_edges]
    ends = np.concatenate([lines, lines[:, ::-1]])
    ends = ends[np.argsort(ends[:, 0], kind="stable")]
    degree = np.bincount(ends[:, 0], minlength=len(found.mesh.vertices))
    start = np.cumsum(degree) - degree
    beside = np.full((len(degree), 2), -1)
    two = degree == 2
    beside[two] = np.column_stack([ends[start[two], 1], ends[start[two] + 1, 1]])
    turning, sharpest = np.zeros(len(degree)), np.zeros(len(degree), dtype=bool)
    reach = CORNER_REACH_LENGTHS * length
    kernels.line_turning(found.mesh.vertices, beside, reach, turning)
    kernels.sharpest_within(found.mesh.vertices, beside, reach, turning, sharpest)
    return sharpest & (turning > np.radians(CORNER_ANGLE_DEG))


def remesh(
    source: FeaturePatches, length: float, projection: PatchProjection | None = None
) -> tuple[FeaturePatches, PatchProjection]:
    """Remesh to edges of about one length; features stay.

    Edges are between 4/5 and 4/3 of the length but for a few, and where features are finer.

    Args:
        source: The mesh.
        length: Of the edges wanted [m].
        projection: Onto what the result lies on; None: the source.

    Returns:
        The mesh, whose vertices lie on the source, and what projects onto it.
    """
    projection = projection or PatchProjection(source)
    now = source
    for round_number in range(REMESHING_ITERATIONS):
        last = round_number >= REMESHING_ITERATIONS - DELAUNAY_ITERATIONS
        now = split_long_edges(now, length)
        now = _collapse_short_edges(now, length)
        now = _flip_edges(now, delaunay=last)
        now = _smooth(now, projection)
    return _flip_edges(now, delaunay=True), projection


def split_long_edges(now: FeaturePatches, length: float) -> FeaturePatches:
    """Split edges until none is longer than 4/3 of a length [m]."""
    for _ in range(MAX_SPLIT_ROUNDS):
        edges = now.edges[0]
        long = np.linalg.norm(np.diff(now.mesh.vertices[edges], axis=1)[:, 0], axis=1) > SPLIT_RATIO * length
        if not long.any():
            break
        now = split_edges(now, long)
    return now


def split_edges(now: FeaturePatches, chosen: Bool[np.ndarray, " E"]) -> FeaturePatches:
    """Split the chosen edges in their middle, in their order, and their triangles in two to four."""
    edges, number, _ = now.edges
    x, t = now.mesh.vertices, now.mesh.triangles
    middle = np.full(len(edges), -1)
    middle[chosen] = len(x) + np.arange(int(chosen.sum()))
    x = np.concatenate([x, x[edges[chosen]].mean(axis=1)])
    m = middle[number]
    count = (m >= 0).sum(axis=1)
    pieces, owners = [t[count == 0]], [np.flatnonzero(count == 0)]

    def add(which: np.ndarray, *triangles: np.ndarray) -> None:
        pieces.extend(triangles)
        owners.extend([which] * len(triangles))

    which = np.flatnonzero(count == 3)
    (a, b, c), (p, q, r) = t[which].T, m[which].T
    add(which, *(np.column_stack(k) for k in ((a, p, r), (p, b, q), (r, q, c), (p, q, r))))
    for k in range(3):
        (a, b, c), (p, q, r) = np.roll(t, -k, axis=1).T, np.roll(m, -k, axis=1).T
        which = np.flatnonzero((count == 1) & (p >= 0))
        add(which, *(np.column_stack([u[which] for u in abc]) for abc in ((a, p, c), (p, b, c))))
        # Edges a b and b c are split: the quadrilateral a p q c is divided along its shorter diagonal.
        two = np.flatnonzero((count == 2) & (r < 0))
        shorter = np.linalg.norm(x[a[two]] - x[q[two]], axis=1) <= np.linalg.norm(x[p[two]] - x[c[two]], axis=1)
        for which, cut in ((two[shorter], ((a, p, q), (a, q, c))), (two[~shorter], ((a, p, c), (p, q, c)))):
            add(which, *(np.column_stack([u[which] for u in abc]) for abc in ((p, b, q), *cut)))
    corner = np.concatenate([now.corner, np.zeros(len(x) - len(now.corner), dtype=bool)])
    return FeaturePatches(
        Mesh(x, np.ascontiguousarray(np.concatenate(pieces))), now.patch[np.concatenate(owners)], corner
    )


def _collapse_short_edges(now: FeaturePatches, length: float) -> FeaturePatches:
    for _ in range(4):
        edges = now.edges[0]
        long = np.linalg.norm(np.diff(now.mesh.vertices[edges], axis=1)[:, 0], axis=1)
        short = np.flatnonzero(long < 0.8 * length)
        order = np.ascontiguousarray(edges[short[np.argsort(long[short], kind="stable")]])
        x, t = now.mesh.vertices.copy(), now.mesh.triangles.copy()
        alive = np.ones(len(t), dtype=bool)
        done = kernels.collapse_edges(order, length, x, t, now.patch, now.kind, alive)
        now = _drop_unused(FeaturePatches(Mesh(x, t[alive]), now.patch[alive], now.corner))
        if done < 0.01 * len(x):
            break
    return now


def _drop_unused(now: FeaturePatches) -> FeaturePatches:
    used, triangles = np.unique(now.mesh.triangles, return_inverse=True)
    mesh = Mesh(now.mesh.vertices[used], np.ascontiguousarray(triangles.reshape(-1, 3)))
    return FeaturePatches(mesh, now.patch, now.corner[used])


def _flip_edges(now: FeaturePatches, delaunay: bool) -> FeaturePatches:
    wanted = np.where(now.kind == 0, 6, 4)
    edges, _, count = now.edges
    border = np.unique(edges[count == 1])
    wanted[np.setdiff1d(np.flatnonzero(now.kind > 0), border)] = 6
    for _ in range(5 if delaunay else 1):
        triangles = now.mesh.triangles.copy()
        some = np.ascontiguousarray(now.edges[0][~now.feature_edges])
        done = kernels.flip_edges(some, now.mesh.vertices, triangles, now.patch, wanted, delaunay)
        now = FeaturePatches(Mesh(now.mesh.vertices, triangles), now.patch, now.corner)
        if not done:
            break
    return now


def _smooth(now: FeaturePatches, projection: PatchProjection) -> FeaturePatches:
    """Move vertices to the middle of their neighbours, within the surface or along their line."""
    x, kind, edges = now.mesh.vertices, now.kind, now.edges[0]
    lines = now.feature_edges
    some = np.where(kind == 1, 1, 0)
    total, count = np.zeros_like(x), np.zeros(len(x))
    for one, other in ((0, 1), (1, 0)):
        # Those on lines are drawn by neighbours on the line alone.
        own = edges[(some[edges[:, one]] == 0) | lines]
        np.add.at(total, own[:, one], x[own[:, other]])
        count += np.bincount(own[:, one], minlength=len(x))
    target = total / np.maximum(count, 1)[:, None]
    normals = now.mesh.vertex_normals
    free = kind == 0
    moved = np.where((kind == 2)[:, None], x, target)
    moved[free] += normals[free] * np.einsum("ij,ij->i", x - moved, normals)[free, None]
    patch = np.zeros(len(x), dtype=np.int64)
    patch[now.mesh.triangles] = now.patch[:, None]
    moved[free] = projection.onto_patches(moved[free], patch[free])[0]
    moved[kind == 1] = projection.onto_lines(moved[kind == 1])
    return now.moved(without_turned_triangles(now.mesh, moved))


def without_turned_triangles(mesh: Mesh, moved: Float[np.ndarray, "V 3"]) -> Float[np.ndarray, "V 3"]:
    """Leave vertices where they were where a triangle would turn over or lose its area."""
    before = mesh.area_vectors
    for _ in range(5):
        after = Mesh(moved, mesh.triangles).area_vectors
        sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
        wrong = np.einsum("ij,ij->i", before, after) < MAX_MOVED_NORMAL_COS * sizes
        wrong |= np.linalg.norm(after, axis=1) < 0.1 * np.linalg.norm(before, axis=1)
        if not wrong.any():
            return moved
        stay = np.unique(mesh.triangles[wrong])
        moved = moved.copy()
        moved[stay] = mesh.vertices[stay]
    return mesh.vertices


def _line_errors(
    now: FeaturePatches, x: Float[np.ndarray, "V 3"], projection: PatchProjection
) -> Float[np.ndarray, "V 3"]:
    """Return how far lines of features are from the chords at each vertex that is free on them (Simpson's rule)."""
    lines, free = now.edges[0][now.feature_edges], now.kind == 1
    total, count = np.zeros_like(x), np.zeros(len(x))
    middle, ends = x[lines].mean(axis=1), x[lines]
    off = (
        4 * (projection.onto_lines(middle) - middle)
        + sum(projection.onto_lines(e) - e for e in (ends[:, 0], ends[:, 1]))
    ) / 6
    for k in (0, 1):
        np.add.at(total, lines[:, k], off)
        count += np.bincount(lines[:, k], minlength=len(x))
    return np.where(free[:, None], total / np.maximum(count, 1)[:, None], 0.0)


def fit_to_patches(now: FeaturePatches, projection: PatchProjection) -> FeaturePatches:
    """Move vertices along their normals until triangles lie as far inside a curved surface as outside.

    With vertices on the surface a mesh lies inside a ball, and loses about (h / 2 R)² of its area.
    """
    mesh, free = now.mesh, now.kind == 0
    weights = np.array([[1, 1, 1], [1.5, 1.5, 0], [0, 1.5, 1.5], [1.5, 0, 1.5]]) / 3
    normals, x = mesh.vertex_normals, mesh.vertices
    for _ in range(FITTING_ITERATIONS):
        shape = Mesh(x, mesh.triangles)
        places = np.einsum("sk,tkd->tsd", weights, shape.corners)
        flat = places.reshape(-1, 3)
        near = projection.onto_patches(flat, np.repeat(now.patch, len(weights)))[0]
        away = np.einsum("td,tsd->ts", shape.area_vectors, (near - flat).reshape(places.shape))
        total = np.bincount(mesh.triangles.ravel(), np.repeat(away.mean(axis=1), 3), len(x))
        area = np.bincount(mesh.triangles.ravel(), np.repeat(shape.areas, 3), len(x))
        x = x + np.where(free, total / np.maximum(area, 1e-300), 0.0)[:, None] * normals
        x = x + _line_errors(now, x, projection)
    return now.moved(x)
