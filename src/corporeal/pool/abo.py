"""Amazon Berkeley Objects as candidates: 7,953 product models, in metres.

Layout, as the archives abo-3dmodels.tar and abo-listings.tar unpack side by side::

    3dmodels/metadata/3dmodels.csv.gz      3dmodel_id, path, …, extent_x, extent_y, extent_z
    3dmodels/original/X/ID.glb
    listings/metadata/listings_X.json.gz   a product a line: 3dmodel_id, product_type, item_name

Source: Collins et al., "ABO: Dataset and Benchmarks for Real-World 3D Object Understanding", CVPR
2022, and the README files beside the data.
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
from corporeal.pool.candidate import Candidate
from corporeal.pool.table import Row

MODELS = Path("3dmodels/metadata/3dmodels.csv.gz")
ORIGINAL = Path("3dmodels/original")
LISTINGS = Path("listings/metadata")
UNPACK = "Unpack abo-3dmodels.tar and abo-listings.tar into one folder, and name that."
LICENCE = "CC-BY-4.0"
OLD_LICENCE = "CC-BY-NC-4.0"
"""Of copies from before the terms were eased: what lies beside the data counts."""
BROKEN = (OSError, EOFError, zlib.error, UnicodeDecodeError, csv.Error)


@dataclass(frozen=True)
class Product:
    """What a listing says of a model."""

    class_name: str
    title: str


def candidates(root: Path) -> list[Candidate]:
    """Return the models that are there, with their product types as classes, by identifier.

    Raises:
        UserError: The folder has not ABO's layout, or a table in it is broken.

    """
    if not (root / MODELS).is_file():
        raise UserError(f"{root}: {MODELS} is not there. {UNPACK}")
    products = _products(root / LISTINGS)
    licence = _licence(root)
    found = []
    for row in sorted(_rows(root / MODELS), key=lambda r: r["3dmodel_id"]):
        file = root / ORIGINAL / row["path"]
        if file.is_file() and file.resolve().is_relative_to(root.resolve()):
            found.append(_candidate(file, row, products.get(row["3dmodel_id"]), licence))
    return found


def _candidate(file: Path, row: dict[str, str], product: Product | None, licence: str) -> Candidate:
    title = f"{product.title}, " if product and product.title else ""
    declared = Row(
        class_name=product.class_name if product else "",
        licence=licence,
        attribution=f"{title}Amazon Berkeley Objects (c) Amazon.com",
        source=f"abo:{row['3dmodel_id']}",
        metric=True,
        extent=_extent(row),
    )
    return Candidate(file, declared, name=f"abo_{row['3dmodel_id']}")


def _extent(row: dict[str, str]) -> float | None:
    try:
        return max(float(row[f"extent_{axis}"]) for axis in "xyz") or None
    except (KeyError, TypeError, ValueError):
        return None


def _rows(path: Path) -> list[dict[str, str]]:
    try:
        with gzip.open(path, "rt", encoding="utf-8", newline="") as stream:
            rows = list(csv.DictReader(stream))
    except BROKEN as problem:
        raise BadFileError(path, f"cannot be read ({problem}).", "Download it again.") from problem
    if rows and not {"3dmodel_id", "path"} <= set(rows[0]):
        raise BadFileError(path, "has no columns '3dmodel_id' and 'path'.", "Download it again.")
    return [r for r in rows if r["3dmodel_id"] and r["path"]]


def _products(folder: Path) -> dict[str, Product]:
    """Return what each model is; of one that is listed in many countries the first English word."""
    found: dict[str, Product] = {}
    for path in sorted(folder.glob("listings_*.json.gz")):
        for item in _lines(path):
            model, words = item.get("3dmodel_id"), _first(item.get("product_type"))
            if isinstance(model, str) and words and model not in found:
                title = _first(item.get("item_name"))
                found[model] = Product(words.replace("_", " ").lower(), title)
    return found


def _lines(path: Path) -> Iterator[dict[str, Any]]:
    try:
        with gzip.open(path) as stream:
            for line in io.TextIOWrapper(stream, encoding="utf-8"):
                if '"3dmodel_id"' in line:
                    yield json.loads(line)
    except (*BROKEN, ValueError) as problem:
        raise BadFileError(path, f"cannot be read ({problem}).", "Download it again.") from problem


def _first(values: Any) -> str:
    """Return the first English text of a list in several languages, else the first."""
    texts = [v for v in values or () if isinstance(v, dict) and isinstance(v.get("value"), str)]
    texts.sort(key=lambda v: not str(v.get("language_tag", "en")).startswith("en"))
    return " ".join(texts[0]["value"].split())[:120] if texts else ""


def _licence(root: Path) -> str:
    places = (root, root / "3dmodels", root / "listings")
    old = any((p / f"LICENSE-{OLD_LICENCE}.txt").exists() for p in places)
    new = any((p / f"LICENSE-{LICENCE}.txt").exists() for p in places)
    return OLD_LICENCE if old and not new else LICENCE
