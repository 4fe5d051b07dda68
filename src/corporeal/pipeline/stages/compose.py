"""Compose a scene of objects from a pool: sample, scale, settle, certify, choose an interaction, write.

A composed scene is a folder: ``scene.glb`` (everything at rest), ``scene.toml`` (what happens), ``certificate.json``
(that it is at rest), ``composition.json`` (what it is made of, and why so large), and ``views/`` (posed pictures).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.core.progress import Progress
from corporeal.core.setting_types import ReadsPath, WritesPath
from corporeal.core.types import GRAVITY_VECTOR
from corporeal.discretization.object_scaling import SceneSizing, scene_extents
from corporeal.geometry.convex_decomposition import decompose_convex
from corporeal.geometry.mesh import join_meshes
from corporeal.io.gltf.glb_merge import MergeMember, merge_glb_files
from corporeal.io.gltf.gltf_reader import read_gltf_model
from corporeal.io.scene_toml import SceneFile, write_scene_file
from corporeal.materials import find_material, friction_between
from corporeal.pool.asset_pool import UNKNOWN_LICENCE, AssetPool, PoolAsset, draw_least_used, parse_count_range
from corporeal.recognition.readable_names import numbered_names
from corporeal.scene.arrange_bodies import BodyArrangement
from corporeal.scene.interactions import (
    ARRANGEMENTS_OF_KIND,
    INTERACTION_KINDS,
    MAX_WIND_SPEED_M_S,
    MIN_OBJECTS_OF_KIND,
    WIND_SPEED_RATIO_RANGE,
    InteractionKind,
    SceneInteraction,
)
from corporeal.scene.rest_certificate import RestCertificate
from corporeal.scene.scene_composition import ComposedObject, SceneComposition, write_certificate, write_composition
from corporeal.scene.settle_bodies import SettleConfig, SettlingEngine
from corporeal.scene.settle_for_interaction import SettledInteraction, settle_for_interaction
from corporeal.scene.settling_body import BodyPose, MassProperties, SettlingBody
from corporeal.scene.wind_threshold import lowest_wind_threshold
from corporeal.vlm.real_sizes import RealExtent, estimate_real_extent, find_class_sizes

Weigh = Callable[[PoolAsset, float], MassProperties]
"""Returns the mass properties of an asset of a real extent [m], about the middle of its box."""

CELLS_ALONG_LARGEST_OBJECT = 48
"""Cells along the largest object at draft detail: half of one is the penetration allowed."""
CONVEX_PIECES_FOLDER = "pieces"
"""Folder of the pool that keeps convex pieces."""
DURATION_AT_REST_S = 1.0
"""Duration of a scene without an interaction [s]."""


@dataclass(frozen=True)
class ComposeConfig:
    """Objects of a scene, and its interaction."""

    classes: tuple[str, ...] = ()
    """Classes to sample from; by default all of the pool."""
    assets: tuple[str, ...] = ()
    """Exactly these assets of the pool, by name, instead of a random choice."""
    count: str = "1-4"
    """Number of objects, or a range to sample it from."""
    repeat: bool = False
    """Allow several objects of one class."""
    seed: int = 0
    """Random seed of the choice of objects, their sizes, arrangement and interaction."""
    arrangement: BodyArrangement | Literal["auto"] = "auto"
    """Arrangement at rest: side by side, stacked, dropped onto one, or in a row."""
    settle_with: SettlingEngine = "mujoco"
    """Rigid-body engine: MuJoCo, or Blender through the program blenderproc on the PATH."""
    interaction: InteractionKind | Literal["auto", "none"] = "auto"
    """Interaction that starts at time 0."""
    sizing: SceneSizing = field(default_factory=SceneSizing)
    vlm: Annotated[str, ReadsPath(prefixes=("replay",))] = "metadata"
    """Source of usual sizes of classes, as --vlm of `describe`; by default a table."""
    record: Annotated[Path | None, WritesPath()] = None
    """Folder to record a model's answers in, for --vlm replay:FOLDER."""


DEFAULT_CONFIG = ComposeConfig()


@dataclass(frozen=True)
class ComposedScene:
    """A scene that was composed."""

    folder: Path
    names: tuple[str, ...]
    """Of its objects."""
    arrangement: BodyArrangement
    action: SceneInteraction | None
    certificate: RestCertificate
    warnings: tuple[str, ...]


def compose(
    pool: AssetPool,
    folder: Path,
    config: ComposeConfig = DEFAULT_CONFIG,
    progress: Progress | None = None,
    weigh: Weigh | None = None,
) -> ComposedScene:
    """Compose one scene and write it into a folder; the same pool and seed give the same bytes.

    Args:
        pool: Pool of assets.
        folder: Folder of the scene.
        config: What goes into it.
        progress: Called with the fraction done and a description.
        weigh: Returns the mass properties of an object; None: those of a homogeneous solid.

    Raises:
        UserError: The pool lacks what is asked for, no rest is found, or no interaction is possible.
    """
    tell = progress or (lambda fraction, words: None)
    rng = np.random.default_rng(config.seed)
    # Which assets, how large, and what may happen.
    tell(0.0, "choosing")
    kind = None if config.interaction in ("auto", "none") else config.interaction
    assets = _choose_assets(pool, config, kind, rng)
    kinds: list[InteractionKind] = [kind] if kind else _possible_kinds(config, len(assets), rng)
    sizes = _asset_sizes(assets, config)
    tell(0.1, "cutting into convex pieces")
    objects = _with_mass_properties(_objects(pool, assets, sizes, config.sizing), weigh)
    tell(0.3, "settling")
    deepest = 0.5 * max(t.extent for t in objects) / CELLS_ALONG_LARGEST_OBJECT
    bodies, rest = [t.body for t in objects], SettleConfig(engine=config.settle_with)
    settled = settle_for_interaction(bodies, config.arrangement, kinds, rng, deepest, rest)
    tell(0.9, "writing")
    warnings = _write(folder, objects, settled, config)
    stated = tuple(dict.fromkeys([*(w for s in sizes for w in s.warnings), *warnings]))
    _write_certificate(folder, objects, settled, config, stated)
    names = tuple(t.name for t in objects)
    return ComposedScene(folder, names, settled.arrangement, settled.action, settled.certificate, stated)


def wind_moves_any(assets: Sequence[PoolAsset], config: ComposeConfig, weigh: Weigh) -> bool:
    """Return whether wind could move any object of a scene, standing alone."""
    real = [s.extent for s in _asset_sizes(assets, config)]
    for asset, size, extent in zip(assets, real, scene_extents(real, config.sizing), strict=True):
        points, triangles, _ = _shape(asset, float(extent))
        inertial = weigh(asset, size).scaled(float(extent) / size)
        body = SettlingBody(asset.name, points, triangles, (), inertial=inertial)
        if WIND_SPEED_RATIO_RANGE[1] * lowest_wind_threshold(body) <= MAX_WIND_SPEED_M_S:
            return True
    return False


def _possible_kinds(config: ComposeConfig, count: int, rng: np.random.Generator) -> list[InteractionKind]:
    """Return the possible interactions of the objects, in random order."""
    if config.interaction == "none":
        return []
    stands = config.arrangement
    able: list[InteractionKind] = [
        k
        for k in INTERACTION_KINDS
        if MIN_OBJECTS_OF_KIND[k] <= count and (count == 1 or stands in ("auto", *ARRANGEMENTS_OF_KIND[k]))
    ]
    return [able[k] for k in rng.permutation(len(able))] or ["fall"]


def _choose_assets(
    pool: AssetPool, config: ComposeConfig, kind: InteractionKind | None, rng: np.random.Generator
) -> list[PoolAsset]:
    """Return the assets named, or sample classes and one asset of each."""
    if config.assets:
        return [_asset_by_name(pool, name) for name in config.assets]
    by_class = pool.classes
    if not by_class:
        raise UserError(f"The pool {pool.folder} has no usable asset. See why: corporeal assets list --rejected")
    for name in config.classes:
        if name not in by_class:
            raise UnknownChoiceError("class", name, list(by_class))
    offered = list(dict.fromkeys(config.classes)) or list(by_class)
    low, high = parse_count_range(config.count)
    low = max(low, MIN_OBJECTS_OF_KIND[kind]) if kind else low
    most = high if config.repeat else min(high, len(offered))
    if most < low:
        raise UserError(
            f"{low} objects are asked for, of {len(offered)} "
            f"class{'es' * (len(offered) != 1)} that may come once each. Name more --classes, or "
            "use --repeat."
        )
    count = int(rng.integers(low, most + 1))
    classes = draw_least_used(offered, {}, count, rng, config.repeat)
    return [by_class[c][rng.integers(len(by_class[c]))] for c in classes]


def _asset_by_name(pool: AssetPool, name: str) -> PoolAsset:
    found = pool.asset(name)
    if found is None:
        raise UnknownChoiceError("asset", name, [a.name for a in pool.assets])
    return found


@dataclass(frozen=True)
class _ObjectToPlace:
    """One object of the scene to be."""

    name: str
    asset: PoolAsset
    real: RealExtent
    extent: float
    """In the scene [m]."""
    body: SettlingBody
    centre: np.ndarray
    """Of the file's box [its own unit]: the origin of the body."""

    @property
    def scale_of_file(self) -> float:
        """Scene size over the file's."""
        return self.extent / self.asset.extent


def _asset_sizes(assets: Sequence[PoolAsset], config: ComposeConfig) -> list[RealExtent]:
    known = find_class_sizes((a.class_name for a in assets), config.vlm, config.record)
    sizes = [estimate_real_extent(a.name, a.class_name, a.extent, a.metric, known) for a in assets]
    if sizes and known.warnings:
        sizes[0] = replace(sizes[0], warnings=(*sizes[0].warnings, *known.warnings))
    return sizes


def _objects(
    pool: AssetPool, assets: Sequence[PoolAsset], sizes: Sequence[RealExtent], sizing: SceneSizing
) -> list[_ObjectToPlace]:
    """Give every asset its name, its size in the scene and a body."""
    names = numbered_names([a.class_name for a in assets])
    extents = scene_extents([s.extent for s in sizes], sizing)
    objects = []
    for name, asset, size, extent in zip(names, assets, sizes, extents, strict=True):
        points, triangles, centre = _shape(asset, float(extent))
        try:
            pieces = decompose_convex(points, triangles, pool.folder / CONVEX_PIECES_FOLDER)
        except UserError as problem:
            raise UserError(f"{asset.name}: {problem}") from None
        body = SettlingBody(name, points, triangles, pieces)
        objects.append(_ObjectToPlace(name, asset, size, float(extent), body, centre))
    return objects


def _with_mass_properties(objects: list[_ObjectToPlace], weigh: Weigh | None) -> list[_ObjectToPlace]:
    """Set mass properties of bodies; wall thickness scales with the object."""
    if weigh is None:
        return objects
    matters = [weigh(t.asset, t.real.extent).scaled(t.extent / t.real.extent) for t in objects]
    bodies = [
        replace(t.body, inertial=m, grips=_least_friction(k, objects, matters))
        for k, (t, m) in enumerate(zip(objects, matters, strict=True))
    ]
    return [replace(t, body=b) for t, b in zip(objects, bodies, strict=True)]


def _least_friction(
    number: int, objects: Sequence[_ObjectToPlace], matters: Sequence[MassProperties]
) -> dict[str, float]:
    """Return the least friction of any two parts of an object and of each other one, by name [-].

    Contacts are not known before settling, so the least is a bound for all.
    """
    found = {}
    for k, (other, matter) in enumerate(zip(objects, matters, strict=True)):
        meeting = product(matters[number].materials, matter.materials)
        pairs = [friction_between(find_material(a), find_material(b)).sliding.typical for a, b in meeting]
        if k != number and pairs:
            found[other.name] = min(pairs)
    return found


def _shape(asset: PoolAsset, extent: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices about the middle of the box [m], triangles, and that middle in the file."""
    mesh = join_meshes(read_gltf_model(asset.file, "one").scene.surfaces)
    centre = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    return (mesh.vertices - centre) * (extent / asset.extent), mesh.triangles, centre


def _write(
    folder: Path, objects: Sequence[_ObjectToPlace], settled: SettledInteraction, config: ComposeConfig
) -> tuple[str, ...]:
    """Write ``scene.glb`` and ``scene.toml``; return what was left out of the files."""
    action = settled.action
    duration = action.duration if action else DURATION_AT_REST_S
    members = [_member(t, p) for t, p in zip(objects, settled.poses, strict=True)]
    extras = {"gravity_m_s2": list(GRAVITY_VECTOR), "duration_s": duration, "fps": 30, "settled": True}
    warnings = merge_glb_files(folder / "scene.glb", members, "scene", extras)
    scene_file = SceneFile(
        folder / "scene.toml",
        file=folder / "scene.glb",
        duration=duration,
        settled=True,
        objects=action.entries if action else (),
    )
    write_scene_file(folder / "scene.toml", scene_file)
    return warnings


def _member(obj: _ObjectToPlace, pose: BodyPose) -> MergeMember:
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
    extras |= {key: words for key, words in known.items() if words not in ("", UNKNOWN_LICENCE)}
    return MergeMember(asset.file, obj.name, (x, y, z), pose.quaternion, scale, extras)


def _write_certificate(
    folder: Path,
    objects: Sequence[_ObjectToPlace],
    settled: SettledInteraction,
    config: ComposeConfig,
    warnings: tuple[str, ...],
) -> None:
    """Write ``certificate.json`` and ``composition.json``."""
    write_certificate(folder, settled.certificate)
    action = settled.action
    composition = SceneComposition(
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
