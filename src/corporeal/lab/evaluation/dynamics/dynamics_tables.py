"""Tables of an evaluation of dynamics: per scene, per group, ranks and rebounds."""

from corporeal.lab.evaluation.dynamics.compared_methods import OURS_NAME
from corporeal.lab.evaluation.dynamics.dynamics_summary import DynamicsSummary, MethodMean
from corporeal.lab.evaluation.dynamics.method_ranking import MethodResult
from corporeal.lab.evaluation.result_table import ResultTable

NO_VALUE = "–"
SCENE_HEADS = ("scene", "method", "expected", "path", "contacts", "parted", "audit")
MEAN_TABLE_HEADS = ("method", "scenes", "expected", "clean", "path", "contacts", "Δt [ms]", "parted")
MEAN_TABLE_HEADS = (*MEAN_TABLE_HEADS, "shape", "rebound")


def dynamics_tables(found: DynamicsSummary) -> list[ResultTable]:
    """Return all tables of an evaluation."""
    return [scene_table(found), *group_tables(found), rank_table(found), life_table(found)]


def scene_table(found: DynamicsSummary) -> ResultTable:
    """Return one row per scene and method."""
    rows = [_cells(row, found.row(row.scene, OURS_NAME)) for row in found.rows]
    return ResultTable(f"Scenes at {found.detail}, against ours at {found.reference}", SCENE_HEADS, rows)


def _cells(row: MethodResult, ours: MethodResult) -> tuple[str, ...]:
    if row.numbers is None:
        return (row.scene, row.method, *(NO_VALUE,) * 4, row.error)
    count = len(row.numbers.expectations)
    expected = f"{row.met} of {count}" if count else NO_VALUE
    audit = row.error or ("clean" if row.clean else row.numbers.faults[0])
    if row.against is None:
        return (row.scene, row.method, expected, NO_VALUE, NO_VALUE, NO_VALUE, audit)
    path = f"{row.against.path:.2f}"
    yardstick = ours.against
    if row.method != OURS_NAME and yardstick is not None and row.against.path <= yardstick.path:
        path = f"= ({path})"
    contacts, parted = f"{row.against.contacts:.2f}", number_text(row.against.parted)
    return (row.scene, row.method, expected, path, contacts, parted, audit)


def group_tables(found: DynamicsSummary) -> list[ResultTable]:
    """Return means of all scenes, and per material class and law."""
    titles = {"all": "All scenes", "material class": "By material class", "law": "By law"}
    return [
        ResultTable(
            titles[kind],
            MEAN_TABLE_HEADS if kind == "all" else (kind, *MEAN_TABLE_HEADS),
            [mean_cells(m) if kind == "all" else (m.group, *mean_cells(m)) for m in means if m.scenes],
        )
        for kind, means in found.means.items()
    ]


def mean_cells(mean: MethodMean) -> tuple[str, ...]:
    """Return one line of means as text."""
    return (
        mean.method,
        str(mean.scenes),
        percent_text(mean.met),
        percent_text(mean.clean) if mean.scenes else NO_VALUE,
        number_text(mean.path),
        number_text(mean.contacts),
        NO_VALUE if mean.delay is None else f"{1e3 * mean.delay:.0f}",
        number_text(mean.parted),
        number_text(mean.shape),
        number_text(mean.rebound),
    )


def rank_table(found: DynamicsSummary) -> ResultTable:
    """Return how far each method keeps the order of stiffness and of restitution."""
    heads = ("method", "τ of stiffness", "pairs", "τ of restitution", "pairs")
    rows = [
        (
            r.method,
            number_text(r.stiffness.tau),
            str(r.stiffness.pairs),
            number_text(r.restitution.tau),
            str(r.restitution.pairs),
        )
        for r in found.ranks
        if r.stiffness.pairs or r.restitution.pairs
    ]
    return ResultTable("Ranks: 1 keeps the real order", heads, rows)


def life_table(found: DynamicsSummary) -> ResultTable:
    """Return how each method does against published rebounds."""
    heads = ("method", "dropped", "in their range", "mean distance")
    rows = [(f.method, str(f.drops), str(f.inside), f"{f.off:.3f}") for f in found.life]
    return ResultTable("Restitution", heads, rows)


def ranking_sentences(found: DynamicsSummary) -> list[str]:
    """Say scene by scene whether ours comes first, and where it does not, why."""
    said = []
    for s in found.standings:
        ours = found.row(s.scene, OURS_NAME)
        where = f"Better than ours: {'; '.join(s.lost)}." if s.lost else ""
        unmet = [e for e in (ours.numbers.expectations if ours.numbers else ()) if not e.met]
        why = [f"{e.sentence}: {e.value}, asked {e.target}" for e in unmet]
        if ours.numbers and ours.numbers.faults:
            why.append(ours.numbers.faults[0])
        because = f" Ours falls short in: {'; '.join(why)}." if why else ""
        place = f"ours {'first' if s.first else 'is not first'}, beside {', '.join(s.beside)}"
        place += "" if s.referred else " (by expectations and the audit alone)"
        said.append(f"{s.scene}: {place}. {where}{because}".replace("..", ".").strip())
    return said


def missing_references(found: DynamicsSummary) -> list[str]:
    """Return which scenes have no reference, and why."""
    return [f"{r.scene}: no reference ({r.error})" for r in found.references if r.numbers is None]


def number_text(value: float | None) -> str:
    """Write a number with two digits after the point."""
    return NO_VALUE if value is None else f"{value:.2f}"


def percent_text(value: float | None) -> str:
    """Write a share as a percentage."""
    return NO_VALUE if value is None else f"{value:.0%}"
