"""Segment: assign every point to an object and a part."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.types import (
    FeatureCloud,
    Inventory,
    Note,
    NoteKind,
    ObjectDescription,
    Part,
    Parts,
    Reconstruction,
    Scene,
    with_text,
)
from corporeal.pipeline.settings import SegmentConfig
from corporeal.recognition.metadata_recognition import substance_hint
from corporeal.recognition.parts_by_name import identify_parts
from corporeal.reconstruction.features import TextPictureEncoder, connect_encoder
from corporeal.reconstruction.segment.part_clusters import PartsConfig
from corporeal.reconstruction.segment.part_naming import NamedParts, name_parts, part_phrases

NEAREST_VOTING_POINTS = 5
"""Number of nearest points that vote for a triangle's part."""


DEFAULT_CONFIG = SegmentConfig()
UNSEEN_SOURCES = ("metadata", "unknown")
"""Sources of parts that have not seen pictures."""


def segment(
    scene: Scene,
    inventory: Inventory,
    config: SegmentConfig = DEFAULT_CONFIG,
    found: Reconstruction | None = None,
    semantic: str = "descriptor",
) -> Parts:
    """Assign every triangle to an object and a part.

    Points are the scene's triangles in order. Nodes and materials of a file are exact, with confidence 1. An object
    from pictures is one surface: if its description names several pieces, they are found among the points of the
    reconstruction.

    Args:
        scene: The assembled scene.
        inventory: Names of its parts.
        config: Segmentation of objects from pictures.
        found: Points with features, where the scene's objects stand now; None: from a model.
        semantic: What the semantic features of these points are, as for ``features.connect``.

    Raises:
        UserError: The inventory describes another scene.
    """
    identity = identify_parts(scene, substance_hint)
    _agree(scene, inventory, [p.name for p in identity.catalogue])
    triangles = [len(s.triangles) for s in scene.surfaces]
    part_of_point = np.repeat(identity.part_of_surface, triangles)
    parts = Parts(
        object_of_point=scene.object_of_triangle,
        part_of_point=part_of_point,
        confidence=np.ones(len(part_of_point)),
        catalogue=identity.catalogue,
    )
    if found is None:
        return parts
    middle = np.concatenate([s.vertices[s.triangles].mean(axis=1) for s in scene.surfaces])
    pictured = np.unique(found.object_of_point)  # others beside them came as models
    shown = [(number, obj) for number, obj in enumerate(inventory.objects) if number in pictured]
    for number, obj in shown:
        pieces = obj.parts[0].pieces if len(obj.parts) == 1 else ()
        if len(pieces) > 1:
            obj = replace(obj, parts=pieces)
            cloud = _of_object(found.cloud, found.object_of_point == number)
            vectors = _vectors(semantic, obj)
            named = name_parts(cloud, obj, vectors, PartsConfig(config.position_weight))
            parts = _replace_with_pieces(parts, number, obj, named, cloud, middle)
    return replace(parts, warnings=(*parts.warnings, *_undivided_objects_warning([obj for _, obj in shown])))


def _agree(scene: Scene, inventory: Inventory, names: list[str]) -> None:
    described = [part.name for obj in inventory.objects for part in obj.parts]
    if described != names:
        raise UserError(
            f"The description speaks of the parts {', '.join(described) or 'none'}, but "
            f"{scene.name!r} has {', '.join(names)}. Describe the scene again."
        )


def _undivided_objects_warning(objects: Sequence[ObjectDescription]) -> list[str]:
    """Return a warning of objects whose pieces are unknown.

    Unknown materials are reported by ``ground``.
    """
    names = [
        obj.name
        for obj in objects
        if not any(p.pieces or p.answered_by not in UNSEEN_SOURCES for p in obj.parts)
        and any(p.answered_by != "unknown" for p in obj.parts)
    ]
    if not names:
        return []
    several = len(names) > 1
    return [
        Note(
            f"{', '.join(names)}: the pieces of {'these objects' if several else 'this object'} "
            f"are unknown. {'Each has' if several else 'It has'} one material throughout; --vlm or "
            "--annotations name pieces.",
            NoteKind.ASSUMED,
        )
    ]


def _of_object(cloud: FeatureCloud, mine: Bool[np.ndarray, " N"]) -> FeatureCloud:
    return replace(
        cloud,
        position=cloud.position[mine],
        colour=cloud.colour[mine],
        semantic=cloud.semantic[mine],
        structural=cloud.structural[mine],
        seen=cloud.seen[mine],
        gaussian_of_point=None,
    )


def _vectors(semantic: str, obj: ObjectDescription) -> Float[np.ndarray, "K S"] | None:
    """Return what the parts' names are among features; None where these know no words."""
    encoder = connect_encoder(semantic)
    if not isinstance(encoder, TextPictureEncoder):
        return None
    return encoder.words(part_phrases(obj))


def _replace_with_pieces(
    parts: Parts,
    number: int,
    obj: ObjectDescription,
    named: NamedParts,
    cloud: FeatureCloud,
    middle: Float[np.ndarray, "T 3"],
) -> Parts:
    """Replace the object's only part by its pieces."""
    own = np.flatnonzero(parts.object_of_point == number)
    share = _nearest_votes(middle[own], cloud.position, named, len(obj.parts))
    best = share.argmax(axis=1)
    kept = np.unique(best)
    place = next(k for k, p in enumerate(parts.catalogue) if p.object == number)
    new = [Part(obj.parts[k].name, number, named.found_by) for k in kept]
    later = parts.part_of_point > place
    of_point = np.where(later, parts.part_of_point + len(new) - 1, parts.part_of_point)
    of_point[own] = place + np.searchsorted(kept, best)
    confidence = parts.confidence.copy()
    confidence[own] = share[np.arange(len(own)), best]
    found_doubts = _doubts(named, obj, kept.tolist())
    doubts = [with_text(words, f"{obj.name}: {words}") for words in found_doubts]
    return replace(
        parts,
        part_of_point=of_point,
        confidence=confidence,
        catalogue=(*parts.catalogue[:place], *new, *parts.catalogue[place + 1 :]),
        warnings=(*parts.warnings, *doubts),
    )


def _nearest_votes(
    places: Float[np.ndarray, "T 3"], points: Float[np.ndarray, "N 3"], named: NamedParts, count: int
) -> Float[np.ndarray, "T K"]:
    """Return the mean confidence of the nearest points for each place and part."""
    near = np.asarray(KDTree(points).query(places, k=min(NEAREST_VOTING_POINTS, len(points)))[1])
    near = near.reshape(len(places), -1)
    share = np.zeros((len(places), count))
    rows = np.arange(len(places))
    for column in near.T:
        share[rows, named.part_of_point[column]] += named.confidence[column] / near.shape[1]
    return share


def _doubts(named: NamedParts, obj: ObjectDescription, kept: Sequence[int]) -> list[str]:
    lost = [p.name for k, p in enumerate(obj.parts) if k not in kept]
    gone = Note(f"{', '.join(lost)} has no place on its surface, and is left out.", NoteKind.LEFT_OUT)
    return [*named.warnings, *([gone] if lost and not named.warnings else [])]
