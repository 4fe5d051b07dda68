"""Extent of an object in its own orientation."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError


def oriented_box_size(points: Float[np.ndarray, "N 3"]) -> tuple[float, float, float]:
    """Extents of the smallest box around the points, shortest first [m].

    The box of least volume over frames that stand on a face of the convex hull and are turned to
    one of that face's edges, beside the world's and the principal frame.
    """
    centred = points - points.mean(axis=0)
    _, _, principal = np.linalg.svd(centred[:: max(1, len(centred) // 20000)], full_matrices=False)
    frames = [np.eye(3)]
    if principal.shape == (3, 3):
        frames.append(principal)
    try:
        hull = ConvexHull(centred)
    except QhullError:  # flat or straight: the principal frame is the right one
        outline = centred
    else:
        outline = centred[hull.vertices]
        frames += _hull_frames(hull)
    sizes = np.ptp(np.einsum("fij,nj->fni", np.stack(frames), outline), axis=1)
    best = np.sort(sizes[np.argmin(np.prod(sizes + 1e-12, axis=1))])
    return float(best[0]), float(best[1]), float(best[2])


def _hull_frames(hull: ConvexHull, most: int = 80) -> list[np.ndarray]:
    corners = hull.points[hull.simplices]
    edge = corners[:, 1] - corners[:, 0]
    area = np.linalg.norm(np.cross(edge, corners[:, 2] - corners[:, 0]), axis=1)
    frames = []
    for k in np.argsort(area)[::-1][:most]:
        normal = hull.equations[k, :3]
        along = edge[k] / np.linalg.norm(edge[k])
        frames.append(np.stack([normal, along, np.cross(normal, along)]))
    return frames
