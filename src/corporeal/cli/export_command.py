"""`corporeal export`: a run in the formats of other tools."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from corporeal.cli.parse import parse
from corporeal.core.terminal import progress_bars

MAX_LISTED_FILES = 6
"""At most this many files of one target are listed."""


def command_export() -> None:
    """Write a run for other tools: OpenUSD, MuJoCo, URDF, animated GLB, splats, HDF5, Alembic.

        corporeal export runs/duck-on-mud --to usd mjcf glb

    SOURCE is the folder of a run; or a scene that is not simulated yet, as `corporeal run` takes it; or a corpus that
    was run. Each target has its own folder in RUN/export; export.json lists what a format cannot represent, and the
    errors. h5, abc and --check need the extra export: pip install 'corporeal[export]'.
    """
    from corporeal.export.export_scene import DEFAULT_TARGETS, export_scene
    from corporeal.export.export_target import ExportConfig, ExportTarget

    @dataclass(frozen=True)
    class Export:
        source: Annotated[
            Path,
            tyro.conf.Positional,
            tyro.conf.arg(metavar="SOURCE", help="The folder of a run, a scene, or a corpus."),
        ]
        to: tuple[ExportTarget, ...] = DEFAULT_TARGETS
        """Target formats."""
        out: Path | None = None
        """Output folder; by default RUN/export."""
        config: ExportConfig = field(default_factory=ExportConfig)

    first = ("to", "at", "soft", "check", "out", "friction-for")
    asked = parse(Export, "export", command_export.__doc__, first=first)
    with progress_bars() as tell:
        record = export_scene(asked.source, asked.to, asked.out, asked.config, tell("export"))
    for name, row in record.targets.items():
        print(f"{name}: {row.skipped or ', '.join(_main(row.files))}")
        for sentence in row.doubts:
            print(f"  {sentence}")
        for what, value in row.checked.items():
            print(f"  {what} {value:.3g}")


def _main(files: tuple[str, ...]) -> list[str]:
    """Return the main files of a target, without those below them."""
    first = [f for f in files if f.count("/") == 1]
    return (
        first
        if len(first) <= MAX_LISTED_FILES
        else [*first[:MAX_LISTED_FILES], f"… {len(first) - MAX_LISTED_FILES} more"]
    )
