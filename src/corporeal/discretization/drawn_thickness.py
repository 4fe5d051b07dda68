"""Thickness and holes of an object as drawn by its mesh, for questions to a model."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from corporeal.discretization.mesh_kind import wall_thickness_behind
from corporeal.discretization.mesh_measures import is_nearly_closed
from corporeal.discretization.open_cavity import volume_below_rim
from corporeal.geometry.mesh import Mesh, TriangleSurface, join_meshes, orient_outward, signed_volume, weld_mesh
from corporeal.geometry.mesh_queries import QueryMesh

MIN_SCAN_TRIANGLES, MAX_SCAN_EDGE_LOG_SPREAD = 3000, 0.6
"""A mesh of more triangles than this, whose edges' logarithms spread less than that, is a scan."""
MAX_HOLLOW_HULL_FRACTION = 0.75
"""What encloses less than this share of its convex hull shows holes, gaps or hollows."""
MIN_VOLUME_LOG_DOUBT = 0.1
"""A scan is thin where its edges alone leave the logarithm of its volume open by so much [-]."""
MIN_LUMP_WALL_RATIO = 2.5
"""A mean thickness over the usual wall, from which a vessel may be a lump [-]: walls are drawn up to twice as thick as
they are, and a filled saucer, the flattest ware, is 2.9 times as thick."""
MIN_DRAWN_HOLLOW_FRACTION = 0.5
"""Of what a vessel encloses: as much room below its rim shows that its hollow is drawn [-]."""
THICKNESS_PERCENTILES = (10, 25, 50)
"""Of the surface [%], behind which the distance of the opposite face is known."""


@dataclass(frozen=True)
class ThinScan:
    """A scan of something thin: how coarse it is, and how thick it draws the object."""

    edge: float
    """Median edge [m]."""
    behind: tuple[float, float, float]
    """Distance to the opposite face behind the surface [m]: a tenth, a quarter and half of it have it as near."""
    doubt: float
    """Standard deviation of the logarithm of the volume that its edges leave open [-]."""


@dataclass(frozen=True)
class DrawnShape:
    """What the mesh of one object shows."""

    hollowed: bool = False
    """Whether it is closed and shows holes, gaps or hollows."""
    thin: ThinScan | None = None
    """None: no scan, or a thick one."""


NO_DRAWN_SHAPE = DrawnShape()
"""Of parts that were not measured or are not closed."""


def measure_drawn_shape(surfaces: Sequence[TriangleSurface], scale: float = 1.0) -> DrawnShape:
    """Measure what a question about an object depends on.

    Args:
        surfaces: All of the object's.
        scale: Lengths in them over the real ones [-].
    """
    mesh = _as_closed_mesh(surfaces)
    if mesh is None:
        return NO_DRAWN_SHAPE
    volume = abs(signed_volume(mesh))
    return DrawnShape(_shows_hollows(mesh, volume), _thin_scan(mesh, volume, scale))


def mean_drawn_thickness(surfaces: Sequence[TriangleSurface], scale: float = 1.0) -> float:
    """Return how thick the shape that surfaces enclose is on average, 2 V / A [m]; 0: it is open.

    Args:
        surfaces: All of the object's.
        scale: Lengths in them over the real ones [-].
    """
    mesh = _as_closed_mesh(surfaces)
    if mesh is None:
        return 0.0
    return 2 * abs(signed_volume(mesh)) / float(mesh.areas.sum()) / scale


def is_drawn_as_lump(surfaces: Sequence[TriangleSurface], wall: float, scale: float = 1.0) -> bool:
    """Return whether a vessel is drawn as a lump: far thicker than its wall, and with no room.

    Args:
        surfaces: All of the object's, upright.
        wall: As such vessels have [m].
        scale: Lengths in them over the real ones [-].
    """
    mesh = _as_closed_mesh(surfaces)
    if mesh is None:
        return False
    volume, shape = abs(signed_volume(mesh)), QueryMesh(mesh)
    if not 2 * volume / float(mesh.areas.sum()) > MIN_LUMP_WALL_RATIO * wall * scale:
        return False
    return volume_below_rim(shape, mesh, np.random.default_rng(0)) < MIN_DRAWN_HOLLOW_FRACTION * volume


def _as_closed_mesh(surfaces: Sequence[TriangleSurface]) -> Mesh | None:
    """Return all surfaces of an object as one mesh, normals outward; None: it is open."""
    whole = join_meshes(surfaces)
    mesh = orient_outward(weld_mesh(whole.vertices, whole.triangles)[0])
    return mesh if is_nearly_closed(mesh) else None


def scan_edge_length(mesh: Mesh) -> float:
    """Return the median edge of a scan [m]; 0: it is none."""
    if len(mesh.triangles) <= MIN_SCAN_TRIANGLES:
        return 0.0
    corners = mesh.corners
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    edges = edges[edges > 0]
    return float(np.median(edges)) if np.std(np.log(edges)) < MAX_SCAN_EDGE_LOG_SPREAD else 0.0


def scan_volume_log_deviation(edge: float, volume: float, area: float) -> float:
    """Return how far a scan's edges leave its volume open: deviation of its logarithm [-].

    The surface of a scan lies anywhere within half an edge of the real one, so the logarithm of its
    volume lies anywhere within A (h/2) / V = h / τ, with the median edge h and the mean thickness
    τ = 2 V / A: a deviation of h / (√3 τ).
    """
    return edge * area / (2 * sqrt(3.0) * volume) if volume > 0 else 0.0


def _shows_hollows(mesh: Mesh, volume: float) -> bool:
    try:
        hull = ConvexHull(mesh.vertices[np.unique(mesh.triangles)])
    except QhullError:  # flat
        return False
    return volume < MAX_HOLLOW_HULL_FRACTION * float(hull.volume)


def _thin_scan(mesh: Mesh, volume: float, scale: float) -> ThinScan | None:
    edge = scan_edge_length(mesh)
    doubt = scan_volume_log_deviation(edge, volume, float(mesh.areas.sum()))
    if doubt < MIN_VOLUME_LOG_DOUBT:
        return None
    behind = wall_thickness_behind(QueryMesh(mesh), np.random.default_rng(0))
    tenth, quarter, half = np.percentile(behind, THICKNESS_PERCENTILES, method="nearest") / scale
    return ThinScan(edge / scale, (float(tenth), float(quarter), float(half)), doubt)
