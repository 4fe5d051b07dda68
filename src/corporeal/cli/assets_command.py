"""`corporeal assets index | list | show | props`: pools of models that scenes are composed of."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from shlex import quote
from typing import Annotated

import tyro

from corporeal.cli.parse import parse, run_subcommand
from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.core.terminal import progress_bars, show_table
from corporeal.pool.asset_pool import AssetPool, PoolAsset

DEFAULT_POOL = Path("pool")
Folder = Annotated[Path, tyro.conf.arg(metavar="POOL")]


def command_assets() -> None:
    """Manage a pool of models: `assets index FOLDER ...`, `list`, `show`."""
    verbs = {"index": _index, "list": _list, "show": _show, "props": _props}
    run_subcommand("assets", verbs)


def _index() -> None:
    """Check every model below the folders, and add those that pass to a pool.

    A model is a glTF or a mesh file. Its class is what a table says (--csv, or a manifest.csv
    in the folder or above it), else the folder it lies in, else its own name. A rejected file gets
    a reason. Models that were checked before are not checked again.
    """
    from corporeal.pool.objaverse import WantedModels
    from corporeal.pool.pool_index import CandidateOrigin, IndexConfig, OriginConfig, index_pool
    from corporeal.pool.quality_gate import GateConfig

    @dataclass(frozen=True)
    class Index:
        folders: Annotated[tuple[Path, ...], tyro.conf.Positional, tyro.conf.arg(metavar="FOLDER ...")] = ()
        """Searched recursively."""
        pool: Folder = DEFAULT_POOL
        """The pool's folder."""
        origin: Annotated[CandidateOrigin, tyro.conf.arg(name="from")] = "folders"
        """Kind of source: plain folders, the cache of the package objaverse, or Amazon Berkeley Objects."""
        csv: Path | None = None
        """Table with columns file, class and, where known, licence, attribution, metric (whether lengths are metres:
        yes or no), extent_m, source."""
        objaverse: WantedModels = field(default_factory=WantedModels)
        gate: GateConfig = field(default_factory=GateConfig)

    first = ("pool", "from", "csv", "classes", "per-class", "most-triangles")
    asked = parse(Index, "assets index", _index.__doc__, words=2, first=first)
    if not asked.folders and asked.origin != "objaverse":
        raise UserError("Name at least one folder of models: corporeal assets index FOLDER.")
    origin = OriginConfig(asked.origin, asked.csv, asked.objaverse)
    with progress_bars() as tell:
        pool = index_pool(asked.folders, asked.pool, IndexConfig(origin, asked.gate), tell("index"))
    _sum_up(pool)


def _sum_up(pool: AssetPool) -> None:
    print(
        f"{pool.folder}: {_count(len(pool.assets), 'asset')} of "
        f"{_count(len(pool.classes), 'class', 'classes')}, {len(pool.rejections)} rejected."
    )
    unknown = sum(not a.credit for a in pool.assets)
    if unknown:
        print(f"Of {_count(unknown, 'asset')} neither licence nor author is known.")
    if pool.rejections:
        reasons = "reason" if len(pool.rejections) == 1 else "reasons"
        print(f"The {reasons}: corporeal assets list --pool {pool.folder} --rejected")


def _list() -> None:
    """List the assets of a pool, or the rejected models with reasons."""
    from corporeal.pool.pool_index import read_pool

    @dataclass(frozen=True)
    class List:
        pool: Folder = DEFAULT_POOL
        """The pool's folder."""
        rejected: bool = False
        """List rejected models with reasons."""
        class_name: Annotated[str, tyro.conf.arg(name="class")] = ""
        """Only of this class."""

    asked = parse(List, "assets list", _list.__doc__, words=2)
    pool = read_pool(asked.pool)
    if asked.rejected:
        rows = [
            ("/".join(Path(r.source).parts[-2:]), r.class_name, r.reason)
            for r in pool.rejections
            if asked.class_name in ("", r.class_name)
        ]
        show_table(("file", "class", "reason"), rows, f"{len(rows)} rejected")
        return
    assets = _of_class(pool, asked.class_name)
    heads = ("class", "name", "extent", "triangles", "licence")
    classes = _count(len({a.class_name for a in assets}), "class", "classes")
    title = f"{_count(len(assets), 'asset')} of {classes}"
    show_table(heads, [_row(a) for a in assets], title)


def _row(a: PoolAsset) -> tuple[str, ...]:
    return (a.class_name, a.name, a.size, f"{a.triangles:,}", re.split(r" \(|;", a.licence)[0])


def _of_class(pool: AssetPool, class_name: str) -> Sequence[PoolAsset]:
    if not class_name:
        return pool.assets
    if class_name not in pool.classes:
        raise UnknownChoiceError("class", class_name, list(pool.classes))
    return pool.classes[class_name]


def _show() -> None:
    """Draw a contact sheet of a pool: every asset with its name, class and extent."""
    from corporeal.cli.pool_contact_sheet import write_pool_contact_sheet
    from corporeal.pool.pool_index import read_pool

    @dataclass(frozen=True)
    class Show:
        names: Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="NAME ...")] = ()
        pool: Folder = DEFAULT_POOL
        """The pool's folder."""
        class_name: Annotated[str, tyro.conf.arg(name="class")] = ""
        """Only of this class."""
        out: Path | None = None
        """File of the picture; by default assets.png in the pool."""
        size: int = 224
        """Size of each tile [px]."""

    asked = parse(Show, "assets show", _show.__doc__, words=2)
    pool = read_pool(asked.pool)
    assets = _named(pool, asked.names) if asked.names else _of_class(pool, asked.class_name)
    if not assets:
        raise UserError(
            f"{asked.pool} is empty: every file was rejected. "
            f"The reasons: corporeal assets list --pool {asked.pool} --rejected"
        )
    path = asked.out or asked.pool / "assets.png"
    with progress_bars() as tell:
        write_pool_contact_sheet(assets, path, asked.size, tell("show"))
    print(path)


def _named(pool: AssetPool, names: Sequence[str]) -> Sequence[PoolAsset]:
    for name in names:
        if pool.asset(name) is None:
            raise UnknownChoiceError("asset", name, [a.name for a in pool.assets])
    return [a for name in names if (a := pool.asset(name)) is not None]


def _count(number: int, word: str, words: str = "") -> str:
    return f"{number} {word if number == 1 else words or word + 's'}"


def _props() -> None:
    """Write the showcase's own twenty models as files: material for a first pool.

    corporeal assets props props/
    corporeal assets index props/
    corporeal assemble --from pool/ --seed 7
    """
    from corporeal.core.store import disk_errors
    from corporeal.io.gltf.glb_writer import write_glb
    from corporeal.showcase.prop_models import POOL_PROP_BUILDERS
    from corporeal.showcase.showcase_scenes import prop_scene

    @dataclass(frozen=True)
    class Props:
        folder: Annotated[Path, tyro.conf.Positional] = Path("props")

    asked = parse(Props, "assets props", _props.__doc__, words=2)
    with progress_bars() as tell, disk_errors(asked.folder):
        progress = tell("props")
        for k, name in enumerate(POOL_PROP_BUILDERS):
            progress(k / len(POOL_PROP_BUILDERS), name)
            path = asked.folder / name.replace("_", " ") / f"{name}.glb"
            path.parent.mkdir(parents=True, exist_ok=True)
            write_glb(path, prop_scene(name))
    print(f"{len(POOL_PROP_BUILDERS)} models in {asked.folder}. Next: corporeal assets index "
          f"{quote(str(asked.folder))}")  # fmt: skip
