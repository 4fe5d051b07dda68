"""Balanced sampling of classes and assets."""

from collections.abc import Mapping, Sequence

import numpy as np

from corporeal.core.errors import UserError


def draw_least_used(
    names: Sequence[str],
    used: Mapping[str, int],
    count: int,
    rng: np.random.Generator,
    repeat: bool = False,
) -> list[str]:
    """Return the ``count`` names that were used least, chance deciding between equals.

    Over any number of draws the uses of two names differ by one at most, as long as every draw is
    offered the same names and the uses are counted between draws.

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
