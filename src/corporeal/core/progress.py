"""Nested progress callbacks."""

from collections.abc import Callable

Progress = Callable[[float, str], None]
"""Called with the fraction done and a description."""


def no_progress(fraction: float, words: str) -> None:
    """Tell nobody."""


def subprogress(progress: Progress, begin: float, end: float, what: str = "") -> Progress:
    """Tell of a part of the work as of the whole.

    Args:
        progress: Callback of the whole.
        begin: Fraction of the whole that is done when the part begins.
        end: The same when it ends.
        what: Tells this part from others in which the same is done; follows the words.
    """
    return lambda fraction, words: progress(begin + (end - begin) * fraction, f"{words}{what}")
