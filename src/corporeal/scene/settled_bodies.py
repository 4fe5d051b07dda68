"""Objects at rest, approximated by boxes, and obstacles between them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from corporeal.scene.settling_body import BodyPose, SettlingBody

FALL_CLEARANCE_FRACTION = 0.02
"""Free space kept beside what falls, over the larger object's size."""
WAY_SAMPLES_COUNT = 33
"""Places along a way at which it is looked whether something is there."""


@dataclass(frozen=True)
class SettledBodies:
    """Bodies where they came to rest; N of them."""

    bodies: Sequence[SettlingBody]
    poses: Sequence[BodyPose]

    def __len__(self) -> int:
        """How many."""
        return len(self.bodies)

    @property
    def names(self) -> list[str]:
        """Of the bodies."""
        return [b.name for b in self.bodies]

    @cached_property
    def boxes(self) -> Float[np.ndarray, "N 2 3"]:
        """Lower and upper corners [m]."""
        points = [p.world(b.hull.vertices) for b, p in zip(self.bodies, self.poses, strict=True)]
        return np.array([[p.min(axis=0), p.max(axis=0)] for p in points])

    @cached_property
    def centres(self) -> Float[np.ndarray, "N 3"]:
        """Centres of mass [m]."""
        pairs = zip(self.bodies, self.poses, strict=True)
        return np.array([p.world(b.centre[None])[0] for b, p in pairs])

    @cached_property
    def sizes(self) -> Float[np.ndarray, " N"]:
        """Largest sides of the boxes [m]."""
        return np.ptp(self.boxes, axis=1).max(axis=1)

    def foot(self, k: int) -> Float[np.ndarray, "3"]:
        """Return the middle of a box's underside [m]."""
        return np.array([*self.boxes[k].mean(axis=0)[:2], self.boxes[k][0, 2]])

    def free(self, k: int) -> bool:
        """Return whether nothing lies on an object, so that it may leave its place."""
        box = self.boxes[k]
        above = np.array([[*box[0, :2], box[1, 2]], [*box[1, :2], np.inf]])
        touching = [
            bool(((above[0] - 1e-3 < b[1]) & (b[0] < above[1])).all() and b[0, 2] > box.mean(0)[2])
            for n, b in enumerate(self.boxes)
            if n != k
        ]
        return not any(touching)

    def gap(self, mover: int, target: int) -> tuple[float, Float[np.ndarray, "2"]]:
        """Return how far the mover slides before it touches [m], and where to.

        It heads for the other's centre of mass, so that it meets it in full.
        """
        boxes = self.boxes
        here, there = (self.centres[k][:2] for k in (mover, target))
        reach = np.linalg.norm(there - here)
        heading = (there - here) / max(float(reach), 1e-9)
        apart = np.maximum(boxes[target][0] - boxes[mover][1], boxes[mover][0] - boxes[target][1])
        shares = [a / abs(h) for a, h in zip(apart[:2], heading, strict=True) if abs(h) > 1e-9]
        return max(0.0, *shares), heading

    def open_way(self, mover: int, target: int) -> bool:
        """Return whether one can go along the floor into another and meets nothing before."""
        if not _share_support(self.boxes[mover], self.boxes[target]):
            return False
        gap, heading = self.gap(mover, target)
        others = [k for k in range(len(self)) if k not in (mover, target)]
        ways = [self.boxes[mover] + [*(s * heading), 0.0] for s in np.linspace(0.0, gap, WAY_SAMPLES_COUNT)]
        return not any(boxes_meet(w, self.boxes[k], margin=0.0) for w in ways for k in others)


def largest_box_side(box: Float[np.ndarray, "2 3"]) -> float:
    """Return the largest side of a box [m]."""
    return float(np.ptp(box, axis=0).max())


def boxes_meet(
    a: Float[np.ndarray, "2 3"], b: Float[np.ndarray, "2 3"], margin: float = FALL_CLEARANCE_FRACTION
) -> bool:
    """Return whether two boxes come closer than a share of the larger one's size."""
    space = margin * max(largest_box_side(a), largest_box_side(b))
    return bool(((a[0] - space < b[1]) & (b[0] - space < a[1])).all())


def _share_support(a: np.ndarray, b: np.ndarray) -> bool:
    """Return whether two objects stand on one support and one could run into the other."""
    shared = min(a[1, 2], b[1, 2]) - max(a[0, 2], b[0, 2])
    return bool(shared > 0.3 * min(a[1, 2] - a[0, 2], b[1, 2] - b[0, 2]))
