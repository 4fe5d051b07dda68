"""Storage of stage results with freshness keys.

A stage's folder holds ``data.npz`` (the result), and ``meta.json`` with its freshness key, its configuration and its
seconds. ``meta.json`` is written last, by an atomic rename: a folder without it is unfinished, whatever else lies in
it.
"""

import errno
import fcntl
import hashlib
import json
import os
import shutil
import sys
import time
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from functools import cache
from pathlib import Path
from typing import IO, Any

import numpy as np

from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError, UserError
from corporeal.core.types import KIND_OF, STORED_KINDS, Note, NoteKind
from corporeal.core.version import __version__

META_FILE = "meta.json"
DATA_FILE = "data.npz"
TREE_ARRAY = "tree"
LOCK_FILE = ".lock"
CACHE_VARIABLE = "CORPOREAL_CACHE"
"""Environment variable that names the folder of what is kept outside of runs."""


class DiskError(UserError):
    """The disk refuses what a stage wants to keep."""


@contextmanager
def disk_errors(path: Path) -> Iterator[None]:
    """Turn a failure to write below ``path`` into one clear sentence.

    Raises:
        DiskError: The disk is full, read-only, over a quota or not ours.
    """
    try:
        yield
    except OSError as error:
        reasons = {
            errno.ENOSPC: "the disk is full. Free some space",
            errno.EDQUOT: "the disk quota is used up. Free some space",
            errno.EFBIG: "the file would exceed the allowed size. Raise the limit (ulimit -f)",
            errno.EROFS: "the disk is read-only. Choose another folder with --out",
            errno.EACCES: "permission denied. Choose another folder with --out",
            errno.EPERM: "it is not permitted. Choose another folder with --out",
            errno.ENOTDIR: "a file is in its way. Choose another folder with --out",
            errno.EEXIST: "a file is in its way. Choose another folder with --out",
            errno.ENAMETOOLONG: "its name is too long. Choose another with --name",
        }
        if error.errno not in reasons:
            raise
        raise DiskError(
            f"Cannot write {path}: {reasons[error.errno]}, then run the same command again: finished stages are kept."
        ) from error


def require_disk_space(folder: Path, needed: int) -> None:
    """Reject to begin what the disk cannot hold.

    Args:
        folder: Where it would be written.
        needed: [bytes]

    Raises:
        DiskError: Less than that is free.
    """
    free = shutil.disk_usage(folder).free
    if needed > free:
        raise DiskError(
            f"Cannot write {folder}: {_megabytes(needed)} MB are needed, and {_megabytes(free)} MB "
            "are free. Free some space, choose another folder with --out, or ask for less detail."
        )


def _megabytes(size: int) -> str:
    """Size in megabytes: two figures below ten, which may be all that is missing."""
    return f"{size / 1e6:,.0f}" if size >= 10e6 else f"{size / 1e6:.2g}"


@contextmanager
def lock_folder(folder: Path, patience: float = 0.0) -> Iterator[None]:
    """Keep other processes out of a run's folder; a process that dies lets go of it.

    Args:
        folder: The run's.
        patience: How long to wait for another process to let go of it [s].

    Raises:
        UserError: Another process works in it.
    """
    try:
        with disk_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)
            lock = (folder / LOCK_FILE).open("a+", encoding="utf-8")
    except FileNotFoundError as error:
        what = "no folder can be made there. Choose another one with --out"
        raise DiskError(f"Cannot write {folder}: {what}.") from error
    with lock:
        if not _locked(lock, patience):
            lock.seek(0)
            raise UserError(
                f"Another corporeal (process {lock.read().strip() or 'unknown'}) works in {folder}."
                " Wait until it is done, or choose another folder with --name or --out."
            )
        with disk_errors(folder):
            lock.truncate(0)
            lock.write(str(os.getpid()))
            lock.flush()
        yield


def _locked(lock: IO[str], patience: float) -> bool:
    until = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            if time.monotonic() >= until:
                return False
            time.sleep(0.05)


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file so that it is either whole or absent."""
    with disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".{path.name}.{os.getpid()}.part")
        try:
            with partial.open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """Fill a folder that appears whole or not at all; what was there before goes only then.

    The caller keeps others out of the folder above (``lock_folder``): what a killed process left there is removed.

    Yields:
        An empty folder to write into.
    """
    partial = folder.with_name(f".{folder.name}.part")
    before = folder.with_name(f".{folder.name}.before")
    with disk_errors(folder):
        if before.exists() and not folder.exists():
            before.rename(folder)  # killed between the two renamings below
        for left in (partial, before):
            shutil.rmtree(left, ignore_errors=True)
        partial.mkdir(parents=True)
        try:
            yield partial
            if folder.exists():
                folder.rename(before)
            partial.rename(folder)
        finally:
            shutil.rmtree(partial, ignore_errors=True)
        shutil.rmtree(before, ignore_errors=True)


def write_json(path: Path, value: Any) -> None:
    """Write JSON that any parser reads: no NaN, no infinity."""
    text = json.dumps(to_plain(value), indent=1, ensure_ascii=False, allow_nan=False)
    write_bytes(path, text.encode())


def read_json(path: Path) -> Any:
    """Read JSON.

    Raises:
        BadFileError: The file is damaged.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, OSError) as error:
        raise BadFileError(path, f"cannot be read as JSON ({error}).", "Delete it.") from error


def to_plain(value: Any) -> Any:
    """Turn arrays, enums, paths and dataclasses into what JSON knows; not finite becomes null."""
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: to_plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(k): to_plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [to_plain(v) for v in value]
    return _to_plain_leaf(value)


def _to_plain_leaf(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.name.lower()
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, np.ndarray):
        return to_plain(value.tolist())
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


UNREADABLE = (OSError, ValueError, KeyError, TypeError, EOFError, RuntimeError, zipfile.BadZipFile)
"""What loading a damaged file, or one with other fields, may raise."""


def save(path: Path, value: Any) -> None:
    """Save a value made of the types in ``STORED_KINDS``, containers, arrays and numbers.

    Raises:
        TypeError: A dataclass or an enumeration in it has no kind.
    """
    arrays: dict[str, Any] = {}
    tree = json.dumps(_encode(value, arrays), allow_nan=True)
    with disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".{os.getpid()}.part.npz")
        try:
            np.savez(partial, **{TREE_ARRAY: np.frombuffer(tree.encode(), np.uint8)}, **arrays)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


def load(path: Path) -> Any:
    """Load what ``save`` saved.

    Raises:
        BadFileError: The file is absent or damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            tree = json.loads(bytes(file[TREE_ARRAY]).decode())
            return _decode(tree, file)
    except UNREADABLE as error:
        raise BadFileError(path, f"cannot be read ({error}).", "Delete the folder it is in and run again.") from error


def _encode(value: Any, arrays: dict[str, Any]) -> Any:
    if isinstance(value, np.ndarray):
        name = f"a{len(arrays)}"
        arrays[name] = value
        return {"array": name}
    if is_dataclass(value) and not isinstance(value, type):
        content = {f.name: _encode(getattr(value, f.name), arrays) for f in fields(value)}
        return {"type": _kind(value), "fields": content}
    if isinstance(value, tuple | list):
        return {"list": [_encode(v, arrays) for v in value], "tuple": isinstance(value, tuple)}
    if isinstance(value, dict):
        return {"dict": [[k, _encode(v, arrays)] for k, v in value.items()]}
    if isinstance(value, Enum):
        return {"type": _kind(value), "member": value.name}
    if isinstance(value, Note):
        return {"note": str(value), "kind": value.kind.name, "size_of": value.size_of}
    return {"path": str(value)} if isinstance(value, Path) else {"value": _plain_number(value)}


def _kind(value: Any) -> str:
    kind = KIND_OF.get(type(value))
    if kind is None:
        raise TypeError(f"{type(value).__name__} has no kind in STORED_KINDS, so it is not stored")
    return kind


def _plain_number(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _decode(tree: dict, arrays: Any) -> Any:
    if "value" in tree:
        return tree["value"]
    if "array" in tree:
        return arrays[tree["array"]]
    if "list" in tree:
        items = [_decode(v, arrays) for v in tree["list"]]
        return tuple(items) if tree["tuple"] else items
    if "dict" in tree:
        return {k: _decode(v, arrays) for k, v in tree["dict"]}
    if "path" in tree:
        return Path(tree["path"])
    if "note" in tree:
        return Note(tree["note"], NoteKind[tree["kind"]], tree["size_of"])
    stored: Any = STORED_KINDS[tree["type"]]
    if "member" in tree:
        return stored[tree["member"]]
    return stored(**{k: _decode(v, arrays) for k, v in tree["fields"].items()})


def result_key(stage: str, config: Any, inputs: list[str]) -> str:
    """Name a result by all it depends on: the stage, its configuration, what came before."""
    text = json.dumps([__version__, stage, to_plain(config), inputs], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:20]


def path_digest(path: Path) -> str:
    """Name a file, or a folder's files, by content."""
    files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
    total = hashlib.sha256()
    for file in files:
        total.update(file.name.encode())
        with file.open("rb") as stream:
            while block := stream.read(1 << 20):
                total.update(block)
    return total.hexdigest()[:20]


def cache_folder(kind: str) -> Path:
    """Return where objects of a kind are kept for all runs: as ``CACHE_VARIABLE`` says, or the system's."""
    chosen = os.environ.get(CACHE_VARIABLE)
    if chosen:
        return Path(chosen).expanduser() / kind
    if sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    elif sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "corporeal" / kind


@dataclass(frozen=True)
class ResultMeta:
    """Metadata beside a finished result."""

    key: str = ""
    """Names the result by all it depends on."""
    config: Any = None
    """As plain data."""
    seconds: float = 0.0
    """What it took [s]."""
    version: str = ""
    """Of this package."""
    source: str = ""
    """Names the state of the package's code that made it."""


def read_meta(folder: Path) -> ResultMeta:
    """Read the metadata of the finished result in ``folder``.

    Raises:
        BadFileError: The folder holds no finished result, or the file is damaged.
    """
    data = read_json(folder / META_FILE)
    if not isinstance(data, dict):
        raise BadFileError(folder / META_FILE, "is not the description of a result.", "Remove the folder.")
    return from_plain(ResultMeta, data)


def is_fresh(folder: Path, wanted: str) -> bool:
    """Whether ``folder`` holds the finished result named ``wanted``."""
    return (folder / META_FILE).exists() and read_meta(folder).key == wanted


def finish_result(folder: Path, wanted: str, config: Any, seconds: float) -> None:
    """Declare the folder finished."""
    made = ResultMeta(wanted, config, round(seconds, 3), __version__, source_digest())
    write_json(folder / META_FILE, made)


@cache
def source_digest() -> str:
    """Name the state of this package's code: a digest of all of its files, kernels and data."""
    package = Path(__file__).parents[1]
    total = hashlib.sha256()
    for file in sorted(p for p in package.rglob("*") if p.is_file()):
        if "__pycache__" not in file.parts:
            total.update(f"{file.relative_to(package)}\n{path_digest(file)}\n".encode())
    return total.hexdigest()[:20]


def begin_result(folder: Path) -> None:
    """Declare the folder unfinished."""
    with disk_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / META_FILE).unlink(missing_ok=True)
