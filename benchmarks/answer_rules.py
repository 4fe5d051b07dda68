"""Compare rules for several answers about masses: who weighs the draws, and how wide they make it.

    python benchmarks/answer_rules.py FOLDER --truth masses.csv --recordings SET ...

The two rules of decision mass-pooled-answers beside the product's, over the same draws of ``--answers 3``, and what
decision mass-pooled-answers asks of rule B. ``--each`` prints the interval of each thing first. Objects are models
of one object each, pictured without names, as in ``evaluate mass``.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import norm, t

from corporeal.core.types import MassEvidence
from corporeal.description.describe_config import DescribeConfig
from corporeal.geometry.scene_transforms import scale_to_life_size
from corporeal.lab.evaluation.mass_evaluation import anonymise
from corporeal.lab.evaluation.measured_masses import WeighedObject, read_measured_masses
from corporeal.pipeline.mass_posterior import (
    INTERVAL_HIGH_QUANTILE,
    SAMPLES_PER_SCENE,
    MassSampler,
    mass_likelihood,
    weighted_quantiles,
)
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.ground import GroundConfig
from corporeal.pipeline.stages.segment import segment

ANSWERS = 3
MISS = 2 / (2 * (1 - INTERVAL_HIGH_QUANTILE))
"""What lying outside a 90 % interval costs in its score, per unit of the logarithm."""
AIM, WIDEST = INTERVAL_HIGH_QUANTILE - (1 - INTERVAL_HIGH_QUANTILE), 2.2
"""Share of masses that should lie inside, and the widest median interval (high over low)."""


@dataclass(frozen=True)
class Drawn:
    """One object's draws, taken from its answers in turn, and what was said of its mass."""

    truth: float
    """On the scales [kg]."""
    masses: Float[np.ndarray, " N"]
    """Of the draws [kg]."""
    pooled: MassEvidence | None
    own: tuple[MassEvidence | None, ...]
    """Of each answer."""
    placed: Float[np.ndarray, " N"] = field(default_factory=lambda: np.ones(0))
    """Of the ways of each draw, every value where it was placed [kg]."""

    def weights(self, evidence: bool, by_its_own: bool) -> Float[np.ndarray, " N"]:
        """Return what each draw counts; they add up to 1."""
        found = np.full(len(self.masses), 1 / len(self.masses))
        if evidence and by_its_own:
            for k, said in enumerate(self.own):
                found[k :: len(self.own)] *= mass_likelihood(self.masses[k :: len(self.own)], said)
        elif evidence:
            found *= mass_likelihood(self.masses, self.pooled)
        return found / found.sum()

    def interval(self, weights: Float[np.ndarray, " N"], few: bool) -> tuple[float, float, float]:
        """Return the 5 %, 50 % and 95 % points [kg]; ``few``: as wide as so few answers say.

        Each half h of the interval of ln m becomes √(h² + s² (t² (1 + 1/N) - z² (N-1)/N)), s the
        deviation of the answers' medians: what the draws hold of the variance between answers is
        taken out, and what a further answer would say is put in.
        """
        low, middle, high = weighted_quantiles(self.masses, weights)
        if not few:
            return low, middle, high
        n = len(self.own)
        each = [(self.masses[k::n], weights[k::n] / weights[k::n].sum()) for k in range(n)]
        between = float(np.var([np.log(weighted_quantiles(*one)[1]) for one in each], ddof=1))
        wider = (
            t.ppf(INTERVAL_HIGH_QUANTILE, n - 1) ** 2 * (1 + 1 / n)
            - norm.ppf(INTERVAL_HIGH_QUANTILE) ** 2 * (n - 1) / n
        )
        reach = np.sqrt(between * wider)
        down, up = np.hypot(np.log(middle / low), reach), np.hypot(np.log(high / middle), reach)
        return middle * float(np.exp(-down)), middle, middle * float(np.exp(up))


def drawn(thing: WeighedObject, recordings: Path, answers: int = ANSWERS) -> Drawn:
    """Draw what an object may weigh by recorded answers, as ``evaluate mass`` does."""
    scene = anonymise(scale_to_life_size(assemble([thing.file])), thing.file)
    said = describe(scene, DescribeConfig(vlm=f"replay:{recordings}", answers=answers))
    scale = MassSampler(scene, segment(scene, said), GroundConfig(), 0)
    draws = [scale.draw(said, number) for number in range(SAMPLES_PER_SCENE)]
    masses = np.array([draw.masses.sum() for draw in draws])
    placed = np.array([scale.mass(draw.inventory) for draw in draws])
    (words,) = said.objects
    assert thing.mass is not None, "only measured things are drawn"
    own = tuple(a.evidence for a in words.answers)
    return Drawn(thing.mass, masses, words.evidence, own, placed)


@dataclass(frozen=True)
class Scored:
    """What intervals of one rule come to; one number a thing."""

    error: Float[np.ndarray, " N"]
    """|ln m̂ - ln m|"""
    width: Float[np.ndarray, " N"]
    """ln high - ln low"""
    inside: Bool[np.ndarray, " N"]
    score: Float[np.ndarray, " N"]
    """Interval score of ln m (Gneiting and Raftery 2007)."""

    def words(self) -> str:
        """Return ALDE, how many lie inside, the median width and the mean interval score."""
        return (
            f"ALDE {self.error.mean():.3f}, inside {self.inside.sum()} of {len(self.inside)}, "
            f"× {np.exp(np.median(self.width)):.2f}, score {self.score.mean():.3f}"
        )


def scored(things: Sequence[Drawn], evidence: bool, by_its_own: bool, few: bool) -> Scored:
    """Score one rule's intervals."""
    found = [one.interval(one.weights(evidence, by_its_own), few) for one in things]
    return against(found, [one.truth for one in things])


def against(found: Sequence[tuple[float, float, float]], truths: Sequence[float]) -> Scored:
    """Score intervals (5 %, 50 %, 95 %) [kg] against what the scales say [kg]."""
    low, middle, high = np.log(found).T
    truth = np.log(truths)
    outside = np.maximum(low - truth, 0) + np.maximum(truth - high, 0)
    inside = (low <= truth) & (truth <= high)
    return Scored(np.abs(middle - truth), high - low, inside, high - low + MISS * outside)


def verdict(plain: Scored, few: Scored) -> dict[str, bool]:
    """Tell which conditions of decision mass-pooled-answers rule B meets; all four must hold."""
    gain = plain.score - few.score
    most = int(np.argmax(gain))
    away = [abs(float(s.inside.mean()) - AIM) for s in (plain, few)]
    return {
        "share inside no farther from 90 %": away[1] <= away[0] + 1e-12,
        "score lower": float(gain.mean()) > 0,
        "lower without the thing that gains most": float(np.delete(gain, most).mean()) > 0,
        "median width at most 2.2": float(np.exp(np.median(few.width))) <= WIDEST,
    }


def main() -> None:
    """Print one line per set, rule, and with or without outside evidence."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--truth", type=Path, required=True)
    parser.add_argument("--recordings", type=Path, nargs="+", required=True)
    parser.add_argument("--each", action="store_true")
    asked = parser.parse_args()
    rows = [one for one in read_measured_masses(asked.folder, asked.truth) if one.mass is not None]
    for recordings in asked.recordings:
        things = [drawn(one, recordings) for one in rows]
        for row, thing in zip(rows, things, strict=True) if asked.each else ():
            print(f"{row.name}: {each(thing)}")
        report(recordings.name, things)


def each(thing: Drawn) -> str:
    """Return a thing's intervals as low < middle < high, over what the scales say."""
    said = []
    for evidence in (True, False):
        weights = thing.weights(evidence, False)
        for few in (False, True):
            found = np.array(thing.interval(weights, few)) / thing.truth
            rule = ("with evidence" if evidence else "without") + ", B" * few
            said.append(f"{rule} " + " < ".join(f"{x:.2f}" for x in found))
    return "; ".join(said)


def report(name: str, things: Sequence[Drawn]) -> None:
    """Print one line per rule, with and without evidence, and what decides about rule B."""
    for evidence in (True, False):
        said = f"{name} {'with evidence' if evidence else 'without'}"
        for own, few in ((False, False), (True, False), (False, True), (True, True)):
            if own and not evidence:
                continue
            rule = " and ".join(["A"] * own + ["B"] * few) or "the product's"
            print(f"{said}, {rule}: {scored(things, evidence, own, few).words()}")
        plain, few = (scored(things, evidence, False, b) for b in (False, True))
        for condition, met in verdict(plain, few).items():
            print(f"{said}, B: {condition}: {'yes' if met else 'no'}")


if __name__ == "__main__":
    main()
