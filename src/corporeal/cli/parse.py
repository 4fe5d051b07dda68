"""Parsing of the command line into dataclasses."""

import sys
from collections.abc import Callable, Mapping, Sequence
from inspect import cleandoc
from typing import Any

import tyro

from corporeal.cli.help_layout import lay_out
from corporeal.core.errors import UnknownChoiceError


def parse(kind: Any, verb: str, description: str | None, words: int = 1, first: Sequence[str] = ()) -> Any:
    """Read the command line into ``kind``; its nested settings become plain flags.

    Args:
        kind: A dataclass.
        verb: Command ("run", "assets list").
        description: For the help.
        words: Number of words of the command.
        first: Options that come first in the help, six at most; all others stand under "more".
    """
    layout = lay_out(kind, first)
    typed = tyro.cli(
        tyro.conf.OmitArgPrefixes[layout.shape],
        prog=f"corporeal {verb}",
        description=cleandoc(description or ""),
        args=sys.argv[1 + words :],
    )
    return layout.settings(typed)


def run_subcommand(verb: str, verbs: Mapping[str, Callable[[], None]]) -> None:
    """Run the subcommand named by the second word (UnknownChoiceError for an unknown one), or list all."""
    word = sys.argv[2] if len(sys.argv) > 2 else "--help"
    if word in ("--help", "-h"):
        width = max(map(len, verbs))
        lines = (f"  corporeal {verb} {w:{width}}  {_first_line(v)}" for w, v in verbs.items())
        print(*lines, "", f"corporeal {verb} WORD --help shows its options.", sep="\n")
        return
    if word not in verbs:
        raise UnknownChoiceError(f"word after {verb}", word, list(verbs))
    verbs[word]()


def _first_line(verb: Callable[[], None]) -> str:
    return (verb.__doc__ or "").splitlines()[0]
