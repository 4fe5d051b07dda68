"""Priors by name: pressure of balls, and restitution by the rules of their sport."""

from collections.abc import Callable

from corporeal.recognition.lexicon import LexiconTerm, head_terms, substance_terms
from corporeal.recognition.metadata_recognition import FileEvidence


def usual_inflation(evidence: FileEvidence) -> float | None:
    """Gauge pressure [Pa] in an object of such a name and one part; None: not sealed.

    What is only called inflatable has the pressure of what is blown up by mouth or a foot pump.
    """
    of_thing = _common_value(evidence, lambda term: term.inflation)
    said = (t.inflation for name in evidence.general for t in substance_terms(name.words))
    blown_up = next((pressure for pressure in said if pressure is not None), None)
    return of_thing if of_thing is not None or not evidence.alone else blown_up


def usual_rebound(evidence: FileEvidence) -> float | None:
    """Restitution that rules ask of an object of such a name and one part; None: none is known."""
    return _common_value(evidence, lambda term: term.rebound)


def _common_value(evidence: FileEvidence, of: Callable[[LexiconTerm], float | None]) -> float | None:
    """Return what all objects with the longest of an object's names have; None: they differ."""
    terms = [t for name in evidence.general for t in head_terms(name.words) if t.kind == "thing"]
    longest = max((len(t.phrase) for t in terms), default=0)
    usual = {of(t) for t in terms if len(t.phrase) == longest}
    return usual.pop() if evidence.alone and len(usual) == 1 else None
