"""Cache of chosen contact normals of the last step."""

from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Int


@dataclass(frozen=True)
class NormalCache:
    """Candidates by pair of bodies and node; N of them. One step reads them, the next is new."""

    pair: Int[np.ndarray, "N 2"]
    node: Int[np.ndarray, "N 3"]
    """Grid indices of nodes."""
    candidate: Int[np.ndarray, " N"]
    """0, 1 or 2: see ``physics.contact.candidate_normals``."""

    @classmethod
    def none(cls) -> "NormalCache":
        """Keep nothing: everything is looked at anew."""
        whole = np.int64
        return cls(np.zeros((0, 2), whole), np.zeros((0, 3), whole), np.zeros(0, whole))

    @classmethod
    def of_pair(
        cls, pair: tuple[int, int], node: Int[np.ndarray, "E 3"], candidate: Int[np.ndarray, " E"]
    ) -> "NormalCache":
        """Keep what one pair took at some nodes."""
        return cls(np.tile(np.array(pair, dtype=np.int64), (len(node), 1)), node, candidate)

    @classmethod
    def of_all(cls, parts: Iterable["NormalCache"]) -> "NormalCache":
        """Keep what several say."""
        every = [cls.none(), *parts]
        return cls(*(np.concatenate([getattr(k, f.name) for k in every]) for f in fields(cls)))

    def of(self, pair: tuple[int, int], node: Int[np.ndarray, "E 3"]) -> Int[np.ndarray, " E"]:
        """Candidate that each of some nodes took for a pair of bodies; -1: none is known."""
        mine = np.all(self.pair == pair, axis=1)
        known = dict(zip(map(tuple, self.node[mine].tolist()), self.candidate[mine], strict=True))
        return np.array([known.get(tuple(at), -1) for at in node.tolist()], dtype=np.int64)

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Copy everything into a dict."""
        return {f.name: np.array(getattr(self, f.name)) for f in fields(self)}
