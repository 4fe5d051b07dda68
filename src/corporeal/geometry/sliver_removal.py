"""Removes triangles with almost no area from a mesh, whatever its topology."""

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.remeshing import unique_edges

MAX_ASPECT_RATIO = 5.0
"""l_max (l_1 + l_2 + l_3) / (4 √3 A) of a triangle [-]; 1: equilateral."""
MIN_NEEDLE_SIDE_RATIO = 0.3
"""Shortest over longest side of slivers of which the shortest side is collapsed; others are cut at their apex."""
MAX_SLIVER_ROUNDS = 30


def aspect_ratios(corners: Float[np.ndarray, "T 3 3"]) -> Float[np.ndarray, " T"]:
    """Return l_max (l_1 + l_2 + l_3) / (4 √3 A) of triangles [-]; 1: equilateral."""
    a, b, c = np.swapaxes(corners, 0, 1)
    sides = np.stack([np.linalg.norm(b - a, axis=1), np.linalg.norm(c - b, axis=1), np.linalg.norm(a - c, axis=1)])
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return sides.max(axis=0) * sides.sum(axis=0) / np.maximum(4 * np.sqrt(3) * area, 1e-300)


def without_slivers(mesh: Mesh) -> tuple[Mesh, Int[np.ndarray, " T"]]:
    """Return a mesh without slivers, and the triangle that each of its own was.

    Of a needle the shortest edge is collapsed; the longest edge of a flat triangle is divided at the vertex opposite,
    in all triangles that it has. Rims and edges of three triangles and more stay where they are but for the width of a
    sliver.
    """
    source = np.arange(len(mesh.triangles))
    for _ in range(MAX_SLIVER_ROUNDS):
        aspect = aspect_ratios(mesh.corners)
        bad = np.flatnonzero(aspect > MAX_ASPECT_RATIO)
        if not len(bad):
            break
        mesh, origin = _one_round(mesh, bad[np.argsort(-aspect[bad], kind="stable")])
        source = source[origin]
    used, triangles = np.unique(mesh.triangles, return_inverse=True)
    return Mesh(mesh.vertices[used], np.ascontiguousarray(triangles.reshape(-1, 3))), source


def _one_round(mesh: Mesh, slivers: Int[np.ndarray, " S"]) -> tuple[Mesh, Int[np.ndarray, " T"]]:
    """Remove those of some slivers that do not touch one another."""
    edges, number, count = unique_edges(mesh.triangles)
    order = np.argsort(number.ravel(), kind="stable")
    first = np.concatenate([[0], np.cumsum(count)])
    held = np.zeros(len(mesh.vertices), dtype=bool)
    held[edges[count != 2]] = True
    x, becomes = mesh.vertices.copy(), np.arange(len(mesh.vertices))
    busy, kept = np.zeros(len(x), dtype=bool), np.ones(len(mesh.triangles), dtype=bool)
    new, origin = [], []
    for t in slivers:
        corners = mesh.triangles[t]
        sides = np.linalg.norm(x[corners] - x[np.roll(corners, -1)], axis=1)
        needle = sides.min() < MIN_NEEDLE_SIDE_RATIO * sides.max()
        k = int(sides.argmin() if needle else sides.argmax())
        around = order[first[number[t, k]] : first[number[t, k] + 1]] // 3
        if busy[mesh.triangles[around]].any():
            continue
        busy[mesh.triangles[around]] = True
        a, b, apex = np.roll(corners, -k)
        if needle:
            becomes[b] = a
            x[a] = _merged_place(x[[a, b]], held[[a, b]])
            continue
        kept[around] = False
        for s in around[around != t]:
            divided = _divided(mesh.triangles[s], {int(a), int(b)}, int(apex))
            new += divided
            origin += [s] * len(divided)
    triangles = np.concatenate([becomes[mesh.triangles[kept]], np.array(new, dtype=np.int64).reshape(-1, 3)])
    origin = np.concatenate([np.flatnonzero(kept), np.array(origin, dtype=np.int64)])
    real = _real_triangles(triangles)
    return Mesh(x, np.ascontiguousarray(triangles[real])), origin[real]


def _real_triangles(triangles: Int[np.ndarray, "T 3"]) -> Int[np.ndarray, " R"]:
    """Return triangles of three vertices, each once."""
    ordered = np.sort(triangles, axis=1)
    first = np.unique(ordered, axis=0, return_index=True)[1]
    return np.sort(first[(np.diff(ordered[first], axis=1) > 0).all(axis=1)])


def _merged_place(places: Float[np.ndarray, "two 3"], held: Bool[np.ndarray, "two"]) -> Float[np.ndarray, "3"]:
    """Return where two vertices meet: in the middle, or at the one that is held."""
    return places[int(held[1])] if held[0] != held[1] else places.mean(axis=0)


def _divided(triangle: Int[np.ndarray, "3"], edge: set[int], apex: int) -> list[tuple[int, int, int]]:
    """Return the two halves of a triangle whose edge gets a vertex; none if it has that vertex."""
    p, q, r = (int(v) for v in triangle)
    while {p, q} != edge:
        p, q, r = q, r, p
    return [] if r == apex else [(p, apex, r), (apex, q, r)]
