"""Errors for users. Each message says what happened, where, and what to do next."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches


class UserError(Exception):
    """Something the user can put right; the CLI prints it in one line and exits with code 2.

    What was noticed before it may follow, as its notes.
    """


@contextmanager
def notes_on_error(before: Iterable[str]) -> Iterator[None]:
    """Add what was noticed before, in sentences, to an error of the user's that ends the block."""
    try:
        yield
    except UserError as error:
        with_notes(error, before)
        raise


def with_notes(error: UserError, before: Iterable[str]) -> UserError:
    """Return the error, with what was noticed before it, in sentences, added to its notes."""
    for sentence in before:
        error.add_note(sentence)
    return error


MAX_SUGGESTED_CHOICES = 3
"""Most choices that are named as what may have been meant."""


class UnknownChoiceError(UserError):
    """A name that is not on the menu."""

    def __init__(self, kind: str, given: str, menu: list[str], near: Sequence[str] = ()) -> None:
        near = near or get_close_matches(given, menu, MAX_SUGGESTED_CHOICES)
        meant = f" Did you mean {' or '.join(near)}?" if near else ""
        every = f"Choose one of: {', '.join(sorted(menu))}."
        super().__init__(f"Unknown {kind} {given!r}. {every}{meant}")


class OutOfRangeError(UserError):
    """A physical value outside the range its source allows."""

    def __init__(self, what: str, value: float, low: float, high: float, unit: str) -> None:
        super().__init__(
            f"{what} is {value:.4g} {unit}, outside the measured "
            f"range [{low:.4g}, {high:.4g}] {unit}. Check the units, or add a source."
        )


def check_range(name: str, value: float | None, low: float, high: float) -> None:
    """Raise for a setting outside its range; None: not set.

    Raises:
        UserError: It is not from low to high, or no number.
    """
    if value is not None and not low <= value <= high:
        raise UserError(f"{name} is {value}. Give a number from {low:g} to {high:g}.")


class BadFileError(UserError):
    """An input file that cannot be used: what is wrong in it, and what to do."""

    def __init__(self, path: object, what: str, next_step: str = "") -> None:
        super().__init__(f"{path}: {what}{' ' + next_step if next_step else ''}")


class SimulationError(UserError):
    """The simulation cannot go on; what it computed so far is kept."""
