"""Assignment of clusters to named parts.

With a model that compares points with words (CLIP) in two passes. First a cluster's prototype, the
mean of its points' semantic features, each weighted by how typical its structural feature is of
the cluster, takes the name that it is most similar to. Then clusters of one name must look alike:
one that looks more like those of another name goes over to them. Without a model, words are held
against colour, height and shape (``regions.attributes``).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array
from scipy.special import log_softmax, softmax

from corporeal.core.types import FeatureCloud, ObjectDescription, PartDescription
from corporeal.reconstruction.segment.optimal_assignment import optimal_assignment
from corporeal.reconstruction.segment.part_attributes import (
    described_attributes,
    log_likelihood,
    observed_attributes,
    relative_heights,
    top_direction,
)
from corporeal.reconstruction.segment.part_clusters import (
    DEFAULT_PARTS,
    ROWS_PER_BATCH,
    PartClusters,
    PartsConfig,
    cluster_parts,
)

CLIP_TEMPERATURE = 0.01
"""Of cosines between CLIP's pictures and words, as it was trained (Radford et al. 2021)."""
HEIGHT_LAYERS = 5
"""Of the object's height, that a name without a model is given in."""


@dataclass(frozen=True)
class NamedParts:
    """Which of an object's parts every point belongs to; N points."""

    part_of_point: Int[np.ndarray, " N"]
    """Index into the object's parts."""
    confidence: Float[np.ndarray, " N"]
    """In [0, 1]: how probable the name is for the cluster, times how surely the point is of it."""
    found_by: str
    """"words", "attributes", "one part" or "no points"."""
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know, in sentences."""


def part_phrases(described_object: ObjectDescription) -> list[str]:
    """Return what a model that knows words is asked for, part by part."""
    return [f"{part.name} of a {described_object.class_name}" for part in described_object.parts]


def name_parts(
    cloud: FeatureCloud,
    described_object: ObjectDescription,
    words: Float[np.ndarray, "K S"] | None = None,
    config: PartsConfig = DEFAULT_PARTS,
) -> NamedParts:
    """Find the parts that words name among one object's points.

    Args:
        cloud: Points of one object, the world's z up.
        described_object: Its parts, at least one.
        words: One unit vector per part in the space of ``cloud.semantic``; None: no model.
        config: How finely the object is taken apart first.
    """
    none = np.zeros(cloud.count, np.int64)
    if not cloud.count:
        return NamedParts(none, np.ones(0), "no points", _missing_part_warnings(none, described_object.parts))
    if len(described_object.parts) == 1:
        return NamedParts(none, np.ones(cloud.count), "one part")
    return name_clusters(cluster_parts(cloud, config), cloud, words, described_object.parts)


def name_clusters(
    clusters: PartClusters,
    cloud: FeatureCloud,
    words: Float[np.ndarray, "K S"] | None,
    parsed: Sequence[PartDescription],
) -> NamedParts:
    """Give every cluster a part's name; each part gets a cluster where there are enough.

    Without a model every layer of a cluster gets its own: what words say of place is the surest of what they say, and a
    cluster may reach from foot to top.

    Args:
        clusters: Of the cloud's points.
        cloud: Points of one object, the world's z up.
        words: One unit vector per part in the space of ``cloud.semantic``; None: no model.
        parsed: The parts.
    """
    if words is None:
        clusters, score = _score_by_attributes(clusters, cloud, parsed)
        part = _claim_clusters(score)
    else:
        score = _score_by_words(clusters, cloud, words)
        appearance = _cluster_sums(cloud.structural, clusters.cluster_of_point, clusters.count)
        part = _agree_on_appearance(appearance, score, _claim_clusters(score))
    sure = softmax(score, axis=1)[np.arange(len(part)), part]
    of_point = part[clusters.cluster_of_point]
    return NamedParts(
        of_point,
        sure[clusters.cluster_of_point] * clusters.confidence,
        "attributes" if words is None else "words",
        _missing_part_warnings(of_point, parsed),
    )


def _missing_part_warnings(part_of_point: np.ndarray, parsed: Sequence[PartDescription]) -> tuple[str, ...]:
    points = np.bincount(part_of_point, minlength=len(parsed))
    lost = [f"'{part.name}'" for part, n in zip(parsed, points, strict=True) if not n]
    return (f"No points were found for {', '.join(lost)}.",) if lost else ()


def _claim_clusters(score: Float[np.ndarray, "C K"]) -> Int[np.ndarray, " C"]:
    """Give each name the cluster that is most surely its own, and each other cluster its best name.

    A name that another one beats everywhere still belongs to a part: the description names it.
    """
    part = score.argmax(axis=1)
    own = optimal_assignment(log_softmax(score, axis=1).T)
    claimed = np.flatnonzero(own >= 0)
    part[own[claimed]] = claimed
    return part


def _score_by_attributes(
    clusters: PartClusters, cloud: FeatureCloud, parsed: Sequence[PartDescription]
) -> tuple[PartClusters, Float[np.ndarray, "C K"]]:
    """Cut clusters into layers of the object's height, and compare each with the names."""
    attributes = [described_attributes(part) for part in parsed]
    up = top_direction(cloud, clusters.cluster_of_point, clusters.count, attributes)
    layer = np.minimum(relative_heights(cloud.position, up) * HEIGHT_LAYERS, HEIGHT_LAYERS - 1).astype(int)
    cut = clusters.cluster_of_point * HEIGHT_LAYERS + layer
    clusters = replace(clusters, cluster_of_point=np.unique(cut, return_inverse=True)[1])
    seen = observed_attributes(cloud, clusters.cluster_of_point, clusters.count, up)
    return clusters, log_likelihood(seen, attributes)


def _score_by_words(clusters: PartClusters, cloud: FeatureCloud, words: np.ndarray) -> Float[np.ndarray, "C K"]:
    """Compare prototypes with words, in units of ``CLIP_TEMPERATURE``."""
    of, count = clusters.cluster_of_point, clusters.count
    mean = _unit(_cluster_sums(cloud.structural, of, count)).astype(np.float32)
    typical = np.empty(cloud.count)
    for rows in _batches(cloud.count):
        typical[rows] = np.sum(cloud.structural[rows].astype(np.float32) * mean[of[rows]], axis=1)
    prototypes = _unit(_cluster_sums(cloud.semantic, of, count, np.maximum(typical, 0)))
    return prototypes @ words.T / CLIP_TEMPERATURE


def _cluster_sums(
    features: np.ndarray, of: np.ndarray, count: int, weight: np.ndarray | None = None
) -> Float[np.ndarray, "C D"]:
    """Return every cluster's weighted sum of features, which may be in half precision."""
    made = np.zeros((count, features.shape[1]))
    share = np.ones(len(of)) if weight is None else weight
    for rows in _batches(len(of)):
        number = np.arange(len(of[rows]))
        own = csr_array((share[rows], (of[rows], number)), shape=(count, len(number)))
        made += own @ features[rows].astype(np.float32)
    return made


def _batches(count: int) -> list[slice]:
    return [slice(k, k + ROWS_PER_BATCH) for k in range(0, count, ROWS_PER_BATCH)]


def _agree_on_appearance(appearance: np.ndarray, score: np.ndarray, part: np.ndarray) -> Int[np.ndarray, " C"]:
    """Let each cluster go over to the name whose other clusters it looks most like.

    Once, all by the result of the first pass. The last cluster of a name stays, and none takes a name that words find
    less probable than one in a hundred of their own.
    """
    total = np.stack([appearance[part == k].sum(axis=0) for k in range(score.shape[1])])
    left = np.bincount(part, minlength=score.shape[1])
    made = part.copy()
    for c, own in enumerate(part):
        if left[own] == 1:
            continue
        others = total.copy()
        others[own] -= appearance[c]
        alike = _unit(others) @ _unit(appearance[c])
        alike[score[c] < score[c, own] - np.log(100)] = -np.inf
        made[c] = int(np.argmax(alike))
        left[own] -= made[c] != own
    return made


def _unit(rows: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(rows, axis=-1, keepdims=True)
    return rows / np.where(length > 0, length, 1)
