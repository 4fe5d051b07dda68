"""Measured masses: a table of one's own, or the layout of ABO-500.

A table is a CSV file with a column that names the object's model (its file name, with or without folder and ending),
one for its mass in kilograms, and optionally one for how it is filled (solid, hollow, full …) and one that says which
rows to score.

ABO-500 is a folder with ``splits.json`` (split →
names of scenes), ``filtered_product_weights.json`` (product → kg; a scene's name begins with its
product, up to the first underscore) and ``scenes/<scene>/``; here each scene holds its mesh as a
``.glb`` file beside the pictures.
"""

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from corporeal.core import store
from corporeal.core.errors import BadFileError, UserError
from corporeal.io.input_files import model_files_in

OBJECT_COLUMNS = ("object", "file", "mesh", "model", "name")
MASS_COLUMNS = ("mass_kg", "mass", "measured_mass_kg", "known_mass_kg", "weight_kg")
FILL_COLUMNS = ("fill", "group")
SCORED_COLUMN = "scored"
NO_VALUES = ("0", "no", "false", "n", "")
ABO_SPLITS_FILE, ABO_WEIGHTS_FILE, ABO_SCENES_FOLDER = ("splits.json", "filtered_product_weights.json", "scenes")
UNGROUPED_NAME = "all"


@dataclass(frozen=True)
class WeighedObject:
    """One object that may have been put on scales."""

    name: str
    file: Path
    mass: float | None = None
    """[kg]; None: not known."""
    fill: str = UNGROUPED_NAME
    """Solid, hollow, full …: whose errors are separated."""


def objects_to_weigh(folder: Path, table: Path | None, split: str) -> list[WeighedObject]:
    """Return what is to be weighed: by a table, by the layout of ABO-500, or just the models."""
    if table is not None:
        return read_measured_masses(folder, table)
    return read_abo(folder, split) if is_abo(folder) else models_in_folder(folder)


def models_in_folder(folder: Path) -> list[WeighedObject]:
    """Every model in a folder, of unknown mass.

    Raises:
        UserError: There is none.
    """
    found = model_files_in(folder) if folder.is_dir() else []
    if not found:
        raise UserError(f"No .glb or .gltf file in {folder}. Name a folder that holds some.")
    return [WeighedObject(path.stem, path) for path in found]


def read_measured_masses(folder: Path, table: Path) -> list[WeighedObject]:
    """Return the models of a folder whose masses a table gives, in the table's order.

    Raises:
        BadFileError: The table cannot be used, or speaks of none of the models.
    """
    models = {w.name: w for w in models_in_folder(folder)}
    rows = _rows(table)
    heads = list(rows[0]) if rows else []
    _column(table, heads, OBJECT_COLUMNS)
    mass = _column(table, heads, MASS_COLUMNS)
    fill = next((h for h in FILL_COLUMNS if h in heads), None)
    found = []
    for row in rows:
        model = _model(row, models)
        if model is None or not _scored(row):
            continue
        group = (row[fill] or "").strip() if fill else ""
        kilograms = _mass(table, model.name, row[mass])
        found.append(WeighedObject(model.name, model.file, kilograms, group or UNGROUPED_NAME))
    if not found:
        step = f"One of {', '.join(OBJECT_COLUMNS)} must name them, such as {next(iter(models))!r}."
        raise BadFileError(table, f"weighs none of the models in {folder}.", step)
    return found


def _scored(row: dict[str, str]) -> bool:
    """Whether a row counts; "no: for a reason" does not."""
    return (row.get(SCORED_COLUMN, "yes") or "").partition(":")[0].strip().lower() not in NO_VALUES


def _model(row: dict[str, str], models: dict[str, WeighedObject]) -> WeighedObject | None:
    """Return the model that any of a row's names means."""
    names = (Path(row[head]).stem for head in OBJECT_COLUMNS if row.get(head))
    return next((models[name] for name in names if name in models), None)


def _rows(table: Path) -> list[dict[str, str]]:
    try:
        with table.open(encoding="utf-8-sig", newline="") as file:
            return list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadFileError(table, f"cannot be read as CSV ({error}).") from error


def _column(table: Path, heads: list[str], names: tuple[str, ...]) -> str:
    for name in names:
        if name in heads:
            return name
    step = f"It has: {', '.join(map(str, heads)) or 'nothing'}."
    raise BadFileError(table, f"has no column {names[0]!r}.", step)


def _mass(table: Path, name: str, given: Any) -> float:
    try:
        mass = float(given)
    except (TypeError, ValueError):
        mass = math.nan
    if not 0 < mass < math.inf:
        raise BadFileError(table, f"{name}: a mass must be a number of kilograms, not {given!r}.")
    return mass


def is_abo(folder: Path) -> bool:
    """Whether a folder has the layout of ABO-500."""
    return (folder / ABO_SPLITS_FILE).exists() and (folder / ABO_WEIGHTS_FILE).exists()


def read_abo(folder: Path, split: str) -> list[WeighedObject]:
    """Return the objects of one split of ABO-500; ``"all"`` for all.

    Raises:
        UserError: There is no such split, or a scene has no mesh or no weight.
    """
    splits, weights = (store.read_json(folder / ABO_SPLITS_FILE), store.read_json(folder / ABO_WEIGHTS_FILE))
    for path, given in ((folder / ABO_SPLITS_FILE, splits), (folder / ABO_WEIGHTS_FILE, weights)):
        if not isinstance(given, dict):
            raise BadFileError(path, "must map names.", "Download it again.")
    if split != "all" and split not in splits:
        raise UserError(f"{folder} has no split {split!r}. Choose one of: {', '.join(splits)}, all.")
    scenes = [s for names in splits.values() for s in names] if split == "all" else splits[split]
    return [_abo_object(folder, str(scene), weights) for scene in scenes]


def _abo_object(folder: Path, scene: str, weights: dict) -> WeighedObject:
    product = scene.split("_")[0]
    place = folder / ABO_SCENES_FOLDER / scene
    models = model_files_in(place) if place.is_dir() else []
    if len(models) != 1:
        raise UserError(f"{place} must hold the product's mesh as one .glb file; it holds {len(models)}.")
    if product not in weights:
        raise BadFileError(folder / ABO_WEIGHTS_FILE, f"has no weight for {product!r}.")
    return WeighedObject(scene, models[0], _mass(folder / ABO_WEIGHTS_FILE, product, weights[product]))
