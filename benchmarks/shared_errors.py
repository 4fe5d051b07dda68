"""Compare what a judged mass may say of the draws: by itself, or as one that errs with them.

    python benchmarks/shared_errors.py FOLDER --truth masses.csv --recordings SET ... [--answers 3]

The rules of decision mass-pooled-answers over the same draws; none but the product's is in use. Objects are models
of one object each, pictured without names, as in ``evaluate mass``.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from math import sqrt
from pathlib import Path

import numpy as np
from answer_rules import Drawn, Scored, against, drawn
from jaxtyping import Float

from corporeal.lab.evaluation.measured_masses import read_measured_masses
from corporeal.pipeline.mass_posterior import weighted_quantiles
from corporeal.vlm.mass_evidence import UNRELATED_EVIDENCE_PROBABILITY, evidence_masses, mass_likelihood

SHARED, TOGETHER = 0.268, 0.676
"""Slope of a judgement's error over that of the ways' median, and their correlation, over 58
judgements of 19 scans and ten things of our own (sets a and b of each) [-]."""
SHARED_PLACED, TOGETHER_PLACED = 0.348, 0.681
"""The same over the error of the values as placed, in the ways that evidence leaves likely [-]."""
DEGREES = 4
"""Of the t-distribution, the usual robust choice where data do not tell [-]."""
RULES = ("without", "product", "t", "shared", "shared within ways")


def weights(thing: Drawn, rule: str) -> Float[np.ndarray, " N"]:
    """Return what each draw counts by a rule; they add up to 1."""
    found = np.ones(len(thing.masses))
    if rule == "product":
        found = mass_likelihood(thing.masses, thing.pooled)
    elif rule != "without":
        found = _judged(thing, rule) * _printed(thing)
    return found / found.sum()


def _judged(thing: Drawn, rule: str) -> Float[np.ndarray, " N"]:
    """Return how likely the judged mass J is, were each draw m the truth.

    Of one that errs with the ways, ln J ~ N(ln m + β (ln M - ln m), σ² (1 - ρ²)): the conditional
    of a bivariate normal distribution, M what the ways come to.
    """
    (centre, width), *_ = evidence_masses(thing.pooled)
    logs = np.log(thing.masses)
    away = np.log(centre) - logs
    if rule == "t":
        return (1 + (away / width) ** 2 / DEGREES) ** (-(DEGREES + 1) / 2)
    share, together, middle = SHARED, TOGETHER, np.median(logs)
    if rule == "shared within ways":
        share, together, middle = SHARED_PLACED, TOGETHER_PLACED, np.log(thing.placed)
    away = (away - share * (middle - logs)) / (width * sqrt(1 - together**2))
    return (1 - UNRELATED_EVIDENCE_PROBABILITY) * np.exp(-0.5 * away**2) + UNRELATED_EVIDENCE_PROBABILITY


def _printed(thing: Drawn) -> Float[np.ndarray, " N"]:
    """Return what print says of each draw, which errs with nothing."""
    if thing.pooled is None:
        return np.ones(len(thing.masses))
    unjudged = mass_likelihood(thing.masses, replace(thing.pooled, printed=()))
    return mass_likelihood(thing.masses, thing.pooled) / unjudged


def ranked(values: Float[np.ndarray, " N"], shares: Float[np.ndarray, " N"], truth: float) -> float:
    """Return the continuous ranked probability score of weighted draws: the lower the better.

    E|X - x| - E|X - X'|/2 (Gneiting and Raftery 2007, JASA 102).
    """
    order = np.argsort(values)
    x, w = values[order], shares[order]
    below = np.cumsum(w)[:-1]
    return float(w @ np.abs(x - truth) - np.sum(below * (1 - below) * np.diff(x)))


def report(things: Sequence[Drawn], rule: str) -> tuple[Scored, float]:
    """Score a rule's intervals, and its draws: the mean ranked score of ln m."""
    counted = [weights(one, rule) for one in things]
    found = [weighted_quantiles(one.masses, w) for one, w in zip(things, counted, strict=True)]
    scores = [ranked(np.log(one.masses), w, float(np.log(one.truth))) for one, w in zip(things, counted, strict=True)]
    return against(found, [one.truth for one in things]), float(np.mean(scores))


def main() -> None:
    """Print one line per set and rule."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--truth", type=Path, required=True)
    parser.add_argument("--recordings", type=Path, nargs="+", required=True)
    parser.add_argument("--answers", type=int, default=1)
    asked = parser.parse_args()
    rows = [one for one in read_measured_masses(asked.folder, asked.truth) if one.mass is not None]
    for recordings in asked.recordings:
        things = [drawn(one, recordings, asked.answers) for one in rows]
        for rule in RULES:
            scored, score = report(things, rule)
            print(f"{recordings.name}, {rule}: {scored.words()}, ranked {score:.4f}")


if __name__ == "__main__":
    main()
