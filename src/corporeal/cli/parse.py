"""From the rest of the command line to a dataclass."""

import sys
from inspect import cleandoc
from typing import Any

import tyro


def parse(kind: Any, verb: str, description: str | None, words: int = 1) -> Any:
    """Read the command line into ``kind``; its nested settings become plain flags.

    Args:
        kind: A dataclass.
        verb: What was typed after the program's name ("run", "assets list").
        description: For the help.
        words: How many words of the command line the verb takes up.

    """
    return tyro.cli(
        tyro.conf.OmitArgPrefixes[kind],
        prog=f"corporeal {verb}",
        description=cleandoc(description or ""),
        args=sys.argv[1 + words :],
    )
