"""`corporeal assemble`: a settled scene of objects from a pool."""

from dataclasses import dataclass, field
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import tyro

from corporeal.cli.parse import parse
from corporeal.core.errors import UserError
from corporeal.core.terminal import progress_bars, show_table
from corporeal.pool.asset_pool import AssetPool
from corporeal.recognition.readable_names import safe_name
from corporeal.scene.scene_composition import read_certificate, read_composition


def compose_from_pool() -> None:
    """Compose a scene at rest from a pool of models, ready to run.

    Classes and assets are drawn at random, scaled, placed without overlap and dropped to rest; a certificate states the
    remaining drift and overlap, and an interaction is chosen. The folder holds scene.glb (at rest), scene.toml (the
    interaction), certificate.json, composition.json and views/ (posed pictures).

        corporeal assemble --from models/ --classes duck "soda can" --seed 7
        corporeal run scenes/duck-soda_can-7/scene.toml

    `corporeal assemble RUN` instead redoes that stage of a run.
    """
    from corporeal.jobs.job import Job, perform_job
    from corporeal.lab.corpus.assemble_corpus import compose_scene
    from corporeal.pipeline.stages.capture import CaptureConfig
    from corporeal.pipeline.stages.compose import ComposeConfig

    @dataclass(frozen=True)
    class Assemble:
        sources: Annotated[tuple[Path, ...], tyro.conf.arg(name="from", metavar="POOL|FOLDER ...")]
        """A pool, or folders of models, which are indexed first."""
        out: Path = Path("scenes")
        """Folder of all scenes."""
        name: str = ""
        """Name of the scene's folder; by default its classes and seed."""
        compose: ComposeConfig = field(default_factory=ComposeConfig)
        capture: CaptureConfig = field(default_factory=CaptureConfig)

    first = ("from", "classes", "count", "seed", "vlm", "out")
    asked = parse(Assemble, "assemble", compose_from_pool.__doc__, first=first)
    folder = asked.out / (asked.name or _name(asked.compose))
    with progress_bars() as tell:
        pool = _pool(asked.sources, asked.out, tell)
        arguments = {"pool": pool, "config": asked.compose, "capturing": asked.capture}
        perform_job(Job(folder.name, compose_scene, folder, "", arguments), tell("assemble"))
    _show(folder)


def _name(config: Any) -> str:
    what = config.assets or config.classes or ("scene",)
    return safe_name("-".join(w.replace(" ", "_") for w in what))[:60] + f"-{config.seed}"


def _pool(sources: tuple[Path, ...], out: Path, tell: Any) -> AssetPool:
    from corporeal.pool.pool_index import POOL_FILE, index_pool, read_pool

    if len(sources) == 1 and (sources[0] / POOL_FILE).exists():
        return read_pool(sources[0])
    for folder in sources:
        if (folder / POOL_FILE).exists():
            raise UserError(f"{folder} is a pool. Name it alone, or index its folders together.")
    return index_pool(sources, out / "pool", progress=tell("index"))


def _show(folder: Path) -> None:
    made, certificate = read_composition(folder), read_certificate(folder)
    rows = [(o.name, o.asset, _length(o.real_extent_m), o.said_by, _length(o.extent_m)) for o in made.objects]
    show_table(("object", "asset", "real size", "size from", "size in the scene"), rows)
    for warning in made.warnings:
        print(f"! {warning}")
    print(f"Arrangement: {made.arrangement}. Interaction: {made.what_happens}.")
    print(
        f"At rest: drift {1e3 * certificate.drift_m:.2g} mm in one second, largest overlap of "
        f"meshes {1e3 * certificate.penetration_m:.2g} mm; {_attempts(certificate.attempts)}, "
        f"{certificate.seconds:.1f} s."
    )
    print(f"Next: corporeal run {quote(str(folder / 'scene.toml'))}")


def _attempts(count: int) -> str:
    return "first attempt" if count == 1 else f"{count} attempts"


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 else f"{100 * metres:.3g} cm"
