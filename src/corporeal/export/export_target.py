"""Interface and registry of writers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Protocol

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError, UserError
from corporeal.core.version import __version__
from corporeal.export.exported_solids import PhysicalScene
from corporeal.export.scene_motion import SceneMotion
from corporeal.io.registry import Writer
from corporeal.simulation.simulation_result import SimulationResult

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
        raise BadFileError(path, f"is not a record of an export ({error}).", "Delete it.") from error


ExportTarget = Literal["usd", "mjcf", "urdf", "glb", "splats", "h5", "npz", "abc"]
SoftRepresentation = Literal["particles", "tetrahedra", "none"]
TargetEngine = Literal["physx", "newton-vbd", "newton-xpbd", "mujoco"]

_CHECKS, _ARRAYS = "corporeal.export.check_exports", "corporeal.export.particle_h5_npz_writer"
_WRITERS = (
    Writer("usd", "corporeal.export.usd_writer:write_usd", f"{_CHECKS}:check_usd", "pxr"),
    Writer("mjcf", "corporeal.export.mjcf_writer:write_mjcf", f"{_CHECKS}:check_mjcf"),
    Writer("urdf", "corporeal.export.urdf_writer:write_urdf", f"{_CHECKS}:check_urdf"),
    Writer("glb", "corporeal.export.animated_glb_writer:write_animated_glb", f"{_CHECKS}:check_glb"),
    Writer("splats", "corporeal.export.usd_splats:write_splat_sequence", f"{_CHECKS}:check_splats"),
    Writer("h5", f"{_ARRAYS}:write_h5", f"{_CHECKS}:check_h5", "h5py", f"{_ARRAYS}:save_h5"),
    Writer("npz", f"{_ARRAYS}:write_npz", f"{_CHECKS}:check_without_reader", write_dataset=f"{_ARRAYS}:save_npz"),
    Writer("abc", "corporeal.export.alembic_writer:write_alembic", f"{_CHECKS}:check_alembic", "alembic3d"),
)
EXPORT_WRITERS: dict[str, Writer] = {writer.name: writer for writer in _WRITERS}
"""Target → its writer, which is a ``TargetWriter``."""


@dataclass(frozen=True)
class ExportConfig:
    """What is exported, and how closely."""

    at: str = "start"
    """The instant that simulators start from: start, end, or seconds."""
    soft: SoftRepresentation = "particles"
    """How simulators get what can deform: material points (USD), tetrahedra (USD, MJCF), or not at all. MJCF knows no
    material points and takes tetrahedra for them."""
    tolerance: float = 1e-3
    """Largest error of a vertex in the GLB video [m]."""
    friction_for: TargetEngine = "physx"
    """Whose rule makes one friction of two where a format has no pairs."""
    hull_vertices: int = 0
    """Largest number of corners of a convex collider in USD, 64 for PhysX on a GPU: hulls of more are enclosed in
    coarser ones. 0: hulls stay as they are, so that what is settled stays put.
    """
    check: bool = False
    """Open the files again with real readers and measure what they hold."""


DEFAULT_EXPORT = ExportConfig()


@dataclass(frozen=True)
class ExportRequest:
    """One scene to be written; its motion where it has any."""

    scene: PhysicalScene
    motion: SceneMotion
    config: ExportConfig
    played: SimulationResult | None = None
    """The run; None: a scene before any simulation."""


@dataclass(frozen=True)
class WrittenTarget:
    """What a writer says of its files."""

    unsaid: tuple[str, ...] = ()
    """What the format could not say, in sentences."""
    measured: dict[str, float] = field(default_factory=dict)
    """By how much it is off: misfit of friction [-], error of vertices [m], modes."""


class NothingToWriteError(UserError):
    """The scene holds nothing that a format is for; other targets are written all the same."""


class TargetWriter(Protocol):
    """Writes one target into a folder that is there and empty."""

    def __call__(self, asked: ExportRequest, folder: Path) -> WrittenTarget:
        """Write the files.

        Raises:
            NothingToWriteError: The scene has nothing that this format is for.
            UserError: A setting makes no sense.
        """
        ...
