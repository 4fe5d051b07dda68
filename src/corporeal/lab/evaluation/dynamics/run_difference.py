"""Differences of two runs of a scene: paths, contacts, shapes, rebounds, dents."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import mean, median

import numpy as np

from corporeal.core.audit_data import FLOOR_NAME, Outcome
from corporeal.lab.evaluation.dynamics.run_measures import ObjectMeasures, RunMeasures

PATH_TIME_AFTER_CONTACT_S = 0.2
"""Paths count until so long after an object's first new contact [s]: small differences of a rebound part them from
there on."""
NEGLIGIBLE_SHAPE_ERROR = 1e-4
"""Shape errors below this are as good as none [-]."""
MIN_DENT_DX = 1.0
"""Depth from which a dent has a place [cells]."""


@dataclass(frozen=True)
class RunDifference:
    """Of a run from its reference; None where there is nothing to compare."""

    path: float
    """Distance of the centres of mass, root mean square over time, over the object's diagonal; mean over objects
    [-]."""
    contacts: float
    """Pairs that touched in both over pairs that touched in either (Jaccard), in [0, 1]."""
    delay: float | None
    """Mean difference of the times of first contacts [s]."""
    parted: float | None
    """Share of pairs that met in both and parted in both, or in neither."""
    at_rest: float
    """Share of objects that lie still at the end in both, or in neither."""
    shape: float
    """Median of |log10| of the ratio of largest shape errors [-]."""
    rebound: float | None
    """Mean difference of rebounds as shares of the fall [-]."""
    dent: float | None
    """Mean distance of dents over the object's length [-]."""


def compare_runs(run: RunMeasures, reference: RunMeasures) -> RunDifference:
    """Compare a run with its reference, object by object and pair by pair.

    Contents that move by themselves in the reference alone are left out.

    Raises:
        ValueError: They are not of one scene.
    """
    mine = {body.name: body for body in run.bodies}
    couples = [(mine[b.name], b) for b in reference.bodies if b.name in mine]
    if not couples:
        raise ValueError("The runs are of two scenes: no object of one is in the other.")
    met, wanted = _touched(run.outcome), _touched(reference.outcome)
    either = met | wanted
    times = [
        (run.outcome.pairs[p].first_contact_s, reference.outcome.pairs[p].first_contact_s)
        for p in sorted(met & wanted)
        if p in _new_contacts(run) or p in _new_contacts(reference)
    ]
    both = [(run.outcome.objects[b.name], reference.outcome.objects[b.name]) for b, _ in couples]
    rebounds = [
        abs(a.rebound_ratio - b.rebound_ratio)
        for a, b in both
        if a.rebound_ratio is not None and b.rebound_ratio is not None
    ]
    return RunDifference(
        path=mean(_path_distance(run, a, reference, b) for a, b in couples),
        contacts=len(met & wanted) / len(either) if either else 1.0,
        delay=_mean([abs(a - b) for a, b in times if a is not None and b is not None]),
        parted=_separation_agreement(run.outcome, reference.outcome),
        at_rest=mean(float(a.at_rest == b.at_rest) for a, b in both),
        shape=median(_log_ratio(a.shape_error_max, b.shape_error_max) for a, b in both),
        rebound=_mean(rebounds),
        dent=_dents(run.outcome, reference.outcome),
    )


def _path_distance(run: RunMeasures, mine: ObjectMeasures, reference: RunMeasures, theirs: ObjectMeasures) -> float:
    """Distance of one object's paths over its diagonal [-]."""
    time = np.array(reference.time)
    until = min(float(time[-1]), run.time[-1], _first_new_contact(reference, theirs) + PATH_TIME_AFTER_CONTACT_S)
    time = time[time <= until + 1e-9]
    there = theirs.places[: len(time)]
    here = np.stack([np.interp(time, run.time, mine.places[:, axis]) for axis in range(3)], axis=1)
    return float(np.sqrt(((here - there) ** 2).sum(axis=1).mean()) / theirs.diagonal)


def _first_new_contact(run: RunMeasures, body: ObjectMeasures) -> float:
    """When an object first touched what it did not touch from the start [s]; inf: it never did."""
    instants = [t for name, t in _new_contacts(run).items() if body.name in name.split("|")]
    return min(instants, default=np.inf)


def _touched(outcome: Outcome) -> set[str]:
    return {name for name, p in outcome.pairs.items() if p.first_contact_s is not None}


def _new_contacts(run: RunMeasures) -> dict[str, float]:
    """Pairs that came to touch after the first frame, and when [s]."""
    begun = run.time[1] if len(run.time) > 1 else 0.0
    instants = {name: p.first_contact_s for name, p in run.outcome.pairs.items()}
    return {name: t for name, t in instants.items() if t is not None and t > begun}


def _separation_agreement(mine: Outcome, theirs: Outcome) -> float | None:
    alike = [
        float(bool(mine.pairs[name].separated) == bool(pair.separated))
        for name, pair in theirs.pairs.items()
        if not name.endswith(f"|{FLOOR_NAME}") and name in _touched(theirs) and name in mine.pairs
    ]
    return _mean(alike)


def _log_ratio(mine: float, theirs: float) -> float:
    return abs(float(np.log10(max(mine, NEGLIGIBLE_SHAPE_ERROR) / max(theirs, NEGLIGIBLE_SHAPE_ERROR))))


def _dents(mine: Outcome, theirs: Outcome) -> float | None:
    found = []
    for name, wanted in theirs.objects.items():
        place = mine.objects[name].dent_place if name in mine.objects else None
        if wanted.dent_place is None or wanted.dent_depth_dx < MIN_DENT_DX or place is None:
            continue
        away = np.linalg.norm(np.array(place) - np.array(wanted.dent_place))
        found.append(float(away) / wanted.length_m)
    return _mean(found)


def _mean(values: Sequence[float]) -> float | None:
    return mean(values) if values else None
