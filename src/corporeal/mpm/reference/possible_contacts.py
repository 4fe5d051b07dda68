"""Some possible contacts of one pair, as the reference engine lists them."""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm.reference.normal_cache import NormalCache


@dataclass(frozen=True)
class PossibleContacts:
    """Some possible contacts of one pair; E of them."""

    pair: tuple[int, int]
    """Two bodies, or a body and B + plane."""
    a: Int[np.ndarray, " E"]
    c: Int[np.ndarray, " E"]
    point: Float[np.ndarray, "E 3"]
    normal: Float[np.ndarray, "E 3"]
    gap: Float[np.ndarray, " E"]
    slips: Bool[np.ndarray, " E"] | None = None
    """Which of them transmit no friction; None: all do."""
    layer: Float[np.ndarray, "E 4"] | None = None
    """Where a wall drags on a liquid that sticks: see ``contact_impulses.Contacts``."""
    kept: NormalCache = field(default_factory=NormalCache.none)
    """Candidate normals that were taken, where they are kept."""
    instead: Float[np.ndarray, " E"] | None = None
    """Of what is round on what is curved: nodes nearer than this transmit nothing [m] …"""
    inward: Float[np.ndarray, " E"] | None = None
    """… and the speed at which a way straight ahead leads into a hollow within a step [m/s]."""
    rolls: int = -1
    """The body whose surface points they are; -1: they are on nodes."""
    corner: Bool[np.ndarray, " E"] | None = None
    """Which of these points are not round; None: all are."""
    acts: Float[np.ndarray, "E 3"] | None = None
    """Where each acts [m], which is beyond no edge; None: at its point."""

    @property
    def placed(self) -> "PossibleContacts":
        """The same, each at the place where it acts."""
        return self if self.acts is None else replace(self, point=self.acts, acts=None)

    @property
    def grips(self) -> Float[np.ndarray, " E"]:
        """Share of the pair's friction that each transmits [-]."""
        return np.ones(len(self.gap)) if self.slips is None else 1.0 - self.slips

    @property
    def rounds(self) -> Bool[np.ndarray, " E"]:
        """At which of them something round may roll."""
        on_points = np.full(len(self.gap), self.rolls >= 0)
        return on_points if self.corner is None else on_points & ~self.corner

    @property
    def inwards(self) -> Float[np.ndarray, " E"]:
        """Speed at which each would close within the step by going straight ahead [m/s]."""
        return np.zeros(len(self.gap)) if self.inward is None else self.inward

    @property
    def layers(self) -> Float[np.ndarray, "E 4"]:
        """The layer of each, without a span where none drags."""
        return np.zeros((len(self.gap), 4)) if self.layer is None else self.layer
