"""Gaps, overlaps and crossings of objects, measured between their rendered surfaces.

The ledger measures between particles, which resolve a surface to a fraction of a cell. Here the meshes of the scene
follow the material, as in the video, and are asked for distances themselves.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.core.audit_data import SurfacePairCheck
from corporeal.core.types import Frame, Particles, Scene, Trajectory
from corporeal.geometry.mesh import Mesh, join_meshes
from corporeal.geometry.mesh_queries import QueryMesh, SegmentCrossings
from corporeal.geometry.point_sampling import sample_surface
from corporeal.geometry.rotation import RigidFit, fit_rigid_motion, rotation_angle
from corporeal.render.skin_binding import SkinBinding, bind_points

NEAR_DX = 2.0
"""Objects whose particles never come nearer than this [cells] are skipped."""
OVERLAP_FRAMES = 12
"""Frames in which overlaps are measured, beside the last …"""
SURFACE_SAMPLES = 400
"""… at so many points of each surface."""
TRACKED_PARTICLES = 60
"""Particles of an object whose ways through another one are followed."""
TRACK_STRIDE_DX = 0.25
"""Their ways are looked at where one has gone farther than this [cells]."""
MAX_TURN_RAD = np.radians(60.0)
"""Where the other turned farther from one look to the next, their paths are unknown [rad]."""
PASSED_FRACTION = 0.5
"""An object has passed through another when more than this share of them has [-]."""
VISIBLE_GAP_RATIO = 0.15
"""A gap between objects that touch is visible beyond this share of the narrower one's
middle side [-]."""
MAX_EDGES_ALONG_SURFACE = 40
"""Edges of a surface that bends are at most its longest side over this, so that dents show, …"""
DENT_EDGE_DX = 1.0
"""… or this, which is as fine as what it follows knows [cells]."""


@dataclass(frozen=True)
class TrackedSurface:
    """The surface of one object and what it follows."""

    surface: QueryMesh
    """At time 0."""
    skin: SkinBinding
    sample: Int[np.ndarray, " N"]
    """Triangle of each point that is asked, and …"""
    weight: Float[np.ndarray, "N 3"]
    """… where in it the point lies."""
    grains: Int[np.ndarray, " G"]
    """Numbers of the particles whose ways are followed."""
    members: Int[np.ndarray, " M"]
    """Numbers of all of the object's particles."""
    closed: bool

    def shape(self, frame: Frame) -> QueryMesh:
        """Return the surface at one instant."""
        return self.surface.moved(self.skin.carried(frame)[0])

    def points(self, shape: QueryMesh) -> Float[np.ndarray, "N 3"]:
        """Return the points on it that are asked [m]."""
        corners = shape.mesh.vertices[shape.mesh.triangles[self.sample]]
        return np.einsum("nk,nkd->nd", self.weight, corners)


def surface_pairs(scene: Scene, particles: Particles, trajectory: Trajectory) -> tuple[SurfacePairCheck, ...]:
    """Measure every two objects that came near each other, in the scene's order."""
    shown = {s.object for s in scene.surfaces if len(s.triangles)}
    close = [p for p in _close_pairs(particles, trajectory) if shown.issuperset(p)]
    coats = {k: _tracked_surface(scene, particles, k) for k in sorted({b for p in close for b in p})}
    passed = _passages(coats, close, trajectory, particles.cell)
    looked = np.unique(np.linspace(0, len(trajectory.time) - 1, OVERLAP_FRAMES + 1).astype(int))
    rows: dict[tuple[int, int], list[float]] = {pair: [] for pair in close}
    for k in looked.tolist():
        frame = trajectory.frames[k]
        shapes = {b: coats[b].shape(frame) for pair in close for b in pair}
        for pair in close:
            rows[pair].append(_gap(pair, coats, shapes, NEAR_DX * particles.cell))
    names = [thing.name for thing in scene.objects]
    widths = {k: float(np.sort(np.ptp(coat.skin.rest, axis=0))[1]) for k, coat in coats.items()}
    found = []
    for a, c in close:
        gap, through = rows[a, c][-1], passed.get((a, c))
        small = VISIBLE_GAP_RATIO * min(widths[a], widths[c]) < gap < NEAR_DX * particles.cell
        found.append(
            SurfacePairCheck(
                first=names[a],
                second=names[c],
                gap_end_m=gap if np.isfinite(gap) else None,
                depth_m=max(0.0, -min(rows[a, c])),
                passed=names[through.who] if through else None,
                passed_s=through.time if through else None,
                hovers=bool(small and _touch_still(trajectory, a, c)),
            )
        )
    return tuple(found)


def _touch_still(trajectory: Trajectory, a: int, c: int) -> bool:
    """Whether two objects pressed on each other in the last frame's time."""
    late = trajectory.time[-2] if len(trajectory.time) > 1 else trajectory.time[-1]
    return bool(trajectory.ledger.last_contact[-1, a, c] >= late)


def _tracked_surface(scene: Scene, particles: Particles, number: int) -> TrackedSurface:
    """Bind an object's surface to its particles, and choose where it is asked."""
    rng = np.random.default_rng([number, 7])
    mesh = join_meshes([s for s in scene.surfaces if s.object == number])
    members = np.flatnonzero(particles.object == number)
    bends = any(particles.treatments[k].kind != "rigid" for k in np.unique(particles.part[members]))
    if bends:
        longest = float(np.ptp(mesh.vertices, axis=0).max())
        mesh = refine_mesh(mesh, max(longest / MAX_EDGES_ALONG_SURFACE, DENT_EDGE_DX * particles.cell))
    owner = np.full(len(mesh.vertices), number)
    skin = bind_points(mesh.vertices, owner, particles, np.zeros(0, dtype=bool))
    points, triangle = sample_surface(mesh, SURFACE_SAMPLES, rng)
    surface = QueryMesh(mesh)
    return TrackedSurface(
        surface=surface,
        skin=skin,
        sample=triangle,
        weight=_barycentric(points, mesh.corners[triangle]),
        grains=rng.permutation(members)[:TRACKED_PARTICLES],
        members=members,
        closed=surface.inside(particles.position[members].astype(float)).mean() > PASSED_FRACTION,
    )


def refine_mesh(mesh: Mesh, edge: float) -> Mesh:
    """Halve triangles until no edge is longer than ``edge`` [m]; neighbours stay neighbours.

    Edges that are the longest of all their triangles are cut in the middle, again and again
    (Rivara 1984, longest-edge bisection).
    """
    while (halved := _halved(mesh, edge)) is not None:
        mesh = halved
    return mesh


def _halved(mesh: Mesh, edge: float) -> Mesh | None:
    """Cut edges that are the longest of all their triangles, once; None: none is too long."""
    vertices = mesh.vertices
    corners = mesh.corners
    sides = corners - np.roll(corners, -1, axis=1)
    long = np.flatnonzero((np.linalg.norm(sides, axis=2) > edge).any(axis=1))
    if not len(long):
        return None
    # What has no long edge has none that is cut.
    triangles = mesh.triangles[long]
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
    # One number per edge: rows are sorted twenty times slower.
    key, of_side = np.unique(ends[..., 0] * len(vertices) + ends[..., 1], return_inverse=True)
    unique = np.stack(np.divmod(key, len(vertices)), axis=1)
    of_side = of_side.reshape(-1, 3)
    length = np.linalg.norm(vertices[unique[:, 0]] - vertices[unique[:, 1]], axis=1)
    rank = np.empty(len(length), dtype=np.int64)
    rank[np.argsort(length, kind="stable")] = np.arange(len(length))
    side = np.argmax(rank[of_side], axis=1)
    longest = np.take_along_axis(of_side, side[:, None], axis=1)[:, 0]
    shared = np.bincount(of_side.ravel(), minlength=len(length))
    cut = (np.bincount(longest, minlength=len(length)) == shared) & (length > edge)
    middle = np.full(len(length), -1)
    middle[cut] = len(vertices) + np.arange(np.count_nonzero(cut))
    halved = np.flatnonzero(cut[longest])
    a, b, c = (triangles[halved, (side[halved] + k) % 3] for k in range(3))
    m = middle[longest[halved]]
    halves = [np.stack([a, m, c], axis=1), np.stack([m, b, c], axis=1)]
    return Mesh(
        np.concatenate([vertices, vertices[unique[cut]].mean(axis=1)]),
        np.concatenate([np.delete(mesh.triangles, long[halved], axis=0), *halves]),
    )


def _barycentric(points: np.ndarray, corners: np.ndarray) -> Float[np.ndarray, "N 3"]:
    """Weights of three corners that give each point."""
    a, b, c = np.swapaxes(corners, 0, 1)
    edges = np.stack([b - a, c - a], axis=2)
    found = np.linalg.pinv(edges) @ (points - a)[:, :, None]
    u, v = found[:, 0, 0], found[:, 1, 0]
    return np.stack([1.0 - u - v, u, v], axis=1)


def _close_pairs(particles: Particles, trajectory: Trajectory) -> list[tuple[int, int]]:
    """Pairs that touched, or whose particles came near each other from one frame to the next."""
    ledger = trajectory.ledger
    count = ledger.gap.shape[1]
    gone = np.linalg.norm(np.diff(ledger.centre, axis=0), axis=2).max(axis=0, initial=0.0)
    pairs = []
    for a, c in combinations(range(count), 2):
        reach = NEAR_DX * particles.cell + gone[a] + gone[c]
        touched = np.isfinite(ledger.first_contact[-1, a, c])
        if touched or np.nanmin(ledger.gap[:, a, c]) < reach:
            pairs.append((a, c))
    return pairs


def _gap(
    pair: tuple[int, int], coats: Mapping[int, TrackedSurface], shapes: dict[int, QueryMesh], reach: float
) -> float:
    """Distance of two surfaces [m], negative where they overlap; inf beyond ``reach``."""
    found = [np.inf]
    for one, other in (pair, pair[::-1]):
        points, shape = coats[one].points(shapes[one]), shapes[other]
        box = shape.mesh.vertices.min(axis=0) - reach, shape.mesh.vertices.max(axis=0) + reach
        points = points[((points > box[0]) & (points < box[1])).all(axis=1)]
        if not len(points):
            continue
        within = shape.inside(points) if coats[other].closed else np.zeros(len(points), np.bool_)
        distance = distance_within(points, shape, within, reach)
        found.append(float(np.where(within, -distance, distance).min()))
    return min(found)


def distance_within(
    points: Float[np.ndarray, "N 3"], shape: QueryMesh, within: Bool[np.ndarray, " N"], reach: float
) -> Float[np.ndarray, " N"]:
    """Distance of points to a surface [m]; of those outside maybe too much, but for the nearest.

    Only triangles that can be within ``reach`` are looked at: a tree of all of them takes longer than asking it for
    some hundred points. What is farther is looked up again where it counts.
    """
    low, high = points.min(axis=0) - reach, points.max(axis=0) + reach
    # One bit of a corner for each side of the box that it does not lie beyond.
    inner = np.hstack([shape.mesh.vertices >= low, shape.mesh.vertices <= high])
    sides = np.packbits(inner, axis=1)[:, 0]
    near = np.bitwise_or.reduce([sides[corner] for corner in shape.mesh.triangles.T])
    near = near == np.packbits(np.ones(6, np.bool_))[0]
    distance = np.full(len(points), np.inf)
    if near.any():
        distance = QueryMesh(shape.mesh.only(near)).closest(points)[0]
    far = distance > reach
    if far.all() or within[far].any():
        distance[far] = shape.closest(points[far])[0]
    return distance


@dataclass(frozen=True)
class Passage:
    """One object passed through another."""

    who: int
    time: float
    """First frame in which it was on the other side [s]."""


def _passages(
    coats: Mapping[int, TrackedSurface], close: Sequence[tuple[int, int]], trajectory: Trajectory, cell: float
) -> dict[tuple[int, int], Passage]:
    """Find the objects that passed through others, by pair."""
    found: dict[tuple[int, int], Passage] = {}
    walks = {(a, c): RelativePath(coats[a], coats[c], cell) for pair in close for a, c in permutations(pair)}
    for k, time in enumerate(trajectory.time.tolist()):
        frame = trajectory.frames[k]
        if not np.isfinite(frame.position).all():
            break
        shapes: dict[int, QueryMesh] = {}
        for (a, c), walk in walks.items():
            pair = (min(a, c), max(a, c))
            if pair in found or not walk.goes_on(frame):
                continue
            if c not in shapes:
                shapes[c] = coats[c].shape(frame)
            if walk.go(frame, shapes[c]) > PASSED_FRACTION:
                found[pair] = Passage(a, time)
    return found


class RelativePath:
    """Piecewise linear paths of particles of one object in the frame of another.

    A line ends where something has moved by ``TRACK_STRIDE_DX``; what rests costs nothing. Of what spins so fast that
    it turns by more than ``MAX_TURN_RAD`` between frames (a shard), there is no
    result: a straight line in its frame would lead through it where the true arc leads past.
    """

    def __init__(self, walker: TrackedSurface, other: TrackedSurface, cell: float) -> None:
        self.walker, self.other, self.cell = walker, other, cell
        self.passed = np.zeros(len(walker.grains), dtype=bool)
        self.last: np.ndarray | None = None
        """Where each grain was last outside, in the other's frame at the start [m]."""
        self.turned: Float[np.ndarray, "3 3"] | None = None
        """How the other was turned in the frame before."""
        self.now: tuple[RigidFit, np.ndarray] | None = None
        """The other's rigid motion and the grains in its frame, as last looked at."""

    def goes_on(self, frame: Frame) -> bool:
        """Whether some grain has come so far near the other that it must be looked at."""
        self.now = fit, there = self._there(frame)
        turned, self.turned = self.turned, fit.rotation
        if self.last is None or turned is None or rotation_angle(fit.rotation @ turned.T) > MAX_TURN_RAD:
            self.last = there
            return False
        box = fit.undo(frame.position[self.other.members].astype(float))
        low, high = np.minimum(there, self.last), np.maximum(there, self.last)
        near = (low < box.max(axis=0) + self.cell) & (high > box.min(axis=0) - self.cell)
        if not near.all(axis=1).any():
            self.last = there
            return False
        gone = np.linalg.norm(there - self.last, axis=1).max()
        return bool(gone > TRACK_STRIDE_DX * self.cell)

    def _there(self, frame: Frame) -> tuple[RigidFit, np.ndarray]:
        """Return the other's rigid motion, and the particles in its frame at the start [m]."""
        mine, start = self.other.members, self.other.skin.start
        fit = fit_rigid_motion(start[mine], frame.position[mine].astype(float), np.ones(len(mine)))
        return fit, fit.undo(frame.position[self.walker.grains].astype(float))

    def go(self, frame: Frame, shape: QueryMesh) -> float:
        """Advance by the last step; return the share of particles that have passed through."""
        assert self.now is not None
        fit, there = self.now
        last = there if self.last is None else self.last
        now = frame.position[self.walker.grains].astype(float)
        outside = ~shape.inside(now) if self.other.closed else np.ones(len(now), dtype=bool)
        through = np.zeros(len(now), dtype=bool)
        through[outside] = self._through(fit, shape, there[outside], last[outside])
        self.passed = np.where(through, ~self.passed, self.passed)
        self.last = np.where(outside[:, None], there, last)
        return float(self.passed.mean())

    def _through(self, fit: RigidFit, shape: QueryMesh, there: np.ndarray, last: np.ndarray) -> Bool[np.ndarray, " N"]:
        """Whether each path, in the other's frame at the start [m], passes through it.

        It enters and leaves by faces that look opposite ways; what slides along a round body cuts its surface at faces
        that look nearly the same way.
        """
        mesh = shape.mesh
        box = fit.undo(mesh.vertices)
        low, high = np.minimum(there, last), np.maximum(there, last)
        near = ((low < box.max(axis=0)) & (high > box.min(axis=0))).all(axis=1)
        near &= np.linalg.norm(there - last, axis=1) > 0.0
        found = np.zeros(len(there), dtype=bool)
        if not near.any():
            return found
        body = QueryMesh(Mesh(box, mesh.triangles))
        met, count = body.crossings(last[near], there[near]), int(np.count_nonzero(near))
        into = np.bincount(met.way[met.side > 0], minlength=count)
        out = np.bincount(met.way[met.side < 0], minlength=count)
        if not self.other.closed:
            found[near] = (into + out) % 2 == 1
            return found
        found[near] = (into > 0) & (out > 0) & self._opposite(body, met, count)
        return found

    @staticmethod
    def _opposite(body: QueryMesh, met: SegmentCrossings, count: int) -> Bool[np.ndarray, " N"]:
        """Whether the first face that each way meets looks against the last one."""
        answer = np.zeros(count, dtype=bool)
        if not len(met.way):
            return answer
        normals = body.mesh.normals
        for k in np.unique(met.way).tolist():
            share, faces = met.share[met.way == k], met.triangle[met.way == k]
            first, final = faces[np.argmin(share)], faces[np.argmax(share)]
            answer[k] = float(normals[first] @ normals[final]) < 0.0
        return answer
