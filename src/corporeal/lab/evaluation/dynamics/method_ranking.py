"""Ranking of methods in a scene."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import sqrt

from corporeal.lab.evaluation.dynamics.compared_methods import OURS_NAME
from corporeal.lab.evaluation.dynamics.run_difference import RunDifference
from corporeal.lab.evaluation.dynamics.run_measures import RunMeasures

RankedPair = tuple[float, float]


@dataclass(frozen=True)
class RankCorrelation:
    """Whether two orders agree."""

    tau: float | None
    """τ_b = (concordant - discordant) / √(untied in x · untied in y), in [-1, 1] (Kendall 1945);
    None: no pair is untied in both."""
    pairs: int
    """Pairs that are untied in x."""


def rank_correlation(groups: Iterable[Sequence[RankedPair]]) -> RankCorrelation:
    """Correlate the ranks of x and y within each group, all groups counted together."""
    balance = untied_x = untied_y = 0
    for group in groups:
        for (a, b), (c, d) in combinations(group, 2):
            balance += _sign(a - c) * _sign(b - d)
            untied_x += a != c
            untied_y += b != d
    both = sqrt(untied_x * untied_y)
    return RankCorrelation(balance / both if both else None, untied_x)


def _sign(value: float) -> int:
    return (value > 0) - (value < 0)


@dataclass(frozen=True)
class MethodResult:
    """One method in one scene."""

    scene: str
    method: str
    numbers: RunMeasures | None
    """None: it was not run, or failed."""
    against: RunDifference | None
    """From the reference; None: there is none to trust."""
    error: str = ""
    """Why it failed, or cannot be accepted."""

    @property
    def met(self) -> int:
        """Expectations that are met."""
        return 0 if self.numbers is None else sum(e.met for e in self.numbers.expectations)

    @property
    def clean(self) -> bool:
        """Whether the audit found nothing."""
        return self.numbers is not None and not self.numbers.faults


@dataclass(frozen=True)
class SceneRanking:
    """How ours compares with all baselines of a scene."""

    scene: str
    first: bool
    """Whether no baseline is better in more columns than it is worse."""
    lost: tuple[str, ...]
    """Columns in which a baseline is better, in sentences."""
    beside: tuple[str, ...]
    """Baselines that were run."""
    referred: bool
    """Whether there was a reference; else expectations and the audit alone were compared."""


def rank_scene(scene: str, rows: Mapping[str, MethodResult]) -> SceneRanking | None:
    """Compare ours with every baseline that was run, column by column; None: nothing to compare.

    Paths closer to the reference than ours count as equal: ours at this detail is the yardstick.
    """
    mine = rows.get(OURS_NAME)
    others = [row for row in rows.values() if row.method != OURS_NAME and row.numbers is not None]
    if mine is None or mine.numbers is None or not others:
        return None
    first, lost = True, []
    for theirs in others:
        won = behind = 0
        for column, ours, other, words in _columns(mine, theirs):
            won += ours > other
            behind += ours < other
            if ours < other:
                lost.append(f"{column}: {theirs.method} {words}")
        first = first and behind <= won
    beside = tuple(row.method for row in others)
    return SceneRanking(scene, first, tuple(lost), beside, mine.against is not None)


def _columns(mine: MethodResult, theirs: MethodResult) -> list[tuple[str, float, float, str]]:
    """Return column, our score, their score (greater is better), and both in words."""
    found: list[tuple[str, float, float, str]] = []
    count = len(mine.numbers.expectations) if mine.numbers else 0
    if count:
        words = f"{theirs.met} of {count}, ours {mine.met}"
        found.append(("expectations", mine.met, theirs.met, words))
    found.append(("audit", mine.clean, theirs.clean, "clean, ours not"))
    a, b = mine.against, theirs.against
    if a is None or b is None:
        return found
    found.append(("path", -a.path, -max(a.path, b.path), ""))
    found.append(("contacts", a.contacts, b.contacts, f"{b.contacts:.2f}, ours {a.contacts:.2f}"))
    if a.parted is not None and b.parted is not None:
        words = f"{b.parted:.2f}, ours {a.parted:.2f}"
        found.append(("separation", a.parted, b.parted, words))
    return found
