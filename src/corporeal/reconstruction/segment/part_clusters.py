"""Clustering of an object's points to candidate parts.

Place and look in one vector, z_i = [ĝ_i ; w x_i]: ĝ unit, x over the object's diagonal, so that
|z_i - z_j|² = |ĝ_i - ĝ_j|² + w² |x_i - x_j|². A few thousand superpoints stand for all points, and
density parts them (``regions.hdbscan``). Too many clusters do no harm, too few do: names join what belongs together
(``regions.naming``).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int
from scipy.spatial import KDTree

from corporeal.core.types import FeatureCloud
from corporeal.reconstruction.segment.hdbscan import NOISE_LABEL, ClusterSelection, DenseClusters, hdbscan
from corporeal.reconstruction.segment.superpoints import superpoints

ROWS_PER_BATCH = 8192
"""Rows that are worked on at a time: what bounds the memory beside the rows themselves."""
AXES_SAMPLE_ROWS = 20_000
"""Rows that the principal axes are found from; more change them little and take longer."""


def reduce_features(features: Float[np.ndarray, "N D"], channels: int = 64) -> Float32[np.ndarray, "N C"]:
    """Return features at unit length on their first principal axes; C = min(D, channels).

    |x_i - x_j|² is nearly 2 (1 - cos) of the features i and j: all of it where D ≤ channels, and
    else all but what the axes left out had of it. Rows of zeros are taken as zeros. Features may be in half precision,
    and are only ever widened ``ROWS_PER_BATCH`` rows at a time.
    """
    count, depth = features.shape
    every = np.linspace(0, count - 1, min(count, AXES_SAMPLE_ROWS)).astype(np.int64)
    sample = _unit(features[np.unique(every)])
    mean = sample.mean(axis=0)
    axes = _principal_axes(sample - mean, min(depth, channels))
    made = np.empty((count, axes.shape[1]), np.float32)
    for start in range(0, count, ROWS_PER_BATCH):
        rows = slice(start, start + ROWS_PER_BATCH)
        made[rows] = (_unit(features[rows]) - mean) @ axes
    return made


def _unit(rows: np.ndarray) -> np.ndarray:
    rows = np.asarray(rows, np.float32)
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(length > 0, length, 1)


def _principal_axes(centred: np.ndarray, count: int) -> np.ndarray:
    """Return the directions of most spread, one a column, each with its largest entry positive."""
    _, axes = np.linalg.eigh((centred.T @ centred).astype(np.float64))
    axes = axes[:, ::-1][:, :count]
    largest = np.take_along_axis(axes, np.abs(axes).argmax(axis=0)[None], axis=0)
    return (axes * np.where(largest < 0, -1, 1)).astype(np.float32)


@dataclass(frozen=True)
class PartsConfig:
    """How finely an object is taken apart."""

    position_weight: float = 0.3
    """w: how much place counts beside look; 0: not at all."""
    superpoints: int = 2000
    """Patches that stand for all points, about."""
    alike: float = 0.1
    """Difference of appearance that parts patches as much as one patch's width does."""
    smallest: int = 10
    """Superpoints that make a cluster."""
    dense: int = 5
    """Superpoints near which a place is dense, the one there included."""
    selection: ClusterSelection = "leaf"
    """The finest clusters ("leaf"), or those that persist over most densities ("mass")."""


DEFAULT_PARTS = PartsConfig()
NOISE_POSITION_WEIGHT = 1.0
"""w where a patch that lies in no dense place goes to the nearest cluster: there place counts
more, for what lies between two looks is mostly shade on either."""


@dataclass(frozen=True)
class PartClusters:
    """What belongs together; N points, C clusters."""

    cluster_of_point: Int[np.ndarray, " N"]
    """0 … C - 1."""
    confidence: Float[np.ndarray, " N"]
    """In [0, 1]: how far inside its cluster a point's patch is; of patches in no dense place how near the nearest
    cluster is, one patch's usual distance counting as 1."""

    @property
    def count(self) -> int:
        """Number of clusters C."""
        return int(self.cluster_of_point.max(initial=-1)) + 1


def cluster_parts(cloud: FeatureCloud, config: PartsConfig = DEFAULT_PARTS) -> PartClusters:
    """Take one object apart by what its points look like and where they are.

    An object that nothing parts is one cluster.

    Args:
        cloud: Points of one object; ``structural`` is ĝ.
        config: How finely.
    """
    if not cloud.count:
        return PartClusters(np.zeros(0, np.int64), np.zeros(0))
    appearance = reduce_features(cloud.structural)
    patch = superpoints(cloud.position, appearance, config.superpoints, config.alike)
    g, x = _means(appearance, patch), _means(_scaled_positions(cloud), patch)
    z = np.concatenate([g, config.position_weight * x], axis=1)
    found = hdbscan(z, config.smallest, config.dense, config.selection)
    whole = _attach_noise(np.concatenate([g, NOISE_POSITION_WEIGHT * x], axis=1), found)
    return PartClusters(whole.cluster_of_point[patch], whole.strength[patch])


def _scaled_positions(cloud: FeatureCloud) -> Float[np.ndarray, "N 3"]:
    """Return where points are, the object's diagonal being 1."""
    x = cloud.position - cloud.position.mean(axis=0)
    diagonal = float(np.linalg.norm(np.ptp(x, axis=0)))
    return (x / (diagonal or 1.0)).astype(np.float32)


def _means(rows: np.ndarray, group: np.ndarray) -> np.ndarray:
    size = np.bincount(group)
    return np.stack([np.bincount(group, column) / size for column in rows.T], axis=1)


def _attach_noise(z: np.ndarray, found: DenseClusters) -> DenseClusters:
    """Give noise to the nearest cluster; all is one cluster where there is none."""
    cluster, strength = found.cluster_of_point.copy(), found.strength.copy()
    noise = cluster == NOISE_LABEL
    if noise.all():
        return DenseClusters(np.zeros_like(cluster), np.ones(len(cluster)))
    away, nearest = KDTree(z[~noise]).query(z[noise])
    cluster[noise] = cluster[~noise][nearest]
    usual = float(np.median(KDTree(z).query(z, k=2)[0][:, 1]))
    strength[noise] = np.minimum(1.0, usual / np.maximum(away, 1e-12))
    return DenseClusters(cluster, strength)
