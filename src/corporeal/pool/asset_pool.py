"""Pools of models: accepted models, and reasons of rejection."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corporeal.core.errors import UserError
from corporeal.io.gltf.gltf_credits import Credit


def draw_least_used(
    names: Sequence[str], used: Mapping[str, int], count: int, rng: np.random.Generator, repeat: bool = False
) -> list[str]:
    """Return the ``count`` names that were used least, chance deciding between equals.

    Over any number of draws the uses of two names differ by one at most, as long as every draw is offered the same
    names and the uses are counted between draws.

    Args:
        names: What there is, each once.
        used: How often each was drawn before; absent: never.
        count: How many to draw.
        rng: Decides between equals.
        repeat: A name may come again within one draw, once every other one is in it.

    Raises:
        ValueError: There are fewer names than asked for, and none may repeat.
    """
    if not names or (count > len(names) and not repeat):
        raise ValueError(f"{count} of {len(names)}")
    order: list[int] = rng.permutation(len(names)).tolist()
    order.sort(key=lambda k: used.get(names[k], 0))
    return [names[order[k % len(names)]] for k in range(count)]


def parse_count_range(asked: str) -> tuple[int, int]:
    """Return fewest and most of "3" or "1-4".

    Raises:
        UserError: It is neither.
    """
    low, _, high = asked.partition("-")
    if not low.strip().isdigit() or not (high or low).strip().isdigit():
        raise UserError(f"--count {asked!r}: give a number or a range, for example 1-4.")
    least, most = int(low), int(high or low)
    if not 1 <= least <= most <= 16:
        raise UserError(f"--count {asked!r}: give numbers from 1 to 16, the smaller first.")
    return least, most


UNKNOWN_LICENCE = "unknown"
"""Licence of what says nothing about it."""


@dataclass(frozen=True)
class PoolAsset:
    """One model that scenes can be made of."""

    name: str
    """Unique in the pool."""
    class_name: str
    """What it is, in words ("soda can")."""
    file: Path
    """A GLB: the file as found, or a cleaned copy below the pool's folder."""
    source: str
    """The file as found."""
    sha256: str
    """Of ``file``'s bytes."""
    licence: str
    """"CC-BY-4.0", …; "unknown" where nothing says."""
    attribution: str
    """Whom to name, and how; empty where nothing says."""
    extent: float
    """Largest extent of the mesh, in units of the file; [m] where ``metric``."""
    metric: bool
    """Whether the file's lengths are metres; otherwise only its shape counts."""
    triangles: int
    open_edges: float
    """Share of the edges that bound one triangle only [-]; recorded, never a reason to reject."""
    texture: int
    """Side of its finest base-colour picture [px], repeats counted; 0: plain colours."""

    @property
    def credit(self) -> str:
        """Licence and attribution in one line; empty where nothing is known of either."""
        licence = "" if self.licence == UNKNOWN_LICENCE else self.licence
        return Credit(licence, self.attribution).words

    @property
    def size(self) -> str:
        """Write the extent: in metres or centimetres, or as mere units."""
        if not self.metric:
            return f"{self.extent:.3g} units"
        return f"{self.extent:.3g} m" if self.extent >= 1 else f"{100 * self.extent:.3g} cm"


@dataclass(frozen=True)
class PoolRejection:
    """One file that did not get into the pool."""

    source: str
    class_name: str
    reason: str


@dataclass(frozen=True)
class AssetPool:
    """Models by class, kept in a folder."""

    folder: Path
    assets: tuple[PoolAsset, ...]
    """By class, then by name."""
    rejections: tuple[PoolRejection, ...] = ()

    @property
    def classes(self) -> dict[str, tuple[PoolAsset, ...]]:
        """The assets of each class, classes in alphabetical order."""
        names = sorted({a.class_name for a in self.assets})
        return {c: tuple(a for a in self.assets if a.class_name == c) for c in names}

    def asset(self, name: str) -> PoolAsset | None:
        """Return the asset of that name, None where there is none."""
        return next((a for a in self.assets if a.name == name), None)
