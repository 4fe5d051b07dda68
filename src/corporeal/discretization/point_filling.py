"""Sampling of material points in bodies, walls and sheets, with their volumes."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.point_relaxation import relax_points
from corporeal.geometry.point_sampling import poisson_disk_subset, sample_surface, scatter_points
from corporeal.geometry.quadrature import centroidal_points

MIN_POINT_VOLUME_FRACTION = 0.02
"""Volumes below this share of spacing³ are left out where there is more."""
SAME_THICKNESS_RATIO = 1.25
"""Ratio of two thicknesses up to which points stand for about the same volume."""
MIN_POINTS_PER_MOMENT = 3
"""Points per moment that is matched."""
MIN_KEPT_MASS_FRACTION, MOMENT_ITERATIONS = 0.1, 30
"""Share of its mass that every point keeps when moments are matched, and attempts at that."""
DART_DISTANCE_SPACINGS = 0.83
"""Least distance, in spacings, at which dart throwing reaches one point per spacing²."""


@dataclass(frozen=True)
class PointFilling:
    """Points and the volume each stands for; N points."""

    points: Float[np.ndarray, "N 3"]
    """[m]"""
    volumes: Float[np.ndarray, " N"]
    """[m³]"""


def fill_body(
    shape: QueryMesh,
    skin: QueryMesh,
    spacing: float,
    deepest: Callable[[np.ndarray], np.ndarray],
    rng: np.random.Generator,
) -> PointFilling:
    """Fill a body, or the wall below its surface.

    Where it is thinner than ``spacing``, one layer of points in its middle replaces the fill, so that stalks and slats
    have no gaps. What has material all through is divided among its points.

    Args:
        shape: The body.
        skin: Its outer surface, normals outward.
        spacing: Between points [m].
        deepest: For each point given, how far below the surface there is material [m]; inf: all
            the way, 0: none here.
        rng: Source of the jitter.
    """
    points = scatter_points(shape, spacing, rng)
    limit = deepest(points)
    elsewhere = bool((limit <= 0).any())
    depth, foot = np.full(len(points), np.inf), np.zeros_like(points)
    ask = np.isfinite(limit) | skin.may_be_within(2 * spacing, points)
    depth[ask], _, foot[ask] = skin.closest(points[ask])
    points, limit, depth, foot = _subset_filling((depth < limit) | (limit == np.inf), points, limit, depth, foot)
    narrow = depth < spacing
    inward = (points - foot)[narrow] / np.maximum(depth[narrow], 1e-300)[:, None]
    narrow[narrow] = depth[narrow] + skin.reach(points[narrow] + 1e-9 * inward, inward) < spacing
    middle, through = fill_narrow_body(skin, spacing, rng)
    there = deepest(middle) > 0
    elsewhere |= not there.all()
    middle, through = _subset_filling(there, middle, through)
    lost = float(narrow.sum()) * spacing**3
    points, limit = points[~narrow], limit[~narrow]
    middle, through = _subset_filling(poisson_disk_subset(middle, 0.6 * spacing, points), middle, through)
    each = lost / max(len(middle), 1)
    if each < MIN_POINT_VOLUME_FRACTION * spacing**3 and len(points):  # only sharp edges: nothing to speak of
        middle, through = middle[:0], through[:0]
    everything = np.concatenate([points, middle])
    held = np.arange(len(everything)) >= len(points)
    limit = np.concatenate([limit, np.full(len(middle), np.inf)])
    relaxed = relax_points(everything, shape, skin, spacing, limit, held)
    least = MIN_POINT_VOLUME_FRACTION * spacing**3
    if np.isfinite(limit).any():
        return PointFilling(relaxed, np.where(held, max(each, least), spacing**3))
    empty = (lambda p: deepest(p) <= 0) if elsewhere else None
    relaxed, volumes = centroidal_points(relaxed, shape, spacing, held, empty)
    volumes[held] = _mean_volumes_by_thickness(volumes[held], through)
    return PointFilling(relaxed, np.maximum(volumes, least))


def _subset_filling(which: np.ndarray, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(a[which] for a in arrays)


def _mean_volumes_by_thickness(
    volumes: Float[np.ndarray, " N"], through: Float[np.ndarray, " N"]
) -> Float[np.ndarray, " N"]:
    """Return points the mean volume [m³] of those where the body is about as thick [m].

    Of what is this thin, one point has few samples. All of them together would say that a twig weighs as much as the
    same length of the trunk.
    """
    likeness = np.floor(np.log(np.maximum(through, 1e-300)) / np.log(SAME_THICKNESS_RATIO))
    _, group = np.unique(likeness, return_inverse=True)
    return (np.bincount(group, volumes) / np.maximum(np.bincount(group), 1))[group]


def fill_narrow_body(
    skin: QueryMesh, spacing: float, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, " N"]]:
    """Lay one layer of points midway through whatever is thinner than ``spacing``.

    Returns:
        Positions, and how thick the body is there [m].
    """
    mesh = skin.mesh
    count = int(np.clip(6 * mesh.areas.sum() / spacing**2, 200, 2_000_000))
    points, triangle = sample_surface(mesh, count, rng)
    inward = -mesh.normals[triangle]
    step = 1e-6 * mesh.extent
    through = skin.reach(points + step * inward, inward) + step
    thin = through < spacing
    middle = points[thin] + 0.5 * through[thin, None] * inward[thin]
    middle, through = _subset_filling(rng.permutation(len(middle)), middle, through[thin])
    apart = poisson_disk_subset(middle, DART_DISTANCE_SPACINGS * spacing)
    return middle[apart], through[apart]


def fill_wall(face: Mesh, spacing: float, thickness: float, rng: np.random.Generator) -> PointFilling:
    """Layers of points below one face of a wall; one layer in the face when it is a thin sheet.

    Candidates are moved down along both the triangles' and the vertices' normals, so that layers close around sharp
    edges, and kept where the face is nowhere nearer than the layer is deep.
    """
    layers = max(1, round(thickness / spacing))
    depths = (np.arange(layers) + 0.5) * thickness / layers if thickness >= spacing else [0.0]
    shape, area = QueryMesh(face), float(face.areas.sum())
    smooth = face.vertex_normals
    found = []
    for depth in depths:
        count = int(np.clip(10 * area / spacing**2, 50, 2_000_000))
        points, triangle = sample_surface(face, count, rng)
        normal = face.normals[triangle]
        soft = smooth[face.triangles[triangle]].mean(axis=1)
        normal = np.where(rng.uniform(size=(count, 1)) < 0.5, normal, soft)
        points = points - depth * normal
        points = points[shape.closest(points)[0] > 0.97 * depth - 1e-12]
        points = points[rng.permutation(len(points))]
        found.append(points[poisson_disk_subset(points, DART_DISTANCE_SPACINGS * spacing)])
    points = np.concatenate(found)
    if not len(points):  # crumpled more tightly than it is thick
        return fill_wall(face, spacing, 0.0, rng)
    return PointFilling(points, np.full(len(points), area * (thickness or spacing) / max(len(points), 1)))


def match_moments(
    points: Float[np.ndarray, "N 3"],
    masses: Float[np.ndarray, " N"],
    wanted: Float[np.ndarray, "M 3"],
    wanted_masses: Float[np.ndarray, " M"],
) -> Float[np.ndarray, " N"]:
    """Adjust masses so that mass, centre and inertia equal those of a reference.

    The smallest relative change m_i (1 + Σ_k λ_k φ_k(x_i)) over the ten monomials φ up to second order that leaves
    every point a tenth of its mass: points that would keep less keep that, and the others are solved again. Points that
    cannot carry the inertia so have the right centre at least; those that cannot carry that either, too few or all to
    one side, are returned with the right mass only, and so is what stands for a single point.

    Returns:
        Masses [kg].
    """
    masses = masses * wanted_masses.sum() / masses.sum()
    centre = np.average(wanted, axis=0, weights=wanted_masses)
    scale = np.sqrt(np.average(((wanted - centre) ** 2).sum(axis=1), weights=wanted_masses))
    if scale <= 1e-9 * np.ptp(points, axis=0).max():
        return masses
    phi = _moment_monomials((points - centre) / scale)
    target = wanted_masses @ _moment_monomials((wanted - centre) / scale)
    for moments in (10, 4):
        if len(points) < MIN_POINTS_PER_MOMENT * moments:
            continue
        change = _least_mass_factors(masses, phi[:, :moments], target[:moments])
        if change is not None:
            return masses * change
    return masses


def _least_mass_factors(
    masses: Float[np.ndarray, " N"], phi: Float[np.ndarray, "N K"], target: Float[np.ndarray, " K"]
) -> Float[np.ndarray, " N"] | None:
    """Smallest factors of masses that give K moments; None where none of at least LEAST do."""
    change, free = np.ones(len(masses)), np.ones(len(masses), dtype=bool)
    for _ in range(MOMENT_ITERATIONS):
        change[free] = 1.0
        missing = target - (masses * change) @ phi
        own = phi[free]
        factors = np.linalg.lstsq((own * masses[free, None]).T @ own, missing, rcond=1e-8)[0]
        change[free] = 1 + own @ factors
        low = free & (change < MIN_KEPT_MASS_FRACTION)
        if not low.any():
            break
        change[low], free[low] = MIN_KEPT_MASS_FRACTION, False
    off = np.abs((masses * change) @ phi - target).max()
    return change if change.min() >= MIN_KEPT_MASS_FRACTION and off <= 1e-6 * masses.sum() else None


def _moment_monomials(x: np.ndarray) -> np.ndarray:
    i, j = np.triu_indices(3)
    return np.concatenate([np.ones((len(x), 1)), x, x[:, i] * x[:, j]], axis=1)
