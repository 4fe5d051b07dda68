"""Objects that were found in pictures or in a splat, and which of those that were named each is."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Cloud
from corporeal.discretization.extent import oriented_size
from corporeal.reconstruction.features import Reader, connect
from corporeal.reconstruction.features.vectors import similarity as likeness
from corporeal.reconstruction.features.vectors import unit
from corporeal.reconstruction.gaussians.closed import Closed
from corporeal.reconstruction.gaussians.intake import Intake
from corporeal.reconstruction.gaussians.solid import Solid
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.reconstruction.segment.match import match
from corporeal.render.portrait import COLOURS, colour_of_part
from corporeal.vlm.seen_objects import (
    UNKNOWN,
    SeenObject,
    Viewer,
    usual,
)

GREY = (0.2, 0.2, 0.2)
"""Linear RGB of what is nobody's, in painted pictures."""


@dataclass(frozen=True)
class FoundObjects:
    """Objects before anybody knows what they are, in order of size."""

    taken: Intake
    cloud: Cloud
    closed: Closed

    @property
    def solids(self) -> tuple[Solid, ...]:
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
        return [oriented_size(solid.vertices)[2] for solid in self.solids]


def named_objects(config: ReconstructConfig, viewer: Viewer, taken: Intake) -> list[SeenObject]:
    """Return what objects there are, from the command line or a model; or nothing."""
    if config.things:
        return [usual(name) for name in config.things]
    return viewer.objects([*taken.some().values()])


def recognised(
    wanted: Sequence[SeenObject], found: FoundObjects, config: ReconstructConfig, viewer: Viewer
) -> list[SeenObject]:
    """Return what each segmented object is; these are in order of size.

    Who named objects on the command line named the largest first. Others are told by CLIP where
    there is one, else by whoever sees the objects painted.
    """
    count = found.count
    if config.things or not wanted:
        number: Sequence[int | None] = range(len(wanted))
    elif config.semantic.startswith("clip"):
        number = _by_words(wanted, found, config.semantic)
    else:
        number = viewer.regions(_painted(found), colour_of_part(count), wanted) or []
    known = [None if k is None or k < 0 or k >= len(wanted) else wanted[k] for k in number]
    return [obj or SeenObject(UNKNOWN) for obj in [*known, *[None] * count][:count]]


def _by_words(wanted: Sequence[SeenObject], found: FoundObjects, spec: str) -> list[int]:
    """Pair segmented objects with names by CLIP similarity."""
    encoder = connect(spec)
    assert isinstance(encoder, Reader)
    of, seen = found.closed.object_of_point, found.cloud.semantic
    looks = np.stack([seen[of == k].mean(axis=0, dtype=np.float64) for k in range(found.count)])
    words = encoder.words([obj.class_name for obj in wanted])
    return match(likeness(unit(looks), words)).tolist()


def _painted(found: FoundObjects) -> list[np.ndarray]:
    """Return pictures, each followed by itself with the objects in colours of their own."""
    paints = np.array([*COLOURS.values()])
    ink = np.concatenate([paints[np.minimum(np.arange(found.count), len(paints) - 1)], [GREY]])
    return found.taken.painted(np.sqrt(ink[found.closed.owner]))
