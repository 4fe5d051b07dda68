"""Gaussians of recordings: pose at rest, and binding to objects.

In the page a mean moves like the nearest vertex of its object, and the ellipsoid turns with the object's pose; only the
video stretches it with the material. Colours are those of degree 0: the same from all sides.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from corporeal.core.types import Reconstruction
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.render.recording_format import RecordedGaussians, SceneBinding

MAX_PAGE_GAUSSIANS = 80_000
"""Gaussians that a page is given: of more, those that cover most."""
MIN_OPACITY = 1 / 255
"""Less opacity is not seen [-]."""


def select_gaussians(found: Reconstruction, cast: SceneBinding) -> RecordedGaussians:
    """Choose and bind Gaussians."""
    g, owner = found.gaussians, found.object_of_gaussian
    covers = g.opacity * np.sort(g.scale, axis=1)[:, 1:].prod(axis=1)
    seen = np.flatnonzero((g.opacity > MIN_OPACITY) & (owner < len(cast.vertices)))
    chosen = seen[np.argsort(-covers[seen], kind="stable")[:MAX_PAGE_GAUSSIANS]]
    chosen = chosen[np.argsort(owner[chosen], kind="stable")]
    w, x, y, z = g.rotation[chosen].T.astype(float)
    axes = Rotation.from_quat(np.stack([x, y, z, w], axis=1)).as_matrix()
    axes = axes * g.scale[chosen, None, :]
    whole = axes @ axes.transpose(0, 2, 1)
    shade = np.column_stack([0.5 + SH_DC_COEFFICIENT * g.sh[chosen, 0], g.opacity[chosen]])
    return RecordedGaussians(
        mean=g.mean[chosen].astype(float),
        covariance=whole[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]],
        colour=np.round(255 * np.clip(shade, 0.0, 1.0)).astype(np.uint8),
        object=owner[chosen],
        vertex=_bound_vertices(g.mean[chosen], owner[chosen], cast),
        all=g.count,
    )


def _bound_vertices(
    mean: Float[np.ndarray, "N 3"], owner: Int[np.ndarray, " N"], cast: SceneBinding
) -> Int[np.ndarray, " N"]:
    out = np.zeros(len(mean), dtype=np.int64)
    for k in np.unique(owner[owner >= 0]).tolist():
        mine = owner == k
        out[mine] = KDTree(cast.skin.rest[cast.vertices[k]]).query(mean[mine])[1]
    return out
