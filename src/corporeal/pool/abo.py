"""Candidates from Amazon Berkeley Objects: 7,953 product models, in metres.

Layout, as the archives abo-3dmodels.tar and abo-listings.tar unpack side by side::

    3dmodels/metadata/3dmodels.csv.gz      3dmodel_id, path, …, extent_x, extent_y, extent_z
    3dmodels/original/X/ID.glb
    listings/metadata/listings_X.json.gz   a product a line: 3dmodel_id, product_type, item_name

Source: Collins et al., "ABO: Dataset and Benchmarks for Real-World 3D Object Understanding", CVPR 2022, and the README
files beside the data.
"""

import csv
import gzip
import io
import json
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from corporeal.core.errors import BadFileError, UserError
from corporeal.pool.model_table import ModelRow
from corporeal.pool.pool_candidates import PoolCandidate

ABO_MODELS_TABLE = Path("3dmodels/metadata/3dmodels.csv.gz")
ABO_MODELS_FOLDER = Path("3dmodels/original")
ABO_LISTINGS_FOLDER = Path("listings/metadata")
ABO_UNPACK_HELP = "Unpack abo-3dmodels.tar and abo-listings.tar into one folder, and name that."
ABO_LICENCE = "CC-BY-4.0"
ABO_OLD_LICENCE = "CC-BY-NC-4.0"
"""Of copies from before the terms were eased: what lies beside the data counts."""
BROKEN_FILE_ERRORS = (OSError, EOFError, zlib.error, UnicodeDecodeError, csv.Error)


@dataclass(frozen=True)
class ListedProduct:
    """What a listing says of a model."""

    class_name: str
    title: str


def abo_candidates(root: Path) -> list[PoolCandidate]:
    """Return the models that are there, with their product types as classes, by identifier.

    Raises:
        UserError: The folder has not ABO's layout, or a table in it is broken.
    """
    if not (root / ABO_MODELS_TABLE).is_file():
        raise UserError(f"{root}: {ABO_MODELS_TABLE} is not there. {ABO_UNPACK_HELP}")
    products = _products_by_model(root / ABO_LISTINGS_FOLDER)
    licence = _licence_beside_data(root)
    found = []
    for row in sorted(_table_rows(root / ABO_MODELS_TABLE), key=lambda r: r["3dmodel_id"]):
        file = root / ABO_MODELS_FOLDER / row["path"]
        if file.is_file() and file.resolve().is_relative_to(root.resolve()):
            found.append(_abo_candidate(file, row, products.get(row["3dmodel_id"]), licence))
    return found


def _abo_candidate(file: Path, row: dict[str, str], product: ListedProduct | None, licence: str) -> PoolCandidate:
    title = f"{product.title}, " if product and product.title else ""
    declared = ModelRow(
        class_name=product.class_name if product else "",
        licence=licence,
        attribution=f"{title}Amazon Berkeley Objects (c) Amazon.com",
        source=f"abo:{row['3dmodel_id']}",
        metric=True,
        extent=_row_extent(row),
    )
    return PoolCandidate(file, declared, name=f"abo_{row['3dmodel_id']}")


def _row_extent(row: dict[str, str]) -> float | None:
    try:
        return max(float(row[f"extent_{axis}"]) for axis in "xyz") or None
    except (KeyError, TypeError, ValueError):
        return None


def _table_rows(path: Path) -> list[dict[str, str]]:
    try:
        with gzip.open(path, "rt", encoding="utf-8", newline="") as stream:
            rows = list(csv.DictReader(stream))
    except BROKEN_FILE_ERRORS as problem:
        raise BadFileError(path, f"cannot be read ({problem}).", "Download it again.") from problem
    if rows and not {"3dmodel_id", "path"} <= set(rows[0]):
        raise BadFileError(path, "has no columns '3dmodel_id' and 'path'.", "Download it again.")
    return [r for r in rows if r["3dmodel_id"] and r["path"]]


def _products_by_model(folder: Path) -> dict[str, ListedProduct]:
    """Return what each model is; of one that is listed in many countries the first English word."""
    found: dict[str, ListedProduct] = {}
    for path in sorted(folder.glob("listings_*.json.gz")):
        for item in _listing_lines(path):
            model, words = item.get("3dmodel_id"), _first_english_text(item.get("product_type"))
            if isinstance(model, str) and words and model not in found:
                title = _first_english_text(item.get("item_name"))
                found[model] = ListedProduct(words.replace("_", " ").lower(), title)
    return found


def _listing_lines(path: Path) -> Iterator[dict[str, Any]]:
    try:
        with gzip.open(path) as stream:
            for line in io.TextIOWrapper(stream, encoding="utf-8"):
                if '"3dmodel_id"' in line:
                    yield json.loads(line)
    except (*BROKEN_FILE_ERRORS, ValueError) as problem:
        raise BadFileError(path, f"cannot be read ({problem}).", "Download it again.") from problem


def _first_english_text(values: Any) -> str:
    """Return the first English text of a list in several languages, else the first."""
    texts = [v for v in values or () if isinstance(v, dict) and isinstance(v.get("value"), str)]
    texts.sort(key=lambda v: not str(v.get("language_tag", "en")).startswith("en"))
    return " ".join(texts[0]["value"].split())[:120] if texts else ""


def _licence_beside_data(root: Path) -> str:
    places = (root, root / "3dmodels", root / "listings")
    old = any((p / f"LICENSE-{ABO_OLD_LICENCE}.txt").exists() for p in places)
    new = any((p / f"LICENSE-{ABO_LICENCE}.txt").exists() for p in places)
    return ABO_OLD_LICENCE if old and not new else ABO_LICENCE
