"""Skinning: vertices and Gaussians are bound to nearby particles at the start.

Weights depend on position and part only, so vertices doubled along a texture seam stay together, and a rigid object,
whose particles all share one rotation, moves exactly.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from corporeal.core.types import Frame, Particles, Parts, Scene
from corporeal.geometry.mesh import join_meshes
from corporeal.mpm.laws.kinematics import determinant
from corporeal.render import kernels_skin
from corporeal.render.packed_scene import vertex_normals, vertex_positions

NEIGHBOUR_PARTICLES = 12
STRETCH_LIMITS = (0.3, 3.0)
"""A picture shows no more than this principal stretch of a particle's surroundings [-]."""
GRANULAR_STRETCH_LIMITS = (0.7, 1.4)
"""The same for granular material, whose neighbours part and whose F says little of a surface."""


@dataclass(frozen=True)
class FacetNormals:
    """Triangles whose normals follow from their corners: F of a fluid knows volume only."""

    triangles: Int[np.ndarray, "T 3"]
    """Vertices of the skin."""
    point: Int[np.ndarray, " V"]
    """Number of each vertex's place: vertices doubled along a seam share one."""
    side: Float[np.ndarray, " V"]
    """1, or -1 where the file's normal is opposite to the winding; 0 of what has no triangle."""

    def normals(self, place: Float[np.ndarray, "V 3"]) -> Float[np.ndarray, "V 3"]:
        """Return unit normals, means by area over the triangles around each place."""
        a, b, c = (place[self.triangles[:, k]] for k in range(3))
        across = np.cross(b - a, c - a)
        total = np.zeros((int(self.point.max()) + 1, 3))
        for corner in range(3):
            np.add.at(total, self.point[self.triangles[:, corner]], across)
        length = np.linalg.norm(total, axis=1, keepdims=True)
        unit = np.divide(total, length, out=np.zeros_like(total), where=length > 0)
        return self.side[:, None] * unit[self.point]


@dataclass(frozen=True)
class SkinBinding:
    """Points bound to particles: vertices of all surfaces in order, or Gaussians."""

    rest: Float[np.ndarray, "V 3"]
    """[m]"""
    normals: Float[np.ndarray, "V 3"]
    """Unit; 0 of what has none."""
    near: Int[np.ndarray, "V k"]
    """Particles of each point, the nearest first."""
    weight: Float[np.ndarray, "V k"]
    start: Float[np.ndarray, "P 3"]
    """Particles' first positions [m]."""
    loose: Bool[np.ndarray, " P"]
    flowing: FacetNormals | None = None
    """Of fluids; None: there are none."""

    def pose(self, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (V, 3) [m] and unit normals (V, 3) at one instant."""
        place, turned = np.empty_like(self.rest), np.empty_like(self.normals)
        moved = self._moved(frame)
        kernels_skin.deform_points_and_normals(
            self.rest, self.normals, self.near, self.weight, self.start, *moved, place, turned
        )
        if self.flowing is not None:
            fresh = self.flowing.normals(place)
            turned = np.where(np.any(fresh, axis=1)[:, None], fresh, turned)
        return place, turned

    def carried(self, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
        """Places (V, 3) [m] and deformation gradients (V, 3, 3) at one instant."""
        place, gradient = np.empty_like(self.rest), np.empty((len(self.rest), 3, 3))
        moved = self._moved(frame)
        kernels_skin.deform_points(self.rest, self.near, self.weight, self.start, *moved, place, gradient)
        return place, gradient

    def _moved(self, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
        """Particles' positions [m] and gradients, made fit to be seen."""
        F = np.ascontiguousarray(frame.deformation, dtype=np.float64)
        F = limit_stretch(F, np.where(self.loose[:, None], GRANULAR_STRETCH_LIMITS, STRETCH_LIMITS))
        now = np.ascontiguousarray(frame.position, dtype=np.float64)
        lost = ~np.all(np.isfinite(now), axis=1)
        if lost.any():
            now = np.where(lost[:, None], self.start, now)
        return now, F


@dataclass(frozen=True)
class _VertexOwners:
    """What every vertex belongs to; V vertices."""

    part: Int[np.ndarray, " V"]
    """-1: none."""
    object: Int[np.ndarray, " V"]


def bind_vertices(
    scene: Scene,
    parts: Parts,
    particles: Particles,
    loose: Bool[np.ndarray, " K"],
    fluid: Bool[np.ndarray, " K"] | None = None,
) -> SkinBinding:
    """Bind every vertex to the nearest particles of its own part, or else of its own object.

    Args:
        scene: With surfaces.
        parts: Which part each triangle is of.
        particles: What carries the surfaces.
        loose: Which parts are granular or liquid.
        fluid: Which parts are fluids, whose normals are those of the posed surface; None: none.
    """
    owners = _owners(scene, parts)
    skin = _bind(vertex_positions(scene), vertex_normals(scene), owners, particles, loose)
    if fluid is None or not fluid.any():
        return skin
    return replace(skin, flowing=_facets(scene, parts, skin, fluid))


def _facets(scene: Scene, parts: Parts, skin: SkinBinding, fluid: np.ndarray) -> FacetNormals:
    """Take the triangles of fluid parts, welded by place."""
    part = np.asarray(parts.part_of_point)
    mine = (part >= 0) & fluid[np.maximum(part, 0)]
    triangles = np.asarray(join_meshes(scene.surfaces).triangles)[mine]
    _, point = np.unique(np.round(skin.rest, 7), axis=0, return_inverse=True)
    touched = np.zeros(len(skin.rest))
    touched[triangles] = 1.0
    wound = FacetNormals(triangles, point.reshape(-1), touched)
    opposite = np.einsum("vi,vi->v", wound.normals(skin.rest), skin.normals) < 0
    return replace(wound, side=np.where(opposite, -touched, touched))


def bind_points(
    points: Float[np.ndarray, "V 3"],
    object_of_point: Int[np.ndarray, " V"],
    particles: Particles,
    loose: Bool[np.ndarray, " K"],
) -> SkinBinding:
    """Bind every point to the nearest particles of its own object; without any it stays."""
    points = np.ascontiguousarray(points, dtype=np.float64)
    owners = _VertexOwners(np.full(len(points), -1), np.asarray(object_of_point))
    return _bind(points, np.zeros_like(points), owners, particles, loose)


def _bind(
    rest: np.ndarray, normals: np.ndarray, owners: _VertexOwners, particles: Particles, loose: np.ndarray
) -> SkinBinding:
    near = np.zeros((len(rest), NEIGHBOUR_PARTICLES), dtype=np.int64)
    weight = np.zeros((len(rest), NEIGHBOUR_PARTICLES))
    for vertices, own in _carrying_pairs(owners, particles):
        near[vertices], weight[vertices] = _nearest(rest[vertices], own, particles.position)
    return SkinBinding(
        rest=rest,
        normals=normals,
        near=near,
        weight=weight,
        start=np.ascontiguousarray(particles.position, dtype=np.float64),
        loose=np.asarray(loose, dtype=bool)[particles.part] if len(loose) else particles.part < 0,
    )


def limit_stretch(
    F: Float[np.ndarray, "P 3 3"], limits: tuple[float, float] | Float[np.ndarray, "P 2"]
) -> Float[np.ndarray, "P 3 3"]:
    """F with its principal stretches within limits; a mirrored or broken F becomes a rotation."""
    low, high = np.broadcast_to(limits, (len(F), 2)).T
    finite = np.isfinite(F)
    if not finite.all():
        F = np.where(np.all(finite, axis=(1, 2))[:, None, None], F, np.eye(3))
    # |σ² - 1| ≤ ‖FᵀF - 1‖, so that small strains need no decomposition.
    outside = np.empty(len(F), np.bool_)
    kernels_skin.mark_strained(F, np.minimum(1 - low**2, high**2 - 1) ** 2, outside)
    if outside.any():
        U, s, Vt = np.linalg.svd(F[outside])
        flip = determinant(U) * determinant(Vt) < 0
        U[flip, :, 2] *= -1
        F = F.copy()
        s = np.clip(s, low[outside, None], high[outside, None])
        F[outside] = U * s[:, None, :] @ Vt
    return F


def _owners(scene: Scene, parts: Parts) -> _VertexOwners:
    counts = [len(s.vertices) for s in scene.surfaces]
    number = np.repeat([s.object for s in scene.surfaces], counts).astype(np.int64)
    part = np.full(sum(counts), -1, dtype=np.int64)
    first, triangle = 0, 0
    for s in scene.surfaces:
        mine = parts.part_of_point[triangle : triangle + len(s.triangles)]
        for corner in range(3):
            part[first + s.triangles[:, corner]] = mine
        first, triangle = first + len(s.vertices), triangle + len(s.triangles)
    return _VertexOwners(part, number)


def _carrying_pairs(owners: _VertexOwners, particles: Particles):
    """Vertices with the particles that may carry them."""
    part, number = owners.part, owners.object
    for k in np.unique(part):
        of_part = np.flatnonzero(particles.part == k)
        for j in np.unique(number[part == k]):
            vertices = np.flatnonzero((part == k) & (number == j))
            own = of_part[particles.object[of_part] == j]
            if len(own) == 0:
                own = np.flatnonzero(particles.object == j)
            if len(own):
                yield vertices, own


def _nearest(points: np.ndarray, own: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    found = KDTree(position[own]).query(points, k=NEIGHBOUR_PARTICLES + 1)
    distance, index = (np.asarray(x) for x in found)
    weight = np.empty((len(points), NEIGHBOUR_PARTICLES))
    kernels_skin.shepard_weights(distance, weight)
    return own[np.minimum(index[:, :NEIGHBOUR_PARTICLES], len(own) - 1)], weight
