"""Make a pool of folders of models, and read it back.

A pool is a folder with ``pool.json`` (assets, and rejections with reasons), ``verdicts.jsonl``
(the gate's verdict on each content, so that no content is judged twice) and ``models/`` (copies of
what had to be cleaned, decimated or converted).
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import BadFileError, UserError
from corporeal.pool.admission import Admission, Member
from corporeal.pool.asset import Asset, Pool, Rejection
from corporeal.pool.candidate import Candidate
from corporeal.pool.gate import GateConfig
from corporeal.pool.origins import OriginConfig, candidates
from corporeal.pool.verdict import Verdicts
from corporeal.recognition.words import writable

POOL = "pool.json"
INDEX_AGAIN = "Make it again: corporeal assets index FOLDER --pool POOL."
Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class IndexConfig:
    """What is declared about the files, and how good they must be."""

    origin: OriginConfig = field(default_factory=OriginConfig)
    gate: GateConfig = field(default_factory=GateConfig)


DEFAULT = IndexConfig()


def index(
    folders: Sequence[Path],
    pool_folder: Path,
    config: IndexConfig = DEFAULT,
    progress: Progress = lambda fraction, words: None,
) -> Pool:
    """Judge every model below the folders and keep the good ones in the pool.

    What other files gave the pool before stays in it as long as they are there. A content that was
    judged before, with the same gate, is not judged again; an interrupted run goes on where it was.

    Args:
        folders: Hold .glb, .gltf and .obj files, at any depth, or a collection.
        pool_folder: Made where it is absent.
        config: What the folders are, who says the classes, how good a model must be.
        progress: Told the fraction done and the file.

    Raises:
        UserError: A folder is absent, a table cannot be used, or another process works here.

    """
    folders = [Path(f) for f in folders]
    with store.alone(pool_folder):
        asking = candidates(folders, config.origin, pool_folder)
        verdicts = Verdicts(pool_folder, config.gate)
        admission = _reopened(pool_folder, asking)
        for k, candidate in enumerate(asking):
            progress(k / len(asking), writable(candidate.file.name))
            admission.ask(candidate, verdicts.of(candidate.file))
        progress(1.0, "")
        _write(pool_folder, admission)
        return read_pool(pool_folder)


def read_pool(folder: Path) -> Pool:
    """Read a pool.

    Raises:
        UserError: There is none in the folder, or its index is damaged.

    """
    members, rejections = _read(Path(folder))
    assets = sorted((m.asset for m in members), key=lambda a: (a.class_name, a.name))
    return Pool(Path(folder), tuple(assets), tuple(rejections))


def _reopened(pool: Path, asking: Sequence[Candidate]) -> Admission:
    """Return what else the pool has, as far as it is still there."""
    if not (pool / POOL).exists():
        return Admission(pool, (), ())
    members, rejections = _read(pool)
    again = {c.file.resolve() for c in asking}

    def stays(path: Path) -> bool:
        return path.exists() and path.resolve() not in again

    return Admission(
        pool,
        (m for m in members if stays(m.found) and m.asset.file.exists()),
        (r for r in rejections if stays(Path(r.source))),
    )


def _write(pool: Path, admission: Admission) -> None:
    value = {
        "assets": [
            asdict(m.asset)
            | {"file": _kept(pool, m.asset.file)}
            | {"found": m.found, "mesh": m.mesh, "look": m.look}
            for m in admission.members
        ],
        "rejections": [asdict(r) for r in admission.rejections],
    }
    store.write_json(pool / POOL, value)


def _kept(pool: Path, file: Path) -> str:
    """Return a path as it stands in the index: what is the pool's own moves with it."""
    return str(file.relative_to(pool)) if file.is_relative_to(pool) else str(file)


def _read(pool: Path) -> tuple[list[Member], list[Rejection]]:
    path = pool / POOL
    if not path.exists():
        raise UserError(f"{pool}: there is no asset pool. {INDEX_AGAIN}")
    kept = store.read_json(path)
    try:
        return (
            [_member(pool, dict(entry)) for entry in kept["assets"]],
            [Rejection(**entry) for entry in kept["rejections"]],
        )
    except (KeyError, TypeError, ValueError) as problem:
        words = f"is no index of an asset pool ({type(problem).__name__}: {problem})."
        raise BadFileError(path, words, f"Delete it. {INDEX_AGAIN}") from problem


def _member(pool: Path, entry: dict) -> Member:
    found, mesh, look = (entry.pop(key) for key in ("found", "mesh", "look"))
    return Member(Asset(**entry | {"file": pool / entry["file"]}), Path(found), mesh, look)
