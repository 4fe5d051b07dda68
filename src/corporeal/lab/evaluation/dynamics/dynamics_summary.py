"""Summary of an evaluation of dynamics: per scene and method, per material class and law, ranks, rebounds.

Everything is read from what finished runs left on the disk.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import mean

from corporeal.core import store
from corporeal.core.audit_data import FLOOR_NAME
from corporeal.lab.evaluation.dynamics.compared_methods import OURS_NAME, reference_folder, run_folder
from corporeal.lab.evaluation.dynamics.dynamics_jobs import EvaluatedScene, MethodComparison, dynamics_jobs
from corporeal.lab.evaluation.dynamics.method_ranking import (
    MethodResult,
    RankCorrelation,
    RankedPair,
    SceneRanking,
    rank_correlation,
    rank_scene,
)
from corporeal.lab.evaluation.dynamics.rebound_drops import RANGE_TOLERANCE, MethodDrop, has_rebound_data, read_drops
from corporeal.lab.evaluation.dynamics.run_difference import compare_runs
from corporeal.lab.evaluation.dynamics.run_measures import ObjectMeasures, RunMeasures, read_run_measures
from corporeal.simulation.audit import ALLOWED_BREACHES

NOT_RUN_TEXT = "not run yet"


@dataclass(frozen=True)
class ReferenceRun:
    """The run that a scene's others are compared with."""

    scene: str
    numbers: RunMeasures | None
    """None: there is none to trust."""
    error: str = ""
    """Why not."""


@dataclass(frozen=True)
class MethodMean:
    """One method over a group of scenes; None where no scene tells."""

    group: str
    method: str
    scenes: int
    """That were run."""
    met: float | None
    """Share of expectations that are met."""
    clean: float
    """Share of scenes with a clean audit."""
    path: float | None
    contacts: float | None
    delay: float | None
    """[s]"""
    parted: float | None
    shape: float | None
    rebound: float | None


@dataclass(frozen=True)
class MethodRanks:
    """Whether a method keeps the order of what is stiffer and what bounces higher."""

    method: str
    stiffness: RankCorrelation
    """Of real E with how little objects of a scene that something touched deform."""
    restitution: RankCorrelation
    """Of restitution with rebound: of materials in scenes, of real balls in reality."""


@dataclass(frozen=True)
class MethodRebounds:
    """One method against published rebounds."""

    method: str
    drops: int
    inside: int
    """In their published range, with some leeway."""
    off: float
    """Mean distance from the range [-]."""


@dataclass(frozen=True)
class DynamicsSummary:
    """A whole evaluation."""

    detail: str
    reference: str
    """Detail of the reference."""
    methods: tuple[str, ...]
    rows: tuple[MethodResult, ...]
    references: tuple[ReferenceRun, ...]
    standings: tuple[SceneRanking, ...]
    means: Mapping[str, tuple[MethodMean, ...]]
    """"all", "material class" and "law" → one line per group and method."""
    ranks: tuple[MethodRanks, ...]
    life: tuple[MethodRebounds, ...]

    def row(self, scene: str, method: str) -> MethodResult:
        """Return one method in one scene."""
        return next(r for r in self.rows if (r.scene, r.method) == (scene, method))


def summarise_dynamics(
    scenes: Sequence[EvaluatedScene], comparison: MethodComparison, errors: Mapping[str, str]
) -> DynamicsSummary:
    """Read all runs that are finished and compare them."""
    done = {job.name for job in dynamics_jobs(scenes, comparison) if job.done}
    state = _EvaluationState(comparison, done, errors)
    methods = [m.name for m in comparison.methods]
    references = [_reference(s.name, state) for s in scenes]
    rows = [
        _row(scene.name, method, reference, state)
        for scene, reference in zip(scenes, references, strict=True)
        for method in methods
    ]
    by_scene = {s.name: {r.method: r for r in rows if r.scene == s.name} for s in scenes}
    drops = {m.name: read_drops(comparison.out, m) if has_rebound_data(m) else [] for m in comparison.methods}
    return DynamicsSummary(
        detail=comparison.settings.fill.detail,
        reference=comparison.reference,
        methods=tuple(methods),
        rows=tuple(rows),
        references=tuple(references),
        standings=tuple(s for n, of in by_scene.items() if (s := rank_scene(n, of)) is not None),
        means=_means(by_scene, methods),
        ranks=tuple(_ranks(m, by_scene, drops[m]) for m in methods),
        life=tuple(_life(m, drops[m]) for m in methods if drops[m]),
    )


@dataclass(frozen=True)
class _EvaluationState:
    """How far the runs of an evaluation came."""

    comparison: MethodComparison
    done: set[str]
    """Names of finished jobs."""
    errors: Mapping[str, str]
    """Name of a failed job → why."""

    def missing(self, name: str) -> str:
        """Return why a run is not there."""
        return self.errors.get(name, NOT_RUN_TEXT)


def _reference(scene: str, state: _EvaluationState) -> ReferenceRun:
    """Read the reference; one that is not physics is none."""
    folder = reference_folder(state.comparison.out, scene, state.comparison.reference)
    name = f"{scene}.{folder.name}"
    if name not in state.done:
        return ReferenceRun(scene, None, state.missing(name))
    numbers = read_run_measures(folder)
    if numbers.faults:
        return ReferenceRun(scene, None, f"refused, its audit is not clean: {numbers.faults[0]}")
    return ReferenceRun(scene, numbers)


def _row(scene: str, method: str, reference: ReferenceRun, state: _EvaluationState) -> MethodResult:
    """Read one run, and compare it with the reference unless it gained energy."""
    name = f"{scene}.{method}"
    if name not in state.done:
        return MethodResult(scene, method, None, None, state.missing(name))
    numbers = read_run_measures(run_folder(state.comparison.out, scene, method))
    if numbers.growth > ALLOWED_BREACHES["mechanical_growth"]:
        return MethodResult(scene, method, numbers, None, f"failed: energy grew by {numbers.growth:.1%}")
    against = None if reference.numbers is None else compare_runs(numbers, reference.numbers)
    return MethodResult(scene, method, numbers, against)


def _means(
    by_scene: Mapping[str, Mapping[str, MethodResult]], methods: Sequence[str]
) -> dict[str, tuple[MethodMean, ...]]:
    """Average over all scenes, and over those in which a material class or a law occurs in ours."""
    kinds: dict[str, Callable[[ObjectMeasures], Iterable[str]]] = {
        "material class": lambda body: body.groups,
        "law": lambda body: body.laws,
    }
    found = {"all": tuple(_mean("all", m, [of[m] for of in by_scene.values()]) for m in methods)}
    for kind, keys in kinds.items():
        groups: dict[str, list[str]] = {}
        for name, of in by_scene.items():
            numbers = of[OURS_NAME].numbers
            for key in sorted({k for b in numbers.bodies for k in keys(b)} if numbers else ()):
                groups.setdefault(key, []).append(name)
        found[kind] = tuple(
            _mean(group, m, [by_scene[n][m] for n in names]) for group, names in sorted(groups.items()) for m in methods
        )
    return found


def _mean(group: str, method: str, rows: Sequence[MethodResult]) -> MethodMean:
    run = [r for r in rows if r.numbers is not None]
    compared = [r.against for r in run if r.against is not None]
    expected = [(r.met, len(r.numbers.expectations)) for r in run if r.numbers is not None]

    def over(name: str) -> float | None:
        values = [v for d in compared if (v := getattr(d, name)) is not None]
        return mean(values) if values else None

    shares = [met / count for met, count in expected if count]
    return MethodMean(
        group=group,
        method=method,
        scenes=len(run),
        met=mean(shares) if shares else None,
        clean=mean(float(r.clean) for r in run) if run else 0.0,
        path=over("path"),
        contacts=over("contacts"),
        delay=over("delay"),
        parted=over("parted"),
        shape=over("shape"),
        rebound=over("rebound"),
    )


def _ranks(method: str, by_scene: Mapping[str, Mapping[str, MethodResult]], drops: Sequence[MethodDrop]) -> MethodRanks:
    """Correlate ranks within each scene; real numbers are those of ours."""
    stiff: list[list[RankedPair]] = []
    bouncy: list[list[RankedPair]] = [[(d.middle, d.restitution) for d in drops]]
    for of in by_scene.values():
        ours, numbers = of[OURS_NAME].numbers, of[method].numbers
        if ours is None or numbers is None:
            continue
        touched = _touched(numbers)
        happened = numbers.outcome.objects
        # Contents that move by themselves in ours alone are left out.
        bodies = [b for b in ours.bodies if b.name in happened]
        stiff.append([(b.young_pa, -happened[b.name].shape_error_max) for b in bodies if b.name in touched])
        ratios = [(b.restitution, happened[b.name].rebound_ratio) for b in bodies]
        bouncy.append([(e, ratio) for e, ratio in ratios if ratio is not None])
    return MethodRanks(method, rank_correlation(stiff), rank_correlation(bouncy))


def _touched(numbers: RunMeasures) -> set[str]:
    """Objects that another object or the floor touched."""
    met = [n for n, p in numbers.outcome.pairs.items() if p.first_contact_s is not None]
    return {name for pair in met for name in pair.split("|")} - {FLOOR_NAME}


def _life(method: str, drops: Sequence[MethodDrop]) -> MethodRebounds:
    return MethodRebounds(
        method=method,
        drops=len(drops),
        inside=sum(d.off <= RANGE_TOLERANCE for d in drops),
        off=mean(d.off for d in drops),
    )


def dynamics_record(found: DynamicsSummary) -> dict:
    """Return the evaluation as JSON keeps it: all but the paths of centres."""
    data = store.to_plain(found)
    for row in (*data["rows"], *data["references"]):
        for body in (row["numbers"] or {}).get("bodies", ()):
            del body["path"]
        if row["numbers"]:
            del row["numbers"]["time"]
    return data
