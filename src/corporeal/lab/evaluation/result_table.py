"""Result tables."""

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class ResultTable:
    """Cells in words; each row as long as the heads."""

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
