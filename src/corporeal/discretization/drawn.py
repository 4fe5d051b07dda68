"""What a mesh draws of an object: holes, and how thick; who is asked about it has to know."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from corporeal.discretization.anatomy import wall_behind
from corporeal.discretization.hollow import volume_below_rim
from corporeal.discretization.survey import closes
from corporeal.geometry.mesh import Mesh, Triangles, joined, orient, signed_volume, weld
from corporeal.geometry.shape import Shape

SCANNED, EVEN = 3000, 0.6
"""A mesh of more triangles than this, whose edges' logarithms spread less than that, is a scan."""
HOLLOWED = 0.75
"""What encloses less than this share of its convex hull shows holes, gaps or hollows."""
IN_DOUBT = 0.1
"""A scan is thin where its edges alone leave the logarithm of its volume open by so much [-]."""
FULL = 2.5
"""A mean thickness over the usual wall, from which a vessel may be a lump [-]: walls are drawn up
to twice as thick as they are, and a filled saucer, the flattest ware, is 2.9 times as thick."""
ROOM = 0.5
"""Of what a vessel encloses: as much room below its rim shows that its hollow is drawn [-]."""
SHARES = (10, 25, 50)
"""Of the surface [%], behind which it is said how far the opposite face lies."""


@dataclass(frozen=True)
class Thin:
    """A scan of something thin: how coarse it is, and how thick it draws the thing."""

    edge: float
    """Median edge [m]."""
    behind: tuple[float, float, float]
    """Distance to the opposite face behind the surface [m]: a tenth, a quarter and half of it have
    it as near."""
    doubt: float
    """Standard deviation of the logarithm of the volume that its edges leave open [-]."""


@dataclass(frozen=True)
class Drawn:
    """What the mesh of one object shows."""

    hollowed: bool = False
    """Whether it is closed and shows holes, gaps or hollows."""
    thin: Thin | None = None
    """None: no scan, or a thick one."""


NOTHING = Drawn()
"""Of what nobody measured, or what is not closed."""


def drawn(surfaces: Sequence[Triangles], scale: float = 1.0) -> Drawn:
    """Measure what a question about an object depends on.

    Args:
        surfaces: All of the object's.
        scale: Lengths in them over the real ones [-].

    """
    mesh = _closed(surfaces)
    if mesh is None:
        return NOTHING
    volume = abs(signed_volume(mesh))
    return Drawn(_hollowed(mesh, volume), _thin(mesh, volume, scale))


def mean_thickness(surfaces: Sequence[Triangles], scale: float = 1.0) -> float:
    """Return how thick the shape that surfaces enclose is on average, 2 V / A [m]; 0: it is open.

    Args:
        surfaces: All of the object's.
        scale: Lengths in them over the real ones [-].

    """
    mesh = _closed(surfaces)
    if mesh is None:
        return 0.0
    return 2 * abs(signed_volume(mesh)) / float(mesh.areas.sum()) / scale


def drawn_full(surfaces: Sequence[Triangles], wall: float, scale: float = 1.0) -> bool:
    """Tell whether a vessel is drawn as a lump: far thicker than its wall, and with no room.

    Args:
        surfaces: All of the object's, upright.
        wall: As such vessels have [m].
        scale: Lengths in them over the real ones [-].

    """
    mesh = _closed(surfaces)
    if mesh is None:
        return False
    volume, shape = abs(signed_volume(mesh)), Shape(mesh)
    if not 2 * volume / float(mesh.areas.sum()) > FULL * wall * scale:
        return False
    return volume_below_rim(shape, mesh, np.random.default_rng(0)) < ROOM * volume


def _closed(surfaces: Sequence[Triangles]) -> Mesh | None:
    """Return all surfaces of an object as one mesh, normals outward; None: it is open."""
    whole = joined(surfaces)
    mesh = orient(weld(whole.vertices, whole.triangles)[0])
    return mesh if closes(mesh) else None


def edge_of_scan(mesh: Mesh) -> float:
    """Return the median edge of a scan [m]; 0: it is none."""
    if len(mesh.triangles) <= SCANNED:
        return 0.0
    corners = mesh.corners
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    edges = edges[edges > 0]
    return float(np.median(edges)) if np.std(np.log(edges)) < EVEN else 0.0


def coarseness(edge: float, volume: float, area: float) -> float:
    """Return how far a scan's edges leave its volume open: deviation of its logarithm [-].

    The surface of a scan lies anywhere within half an edge of the real one, so the logarithm of its
    volume lies anywhere within A (h/2) / V = h / τ, with the median edge h and the mean thickness
    τ = 2 V / A: a deviation of h / (√3 τ).
    """
    return edge * area / (2 * sqrt(3.0) * volume) if volume > 0 else 0.0


def _hollowed(mesh: Mesh, volume: float) -> bool:
    try:
        hull = ConvexHull(mesh.vertices[np.unique(mesh.triangles)])
    except QhullError:  # flat
        return False
    return volume < HOLLOWED * float(hull.volume)


def _thin(mesh: Mesh, volume: float, scale: float) -> Thin | None:
    edge = edge_of_scan(mesh)
    doubt = coarseness(edge, volume, float(mesh.areas.sum()))
    if doubt < IN_DOUBT:
        return None
    behind = wall_behind(Shape(mesh), np.random.default_rng(0))
    tenth, quarter, half = np.percentile(behind, SHARES, method="nearest") / scale
    return Thin(edge / scale, (float(tenth), float(quarter), float(half)), doubt)
