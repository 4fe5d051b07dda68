"""From the rest of the command line to a dataclass."""

import sys
from collections.abc import Callable, Mapping, Sequence
from inspect import cleandoc
from typing import Any

import tyro

from corporeal.cli.help_layout import lay_out
from corporeal.core.errors import UnknownChoiceError


def parse(
    kind: Any, verb: str, description: str | None, words: int = 1, first: Sequence[str] = ()
) -> Any:
    """Read the command line into ``kind``; its nested settings become plain flags.

    Args:
        kind: A dataclass.
        verb: What was typed after the program's name ("run", "assets list").
        description: For the help.
        words: How many words of the command line the stage takes up.
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
    """Do what the second word of the command line says, or list the words there are.

    Raises:
        UnknownChoiceError: There is no such word.

    """
    word = sys.argv[2] if len(sys.argv) > 2 else "--help"
    if word in ("--help", "-h"):
        width = max(map(len, verbs))
        lines = (f"  corporeal {verb} {w:{width}}  {_first_line(v)}" for w, v in verbs.items())
        print(*lines, "", f"corporeal {verb} WORD --help tells more.", sep="\n")
        return
    if word not in verbs:
        raise UnknownChoiceError(f"word after {verb}", word, list(verbs))
    verbs[word]()


def _first_line(verb: Callable[[], None]) -> str:
    return (verb.__doc__ or "").splitlines()[0]
