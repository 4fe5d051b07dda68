"""Make a pool of folders of models, and read it back.

A pool is a folder with ``pool.json`` (assets, and rejections with reasons), ``verdicts.jsonl``
(the gate's verdict on each content, so that no content is judged twice) and ``models/`` (copies of
what had to be cleaned, decimated or converted).
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Literal

from corporeal.core import store
from corporeal.core.errors import BadFileError, UserError
from corporeal.core.progress import Progress, no_progress
from corporeal.io.load_model import readable_model_formats
from corporeal.pool import abo, objaverse
from corporeal.pool.asset_pool import AssetPool, PoolAsset, PoolRejection
from corporeal.pool.gate_verdicts import GateVerdicts
from corporeal.pool.pool_admission import PoolAdmission, PoolMember
from corporeal.pool.pool_candidates import PoolCandidate, candidates_in
from corporeal.pool.quality_gate import GateConfig
from corporeal.recognition.readable_names import single_line_text

CandidateOrigin = Literal["folders", "objaverse", "abo"]


@dataclass(frozen=True)
class OriginConfig:
    """What the folders are, and what is declared about the files in them."""

    origin: CandidateOrigin = "folders"
    """Plain folders, the cache of the package objaverse, or Amazon Berkeley Objects."""
    csv: Path | None = None
    """Of plain folders: table with columns file, class and, where known, licence, attribution, extent_m, metric."""
    wanted: objaverse.WantedModels = field(default_factory=objaverse.WantedModels)


def find_candidates(folders: Sequence[Path], config: OriginConfig, pool: Path) -> list[PoolCandidate]:
    """Return what asks to be let into the pool.

    Raises:
        UserError: There is nothing, or a folder, table or collection cannot be used.
    """
    if config.origin == "folders":
        found = candidates_in(folders, config.csv, pool)
    elif config.origin == "abo":
        found = [c for folder in folders for c in abo.abo_candidates(folder)]
    else:
        found = _of_objaverse(folders, config.wanted)
    if not found:
        named = ", ".join(map(str, folders)) or str(objaverse.OBJAVERSE_CACHE)
        raise UserError(f"{named}: no model ({readable_model_formats()}) lies there or below.")
    return found


def _of_objaverse(folders: Sequence[Path], wanted: objaverse.WantedModels) -> list[PoolCandidate]:
    """Return what the caches hold; of the wanted categories only, where some are named."""
    if wanted.classes and not folders:
        folders = [objaverse.fetch_objaverse(wanted)]
    found = [c for cache in folders or [None] for c in objaverse.objaverse_candidates(cache)]
    names = {objaverse.category_words(c) for c in wanted.classes}
    return [c for c in found if not names or c.declared.class_name in names]


POOL_FILE = "pool.json"
INDEX_POOL_AGAIN = "Make it again: corporeal assets index FOLDER --pool POOL."


@dataclass(frozen=True)
class IndexConfig:
    """What is declared about the files, and how good they must be."""

    origin: OriginConfig = field(default_factory=OriginConfig)
    gate: GateConfig = field(default_factory=GateConfig)


DEFAULT_INDEX_CONFIG = IndexConfig()


def index_pool(
    folders: Sequence[Path],
    pool_folder: Path,
    config: IndexConfig = DEFAULT_INDEX_CONFIG,
    progress: Progress = no_progress,
) -> AssetPool:
    """Judge every model below the folders and keep the good ones in the pool.

    What other files gave the pool before stays in it as long as they are there. A content that was judged before, with
    the same gate, is not judged again; an interrupted run goes on where it was.

    Args:
        folders: Hold models (glTF or meshes), at any depth, or a collection.
        pool_folder: Made where it is absent.
        config: What the folders are, who says the classes, how good a model must be.
        progress: Called with the fraction done and the file.

    Raises:
        UserError: A folder is absent, a table cannot be used, or another process works here.
    """
    folders = [Path(f) for f in folders]
    with store.lock_folder(pool_folder):
        asking = find_candidates(folders, config.origin, pool_folder)
        verdicts = GateVerdicts(pool_folder, config.gate)
        admission = _former_assets(pool_folder, asking)
        for k, candidate in enumerate(asking):
            progress(k / len(asking), single_line_text(candidate.file.name))
            admission.ask(candidate, verdicts.of(candidate.file))
        progress(1.0, "")
        _write_pool(pool_folder, admission)
        return read_pool(pool_folder)


def read_pool(folder: Path) -> AssetPool:
    """Read a pool.

    Raises:
        UserError: There is none in the folder, or its index is damaged.
    """
    members, rejections = _read_index(Path(folder))
    assets = sorted((m.asset for m in members), key=lambda a: (a.class_name, a.name))
    return AssetPool(Path(folder), tuple(assets), tuple(rejections))


def _former_assets(pool: Path, asking: Sequence[PoolCandidate]) -> PoolAdmission:
    """Return what else the pool has, as far as it is still there."""
    if not (pool / POOL_FILE).exists():
        return PoolAdmission(pool, (), ())
    members, rejections = _read_index(pool)
    again = {c.file.resolve() for c in asking}

    def stays(path: Path) -> bool:
        return path.exists() and path.resolve() not in again

    return PoolAdmission(
        pool,
        (m for m in members if stays(m.found) and m.asset.file.exists()),
        (r for r in rejections if stays(Path(r.source))),
    )


def _write_pool(pool: Path, admission: PoolAdmission) -> None:
    value = {
        "assets": [
            asdict(m.asset)
            | {"file": _path_in_index(pool, m.asset.file)}
            | {"found": m.found, "mesh": m.mesh, "look": m.look}
            for m in admission.members
        ],
        "rejections": [asdict(r) for r in admission.rejections],
    }
    store.write_json(pool / POOL_FILE, value)


def _path_in_index(pool: Path, file: Path) -> str:
    """Return a path as the index has it: what is the pool's own moves with it."""
    return str(file.relative_to(pool)) if file.is_relative_to(pool) else str(file)


def _read_index(pool: Path) -> tuple[list[PoolMember], list[PoolRejection]]:
    path = pool / POOL_FILE
    if not path.exists():
        raise UserError(f"{pool}: there is no asset pool. {INDEX_POOL_AGAIN}")
    kept = store.read_json(path)
    try:
        return (
            [_pool_member(pool, dict(entry)) for entry in kept["assets"]],
            [PoolRejection(**entry) for entry in kept["rejections"]],
        )
    except (KeyError, TypeError, ValueError) as problem:
        words = f"is no index of an asset pool ({type(problem).__name__}: {problem})."
        raise BadFileError(path, words, f"Delete it. {INDEX_POOL_AGAIN}") from problem


def _pool_member(pool: Path, entry: dict) -> PoolMember:
    found, mesh, look = (entry.pop(key) for key in ("found", "mesh", "look"))
    return PoolMember(PoolAsset(**entry | {"file": pool / entry["file"]}), Path(found), mesh, look)
