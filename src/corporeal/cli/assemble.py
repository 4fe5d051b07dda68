"""`corporeal assemble`: a settled scene of things from a pool."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from corporeal.cli.parse import parse
from corporeal.errors import UserError
from corporeal.formats.words import safe
from corporeal.pool.asset import Pool
from corporeal.store import read_json
from corporeal.terminal import show_table, told


def compose_from_pool() -> None:
    """Assemble a settled scene of things from a pool, ready to run.

    Draws classes and things, sizes them, places them free of each other, lets them settle, proves
    that they rest, and gives the scene something to happen. The folder holds scene.glb (at rest),
    scene.toml (what happens), certificate.json, composition.json and views/ (posed pictures).

        corporeal assemble --from models/ --classes duck "soda can" --seed 7
        corporeal run scenes/duck-soda_can-7/scene.toml

    `corporeal assemble RUN` instead redoes that verb of a run.
    """
    from corporeal.corpus.assemble import compose_scene
    from corporeal.corpus.jobs import Job, perform
    from corporeal.stages.capture import CaptureConfig
    from corporeal.stages.compose import ComposeConfig

    @dataclass(frozen=True)
    class Assemble:
        sources: Annotated[tuple[Path, ...], tyro.conf.arg(name="from", metavar="POOL|FOLDER ...")]
        """A pool, or folders of models: those are made a pool first."""
        out: Path = Path("scenes")
        """Folder that holds the scenes."""
        name: str = ""
        """The scene's own folder inside; by default its classes and seed."""
        compose: ComposeConfig = field(default_factory=ComposeConfig)
        capture: CaptureConfig = field(default_factory=CaptureConfig)

    asked = parse(Assemble, "assemble", compose_from_pool.__doc__)
    folder = asked.out / (asked.name or _name(asked.compose))
    with told() as tell:
        pool = _pool(asked.sources, asked.out, tell)
        arguments = {"pool": pool, "config": asked.compose, "capturing": asked.capture}
        perform(Job(folder.name, compose_scene, folder, "", arguments), tell("assemble"))
    _show(folder)


def _name(config: Any) -> str:
    what = config.assets or config.classes or ("scene",)
    return safe("-".join(w.replace(" ", "_") for w in what))[:60] + f"-{config.seed}"


def _pool(sources: tuple[Path, ...], out: Path, tell: Any) -> Pool:
    from corporeal.pool.index import POOL, index, read_pool

    if len(sources) == 1 and (sources[0] / POOL).exists():
        return read_pool(sources[0])
    for folder in sources:
        if (folder / POOL).exists():
            raise UserError(f"{folder} is a pool. Name it alone, or index its folders together.")
    return index(sources, out / "pool", progress=tell("index"))


def _show(folder: Path) -> None:
    made = read_json(folder / "composition.json")
    proof = read_json(folder / "certificate.json")
    rows = [
        (o["name"], o["asset"], _length(o["real_extent_m"]), o["said_by"], _length(o["extent_m"]))
        for o in made["objects"]
    ]
    show_table(("object", "asset", "real size", "said by", "size in the scene"), rows)
    for warning in made["warnings"]:
        print(f"! {warning}")
    print(f"Stands as a {made['arrangement']}. What happens: {made['what_happens']}.")
    print(
        f"At rest: moves {1e3 * proof['drift_m']:.2g} mm in a second, meshes overlap by at most "
        f"{1e3 * proof['penetration_m']:.2g} mm; {_attempts(proof['attempts'])}, "
        f"{proof['seconds']:.1f} s."
    )
    print(f"Go on with: corporeal run {folder / 'scene.toml'}")


def _attempts(count: int) -> str:
    return "first attempt" if count == 1 else f"{count} attempts"


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 else f"{100 * metres:.3g} cm"
