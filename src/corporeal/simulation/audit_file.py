"""Reading and writing of ``audit.json``."""

from pathlib import Path
from typing import TypeVar

from corporeal.core import store
from corporeal.core.audit_data import Audit, RunAudit
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError

AUDIT_FILE = "audit.json"

A = TypeVar("A", bound=Audit)


def write_audit(folder: Path, audit: Audit) -> None:
    """Write an audit into a folder.

    Raises:
        DiskError: It cannot be written.
    """
    store.write_json(folder / AUDIT_FILE, audit)


def read_audit(folder: Path) -> Audit:
    """Read the audit of a simulation from the folder of its frames.

    Raises:
        BadFileError: The file is absent, damaged, or of a version that had other fields.
    """
    return _read(Audit, folder, f"Simulate again: corporeal simulate {folder.parent}.")


def read_run_audit(folder: Path) -> RunAudit:
    """Read the audit of a finished run from the run's folder.

    Raises:
        BadFileError: The file is absent, damaged, or of a version that had other fields.
    """
    return _read(RunAudit, folder, f"Make it again: corporeal report {folder}.")


def _read(kind: type[A], folder: Path, remedy: str) -> A:
    path = folder / AUDIT_FILE
    data = store.read_json(path)
    try:
        return from_plain(kind, data)
    except (ValueError, TypeError, AttributeError) as error:
        raise BadFileError(path, f"is no audit that this version can read ({error}).", remedy) from error
