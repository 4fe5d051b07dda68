"""`corporeal evaluate mass | materials | dynamics`."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from corporeal.cli.corpus_command import WorkerOptions, log_event, worker_factory
from corporeal.cli.parse import parse, run_subcommand
from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.terminal import console, progress_bars, show_table
from corporeal.lab.evaluation.result_table import ResultTable

if TYPE_CHECKING:
    from corporeal.lab.evaluation.dynamics.dynamics_summary import DynamicsSummary

Folder = Annotated[
    Path | None,
    tyro.conf.Positional,
    tyro.conf.arg(metavar="FOLDER", help="Models, one object each."),
]
Target = Annotated[
    str, tyro.conf.Positional, tyro.conf.arg(metavar="TARGET", help='"showcase", or the folder of a corpus.')
]


def command_evaluate() -> None:
    """Compare predictions with ground truth: mass, materials, dynamics."""
    run_subcommand("evaluate", EVALUATIONS)


def _folder(folder: Path | None, what: str) -> Path:
    if folder is None:
        raise UserError(f"Name a folder: corporeal evaluate {what} FOLDER.")
    return folder


def evaluate_mass() -> None:
    """Predict masses, and compare them with measured ones where --truth gives them.

    FOLDER holds models, one object each; the CSV has columns object, mass_kg and, optionally, fill (solid, hollow,
    full), by which errors are grouped. Without --truth, masses are only predicted. A folder in the layout of ABO-500
    needs no CSV: choose its --split.
    """
    from corporeal.description.describe_config import DescribeConfig
    from corporeal.lab.evaluation import mass_evaluation, mass_report, measured_masses
    from corporeal.pipeline.stages.ground import GroundConfig

    @dataclass(frozen=True)
    class Mass:
        folder: Folder = None
        truth: Path | None = None
        """Table of measured masses (CSV)."""
        split: str = "test"
        """Split of ABO-500; "all" for all."""
        json: Path | None = None
        """Output file for rows and errors (JSON)."""
        figure: Path | None = None
        """Output file for a plot of predicted against measured mass (PNG)."""
        how: mass_evaluation.MassConfig = field(default_factory=mass_evaluation.MassConfig)
        describe: DescribeConfig = field(default_factory=DescribeConfig)
        ground: GroundConfig = field(default_factory=GroundConfig)

    first = ("truth", "vlm", "anonymous", "split", "json", "figure")
    asked = parse(Mass, "evaluate mass", evaluate_mass.__doc__, words=2, first=first)
    objects = measured_masses.objects_to_weigh(_folder(asked.folder, "mass"), asked.truth, asked.split)
    with progress_bars() as tell:
        done = tell("evaluate")
        found = mass_evaluation.predict_masses(objects, asked.describe, asked.ground, asked.how, done)
    result = mass_evaluation.compare_masses(found)
    _show(mass_report.mass_tables(result))
    if asked.json is not None:
        store.write_json(asked.json, result)
    if asked.figure is not None:
        mass_report.mass_figure(result.rows, asked.figure)


def evaluate_materials() -> None:
    """Compare recognised materials with those that --truth TOML accepts.

    FOLDER holds models; the table lists, per file and part, the accepted materials, the likeliest first.
    """
    from corporeal.description.describe_config import DescribeConfig
    from corporeal.lab.evaluation import material_evaluation
    from corporeal.pipeline.stages.ground import GroundConfig

    @dataclass(frozen=True)
    class Materials:
        folder: Folder = None
        truth: Path | None = None
        """Accepted materials of parts (TOML)."""
        json: Path | None = None
        """Output file for rows and errors (JSON)."""
        describe: DescribeConfig = field(default_factory=DescribeConfig)
        ground: GroundConfig = field(default_factory=GroundConfig)

    first = ("truth", "vlm", "annotations", "record", "json", "library")
    asked = parse(Materials, "evaluate materials", evaluate_materials.__doc__, words=2, first=first)
    if asked.truth is None:
        raise UserError(f"No ground truth. Give --truth TOML. {material_evaluation.TRUTH_FILE_ADVICE}")
    library = asked.ground.library
    truth = material_evaluation.read_material_truth(asked.truth, library)
    folder = _folder(asked.folder, "materials")
    with progress_bars() as tell:
        rows = material_evaluation.evaluate_materials(folder, truth, asked.describe, library, tell("evaluate"))
    _show(material_evaluation.recognition_tables(rows))
    if asked.json is not None:
        store.write_json(asked.json, material_evaluation.recognition_record(rows))


def evaluate_dynamics() -> None:
    """Compare trajectories with baselines, with a finer run, and with measured rebounds.

        corporeal evaluate dynamics showcase --against single capped one
        corporeal evaluate dynamics corpus/ --against vomp:fields/ --json d.json

    TARGET is "showcase" or a corpus whose scenes are assembled. Each run is written to OUT/SCENE/METHOD in its own
    process; repeat the command to resume. A failed run is a row.
    """
    from corporeal.jobs.executor import Executor
    from corporeal.lab.evaluation.dynamics import dynamics_tables
    from corporeal.lab.evaluation.dynamics.dynamics_evaluation import DynamicsConfig
    from corporeal.lab.evaluation.dynamics.dynamics_evaluation import evaluate_dynamics as evaluate
    from corporeal.pipeline.settings import Settings

    @dataclass(frozen=True)
    class Dynamics:
        target: Target
        how: DynamicsConfig = field(default_factory=DynamicsConfig)
        out: Path | None = None
        """Folder of the runs; default dynamics/, of a corpus CORPUS/dynamics/."""
        json: Path | None = None
        """Output file for all numbers (JSON)."""
        figure: Path | None = None
        """Output file for a figure (PNG)."""
        page: Path | None = None
        """Output file for the report; default OUT/report.html."""
        crew: WorkerOptions = field(default_factory=WorkerOptions)
        settings: Annotated[Settings, tyro.conf.arg(name="")] = field(default_factory=Settings)

    first = ("against", "reference", "detail", "out", "json", "figure")
    doc = evaluate_dynamics.__doc__
    asked = parse(Dynamics, "evaluate dynamics", doc, words=2, first=first)
    here = Path() if asked.target == "showcase" else Path(asked.target)
    out = asked.out or here / "dynamics"
    with progress_bars() as tell:
        hands = Executor(worker_factory(asked.crew, out), tell("evaluate"), log_event)
        found = evaluate(asked.target, out, asked.how, asked.settings, hands)
    _show(dynamics_tables.dynamics_tables(found))
    for sentence in (*dynamics_tables.ranking_sentences(found), *dynamics_tables.missing_references(found)):
        console.print(sentence, markup=False, highlight=False)
    _write_dynamics(found, asked, out)


def _write_dynamics(found: "DynamicsSummary", asked: Any, out: Path) -> None:
    """Write the report of an evaluation of dynamics, and the files asked for."""
    from corporeal.lab.evaluation.dynamics import dynamics_page
    from corporeal.lab.evaluation.dynamics.dynamics_summary import dynamics_record

    page = asked.page or out / "report.html"
    dynamics_page.write_dynamics_page(found, page)
    print(page)
    if asked.json is not None:
        store.write_json(asked.json, dynamics_record(found))
    if asked.figure is not None:
        dynamics_page.draw_dynamics(found, asked.figure)


def _show(tables: Sequence[ResultTable]) -> None:
    for table in tables:
        if table.rows:
            show_table(table.heads, table.rows, table.title)


EVALUATIONS = {
    "mass": evaluate_mass,
    "materials": evaluate_materials,
    "dynamics": evaluate_dynamics,
}
