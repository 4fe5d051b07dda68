"""Runs made by hand for comparisons: what a test does not name is as in a run where all is well."""

from dataclasses import replace

from corporeal.core.audit_data import Expectation
from corporeal.lab.evaluation.dynamics.run_measures import ObjectMeasures, RunMeasures
from sample_findings import object_outcome, outcome, pair_outcome

FPS = 60
FRAMES = 61


def body(name="ball_0", velocity=(0.0, 0.0, 0.0), **what):
    """One that moves evenly."""
    times = [k / FPS for k in range(FRAMES)]
    path = tuple(tuple(v * t for v in velocity) for t in times)
    said = {"diagonal": 1.0, "young_pa": 1e6, "restitution": 0.5}
    said |= {"groups": ("elastomer",), "laws": ("neo hookean",)}
    return ObjectMeasures(name=name, path=path, **said | what)


def pair(first=None, separated=None, start=2.0):
    """Two bodies of which the first contact is at an instant."""
    return pair_outcome(first_contact_s=first, separated=separated, gap_start_dx=start)


def run(bodies=None, objects=None, pairs=None, **what):
    """A run of some bodies whose audit is clean."""
    bodies = bodies or (body(),)
    objects = {b.name: object_outcome() for b in bodies} | (objects or {})
    said = {
        "time": tuple(k / FPS for k in range(FRAMES)),
        "bodies": tuple(bodies),
        "outcome": outcome(objects, pairs or {}),
        "faults": (), "growth": 0.0, "overlap_dx": 0.2, "expectations": (), "seconds": 1.0,
        "particles": 1000, "steps": 100,
    }  # fmt: skip
    return RunMeasures(**said | what)


def expecting(numbers, *met):
    """The same run, with expectations of which some are met."""
    seen = tuple(Expectation(f"sentence {k}", "1 mm", "above 2 mm", m) for k, m in enumerate(met))
    return replace(numbers, expectations=seen)
