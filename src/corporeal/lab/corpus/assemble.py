"""Assemble the scenes of a corpus: each planned scene is made in a process of its own.

A scene's folder below ``<corpus>/scenes`` appears whole or not at all, under an id that covers the
settings, the seed and the bytes of its assets.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.io.glb import read_model
from corporeal.io.scene_file import SceneFile, write_scene_file
from corporeal.io.transforms import write_views
from corporeal.jobs.carry_out import Hands, carry_out
from corporeal.jobs.jobs import Job, Progress
from corporeal.jobs.manifest import Row
from corporeal.lab.corpus.plan import (
    PLAN,
    CorpusConfig,
    Plan,
    PlannedScene,
    Windy,
    plan,
    read_plan,
    write_plan,
)
from corporeal.lab.corpus.run import SCENE, SCENES, VIEWS
from corporeal.lab.corpus.weighing import weigh
from corporeal.pipeline import runner
from corporeal.pipeline.stages.capture import CaptureConfig, capture
from corporeal.pipeline.stages.compose import ComposeConfig, compose, moved_by_wind
from corporeal.pool.asset import Asset, Pool
from corporeal.scene.interactions import KINDS, STANDING

SEEDS = 2
"""Other seeds that a planned scene is tried with."""
SETTLED = 0.5
"""Share of the time that it takes to compose a scene; the pictures take the rest."""


@dataclass(frozen=True)
class Sources:
    """What scenes are made of, and how."""

    pool: Pool | None
    """None for the showcase."""
    composing: ComposeConfig
    """How every scene is composed; what the plan decides is taken from the plan."""
    capturing: CaptureConfig
    """Which pictures are taken of it."""


def assemble_corpus(
    folder: Path, config: CorpusConfig, sources: Sources, hands: Hands
) -> dict[str, Row]:
    """Plan a corpus and make its scenes; return what became of each.

    A folder that was planned before with the same settings keeps its plan, whatever the pool has
    got since.

    Raises:
        UserError: The pool is empty or lost what the plan needs, the folder holds a corpus that was
            planned otherwise, or another process works in it.

    """
    with store.alone(folder):
        made = _planned(folder, config, sources)
        for message in made.messages:
            hands.say(message)
        return carry_out(folder, "assemble", assembly(folder, made, sources), hands)


def _planned(folder: Path, config: CorpusConfig, sources: Sources) -> Plan:
    if (folder / PLAN).exists():
        made = read_plan(folder)
        if made.config != config:
            raise UserError(
                f"{folder} holds a corpus that was planned with other settings. Choose another "
                f"folder, or delete {folder / PLAN} and what was made from it."
            )
        return made
    pool = sources.pool
    made = plan(pool.assets, config, _windy(pool, sources.composing)) if pool else plan((), config)
    write_plan(folder, made)
    return made


def _windy(pool: Pool, composing: ComposeConfig) -> Windy:
    weigher = partial(weigh, folder=pool.folder)
    return lambda names: moved_by_wind(_assets(pool, names), composing, weigher)


def assembly(folder: Path, made: Plan, sources: Sources) -> list[Job]:
    """Say what is to be done for every scene of a plan.

    Raises:
        UserError: The pool no longer has an asset of the plan.

    """
    pool = sources.pool
    if pool is None:
        return [_showcase_job(folder, scene) for scene in made.scenes]
    return [
        _compose_job(folder / SCENES / scene.name, pool, planned(scene, sources.composing), sources)
        for scene in made.scenes
    ]


def planned(scene: PlannedScene, composing: ComposeConfig) -> ComposeConfig:
    """Say how one scene of a plan is composed."""
    return replace(
        composing,
        assets=scene.assets,
        seed=scene.seed,
        arrangement=scene.arrangement,
        interaction=scene.interaction,
    )


def _compose_job(folder: Path, pool: Pool, config: ComposeConfig, sources: Sources) -> Job:
    assets = _assets(pool, config.assets)
    capturing = replace(sources.capturing, threads=None)
    configs = [asdict(replace(config, record=None)), asdict(capturing)]
    inputs = [*(a.sha256 for a in assets), *runner.files_read(config)]
    few = Pool(pool.folder.resolve(), assets)
    return Job(
        name=folder.name,
        function=planned_scene,
        folder=folder,
        key=store.key("corpus assemble", configs, inputs),
        arguments={"pool": few, "config": config, "capturing": sources.capturing},
    )


def _showcase_job(folder: Path, scene: PlannedScene) -> Job:
    return Job(
        name=scene.name,
        function=showcase_scene,
        folder=folder / SCENES / scene.name,
        key=store.key("corpus assemble", {"showcase": scene.name}, []),
        arguments={"name": scene.name},
    )


def compose_scene(
    folder: Path, progress: Progress, pool: Pool, config: ComposeConfig, capturing: CaptureConfig
) -> None:
    """Compose one scene and take its pictures, in the process of a worker."""
    weigher = partial(weigh, folder=pool.folder)
    compose(pool, folder, config, lambda d, words: progress(SETTLED * d, words), weigher)
    if capturing.views:
        scene = read_model(folder / "scene.glb").scene
        views = capture(
            scene, capturing, lambda d, words: progress(SETTLED + (1 - SETTLED) * d, words)
        )
        write_views(folder / VIEWS, views)


def planned_scene(
    folder: Path, progress: Progress, pool: Pool, config: ComposeConfig, capturing: CaptureConfig
) -> None:
    """Compose a scene of a plan; where it does not come to rest, from other seeds and otherwise.

    Raises:
        UserError: It never came to rest; the reason is that of the planned way.

    """
    first: UserError | None = None
    for way in ways(config):
        try:
            return compose_scene(folder, progress, pool, way, capturing)
        except UserError as error:
            first = first or error
    assert first is not None
    raise first


def ways(config: ComposeConfig) -> list[ComposeConfig]:
    """Return how a planned scene may be composed, the best way first.

    As planned; then from other seeds; then standing otherwise, as its interaction allows.
    """
    seeds = [int(n) for n in np.random.SeedSequence(config.seed).generate_state(SEEDS)]
    same = [config, *(replace(config, seed=n) for n in seeds)]
    if len(config.assets) < 2 or config.interaction not in KINDS:
        return same
    others = [a for a in STANDING[config.interaction] if a != config.arrangement]
    return same + [replace(config, arrangement=a) for a in others]


def showcase_scene(folder: Path, progress: Progress, name: str) -> None:
    """Write one scene of the showcase, in the process of a worker."""
    progress(0.0, "building")
    path = runner.write_showcase(name, folder)
    path = path.rename(folder / "scene.glb")
    write_scene_file(folder / SCENE, SceneFile(folder / SCENE, file=path))


def _assets(pool: Pool, names: Sequence[str]) -> tuple[Asset, ...]:
    found = [pool.asset(name) for name in names]
    gone = [name for name, asset in zip(names, found, strict=True) if asset is None]
    if gone:
        raise UserError(
            f"{pool.folder} no longer has {', '.join(gone)}, which the corpus was planned with. "
            "Choose another folder for a new corpus."
        )
    return tuple(asset for asset in found if asset is not None)
