"""Objects found in pictures or in a splat, matched to given names."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from corporeal.core.types import FeatureCloud
from corporeal.discretization.mesh_measures import oriented_box_size
from corporeal.reconstruction.features import TextPictureEncoder, connect_encoder
from corporeal.reconstruction.features.vit_pictures import cosine_similarity as likeness
from corporeal.reconstruction.features.vit_pictures import unit_rows
from corporeal.reconstruction.gaussians.gaussian_scene import GaussianScene
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.reconstruction.segment.optimal_assignment import optimal_assignment
from corporeal.reconstruction.surface.closed_surface import ClosedSurface
from corporeal.reconstruction.surface.object_surfaces import ObjectSurfaces
from corporeal.render.object_portrait import PART_COLOURS, part_colour_names
from corporeal.vlm.photographed_objects import UNKNOWN_CLASS, PhotoInterview, SeenObject, object_of_usual_size

NOBODYS_GREY = (0.2, 0.2, 0.2)
"""Linear RGB of what belongs to no object, in painted pictures."""


@dataclass(frozen=True)
class FoundObjects:
    """Objects before anybody knows what they are, in order of size."""

    taken: GaussianScene
    cloud: FeatureCloud
    closed: ObjectSurfaces

    @property
    def solids(self) -> tuple[ClosedSurface, ...]:
        """One closed surface each."""
        return self.closed.solids

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.solids)

    @cached_property
    def boxes(self) -> Float[np.ndarray, "K 2 3"]:
        """Low and high corner of each one's surface, in the file's unit."""
        corners = [solid.vertices for solid in self.solids]
        return np.array([[v.min(axis=0), v.max(axis=0)] for v in corners])

    @cached_property
    def extents(self) -> list[float]:
        """Longest side of each one's oriented bounding box, in the file's unit."""
        return [oriented_box_size(solid.vertices)[2] for solid in self.solids]


def named_objects(config: ReconstructConfig, viewer: PhotoInterview, taken: GaussianScene) -> list[SeenObject]:
    """Return what objects there are, from the command line or a model; or nothing."""
    if config.object_names:
        return [object_of_usual_size(name) for name in config.object_names]
    return viewer.objects([*taken.some().values()])


def recognise_objects(
    wanted: Sequence[SeenObject], found: FoundObjects, config: ReconstructConfig, viewer: PhotoInterview
) -> list[SeenObject]:
    """Return what each segmented object is; these are in order of size.

    Objects named on the command line are named the largest first. Others are distinguished by CLIP where there is one,
    else by whoever sees the objects painted.
    """
    count = found.count
    if config.object_names or not wanted:
        number: Sequence[int | None] = range(len(wanted))
    elif config.semantic.startswith("clip"):
        number = _match_by_words(wanted, found, config.semantic)
    else:
        number = viewer.regions(_paint_objects(found), part_colour_names(count), wanted) or []
    known = [None if k is None or k < 0 or k >= len(wanted) else wanted[k] for k in number]
    return [obj or SeenObject(UNKNOWN_CLASS) for obj in [*known, *[None] * count][:count]]


def _match_by_words(wanted: Sequence[SeenObject], found: FoundObjects, spec: str) -> list[int]:
    """Pair segmented objects with names by CLIP similarity."""
    encoder = connect_encoder(spec)
    assert isinstance(encoder, TextPictureEncoder)
    of, seen = found.closed.object_of_point, found.cloud.semantic
    looks = np.stack([seen[of == k].mean(axis=0, dtype=np.float64) for k in range(found.count)])
    words = encoder.words([obj.class_name for obj in wanted])
    return optimal_assignment(likeness(unit_rows(looks), words)).tolist()


def _paint_objects(found: FoundObjects) -> list[np.ndarray]:
    """Return pictures, each followed by itself with the objects in colours of their own."""
    paints = np.array([*PART_COLOURS.values()])
    ink = np.concatenate([paints[np.minimum(np.arange(found.count), len(paints) - 1)], [NOBODYS_GREY]])
    return found.taken.painted(np.sqrt(ink[found.closed.owner]))
