"""Direct surfaces: lathes, tubes, rounded boxes, cushions, mounds, leaves. All closed."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from corporeal.showcase.prop_mesh import (
    PropMesh,
    PropPoint,
    corner_normals,
    make_mesh,
    mesh_union,
    welded_vertex_normals,
)


def soften_corners(points: ArrayLike, rounds: int = 3) -> Float[np.ndarray, "N D"]:
    """Cut corners (Chaikin 1974; doubled points stay sharp), then drop points on straight runs."""
    from skimage.measure import approximate_polygon  # brings a second of start-up with it

    p = np.asarray(points, float)
    for _ in range(rounds):
        a, b = p[:-1], p[1:]
        new = np.stack([0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b], 1).reshape(-1, p.shape[1])
        p = np.concatenate([p[:1], new, p[-1:]])
    return approximate_polygon(p, 3e-4 * np.ptp(p, axis=0).max())


def lathe_surface(profile: ArrayLike, segments: int = 64, loop: bool = False) -> PropMesh:
    """Turn (r, z) points [m] about z; u goes round, v along the profile.

    Open profiles run from axis to axis, bottom first; a loop makes a ring.
    """
    p = np.asarray(profile, float)
    p = np.concatenate([p, p[:1]]) if loop else p
    along = _path_lengths(p)
    j = np.arange(segments + 1)
    angle = 2 * np.pi * (j % segments) / segments
    r, z = p[:, :1], np.repeat(p[:, 1:], segments + 1, 1)
    v = np.stack([r * np.cos(angle), r * np.sin(angle), z], -1).reshape(-1, 3)
    uv = np.stack(np.broadcast_arrays(j / segments, (along / along[-1])[:, None]), -1)
    return make_mesh(v, _drop_degenerate(v, _grid_triangles(len(p), segments + 1)), uv=uv.reshape(-1, 2))


def tube_surface(path: ArrayLike, radii: ArrayLike, sides: int = 10, uv_per_metre: float = 1.0) -> PropMesh:
    """Rod along a path [m] with rounded ends; one radius, or one per point [m]."""
    p = np.asarray(path, float)
    r = np.broadcast_to(radii, len(p)).astype(float)
    t = _path_directions(np.gradient(p, axis=0))
    along = _path_lengths(p)
    a, b = r[0] * t[0], r[-1] * t[-1]
    points = np.concatenate([[p[0] - 0.6 * a, p[0] - 0.4 * a], p, [p[-1] + 0.4 * b, p[-1] + 0.6 * b]])
    widths = np.concatenate([[0, 0.7 * r[0]], r, [0.7 * r[-1], 0]])
    headings = np.concatenate([t[:1], t[:1], t, t[-1:], t[-1:]])
    lengths = np.concatenate([[0, 0], along, along[-1:], along[-1:]]) * uv_per_metre
    angle = 2 * np.pi * (np.arange(sides + 1) % sides) / sides
    side = np.cross(t[0], [1, 0, 0] if abs(t[0, 0]) < 0.9 else [0, 1, 0])
    rings = []
    for point, width, heading in zip(points, widths, headings, strict=True):
        side = side - (side @ heading) * heading
        side /= np.linalg.norm(side)
        up = np.cross(heading, side)
        rings.append(point + width * (np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * up))
    v = np.concatenate(rings)
    u = np.arange(sides + 1) / sides
    uv = np.stack(np.broadcast_arrays(u, lengths[:, None]), -1).reshape(-1, 2)
    return make_mesh(v, _drop_degenerate(v, _grid_triangles(len(points), sides + 1)), uv=uv)


def ring_surface(path: ArrayLike, radius: float, sides: int = 6) -> PropMesh:
    """Bend a rod along a closed path [m]: piping on cushions, hoops."""
    p = np.asarray(path, float)
    t = _path_directions(np.roll(p, -1, 0) - np.roll(p, 1, 0))
    side = _path_directions(np.cross(t, [0.1, 0.2, 1.0]))[:, None]
    up = np.cross(t, side[:, 0])[:, None]
    angle = (2 * np.pi * np.arange(sides) / sides)[:, None]
    v = p[:, None] + radius * (np.cos(angle) * side + np.sin(angle) * up)
    n = len(p)
    i, j = np.arange(n)[:, None], np.arange(sides)[None]
    following, beside = (i + 1) % n * sides, (j + 1) % sides
    corners = (i * sides + j, i * sides + beside, following + beside, following + j)
    a, b, c, d = (x.reshape(-1) for x in corners)
    return make_mesh(v.reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


@dataclass(frozen=True)
class RoundedBox:
    """A box with rounded edges, centred on the origin."""

    size: PropPoint
    """[m]"""
    radius: float
    """Of the edges [m]."""
    corner: int = 3
    """Pieces over half a rounded edge."""
    inner: int = 1
    """Pieces between the edges."""
    tile: float = 0.25
    """Size of one texture tile [m]."""
    grain: int | None = None
    """Axis along which u runs; None: the longest."""

    def mesh(self) -> PropMesh:
        """Six curved faces, each with its own texture coordinates."""
        faces = [self._face(axis, sign) for axis in range(3) for sign in (-1, 1)]
        start = np.cumsum([0] + [len(v) for v, *_ in faces])
        return make_mesh(
            np.round(np.concatenate([v for v, *_ in faces]), 9),
            np.concatenate([f + s for (_, f, _, _), s in zip(faces, start, strict=False)]),
            np.concatenate([uv for *_, uv, _ in faces]),
            np.concatenate([n for *_, n in faces]),
        )

    def _face(self, axis: int, sign: int) -> tuple[np.ndarray, ...]:
        """Vertices, triangles, texture coordinates and normals of one side."""
        half = np.asarray(self.size, float) / 2
        grain = int(np.argmax(half)) if self.grain is None else self.grain
        a, b = sorted((i for i in range(3) if i != axis), key=lambda i: i != grain)
        ga, gb = self._steps(half[a]), self._steps(half[b])
        p = np.zeros((len(ga), len(gb), 3))
        p[..., axis], p[..., a], p[..., b] = sign * half[axis], ga[:, None], gb[None]
        core = np.clip(p, -(half - self.radius), half - self.radius)
        n = _path_directions(p - core)
        v = (core + self.radius * n).reshape(-1, 3)
        f = _grid_triangles(len(ga), len(gb))
        outward = np.cross(v[f[0, 1]] - v[f[0, 0]], v[f[0, 2]] - v[f[0, 0]])[axis] * sign > 0
        uv = np.stack([p[..., a] + 0.37 * axis, p[..., b] + 0.23 * sign], -1) / self.tile
        return v, f if outward else f[:, ::-1], uv.reshape(-1, 2), n.reshape(-1, 3)

    def _steps(self, half: float) -> Float[np.ndarray, " N"]:
        """Grid coordinates along one edge: dense over the rounding, ``inner`` pieces between."""
        flat = half - self.radius
        bend = self.radius * np.tan(np.linspace(0, np.pi / 4, self.corner + 1))
        middle = np.linspace(-flat, flat, self.inner + 1)[1:-1]
        return np.concatenate([-flat - bend[::-1], middle, flat + bend])


@dataclass(frozen=True)
class CushionShape:
    """A box filled with foam: its faces bulge; piping runs along its seams."""

    size: PropPoint
    """Of the box before it is filled [m]."""
    puff: float
    """How far the upper and lower face bulge [m]."""
    radius: float
    """Of the edges [m]."""
    piping: float
    """Radius of the piping [m]; 0: none."""
    detail: int
    """Pieces between the edges."""
    pinch: float = 0.0
    """How far the sides are pulled in, as a share of the half size."""
    seams: tuple[int, ...] = (-1, 1)
    """Piping on the lower and upper edge, or for (0,) round the waist."""

    def mesh(self) -> PropMesh:
        """Fill the box and sew the piping on."""
        plain = RoundedBox(self.size, self.radius, inner=self.detail).mesh()
        v = self._filled(plain.vertices)
        body = replace(plain, vertices=v, normals=welded_vertex_normals(v, plain.faces))
        if not self.piping:
            return body
        inset = 0.29 * self.radius if len(self.seams) == 2 else 0.0
        width, depth, height = np.asarray(self.size) / 2 - inset
        path = _rounded_rectangle(width, depth, self.radius - inset)
        level = np.full((len(path), 1), height)
        edges = [self._filled(np.hstack([path, s * level])) for s in self.seams]
        return mesh_union([body, *(ring_surface(e, self.piping).tinted([0.8] * 3) for e in edges)])

    def _filled(self, p: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        x, y, z = np.clip(p / (np.asarray(self.size) / 2), -1, 1).T
        crown = ((1 - x**2) * (1 - y**2)) ** 0.7
        bulge = 1 + 0.03 * (1 - z**2)
        wide, deep = (bulge - self.pinch * (1 - t**2) for t in (y, x))
        return np.stack([p[:, 0] * wide, p[:, 1] * deep, p[:, 2] + z * self.puff * crown], 1)


RimRadius = Callable[[np.ndarray], np.ndarray]
HeightField = Callable[[np.ndarray, np.ndarray], np.ndarray]


def mound_surface(
    height: HeightField, radius: RimRadius, rings: int = 56, segments: int = 128, tile: float = 0.3
) -> PropMesh:
    """Heap up height(x, y) [m] over a disc of radius(angle) [m]; flat base, rim on the floor."""
    s = np.linspace(0, 1, rings + 1)[:, None] ** 0.9
    angle = (2 * np.pi * np.arange(segments) / segments)[None]
    x, y = radius(angle) * s * np.cos(angle), radius(angle) * s * np.sin(angle)
    z = np.where(s < 1, np.maximum(height(x, y), 1e-3), 0)
    top = np.stack([x, y, z], -1)[1:].reshape(-1, 3)
    v = np.concatenate([[[0, 0, z[0].mean()], [0, 0, 0]], top, top[-segments:]])
    i, j = np.arange(rings - 1)[:, None] * segments, np.arange(segments)[None]
    a, b = 2 + i + j, 2 + i + (j + 1) % segments
    k, n = np.arange(segments), len(top) + 2
    skin = [
        np.stack([a, a + segments, b + segments], -1).reshape(-1, 3),
        np.stack([a, b + segments, b], -1).reshape(-1, 3),
        np.stack([0 * k, 2 + k, 2 + (k + 1) % segments], -1),
    ]
    base = np.stack([0 * k + 1, n + (k + 1) % segments, n + k], -1)
    upper = np.concatenate(skin)
    # Top and base each keep their own normals at the rim, or it would shade like a knife edge.
    normals = corner_normals(v, upper, upper, len(v))
    normals[n:] = normals[1] = [0, 0, -1]
    return make_mesh(v, np.concatenate([upper, base]), uv=v[:, :2] / tile, normals=normals)


def leaf_surface(length: float, thickness: float, curl: float) -> PropMesh:
    """Lens-thin closed leaf along +x, 0.46 as wide as long, its tip drooping by ``curl``."""
    s = np.array([0.0, 0.18, 0.45, 0.75, 1.0])
    half = 0.23 * length * np.array([0, 0.75, 1.0, 0.62, 0])
    rib = np.stack([s * length, 0 * s, -curl * length * s**2], 1)
    lift = thickness / 2 * np.sin(np.pi * s)[:, None] * [0, 0, 1]
    left, right = (rib + np.stack([0 * s, side * half, 0.22 * half], 1) for side in (1, -1))
    grid = _grid_triangles(3, 5)
    vertices = [np.concatenate([left, rib + sign * lift, right]) for sign in (1, -1)]
    # Both faces keep their own normals at the rim.
    normals = [
        sign * welded_vertex_normals(v, _drop_degenerate(v, grid)) for v, sign in zip(vertices, (-1, 1), strict=True)
    ]
    v = np.concatenate(vertices)
    faces = _drop_degenerate(v, np.concatenate([grid[:, ::-1], grid + 15]))
    uv = np.stack([np.tile(s, 6), np.tile(np.repeat([1, 0.5, 0], 5), 2)], 1)
    return make_mesh(v, faces, uv, np.concatenate(normals))


def _path_directions(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _path_lengths(path: Float[np.ndarray, "N D"]) -> Float[np.ndarray, " N"]:
    """Length along a path up to each point [m]."""
    return np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])


def _grid_triangles(rows: int, columns: int) -> Int[np.ndarray, "T 3"]:
    """Triangles of a grid of rows × columns vertices."""
    i, j = np.arange(rows - 1)[:, None] * columns, np.arange(columns - 1)[None]
    a = (i + j).reshape(-1)
    return np.concatenate([np.stack([a, a + 1, a + columns + 1], 1), np.stack([a, a + columns + 1, a + columns], 1)])


def _drop_degenerate(vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "T 3"]) -> Int[np.ndarray, "S 3"]:
    """Drop triangles with two corners in one place (poles)."""
    a, b, c = (np.round(vertices, 9)[faces[:, i]] for i in range(3))
    flat = (a == b).all(1) | (b == c).all(1) | (c == a).all(1)
    return faces[~flat]


def _rounded_rectangle(a: float, b: float, r: float) -> Float[np.ndarray, "N 2"]:
    """Outline with half sides a, b and corner radius r [m], anticlockwise."""
    turn = np.radians(np.linspace(0, 90, 5))
    quarter = r * np.stack([np.cos(turn), np.sin(turn)], 1)
    corners = []
    for k, centre in enumerate(((a - r, b - r), (r - a, b - r), (r - a, r - b), (a - r, r - b))):
        c, s = np.cos(k * np.pi / 2), np.sin(k * np.pi / 2)
        corners.append(np.asarray(centre) + quarter @ np.array([[c, s], [-s, c]]))
    share = np.linspace(0, 1, 9)[1:-1, None]
    pieces = []
    for k, arc in enumerate(corners):
        end = corners[(k + 1) % 4][0]
        pieces += [arc, arc[-1] + (end - arc[-1]) * share]
    return np.concatenate(pieces)
