"""``export.json``: written files, unsupported features, errors."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError
from corporeal.core.version import __version__

RECORD_FILE_NAME = "export.json"


@dataclass(frozen=True)
class TargetRecord:
    """One target of one export."""

    at_s: float
    """The exported instant [s]."""
    files: tuple[str, ...] = ()
    """From the folder of ``export.json``."""
    unsaid: tuple[str, ...] = ()
    """What the format could not say, in sentences."""
    measured: Mapping[str, float] = field(default_factory=dict)
    """By how much it is off."""
    checked: Mapping[str, float] = field(default_factory=dict)
    """What real readers found in the files; empty: they were not asked."""
    doubts: tuple[str, ...] = ()
    """What real readers complained of, or why they were not asked."""
    skipped: str = ""
    """Why nothing was written; "": something was."""
    version: str = __version__
    """Of corporeal."""


@dataclass(frozen=True)
class ExportRecord:
    """All targets in one folder, the newest of each."""

    source: str
    """The run or the scene."""
    unsaid: tuple[str, ...] = ()
    """What no format could say."""
    targets: Mapping[str, TargetRecord] = field(default_factory=dict)


def write_record(folder: Path, record: ExportRecord) -> Path:
    """Write ``export.json``; targets of earlier exports of the same source are kept in it."""
    path = folder / RECORD_FILE_NAME
    before = read_record(path) if path.exists() else record
    if before.source == record.source:
        kept = {name: row for name, row in before.targets.items() if (folder / name).exists()}
        record = ExportRecord(record.source, record.unsaid, kept | dict(record.targets))
    store.write_json(path, record)
    return path


def read_record(path: Path) -> ExportRecord:
    """Read ``export.json``.

    Raises:
        BadFileError: It is damaged.

    """
    found = store.read_json(path)
    try:
        return from_plain(ExportRecord, found)
    except (ValueError, TypeError, AttributeError) as error:
        raise BadFileError(
            path, f"is not a record of an export ({error}).", "Delete it."
        ) from error
