"""Lowering of the visual hull's roof over unobserved tops.

Cameras that look down at an angle bound what is plain from above by nothing but the rays that graze it: the visual hull
is a roof over it (Laurentini 1994). The object touches each of these rays somewhere between its eaves and its ridge
(Franco, Lapierre and Boyer 2006), and outlines do not say where. How much that is comes from cutting the surface off,
level, until its outlines lack more than a pixel in some views: a roof is cut down to its eaves, a flat face at once
lacks its far edge. All heights between are as good, so that the top goes to the middle, and what is between goes along.
Nothing is in doubt where photographs agree on where the top is (``photometric.py``), below what they know of it, or
where it lies lower than outlines allow: something else held it there.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_dilation

from corporeal.geometry.mesh import Mesh
from corporeal.multiview.silhouette_coherence import is_outside_silhouettes
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.visual_hull import pixel_width
from corporeal.reconstruction.surface.kernels_outline import rasterise_views

TOP_BISECTION_STEPS = 6
"""Of what may be cut off: a 64th of the height is finer than any outline."""
MIN_KNOWN_BELIEF = 0.5
"""Confidence from which on photographs know a vertex, and mean confidence from which on the top."""
MIN_SAID_HEIGHT_FRACTION = 0.1
"""Share of the height from which on it is reported: mass changes by as much."""
PIXEL_NEIGHBOURHOOD = np.ones((1, 3, 3), bool)
"""Outlines are known to a pixel."""


@dataclass(frozen=True)
class HullTop:
    """What nothing holds of an object's height."""

    share: float = 0.0
    """How much higher, or lower, an object may be than its surface, over its height."""
    lowest: float = 0.0
    """Angle above the horizon of the camera that sees the object from lowest [deg]."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Say so in a sentence, where it matters."""
        if self.share <= MIN_SAID_HEIGHT_FRACTION:
            return ()
        return (
            f"Its height is known to ±{self.share:.0%} only: no photograph is level with its top, "
            f"the lowest looks down at {self.lowest:.0f}°, and what is plain there shows no depth. "
            "Take some pictures from low down.",
        )


def lower_hull_top(
    mesh: Mesh,
    belief: Float[np.ndarray, " N"],
    still: Bool[np.ndarray, " N"],
    cameras: Float[np.ndarray, "V 18"],
    shape: tuple[int, ...],
    pool: ThreadPool,
) -> tuple[Mesh, HullTop]:
    """Return a surface with half of its roof, and how much of its height stays in doubt.

    Args:
        mesh: Closed, +z up.
        belief: How far photographs know each vertex [0–1].
        still: Vertices that stay where they are: where these are in the roof, all of it does.
        cameras: As ``DepthRendering.rows``.
        shape: Rows and columns of their pictures.
        pool: Threads.
    """
    z, lowest = mesh.vertices[:, 2], _least_view_angle(mesh, cameras)
    low, high = float(z.min()), float(z.max())
    wide = pixel_width(cameras, mesh.vertices.mean(axis=0))
    pixel = wide / np.cos(np.radians(lowest))
    own = _silhouettes(mesh, cameras, shape, pool)
    # What cutting off a pixel's worth too much would leave of outlines is no roof.
    eaves = high - _unmissed_height_fraction(mesh, own, cameras, pool) * (high - low) + pixel
    area = np.bincount(mesh.triangles.ravel(), np.repeat(mesh.areas / 3, 3), len(z))
    over = z > eaves
    known = belief[over] @ area[over] > MIN_KNOWN_BELIEF * area[over].sum()
    if not over.any() or known or still[over].any() or not _is_bounded_by_outlines(mesh, own, cameras, pixel):
        return mesh, HullTop(0.0, lowest)
    eaves = max(eaves, _known_height(z, area * (belief > MIN_KNOWN_BELIEF), wide**2))
    vertices = mesh.vertices.copy()
    vertices[:, 2] = np.where(z > eaves, (z + eaves) / 2, z)
    top = (high + eaves) / 2
    return Mesh(vertices, mesh.triangles), HullTop(float((top - eaves) / (top - low)), lowest)


def _known_height(z: Float[np.ndarray, " N"], known: Float[np.ndarray, " N"], pixel: float) -> float:
    """Return the height above which photographs know a pixel of surface [m²]; -inf: nowhere."""
    falling = np.argsort(-z)
    enough = np.flatnonzero(np.cumsum(known[falling]) >= pixel)
    return float(z[falling[enough[0]]]) if len(enough) else -np.inf


def _unmissed_height_fraction(
    mesh: Mesh, own: Bool[np.ndarray, "V H W"], cameras: Float[np.ndarray, "V 18"], pool: ThreadPool
) -> float:
    """Return the share of a surface's height above which outlines lack a pixel at most."""
    z, looks, lost, most = mesh.vertices[:, 2], own.any(axis=(1, 2)), 0.0, 1.0
    for _ in range(TOP_BISECTION_STEPS):
        share = (lost + most) / 2
        vertices = mesh.vertices.copy()
        vertices[:, 2] = np.minimum(z, z.max() - share * np.ptp(z))
        cut = _silhouettes(Mesh(vertices, mesh.triangles), cameras, own.shape[1:], pool)
        lacks = (own & ~np.asarray(binary_dilation(cut, PIXEL_NEIGHBOURHOOD), bool)).any(axis=(1, 2))
        much = _is_no_accident(int(lacks.sum()), int(looks.sum()))
        lost, most = (lost, share) if much else (share, most)
    return lost


def _is_bounded_by_outlines(
    mesh: Mesh, own: Bool[np.ndarray, "V H W"], cameras: Float[np.ndarray, "V 18"], pixel: float
) -> bool:
    """Return whether the top of a surface would leave its outlines if it were higher by a pixel."""
    top = mesh.vertices[mesh.vertices[:, 2].argmax()] + (0, 0, pixel)
    pose, (height, width) = cameras[:, :12].reshape(-1, 3, 4), own.shape[1:]
    right, down, ahead = (pose[:, :, :3] @ top + pose[:, :, 3]).T
    u = np.floor(cameras[:, 12] * right / ahead + cameras[:, 14]).astype(int)
    v = np.floor(cameras[:, 13] * down / ahead + cameras[:, 15]).astype(int)
    looks = (ahead > 0) & (u >= 0) & (u < width) & (v >= 0) & (v < height)
    within = own[np.flatnonzero(looks), v[looks], u[looks]]
    return _is_no_accident(int((~within).sum()), len(within))


def _is_no_accident(views: int, looking: int) -> bool:
    """Return whether so many views are no accident."""
    return bool(is_outside_silhouettes(np.array([views]), np.array([looking]))[0])


def _silhouettes(
    mesh: Mesh, cameras: Float[np.ndarray, "V 18"], shape: tuple[int, ...], pool: ThreadPool
) -> Bool[np.ndarray, "V H W"]:
    """Return the pixels that a surface covers in each view."""
    out = np.zeros((len(cameras), *shape), np.bool_)
    rest = mesh.vertices, mesh.triangles, cameras, out
    pool.each(rasterise_views, [(*span, *rest) for span in pool.spans(len(cameras))])
    return out


def _least_view_angle(mesh: Mesh, cameras: Float[np.ndarray, "V 18"]) -> float:
    """Return the least angle at which a camera looks down at the middle of a surface [deg]."""
    pose = cameras[:, :12].reshape(-1, 3, 4)
    eyes = -np.einsum("vji,vj->vi", pose[:, :, :3], pose[:, :, 3])
    back = eyes - (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    return float(np.degrees(np.arcsin(back[:, 2] / np.linalg.norm(back, axis=1))).min())
