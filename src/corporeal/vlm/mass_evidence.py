"""Evidence of an object's mass from outside the library, and contradictions to it.

Printed facts and one direct estimate, used as importance weights of samples.
"""

from math import log

import numpy as np
from jaxtyping import Float

from corporeal.core.types import MassEvidence, Note, NoteKind, ObjectDescription
from corporeal.discretization.part_model import NORMAL_90_PERCENT_WIDTH_SIGMAS
from corporeal.vlm.interpret_answers import leaf_parts

MIN_JUDGED_MASS_LOG_STD = 0.25
"""Standard deviation of the logarithm of a judged mass, at least [-]: direct answers on objects that no data set
publishes are off by a fifth (ALDE .20).
"""
PACKAGING_MASS_RATIO = 1.12
"""Usual mass of packaged goods over their printed net weight [-]."""
PRINTED_MASS_LOG_STD = 0.12
"""Standard deviation of the logarithm of a mass that follows from a printed weight [-]."""
UNRELATED_EVIDENCE_PROBABILITY = 0.02
"""Probability that the evidence is about another object [-]."""
CONTRADICTION_STD_COUNT = 3.0
"""Evidence further than this many standard deviations from every sample contradicts them."""


def mass_likelihood(masses: Float[np.ndarray, " N"], evidence: MassEvidence | None) -> Float[np.ndarray, " N"]:
    """Likelihood of each mass [kg] given the evidence: log-normal with a floor."""
    found = np.ones(len(masses))
    for centre, width in evidence_masses(evidence):
        away = np.log(masses / centre) / width
        found *= (1 - UNRELATED_EVIDENCE_PROBABILITY) * np.exp(-0.5 * away**2) + UNRELATED_EVIDENCE_PROBABILITY
    return found


def evidence_masses(evidence: MassEvidence | None) -> list[tuple[float, float]]:
    """Return the evidence as masses: centre [kg] and standard deviation of the logarithm."""
    if evidence is None:
        return []
    width = log(evidence.high / evidence.low) / NORMAL_90_PERCENT_WIDTH_SIGMAS
    found = [(evidence.likely, max(width, MIN_JUDGED_MASS_LOG_STD))]
    for kind, factor in (("net weight", PACKAGING_MASS_RATIO), ("total weight", 1.0)):
        values = [f.value for f in evidence.printed if f.kind == kind and f.value]
        if values:  # the same in ounces and in grams is one statement
            found.append((factor * float(np.median(values)), PRINTED_MASS_LOG_STD))
    return found


def mass_contradiction(words: ObjectDescription, masses: Float[np.ndarray, " N"]) -> str:
    """Describe evidence that is far from every sample, with reconciling changes; "": none."""
    clauses = []
    for centre, width in evidence_masses(words.evidence):
        away = np.log(masses / centre) / width
        nearest = float(away[np.argmin(np.abs(away))])
        if abs(nearest) > CONTRADICTION_STD_COUNT:
            clauses.append((centre, nearest))
    if not clauses:
        return ""
    estimate, _ = max(clauses, key=lambda row: abs(row[1]))
    low, high = float(masses.min()), float(masses.max())
    return Note(
        f"{words.name}: all its hypotheses weigh {low:.3g} to {high:.3g} kg, but "
        f"its mass was estimated at {estimate:.3g} kg. {_reconciliation_text(words, masses, estimate)} "
        "--annotations decides.",
        NoteKind.ASSUMED,
    )


def _reconciliation_text(words: ObjectDescription, masses: np.ndarray, estimate: float) -> str:
    """Name changes that would make the likeliest hypothesis weigh as estimated."""
    ratio = estimate / float(np.median(masses))
    main = max(leaf_parts(words.parts), key=lambda p: p.volume_share - p.inner_share)
    size = f"an object {ratio ** (1 / 3):.2f} times as large"
    if main.structure == "filled":
        wanted = f"{main.name} filled to {min((main.fill or 1.0) * ratio, 1.0):.0%}"
    elif main.structure in ("shell", "sheet", "hollow"):
        wanted = f"a wall of {main.name} {ratio:.2g} times as thick"
    elif ratio < 1:
        share = (main.solidity or 1.0) * ratio
        wanted = f"{main.name} hollow, or {share:.0%} of its volume material"
    else:
        wanted = f"a material of {main.name} {ratio:.2g} times as dense"
    return f"To reconcile them it would take {wanted}, or {size}."
