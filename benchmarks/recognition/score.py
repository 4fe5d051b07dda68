"""Right, wrong or unknown, and whether the margin knew."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from corporeal.vlm.metadata import recognise
from recognition.facts import Fact

BANDS = (0.0, 0.35, 0.45, 0.6, 1.01)
"""Edges of the margins that are looked at together."""


@dataclass(frozen=True)
class Row:
    """One part, answered and judged."""

    group: str
    file: str
    part: str
    answer: str | None
    margin: float
    accepted: tuple[str, ...]
    reason: str

    @property
    def verdict(self) -> str:
        """One of right, wrong and unknown."""
        if self.answer is None:
            return "unknown"
        return "right" if self.answer in self.accepted else "wrong"


@dataclass(frozen=True)
class Score:
    """Shares of all parts."""

    parts: int
    right: float
    wrong: float
    unknown: float
    likeliest: float
    """Share answered with the material that was thought likeliest."""


def judge(facts: Sequence[Fact]) -> list[Row]:
    """Ask the recogniser about every part."""
    rows = []
    for fact in facts:
        said = recognise(fact.evidence)
        whose = (fact.group, fact.file, fact.part)
        rows.append(Row(*whose, said.material, said.margin, fact.accepted, said.reason))
    return rows


def score(rows: Sequence[Row]) -> Score:
    """Count verdicts."""
    total = len(rows)

    def share(verdict: str) -> float:
        return sum(r.verdict == verdict for r in rows) / total

    first = sum(r.answer == r.accepted[0] for r in rows) / total
    return Score(total, share("right"), share("wrong"), share("unknown"), first)


def ordering(rows: Sequence[Row]) -> float:
    """Area under the ROC curve: how often a right answer has a larger margin than a wrong one.

    Ties count half; 0.5 is chance, nan where there is only one kind.
    """
    right = [r.margin for r in rows if r.verdict == "right"]
    wrong = [r.margin for r in rows if r.verdict == "wrong"]
    pairs = [(a > b) + 0.5 * (a == b) for a in right for b in wrong]
    return sum(pairs) / len(pairs) if pairs else float("nan")


def bands(rows: Sequence[Row]) -> list[tuple[float, float, int, float, float]]:
    """Per band of margins: its edges, answers in it, their mean margin, share of them right."""
    found = []
    for low, high in pairwise(BANDS):
        inside = [r for r in rows if r.answer is not None and low <= r.margin < high]
        if inside:
            mean = sum(r.margin for r in inside) / len(inside)
            right = sum(r.verdict == "right" for r in inside) / len(inside)
            found.append((low, min(high, 1.0), len(inside), mean, right))
    return found
