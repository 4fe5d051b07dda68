"""Material points for bodies, walls and sheets: where they lie and how much each stands for."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.quadrature import centred
from corporeal.geometry.relaxation import relax
from corporeal.geometry.shape import Shape
from corporeal.geometry.spread import sample_surface, scatter, thin_out

SLIVER = 0.02
"""Volumes below this share of spacing³ are left out where there is more."""
PACKING = 0.83
"""Least distance, in spacings, at which dart throwing reaches one point per spacing²."""


@dataclass(frozen=True)
class Filling:
    """Points and the volume each stands for; N points."""

    points: Float[np.ndarray, "N 3"]
    """[m]"""
    volumes: Float[np.ndarray, " N"]
    """[m³]"""


def fill_body(
    shape: Shape,
    skin: Shape,
    spacing: float,
    deepest: Callable[[np.ndarray], np.ndarray],
    rng: np.random.Generator,
) -> Filling:
    """Fill a body, or the wall below its surface.

    Where it is thinner than ``spacing``, one layer of points in its middle replaces the fill, so
    that stalks and slats have no gaps. What has matter all through is divided among its points.

    Args:
        shape: The body.
        skin: Its outer surface, normals outward.
        spacing: Between points [m].
        deepest: For each point given, how far below the surface there is material [m]; inf: all
            the way, 0: none here.
        rng: Source of the jitter.

    """
    points = scatter(shape, spacing, rng)
    limit = deepest(points)
    depth, foot = np.full(len(points), np.inf), np.zeros_like(points)
    ask = np.isfinite(limit) | skin.may_be_within(2 * spacing, points)
    depth[ask], _, foot[ask] = skin.closest(points[ask])
    points, limit, depth, foot = _pick(
        (depth < limit) | (limit == np.inf), points, limit, depth, foot
    )
    narrow = depth < spacing
    inward = (points - foot)[narrow] / np.maximum(depth[narrow], 1e-300)[:, None]
    narrow[narrow] = depth[narrow] + skin.reach(points[narrow] + 1e-9 * inward, inward) < spacing
    middle = fill_narrow(skin, spacing, rng)
    middle = middle[deepest(middle) > 0]
    lost = float(narrow.sum()) * spacing**3
    points, limit = points[~narrow], limit[~narrow]
    middle = middle[thin_out(middle, 0.6 * spacing, points)]
    each = lost / max(len(middle), 1)
    if each < SLIVER * spacing**3 and len(points):  # only sharp edges: nothing to speak of
        middle = middle[:0]
    everything = np.concatenate([points, middle])
    held = np.arange(len(everything)) >= len(points)
    limit = np.concatenate([limit, np.full(len(middle), np.inf)])
    relaxed = relax(everything, shape, skin, spacing, limit, held)
    least = SLIVER * spacing**3
    if np.isfinite(limit).any():
        return Filling(relaxed, np.where(held, max(each, least), spacing**3))
    relaxed, volumes = centred(relaxed, shape, spacing, held)
    if held.any():
        volumes[held] = volumes[held].mean()  # of what is this thin, samples are few
    return Filling(relaxed, np.maximum(volumes, least))


def _pick(mask: np.ndarray, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
    return tuple(a[mask] for a in arrays)


def fill_narrow(skin: Shape, spacing: float, rng: np.random.Generator) -> Float[np.ndarray, "N 3"]:
    """One layer of points midway through whatever is thinner than ``spacing``."""
    mesh = skin.mesh
    count = int(np.clip(6 * mesh.areas.sum() / spacing**2, 200, 2_000_000))
    points, triangle = sample_surface(mesh, count, rng)
    inward = -mesh.normals[triangle]
    step = 1e-6 * mesh.extent
    through = skin.reach(points + step * inward, inward) + step
    thin = through < spacing
    middle = points[thin] + 0.5 * through[thin, None] * inward[thin]
    middle = middle[rng.permutation(len(middle))]
    return middle[thin_out(middle, PACKING * spacing)]


def fill_wall(face: Mesh, spacing: float, thickness: float, rng: np.random.Generator) -> Filling:
    """Layers of points below one face of a wall; one layer in the face when it is a thin sheet.

    Candidates are moved down along both the triangles' and the vertices' normals, so that layers
    close around sharp edges, and kept where the face is nowhere nearer than the layer is deep.
    """
    layers = max(1, round(thickness / spacing))
    depths = (np.arange(layers) + 0.5) * thickness / layers if thickness >= spacing else [0.0]
    shape, area = Shape(face), float(face.areas.sum())
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
        found.append(points[thin_out(points, PACKING * spacing)])
    points = np.concatenate(found)
    if not len(points):  # crumpled more tightly than it is thick
        return fill_wall(face, spacing, 0.0, rng)
    return Filling(
        points, np.full(len(points), area * (thickness or spacing) / max(len(points), 1))
    )


def match_moments(
    points: Float[np.ndarray, "N 3"],
    masses: Float[np.ndarray, " N"],
    wanted: Float[np.ndarray, "M 3"],
    wanted_masses: Float[np.ndarray, " M"],
) -> Float[np.ndarray, " N"]:
    """Adjust masses so that mass, centre and inertia equal those of a reference.

    The smallest relative change m_i (1 + Σ_k λ_k φ_k(x_i)) over the ten monomials φ up to second
    order; returned unchanged in shape when the points cannot carry it (fewer than 30, a change
    that would make a mass negative, or a reference that is a single point).

    Returns:
        Masses [kg].

    """
    masses = masses * wanted_masses.sum() / masses.sum()
    if len(points) < 30:
        return masses
    centre = np.average(wanted, axis=0, weights=wanted_masses)
    scale = np.sqrt(np.average(((wanted - centre) ** 2).sum(axis=1), weights=wanted_masses))
    if scale <= 1e-9 * np.ptp(points, axis=0).max():
        return masses
    phi = _monomials((points - centre) / scale)
    missing = wanted_masses @ _monomials((wanted - centre) / scale) - masses @ phi
    factors = np.linalg.lstsq((phi * masses[:, None]).T @ phi, missing, rcond=1e-8)[0]
    change = 1 + phi @ factors
    return masses * change if change.min() > 0.1 else masses


def _monomials(x: np.ndarray) -> np.ndarray:
    i, j = np.triu_indices(3)
    return np.concatenate([np.ones((len(x), 1)), x, x[:, i] * x[:, j]], axis=1)
