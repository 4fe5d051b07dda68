"""Signed distances [m], negative inside: primitives, smooth booleans, a mesher with true normals.

Formulas after Inigo Quilez, "Distance functions" and "Smooth minimum".
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import fast_simplification
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation
from skimage.measure import marching_cubes

from corporeal.showcase.prop_mesh import ZERO_OFFSET, PropMesh, make_mesh, unit_vectors, weld_vertices

SdfPoints = Float[np.ndarray, "N 3"]
SignedDistances = Float[np.ndarray, " N"]
SignedDistanceField = Callable[[SdfPoints], SignedDistances]
"""From points [m] to signed distances [m]."""
MAX_FIELD_SLOPE = 3.0
"""Values of a field over distances from its surface, at most [-]: 1 where they are distances, more about ellipsoids and
stretched rings."""


def _vector_lengths(v: SdfPoints) -> SignedDistances:
    """Length of each vector [m], as ``np.linalg.norm``, which takes twice as long."""
    x, y, z = v.T
    return np.sqrt(x * x + y * y + z * z)


def sdf_ellipsoid(centre: ArrayLike, radii: ArrayLike, turn: ArrayLike = ZERO_OFFSET) -> SignedDistanceField:
    """Ellipsoid about a centre, turned by xyz Euler angles [degrees]; exact on its surface."""
    c, r = np.asarray(centre, float), np.asarray(radii, float)
    axes = Rotation.from_euler("xyz", np.asarray(turn), degrees=True).as_matrix()

    def field(p: SdfPoints) -> SignedDistances:
        q = (p - c) @ axes
        k0, k1 = _vector_lengths(q / r), _vector_lengths(q / r**2)
        return k0 * (k0 - 1) / (k1 + 1e-9)

    return field


def sdf_sphere(centre: ArrayLike, radius: float) -> SignedDistanceField:
    """Sphere."""
    return lambda p: _vector_lengths(p - np.asarray(centre, float)) - radius


def sdf_capsule(start: ArrayLike, end: ArrayLike, first: float, last: float) -> SignedDistanceField:
    """Stick from start to end whose radius goes from first to last."""
    a, axis = np.asarray(start, float), np.asarray(end, float) - np.asarray(start, float)

    def field(p: SdfPoints) -> SignedDistances:
        t = np.clip((p - a) @ axis / (axis @ axis), 0, 1)
        return _vector_lengths(p - a - t[:, None] * axis) - (first + (last - first) * t)

    return field


def sdf_cylinder(radius: float, low: float, high: float, fillet: float) -> SignedDistanceField:
    """Upright cylinder between two heights, its edges rounded by ``fillet``."""

    def field(p: SdfPoints) -> SignedDistances:
        side = np.hypot(p[:, 0], p[:, 1]) - radius
        ends = np.abs(p[:, 2] - (low + high) / 2) - (high - low) / 2
        d = np.stack([side, ends], 1) + fillet
        return np.minimum(d.max(1), 0) + np.linalg.norm(np.maximum(d, 0), axis=1) - fillet

    return field


def sdf_torus(centre: ArrayLike, major: float, minor: float, tall: float = 1.0) -> SignedDistanceField:
    """Ring in the xz plane; ``tall`` stretches it along z."""

    def field(p: SdfPoints) -> SignedDistances:
        q = p - np.asarray(centre, float)
        return np.hypot(np.hypot(q[:, 0], q[:, 2] / tall) - major, q[:, 1]) - minor

    return field


def sdf_half_space_above(height: float) -> SignedDistanceField:
    """All that lies above a height."""
    return lambda p: height - p[:, 2]


def sdf_smooth_union(*fields: SignedDistanceField, k: float) -> SignedDistanceField:
    """Smooth union: seams blend over about k [m]."""

    def field(p: SdfPoints) -> SignedDistances:
        d = fields[0](p)
        for other in fields[1:]:
            e = other(p)
            h = np.maximum(k - np.abs(d - e), 0) / k
            d = np.minimum(d, e) - h * h * k / 4
        return d

    return field


def sdf_smooth_intersection(f: SignedDistanceField, g: SignedDistanceField, k: float = 1e-4) -> SignedDistanceField:
    """Smooth intersection."""
    outside = sdf_smooth_union(lambda p: -f(p), lambda p: -g(p), k=k)
    return lambda p: -outside(p)


def sdf_smooth_difference(f: SignedDistanceField, g: SignedDistanceField, k: float = 1e-4) -> SignedDistanceField:
    """Smooth difference."""
    return sdf_smooth_intersection(f, lambda p: -g(p), k)


def sdf_displaced(
    f: SignedDistanceField, noise: SignedDistanceField, depth: float, wavelength: float
) -> SignedDistanceField:
    """Push the surface in and out by noise of this depth and wavelength [m]."""
    return lambda p: f(p) + depth * noise(p / wavelength)


def periodic_noise_3d(seed: int, falloff: float = 1.8, n: int = 48) -> SignedDistanceField:
    """Periodic fractal noise of period 4 and unit variance, from filtered white noise."""
    frequency = np.fft.fftfreq(n, 1 / n)
    k = np.sqrt(sum(np.square(g) for g in np.meshgrid(*[frequency] * 3, indexing="ij")))
    white = np.fft.fftn(np.random.default_rng(seed).standard_normal((n, n, n)))
    volume = np.fft.ifftn(white / np.maximum(k, 2) ** falloff * (k > 0)).real
    volume /= volume.std()
    return lambda p: map_coordinates(volume, (np.asarray(p) * n / 4).T, order=1, mode="grid-wrap")


@dataclass(frozen=True)
class SdfSampling:
    """How finely a field becomes triangles."""

    low: Sequence[float] | np.ndarray
    """Lowest corner of a box that holds the surface [m]."""
    high: Sequence[float] | np.ndarray
    """Highest corner [m]."""
    step: float
    """Spacing of the grid [m]."""
    triangles: int
    """How many to keep."""


def mesh_sdf(f: SignedDistanceField, sampling: SdfSampling) -> PropMesh:
    """March over the box, thin out, pull back onto the surface, shade with the true gradient."""
    step = sampling.step
    v, faces = _marching_cubes(f, sampling)
    if sampling.triangles < len(faces):
        thinned = fast_simplification.simplify(v, faces, target_count=sampling.triangles)
        v, faces = weld_vertices(thinned[0], thinned[1])
    for _ in range(3):
        g = sdf_gradient(f, v, step / 4)
        reach = np.clip(f(v), -step / 2, step / 2)[:, None]
        v = v - reach * g / np.maximum((g * g).sum(1, keepdims=True), 0.25)
    return make_mesh(v, faces, normals=unit_vectors(sdf_gradient(f, v, step / 3)))


def sdf_gradient(f: SignedDistanceField, p: SdfPoints, h: float) -> SdfPoints:
    """Central differences over ±h [m]."""
    e = np.eye(3) * h
    return np.stack([f(p + e[i]) - f(p - e[i]) for i in range(3)], 1) / (2 * h)


def _marching_cubes(f: SignedDistanceField, sampling: SdfSampling) -> tuple[np.ndarray, np.ndarray]:
    """Marching cubes on a regular grid, welded."""
    step = sampling.step
    # An odd offset keeps grid points off flat faces: a distance of exactly zero would tear them.
    axes = [np.arange(a - 2.318 * step, b + 3 * step, step) for a, b in zip(sampling.low, sampling.high, strict=True)]
    values = values_near_surface(f, axes, step)
    if min(np.take(values, end, axis).min() for axis in range(3) for end in (0, -1)) < 0:
        raise ValueError(
            f"The surface leaves the box {sampling.low} to {sampling.high} m and would stay open. Widen the box."
        )
    v, faces, _, _ = marching_cubes(values, 0.0, spacing=(step, step, step), gradient_direction="descent")
    return weld_vertices(v + np.array([a[0] for a in axes]), faces)


def values_near_surface(f: SignedDistanceField, axes: Sequence[np.ndarray], step: float) -> Float[np.ndarray, "X Y Z"]:
    """Values of a field on a grid, exact in every cell that its surface could go through.

    Every second point along each axis is asked first. Where the values at all eight about a place
    are so large that no surface can be between them (see ``MAX_FIELD_SLOPE``), one of them does
    for the points between.
    """
    # One more than the grid has, so that every point lies between two.
    coarse = [a[0] + 2 * step * np.arange(len(a) // 2 + 1) for a in axes]
    far = _values_on_grid(f, *np.meshgrid(*coarse, indexing="ij"))
    reach, least = MAX_FIELD_SLOPE * np.sqrt(3) * step, np.abs(far)
    shape = [len(a) for a in axes]
    values, near = np.empty(shape), np.zeros(shape, bool)
    # Of the eight points about a cell of 2 x 2 x 2, the one that is nearest to the surface.
    for axis in range(3):
        least = np.minimum(least, np.roll(least, -1, axis))
    cells = tuple(np.arange(n) // 2 for n in shape)
    near[:] = least[np.ix_(*cells)] <= reach
    values[:] = far[np.ix_(*cells)]
    places = np.nonzero(near)
    values[near] = _values_on_grid(f, *(a[k] for a, k in zip(axes, places, strict=True)))
    return values


def _values_on_grid(f: SignedDistanceField, *place: np.ndarray) -> np.ndarray:
    """Values of a field at places [m] given axis by axis."""
    return f(np.stack(place, -1).reshape(-1, 3)).reshape(place[0].shape)
