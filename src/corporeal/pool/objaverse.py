"""Candidates from Objaverse 1.0: cached or downloaded by its package.

Layout of the cache, ``~/.objaverse/hf-objaverse-v1``, as the package ``objaverse`` writes it::

    object-paths.json.gz         uid → "glbs/000-023/<uid>.glb"
    lvis-annotations.json.gz     LVIS category → [uid, …], 46,207 models in 1,156 categories
    metadata/000-023.json.gz     uid → name, license, user, viewerUrl, …
    glbs/000-023/<uid>.glb

Models are in units of their makers. Source: Deitke et al., "Objaverse: A Universe of Annotated 3D Objects", CVPR 2023.
"""

import gzip
import importlib
import json
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from corporeal.core.errors import BadFileError, UserError
from corporeal.pool.model_table import ModelRow
from corporeal.pool.pool_candidates import PoolCandidate
from corporeal.recognition.readable_names import single_line_text

OBJAVERSE_CACHE = Path("~/.objaverse/hf-objaverse-v1")
OBJAVERSE_PATHS_FILE = "object-paths.json.gz"
OBJAVERSE_LVIS_FILE = "lvis-annotations.json.gz"
INSTALL_OBJAVERSE = "Install it: pip install 'corporeal[objaverse]'."
OBJAVERSE_LICENCES = {
    "by": "CC-BY-4.0",
    "by-nc": "CC-BY-NC-4.0",
    "by-nc-sa": "CC-BY-NC-SA-4.0",
    "by-sa": "CC-BY-SA-4.0",
    "cc0": "CC0-1.0",
}
"""Short names in the annotations → what they stand for (the data set's own list)."""


@dataclass(frozen=True)
class WantedModels:
    """Which models."""

    classes: tuple[str, ...] = ()
    """LVIS categories, as words ("coffee mug"); none: what is there already."""
    per_class: int = 10
    """Models of each."""


def objaverse_candidates(cache: Path | None = None) -> list[PoolCandidate]:
    """Return the models that lie in the cache, by LVIS category, then by identifier.

    Raises:
        UserError: There is no such cache, or a file in it is broken.
    """
    root = (cache or OBJAVERSE_CACHE).expanduser()
    if not (root / OBJAVERSE_PATHS_FILE).is_file():
        raise UserError(
            f"{root}: {OBJAVERSE_PATHS_FILE} is not there. Name the cache of the package objaverse, or let it "
            "be downloaded: corporeal assets index --from objaverse --classes mug chair."
        )
    paths = _read_gzip_json(root / OBJAVERSE_PATHS_FILE)
    lvis = _read_gzip_json(root / OBJAVERSE_LVIS_FILE) if (root / OBJAVERSE_LVIS_FILE).is_file() else {}
    class_of = {uid: category_words(category) for category, uids in lvis.items() for uid in uids}
    files = {uid: root / path for uid, path in paths.items() if (root / path).is_file()}
    notes = _annotations(root, files)
    order = sorted(files, key=lambda uid: (class_of.get(uid, ""), uid))
    return [_objaverse_candidate(uid, files[uid], class_of.get(uid, ""), notes.get(uid, {})) for uid in order]


def fetch_objaverse(wanted: WantedModels) -> Path:
    """Have the package download the models of some categories into its cache; return the cache.

    Raises:
        UserError: The package is not installed, the network fails, or a category is unknown.
    """
    try:
        package: Any = importlib.import_module("objaverse")
    except ImportError:
        raise UserError(f"The package objaverse is not installed. {INSTALL_OBJAVERSE}") from None
    try:
        uids = choose_models(package.load_lvis_annotations(), wanted)
        package.load_annotations(uids)
        package.load_objects(uids)
    except OSError as problem:
        raise UserError(
            f"Objaverse cannot be downloaded ({problem}). Check the network, or index what is "
            f"there: corporeal assets index {OBJAVERSE_CACHE} --from objaverse."
        ) from problem
    return OBJAVERSE_CACHE.expanduser()


def choose_models(lvis: dict[str, list[str]], wanted: WantedModels) -> list[str]:
    """Return the identifiers of the first models of each category wanted.

    Raises:
        UserError: A category is unknown.
    """
    known = {category_words(category): uids for category, uids in lvis.items()}
    chosen = []
    for name in wanted.classes:
        if category_words(name) not in known:
            near = [k for k in sorted(known) if category_words(name) in k or k in category_words(name)]
            advice = f"Did you mean: {', '.join(near[:8])}?" if near else "See lvisdataset.org."
            raise UserError(f"Objaverse has no LVIS category {name!r}. {advice}")
        chosen += sorted(known[category_words(name)])[: wanted.per_class]
    return chosen


def category_words(category: str) -> str:
    """Return a category in words: "mouse (computer equipment)" for "mouse_(computer_equipment)"."""
    return " ".join(category.replace("_", " ").split()).lower()


def _objaverse_candidate(uid: str, file: Path, class_name: str, note: dict) -> PoolCandidate:
    declared = ModelRow(
        class_name=class_name,
        licence=OBJAVERSE_LICENCES.get(str(note.get("license")), str(note.get("license") or "")),
        attribution=single_line_text(_attribution(note)),
        source=single_line_text(str(note.get("viewerUrl") or f"objaverse:{uid}")),
        metric=False,
    )
    return PoolCandidate(file, declared, name=f"{class_name or 'objaverse'} {uid[:8]}")


def _attribution(note: dict) -> str:
    author = note.get("user")
    user = author if isinstance(author, dict) else {}
    author = str(user.get("displayName") or user.get("username") or "")
    title = str(note.get("name") or "")
    named = f"{title} by {author}" if title and author else title or author
    return f"{named} ({note['viewerUrl']})" if named and note.get("viewerUrl") else named


def _annotations(root: Path, files: dict[str, Path]) -> dict[str, dict]:
    """Return what is known of the models; each folder of models has one file of annotations."""
    found: dict[str, dict] = {}
    for part in sorted({file.parent.name for file in files.values()}):
        path = root / "metadata" / f"{part}.json.gz"
        if path.is_file():
            notes = _read_gzip_json(path)
            found |= {u: n for u, n in notes.items() if u in files and isinstance(n, dict)}
    return found


def _read_gzip_json(path: Path) -> dict[str, Any]:
    try:
        with gzip.open(path, "rt", encoding="utf-8") as stream:
            value = json.load(stream)
    except (OSError, EOFError, zlib.error, ValueError) as problem:
        step = "Delete it; it is downloaded again."
        raise BadFileError(path, f"cannot be read ({problem}).", step) from problem
    if not isinstance(value, dict):
        raise BadFileError(path, "is not an Objaverse file.", "Delete it.")
    return value
