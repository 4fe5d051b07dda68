"""Compose a scene of objects from a pool: draw, size, settle, certify, begin, write it all down.

A composed scene is a folder: ``scene.glb`` (everything at rest), ``scene.toml`` (what happens),
``certificate.json`` (that it is at rest), ``composition.json`` (what it is made of, and why so
large), and ``views/`` (posed pictures).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np

from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.core.types import DOWNWARDS
from corporeal.discretization.sizes import Sizing, scene_extents
from corporeal.geometry.convex_decompose import decompose
from corporeal.geometry.mesh import joined
from corporeal.io.glb import read_model
from corporeal.io.glb_merge import Member, merge
from corporeal.io.scene_file import SceneFile, write_scene_file
from corporeal.materials import find, friction_between
from corporeal.pool.asset import UNKNOWN, Asset, Pool
from corporeal.pool.draw import counts, draw
from corporeal.recognition.words import numbered
from corporeal.scene.arrange import Arrangement
from corporeal.scene.begin import Begun, drop_and_begin
from corporeal.scene.body import Body, Pose
from corporeal.scene.breeze import slowest_wind
from corporeal.scene.certificate import Certificate
from corporeal.scene.composition import (
    ComposedObject,
    Composition,
    write_certificate,
    write_composition,
)
from corporeal.scene.interactions import KINDS, NEEDS, STANDING, STORM, WIND, Action, Kind
from corporeal.scene.mass_properties import MassProperties
from corporeal.scene.rest import RestConfig, SettlingEngine
from corporeal.vlm.sizes import RealExtent, real_extent, usual_sizes

Progress = Callable[[float, str], None]
Weigh = Callable[[Asset, float], MassProperties]
"""Given an asset and its real extent [m], says how its mass lies: at that size, about the middle of
its box."""

FINEST = 48
"""Cells along the largest object at draft detail: half of one is the penetration allowed."""
PIECES = "pieces"
"""Folder of the pool that keeps convex pieces."""
AT_REST = 1.0
"""How long to film a scene in which nothing happens [s]."""


@dataclass(frozen=True)
class ComposeConfig:
    """What goes into a scene and what happens in it."""

    classes: tuple[str, ...] = ()
    """Classes to draw from; by default all of the pool."""
    assets: tuple[str, ...] = ()
    """Exactly these assets of the pool, by name, instead of a random choice."""
    count: str = "1-4"
    """Number of objects, or a range to draw it from."""
    repeat: bool = False
    """Allow several objects of one class."""
    seed: int = 0
    """Seed of all random numbers."""
    arrangement: Arrangement | Literal["auto"] = "auto"
    """Arrangement at rest: side by side, stacked, dropped onto one, or in a row."""
    settle_with: SettlingEngine = "mujoco"
    """Rigid-body engine: MuJoCo, or Blender through the program blenderproc on the PATH."""
    interaction: Kind | Literal["auto", "none"] = "auto"
    """Interaction that starts at time 0."""
    sizing: Sizing = field(default_factory=Sizing)
    vlm: str = "metadata"
    """Source of usual sizes of classes, as --vlm of `describe`; by default a table."""
    record: Path | None = None
    """Folder to record a model's answers in, for --vlm replay:FOLDER."""


DEFAULT = ComposeConfig()


@dataclass(frozen=True)
class Composed:
    """A scene that was composed."""

    folder: Path
    names: tuple[str, ...]
    """Of its objects."""
    arrangement: Arrangement
    action: Action | None
    certificate: Certificate
    warnings: tuple[str, ...]


def compose(
    pool: Pool,
    folder: Path,
    config: ComposeConfig = DEFAULT,
    progress: Progress | None = None,
    weigh: Weigh | None = None,
) -> Composed:
    """Compose one scene and write it into a folder; the same pool and seed give the same bytes.

    Args:
        pool: What there is.
        folder: Where the scene goes.
        config: What goes into it.
        progress: Told the fraction done and what is being done.
        weigh: Says how the mass of an object lies; None: as in a solid of one material.

    Raises:
        UserError: The pool lacks what is asked for, no rest is found, or nothing has room to
            happen.

    """
    tell = progress or (lambda fraction, words: None)
    rng = np.random.default_rng(config.seed)
    # Which assets, how large, and what may happen.
    tell(0.0, "choosing")
    kind = None if config.interaction in ("auto", "none") else config.interaction
    assets = _chosen(pool, config, kind, rng)
    kinds: list[Kind] = [kind] if kind else _possible_kinds(config, len(assets), rng)
    sizes = _sized(assets, config)
    tell(0.1, "cutting into convex pieces")
    objects = _weighed(_objects(pool, assets, sizes, config.sizing), weigh)
    tell(0.3, "settling")
    deepest = 0.5 * max(t.extent for t in objects) / FINEST
    bodies, rest = [t.body for t in objects], RestConfig(engine=config.settle_with)
    settled = drop_and_begin(bodies, config.arrangement, kinds, rng, deepest, rest)
    tell(0.9, "writing")
    warnings = _write(folder, objects, settled, config)
    stated = tuple(dict.fromkeys([*(w for s in sizes for w in s.warnings), *warnings]))
    _keep(folder, objects, settled, config, stated)
    names = tuple(t.name for t in objects)
    return Composed(folder, names, settled.arrangement, settled.action, settled.certificate, stated)


def moved_by_wind(assets: Sequence[Asset], config: ComposeConfig, weigh: Weigh) -> bool:
    """Tell whether any of the objects of a scene could be moved by a wind, standing alone.

    Args:
        assets: What the scene is of.
        config: How large objects are.
        weigh: Says how the mass of an object lies.

    """
    real = [s.extent for s in _sized(assets, config)]
    for asset, size, extent in zip(assets, real, scene_extents(real, config.sizing), strict=True):
        points, triangles, _ = _shape(asset, float(extent))
        inertial = weigh(asset, size).scaled(float(extent) / size)
        body = Body(asset.name, points, triangles, (), inertial=inertial)
        if WIND[1] * slowest_wind(body) <= STORM:
            return True
    return False


# ---------------------------------------------------------------- what is in it


def _possible_kinds(config: ComposeConfig, count: int, rng: np.random.Generator) -> list[Kind]:
    """Return what so many objects, standing as asked, can do, in an order of chance."""
    if config.interaction == "none":
        return []
    stands = config.arrangement
    able: list[Kind] = [
        k for k in KINDS if NEEDS[k] <= count and (count == 1 or stands in ("auto", *STANDING[k]))
    ]
    return [able[k] for k in rng.permutation(len(able))] or ["fall"]


def _chosen(
    pool: Pool, config: ComposeConfig, kind: Kind | None, rng: np.random.Generator
) -> list[Asset]:
    """Return the assets named, or draw classes and one asset of each."""
    if config.assets:
        return [_named(pool, name) for name in config.assets]
    by_class = pool.classes
    if not by_class:
        raise UserError(
            f"The pool {pool.folder} has no usable asset. See why: corporeal assets list --rejected"
        )
    for name in config.classes:
        if name not in by_class:
            raise UnknownChoiceError("class", name, list(by_class))
    offered = list(dict.fromkeys(config.classes)) or list(by_class)
    low, high = counts(config.count)
    low = max(low, NEEDS[kind]) if kind else low
    most = high if config.repeat else min(high, len(offered))
    if most < low:
        raise UserError(
            f"{low} objects are asked for, of {len(offered)} "
            f"class{'es' * (len(offered) != 1)} that may come once each. Name more --classes, or "
            "say --repeat."
        )
    count = int(rng.integers(low, most + 1))
    classes = draw(offered, {}, count, rng, config.repeat)
    return [by_class[c][rng.integers(len(by_class[c]))] for c in classes]


def _named(pool: Pool, name: str) -> Asset:
    found = pool.asset(name)
    if found is None:
        raise UnknownChoiceError("asset", name, [a.name for a in pool.assets])
    return found


# ---------------------------------------------------------------- how large


@dataclass(frozen=True)
class _Placed:
    """One object of the scene to be."""

    name: str
    asset: Asset
    real: RealExtent
    extent: float
    """In the scene [m]."""
    body: Body
    centre: np.ndarray
    """Of the file's box [its own unit]: the origin of the body."""

    @property
    def scale_of_file(self) -> float:
        """Scene size over the file's."""
        return self.extent / self.asset.extent


def _sized(assets: Sequence[Asset], config: ComposeConfig) -> list[RealExtent]:
    known = usual_sizes((a.class_name for a in assets), config.vlm, config.record)
    sizes = [real_extent(a.name, a.class_name, a.extent, a.metric, known) for a in assets]
    if sizes and known.warnings:
        sizes[0] = replace(sizes[0], warnings=(*sizes[0].warnings, *known.warnings))
    return sizes


def _objects(
    pool: Pool, assets: Sequence[Asset], sizes: Sequence[RealExtent], sizing: Sizing
) -> list[_Placed]:
    """Give every asset its name, its size in the scene and a body."""
    names = numbered([a.class_name for a in assets])
    extents = scene_extents([s.extent for s in sizes], sizing)
    objects = []
    for name, asset, size, extent in zip(names, assets, sizes, extents, strict=True):
        points, triangles, centre = _shape(asset, float(extent))
        try:
            pieces = decompose(points, triangles, pool.folder / PIECES)
        except UserError as problem:
            raise UserError(f"{asset.name}: {problem}") from None
        body = Body(name, points, triangles, pieces)
        objects.append(_Placed(name, asset, size, float(extent), body, centre))
    return objects


def _weighed(objects: list[_Placed], weigh: Weigh | None) -> list[_Placed]:
    """Let bodies know how their mass lies, walls being as thick as the object is large."""
    if weigh is None:
        return objects
    matters = [weigh(t.asset, t.real.extent).scaled(t.extent / t.real.extent) for t in objects]
    bodies = [
        replace(t.body, inertial=m, grips=_grips(k, objects, matters))
        for k, (t, m) in enumerate(zip(objects, matters, strict=True))
    ]
    return [replace(t, body=b) for t, b in zip(objects, bodies, strict=True)]


def _grips(
    number: int, objects: Sequence[_Placed], matters: Sequence[MassProperties]
) -> dict[str, float]:
    """Return the least friction of any two parts of an object and of each other one, by name [-].

    Which parts will touch is not known before all lie at rest; the least holds whichever do.
    """
    found = {}
    for k, (other, matter) in enumerate(zip(objects, matters, strict=True)):
        meeting = product(matters[number].materials, matter.materials)
        pairs = [friction_between(find(a), find(b)).sliding.typical for a, b in meeting]
        if k != number and pairs:
            found[other.name] = min(pairs)
    return found


def _shape(asset: Asset, extent: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices about the middle of the box [m], triangles, and that middle in the file."""
    mesh = joined(read_model(asset.file, "one").scene.surfaces)
    centre = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    return (mesh.vertices - centre) * (extent / asset.extent), mesh.triangles, centre


# ---------------------------------------------------------------- written down


def _write(
    folder: Path, objects: Sequence[_Placed], settled: Begun, config: ComposeConfig
) -> tuple[str, ...]:
    """Write ``scene.glb`` and ``scene.toml``; return what was left out of the files."""
    action = settled.action
    duration = action.duration if action else AT_REST
    members = [_member(t, p) for t, p in zip(objects, settled.poses, strict=True)]
    extras = {"gravity_m_s2": list(DOWNWARDS), "duration_s": duration, "fps": 30, "settled": True}
    warnings = merge(folder / "scene.glb", members, "scene", extras)
    scene_file = SceneFile(
        folder / "scene.toml",
        file=folder / "scene.glb",
        duration=duration,
        settled=True,
        objects=action.entries if action else (),
    )
    write_scene_file(folder / "scene.toml", scene_file)
    return warnings


def _member(obj: _Placed, pose: Pose) -> Member:
    asset, scale = obj.asset, obj.scale_of_file
    x, y, z = pose.world(-scale * obj.centre[None])[0].tolist()
    extras = {
        "object_id": obj.name,
        "class": asset.class_name,
        "asset": asset.name,
        "asset_sha256": asset.sha256,
        "source": asset.source,
        "real_extent_m": obj.real.extent,
        "scale": obj.extent / obj.real.extent,
        "sized_by": obj.real.by,
    }
    known = {"licence": asset.licence, "attribution": asset.attribution}
    extras |= {key: words for key, words in known.items() if words not in ("", UNKNOWN)}
    return Member(asset.file, obj.name, (x, y, z), pose.quaternion, scale, extras)


def _keep(
    folder: Path,
    objects: Sequence[_Placed],
    settled: Begun,
    config: ComposeConfig,
    warnings: tuple[str, ...],
) -> None:
    """Write ``certificate.json`` and ``composition.json``."""
    write_certificate(folder, settled.certificate)
    action = settled.action
    composition = Composition(
        seed=config.seed,
        arrangement=settled.arrangement,
        settled_with=config.settle_with,
        interaction=action.kind if action else "none",
        what_happens=action.words if action else "nothing: everything stays at rest",
        sizing=config.sizing,
        objects=tuple(
            ComposedObject(
                name=t.name,
                class_name=t.asset.class_name,
                asset=t.asset.name,
                source=t.asset.source,
                sha256=t.asset.sha256,
                licence=t.asset.licence,
                attribution=t.asset.attribution,
                real_extent_m=t.real.extent,
                said_by=t.real.said_by,
                reason=t.real.reason,
                extent_m=t.extent,
            )
            for t in objects
        ),
        warnings=warnings,
    )
    write_composition(folder, composition)
