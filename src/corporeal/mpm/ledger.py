"""Ledger of impulses, work, losses and contacts of the reference engine."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, Int


@dataclass
class EngineLedger:
    """Accumulated since time 0; B bodies, W planes."""

    external_impulse: Float[np.ndarray, "B 3"]
    """[N s]"""
    plane_impulse: Float[np.ndarray, "W B 3"]
    """[N s]"""
    pair_impulse: Float[np.ndarray, "B B"]
    """[N s]"""
    push_work: Float[np.ndarray, ""]
    """[J]"""
    friction_loss: Float[np.ndarray, ""]
    """[J]"""
    impact_loss: Float[np.ndarray, ""]
    """Taken by normal contact: by restitution of what is rigid, by nodes of what is soft [J]."""
    impact_of_pair: Float[np.ndarray, "N N"]
    """The same of each pair, symmetric [J]; below 0: contact gave it energy."""
    plastic_loss: Float[np.ndarray, ""]
    """[J]"""
    viscous_loss: Float[np.ndarray, ""]
    """Taken by joints' dampers, and the work on Maxwell branches: what they hold now is no loss [J]."""
    first_contact: Float[np.ndarray, "N N"]
    """[s]; nan: none yet."""
    last_contact: Float[np.ndarray, "N N"]
    """[s]"""
    contact_point: Float[np.ndarray, "N N 3"]
    """[m]"""

    @classmethod
    def blank(cls, bodies: int, planes: int) -> "EngineLedger":
        """Open a ledger at time 0."""
        everything = bodies + planes
        return cls(
            external_impulse=np.zeros((bodies, 3)),
            plane_impulse=np.zeros((planes, bodies, 3)),
            pair_impulse=np.zeros((bodies, bodies)),
            push_work=np.zeros(()),
            friction_loss=np.zeros(()),
            impact_loss=np.zeros(()),
            impact_of_pair=np.zeros((everything, everything)),
            plastic_loss=np.zeros(()),
            viscous_loss=np.zeros(()),
            first_contact=np.full((everything, everything), np.nan),
            last_contact=np.full((everything, everything), np.nan),
            contact_point=np.full((everything, everything, 3), np.nan),
        )

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Copy everything into a dict."""
        return {f.name: np.array(getattr(self, f.name)) for f in fields(self)}

    def as_measured(self) -> dict:
        """Copy everything, scalars as floats, under the names of ``Measure``."""
        return {k: float(v) if v.ndim == 0 else v for k, v in self.as_arrays().items()}

    def strike(self, pair: Int[np.ndarray, "E 2"], taken: Float[np.ndarray, " E"]) -> None:
        """Enter the energy [J] that the normal impulses of one step's contacts took."""
        self.impact_loss += taken.sum()
        for side in (pair, pair[:, ::-1]):
            np.add.at(self.impact_of_pair, (side[:, 0], side[:, 1]), taken)

    def enter(
        self,
        pair: Int[np.ndarray, "E 2"],
        impulse: Float[np.ndarray, "E 3"],
        normal: Float[np.ndarray, "E 3"],
        point: Float[np.ndarray, "E 3"],
        time: float,
    ) -> None:
        """Enter one step's contact impulses.

        Args:
            pair: The two partners of every contact: bodies, or B + plane in second place.
            impulse: J [N s], -J on the first and +J on the second.
            normal: Of every contact, from the first partner to the second.
            point: Where it acts [m].
            time: Now [s].
        """
        bodies = len(self.external_impulse)
        size = np.sum(impulse * normal, axis=1)
        for a, c in np.unique(pair[np.any(impulse != 0.0, axis=1)], axis=0):
            mine = np.flatnonzero((pair[:, 0] == a) & (pair[:, 1] == c))
            if c >= bodies:
                self.plane_impulse[c - bodies, a] -= impulse[mine].sum(axis=0)
            else:
                self.pair_impulse[a, c] += size[mine].sum()
                self.pair_impulse[c, a] = self.pair_impulse[a, c]
            if not np.any(size[mine] > 0.0):  # a wall that only drags on a liquid is no impact
                continue
            if np.isnan(self.first_contact[a, c]):
                place = np.average(point[mine], axis=0, weights=size[mine])
                self.first_contact[[a, c], [c, a]] = time
                self.contact_point[[a, c], [c, a]] = place
            self.last_contact[[a, c], [c, a]] = time
