"""`corporeal evaluate WHAT`: what was predicted against what is known."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from corporeal import store
from corporeal.cli.parse import parse
from corporeal.errors import UserError
from corporeal.terminal import show_table, told


def verb_evaluate() -> None:
    """Compare what was predicted with what is known: mass, materials, parts or objects.

    FOLDER holds models, one object each; the CSV has columns object, mass_kg and, if you like, fill
    (solid, hollow, full: whose errors are told apart). Without --truth masses are predicted only.
    A folder in the layout of ABO-500 needs no CSV: choose its --split. `evaluate materials` needs
    --truth TOML: per file and part the materials that are right, the likeliest first.
    `evaluate parts` pictures each model from all sides, looks for its parts among the points that
    the pictures show, and compares with the file's own nodes and materials; without FOLDER it takes
    four models of the showcase. With --structural dinov2 --semantic clip models look at them.
    `evaluate objects` pictures settled scenes (FOLDER: what `assemble` wrote) and tells their
    things apart by points on what the pictures show, or by Gaussians: --points-from gaussians.
    """
    from corporeal.evaluation import mass, objects, parts
    from corporeal.regions.parts import PartsConfig
    from corporeal.stages.describe import DescribeConfig
    from corporeal.stages.ground import GroundConfig

    @dataclass(frozen=True)
    class Evaluate:
        what: tyro.conf.Positional[Literal["mass", "materials", "parts", "objects"]]
        folder: Annotated[Path | None, tyro.conf.Positional] = None
        truth: Path | None = None
        """Table of measured masses (CSV), or of what parts are made of (TOML)."""
        names: Path | None = None
        """TOML with what parts are called: per file, the file's name of a part = another name."""
        split: str = "test"
        """Of ABO-500; "all" for all."""
        json: Path | None = None
        """Where rows and errors go, as data."""
        figure: Path | None = None
        """Where a picture goes (PNG): of predicted against measured mass, of parts, of objects."""
        how: mass.MassConfig = field(default_factory=mass.MassConfig)
        look: parts.PartsEvaluationConfig = field(default_factory=parts.PartsEvaluationConfig)
        clusters: PartsConfig = field(default_factory=PartsConfig)
        scenes: objects.ObjectsEvaluationConfig = field(
            default_factory=objects.ObjectsEvaluationConfig
        )
        describe: DescribeConfig = field(default_factory=DescribeConfig)
        ground: GroundConfig = field(default_factory=GroundConfig)

    asked = parse(Evaluate, "evaluate", verb_evaluate.__doc__)
    judges = {"mass": _masses, "materials": _materials, "parts": _parts, "objects": _objects}
    judges[asked.what](asked)


def _folder(asked: Any) -> Path:
    if asked.folder is None:
        raise UserError(f"Name a folder: corporeal evaluate {asked.what} FOLDER.")
    return asked.folder


def _masses(asked: Any) -> None:
    from corporeal.evaluation import mass, report, truth

    things = truth.objects(_folder(asked), asked.truth, asked.split)
    with told() as tell:
        done = tell("evaluate")
        found = mass.predict_all(things, asked.describe, asked.ground, asked.how, done)
    result = mass.compare(found)
    _show(report.tables(result))
    if asked.json is not None:
        store.write_json(asked.json, result)
    if asked.figure is not None:
        report.mass_figure(result["rows"], asked.figure)


def _materials(asked: Any) -> None:
    from corporeal.evaluation import recognition

    if asked.truth is None:
        raise UserError(f"Nothing to judge by. Say --truth TOML. {recognition.EXAMPLE}")
    library = asked.ground.library
    truth = recognition.read_truth(asked.truth, library)
    with told() as tell:
        done = tell("evaluate")
        rows = recognition.judge(_folder(asked), truth, asked.describe, library, done)
    _show(recognition.tables(rows))
    if asked.json is not None:
        store.write_json(asked.json, recognition.record(rows))


def _parts(asked: Any) -> None:
    from corporeal.evaluation import parts, parts_figure

    names = {} if asked.names is None else parts.read_names(asked.names)
    with told() as tell:
        how = parts.Judging(asked.look, asked.clusters, asked.describe)
        found = parts.judge(asked.folder, names, how, tell("evaluate"))
    rows = [row for row, _ in found]
    _show(parts.tables(rows))
    if asked.json is not None:
        store.write_json(asked.json, parts.record(rows))
    if asked.figure is not None:
        parts_figure.draw(found, asked.figure)


def _objects(asked: Any) -> None:
    from corporeal.evaluation import objects, objects_figure

    with told() as tell:
        found = objects.judge(_folder(asked), asked.scenes, tell("evaluate"))
    rows = [row for row, _ in found]
    _show(objects.tables(rows))
    if asked.json is not None:
        store.write_json(asked.json, objects.record(rows))
    if asked.figure is not None:
        objects_figure.draw(found, asked.figure)


def _show(tables: list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]) -> None:
    for title, heads, rows in tables:
        if rows:
            show_table(heads, rows, title)
