"""Assembly of the scenes of a corpus, each in its own process.

A scene's folder below ``<corpus>/scenes`` appears whole or not at all, under an id that covers the settings, the seed
and the bytes of its assets.

Mass properties of the objects of a pool, for settling.

Pieces of uniform density would do for a stone. A pot is heavier than its plant, a can is a wall around its contents,
and a cup on its side rolls to where its handle is lowest.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.progress import Progress
from corporeal.io.gltf.gltf_reader import read_gltf_model
from corporeal.io.photos.transforms_json import write_views
from corporeal.io.scene_toml import SceneFile, write_scene_file
from corporeal.jobs.executor import Executor, execute_jobs
from corporeal.jobs.job import Job, ManifestRow
from corporeal.lab.corpus.corpus_plan import (
    PLAN_FILE,
    CorpusConfig,
    CorpusPlan,
    PlannedScene,
    WindTest,
    plan_corpus,
    read_plan,
    write_plan,
)
from corporeal.lab.corpus.run_corpus import SCENE_TOML_FILE, SCENES_FOLDER, VIEWS_FOLDER
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.stages.assemble import AssembleConfig, assemble
from corporeal.pipeline.stages.capture import CaptureConfig, capture
from corporeal.pipeline.stages.compose import ComposeConfig, compose, wind_moves_any
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.fill import FillConfig, fill
from corporeal.pipeline.stages.ground import ground
from corporeal.pipeline.stages.segment import segment
from corporeal.pool.asset_pool import AssetPool, PoolAsset
from corporeal.scene.interactions import ARRANGEMENTS_OF_KIND, INTERACTION_KINDS
from corporeal.scene.settling_body import MassProperties, cubes_mass_properties

MASS_CACHE_FOLDER = "matter"
"""Of a pool: what its objects weigh."""
MASS_CACHE_VERSION = 6
"""Of the way objects are weighed: kept results of another version are made anew."""


def asset_mass_properties(asset: PoolAsset, extent: float, folder: Path | None = None) -> MassProperties:
    """Fill an object of the pool with the materials that its names suggest, and weigh it.

    Args:
        asset: What.
        extent: Its largest real extent [m].
        folder: The pool's, where the result is kept; None: nowhere.

    Returns:
        Of the object at its real size, about the middle of its box, +Z up.

    Raises:
        UserError: It cannot be filled.
    """
    config = FillConfig()
    asked = {"extent": round(extent, 6), "class": asset.class_name, "version": MASS_CACHE_VERSION}
    name = store.result_key("weigh", asked | {"detail": config.detail}, [asset.sha256])
    kept = folder / MASS_CACHE_FOLDER / f"{name}.json" if folder else None
    if kept and kept.exists():
        found = store.read_json(kept)
        centre, inertia = np.array(found["centre"]), np.array(found["inertia"])
        surface = found["friction"], found["grip"], tuple(found["materials"])
        return MassProperties(found["mass"], centre, inertia, *surface)
    inertial = _compute_mass_properties(asset, extent, config)
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        store.write_json(kept, store.to_plain(inertial))
    return inertial


def _compute_mass_properties(asset: PoolAsset, extent: float, config: FillConfig) -> MassProperties:
    scene = assemble([asset.file], AssembleConfig(objects="one", extent=(f"{extent:.9g}",)))
    obj = replace(scene.objects[0], class_name=asset.class_name)
    scene = replace(scene, objects=(obj,))
    inventory = describe(scene)
    parts = segment(scene, inventory)
    field = ground(scene, parts, inventory)
    particles = fill(scene, parts, field, config)
    corners = np.concatenate([s.vertices for s in scene.surfaces])
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    sides = np.cbrt(particles.volume)
    inertial = cubes_mass_properties(particles.position - middle, particles.mass, sides)
    # Which part it will stand on is not known yet.
    on_floor = field.friction[:-1, -1]
    return replace(
        inertial,
        friction=float(on_floor.max()),
        grip=float(on_floor.min()),
        materials=tuple(dict.fromkeys(m.name for m in field.materials)),
    )


EXTRA_SEEDS = 2
"""Other seeds that a planned scene is tried with."""
COMPOSE_TIME_FRACTION = 0.5
"""Share of the time that it takes to compose a scene; the pictures take the rest."""


@dataclass(frozen=True)
class Sources:
    """What scenes are made of, and how."""

    pool: AssetPool | None
    """None for the showcase."""
    composing: ComposeConfig
    """How every scene is composed; what the plan decides is taken from the plan."""
    capturing: CaptureConfig
    """Which pictures are taken of it."""


def assemble_corpus(folder: Path, config: CorpusConfig, sources: Sources, hands: Executor) -> dict[str, ManifestRow]:
    """Plan a corpus and make its scenes; return what became of each.

    A folder that was planned before with the same settings keeps its plan, whatever the pool has got since.

    Raises:
        UserError: The pool is empty or lost what the plan needs, the folder holds a corpus that was planned otherwise,
            or another process works in it.
    """
    with store.lock_folder(folder):
        made = _planned_corpus(folder, config, sources)
        for message in made.messages:
            hands.say(message)
        return execute_jobs(folder, "assemble", assembly_jobs(folder, made, sources), hands)


def _planned_corpus(folder: Path, config: CorpusConfig, sources: Sources) -> CorpusPlan:
    if (folder / PLAN_FILE).exists():
        made = read_plan(folder)
        if made.config != config:
            raise UserError(
                f"{folder} holds a corpus that was planned with other settings. Choose another "
                f"folder, or delete {folder / PLAN_FILE} and what was made from it."
            )
        return made
    pool = sources.pool
    made = plan_corpus(pool.assets, config, _wind_test(pool, sources.composing)) if pool else plan_corpus((), config)
    write_plan(folder, made)
    return made


def _wind_test(pool: AssetPool, composing: ComposeConfig) -> WindTest:
    weigher = partial(asset_mass_properties, folder=pool.folder)
    return lambda names: wind_moves_any(_assets(pool, names), composing, weigher)


def assembly_jobs(folder: Path, made: CorpusPlan, sources: Sources) -> list[Job]:
    """Describe what is to be done for every scene of a plan.

    Raises:
        UserError: The pool no longer has an asset of the plan.
    """
    pool = sources.pool
    if pool is None:
        return [_showcase_job(folder, scene) for scene in made.scenes]
    return [
        _compose_job(
            folder / SCENES_FOLDER / scene.name, pool, planned_compose_config(scene, sources.composing), sources
        )
        for scene in made.scenes
    ]


def planned_compose_config(scene: PlannedScene, composing: ComposeConfig) -> ComposeConfig:
    """Return how one scene of a plan is composed."""
    return replace(
        composing, assets=scene.assets, seed=scene.seed, arrangement=scene.arrangement, interaction=scene.interaction
    )


def _compose_job(folder: Path, pool: AssetPool, config: ComposeConfig, sources: Sources) -> Job:
    assets = _assets(pool, config.assets)
    capturing = replace(sources.capturing, threads=None)
    configs = [asdict(replace(config, record=None)), asdict(capturing)]
    inputs = [*(a.sha256 for a in assets), *run_pipeline.digests_of_named_files(config)]
    few = AssetPool(pool.folder.resolve(), assets)
    return Job(
        name=folder.name,
        function=planned_scene,
        folder=folder,
        key=store.result_key("corpus assemble", configs, inputs),
        arguments={"pool": few, "config": config, "capturing": sources.capturing},
    )


def _showcase_job(folder: Path, scene: PlannedScene) -> Job:
    return Job(
        name=scene.name,
        function=showcase_scene,
        folder=folder / SCENES_FOLDER / scene.name,
        key=store.result_key("corpus assemble", {"showcase": scene.name}, []),
        arguments={"name": scene.name},
    )


def compose_scene(
    folder: Path, progress: Progress, pool: AssetPool, config: ComposeConfig, capturing: CaptureConfig
) -> None:
    """Compose one scene and take its pictures, in the process of a worker."""
    weigher = partial(asset_mass_properties, folder=pool.folder)
    compose(pool, folder, config, lambda d, words: progress(COMPOSE_TIME_FRACTION * d, words), weigher)
    if capturing.views:
        scene = read_gltf_model(folder / "scene.glb").scene
        views = capture(
            scene, capturing, lambda d, words: progress(COMPOSE_TIME_FRACTION + (1 - COMPOSE_TIME_FRACTION) * d, words)
        )
        write_views(folder / VIEWS_FOLDER, views)


def planned_scene(
    folder: Path, progress: Progress, pool: AssetPool, config: ComposeConfig, capturing: CaptureConfig
) -> None:
    """Compose a scene of a plan; where it does not come to rest, from other seeds and otherwise.

    Raises:
        UserError: It never came to rest; the reason is that of the planned way.
    """
    first: UserError | None = None
    for way in fallback_compose_configs(config):
        try:
            return compose_scene(folder, progress, pool, way, capturing)
        except UserError as error:
            first = first or error
    assert first is not None
    raise first


def fallback_compose_configs(config: ComposeConfig) -> list[ComposeConfig]:
    """Return how a planned scene may be composed, the best way first.

    As planned; then from other seeds; then standing otherwise, as its interaction allows.
    """
    seeds = [int(n) for n in np.random.SeedSequence(config.seed).generate_state(EXTRA_SEEDS)]
    same = [config, *(replace(config, seed=n) for n in seeds)]
    if len(config.assets) < 2 or config.interaction not in INTERACTION_KINDS:
        return same
    others = [a for a in ARRANGEMENTS_OF_KIND[config.interaction] if a != config.arrangement]
    return same + [replace(config, arrangement=a) for a in others]


def showcase_scene(folder: Path, progress: Progress, name: str) -> None:
    """Write one scene of the showcase, in the process of a worker."""
    progress(0.0, "building")
    path = run_pipeline.write_showcase(name, folder)
    path = path.rename(folder / "scene.glb")
    write_scene_file(folder / SCENE_TOML_FILE, SceneFile(folder / SCENE_TOML_FILE, file=path))


def _assets(pool: AssetPool, names: Sequence[str]) -> tuple[PoolAsset, ...]:
    found = [pool.asset(name) for name in names]
    gone = [name for name, asset in zip(names, found, strict=True) if asset is None]
    if gone:
        raise UserError(
            f"{pool.folder} no longer has {', '.join(gone)}, which the corpus was planned with. "
            "Choose another folder for a new corpus."
        )
    return tuple(asset for asset in found if asset is not None)
