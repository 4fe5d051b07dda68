"""Prompts in files. The first line of each states its version, such as "version: materials/1".

Answers are recorded under the version of their prompt and the facts that were put into it, not under its text. Raise
the number when the question asks for something else, so that answers to the former one no longer fit; leave it when
only the words change.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources.abc import Traversable
from pathlib import Path
from string import Template

VERSION = re.compile(r"version: (\w+/\d+)\n+")


@dataclass(frozen=True)
class Prompt:
    """The text of a question, with $facts and {lists} to be put into it."""

    version: str
    """Name and number: "materials/1"."""
    text: str

    def names(self) -> Iterator[str]:
        """Return the names of the facts that stand in the text."""
        return iter(Template(self.text).get_identifiers())


def read_prompt(file: Traversable | Path) -> Prompt:
    """Read a prompt.

    Raises:
        ValueError: Its first line states no version.
    """
    text = file.read_text(encoding="utf-8")
    stated = VERSION.match(text)
    if stated is None:
        raise ValueError(f"{file.name} states no version, such as 'version: materials/1'")
    return Prompt(stated[1], text[stated.end() :])
