"""A corpus is assembled from a pool and run, and every result has a name that covers its causes."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_jobs import silent

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.discretization.object_scaling import SceneSizing
from corporeal.jobs.executor import Executor
from corporeal.jobs.job import Job
from corporeal.jobs.local_workers import local_worker_pool
from corporeal.lab.corpus.assemble_corpus import Sources, assemble_corpus, assembly_jobs, fallback_compose_configs
from corporeal.lab.corpus.corpus_plan import CorpusConfig, plan_corpus, read_plan
from corporeal.lab.corpus.corpus_report import report_corpus
from corporeal.lab.corpus.run_corpus import RunConfig, forget_runs, run_corpus, run_scene
from corporeal.pipeline.run_pipeline import Settings
from corporeal.pipeline.stages.assemble import AssembleConfig
from corporeal.pipeline.stages.capture import CaptureConfig
from corporeal.pipeline.stages.compose import ComposeConfig
from corporeal.pipeline.stages.video import VideoConfig
from corporeal.pool.asset_pool import AssetPool, PoolAsset
from corporeal.scene.interactions import ARRANGEMENTS_OF_KIND
from glb_maker import CUBE, CUBE_TRIANGLES, Maker

CLASSES = {"brick": (2, 1, 1), "box": (1, 1, 1), "wood block": (1, 1, 2), "book": (2, 1, 3)}
"""Sides of the boxes that stand in for models [dm]."""
SMALL = CaptureConfig(views=1, size=(32, 32), threads=1)
CONFIG = CorpusConfig(scenes=5, count="1-3", seed=3)


@pytest.fixture(scope="module")
def pool(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pool")
    return AssetPool(folder, tuple(_asset(folder, *known) for known in CLASSES.items()))


def _asset(folder, name, sides):
    maker = Maker()
    sides = np.array(sides, np.float32) / 10
    maker.node(mesh=maker.mesh(CUBE * sides, CUBE_TRIANGLES))
    path = maker.save(folder / f"{name}.glb")
    extent = float(sides.max())
    return PoolAsset(name, name, path, "here", name * 4, "CC0", "me", extent, True, 12, 0.0, 0)


def keys(pool, folder="c", config=CONFIG, composing=ComposeConfig(), capturing=SMALL):  # noqa: B008
    made = plan_corpus(pool.assets, config)
    jobs = assembly_jobs(Path(folder), made, Sources(pool, composing, capturing))
    return {job.name: job.key for job in jobs}


def test_an_id_covers_settings_seed_and_bytes_and_nothing_else(pool):
    known = keys(pool)
    assert len(set(known.values())) == len(known)
    assert keys(pool, folder="elsewhere") == known
    assert keys(pool, capturing=replace(SMALL, threads=4)) == known
    assert keys(pool, composing=ComposeConfig(record=Path("answers"))) == known
    others = [
        keys(pool, composing=ComposeConfig(sizing=SceneSizing(metric=True))),
        keys(pool, capturing=replace(SMALL, views=2)),
        keys(pool, config=replace(CONFIG, seed=4)),
    ]
    assert not any(set(other.values()) & set(known.values()) for other in others)
    changed = [replace(a, sha256="other") if a.name == "box" else a for a in pool.assets]
    other = keys(AssetPool(pool.folder, tuple(changed)))
    used = {s.name: "box" in s.assets for s in plan_corpus(pool.assets, CONFIG).scenes}
    assert {name: other[name] != known[name] for name in known} == used


def test_a_scene_is_tried_as_planned_first_and_keeps_its_interaction_whatever_is_tried():
    config = ComposeConfig(assets=("a", "b"), seed=9, arrangement="stack", interaction="fall", count="2")
    tried = fallback_compose_configs(config)
    assert tried[0] == config and tried == fallback_compose_configs(config)
    assert {w.interaction for w in tried} == {"fall"} and len({w.seed for w in tried}) == 3
    assert {w.arrangement for w in tried} == set(ARRANGEMENTS_OF_KIND["fall"])
    alone = fallback_compose_configs(replace(config, assets=("a",), arrangement="scatter"))
    assert {w.arrangement for w in alone} == {"scatter"}


def test_a_pool_that_lost_what_was_planned_is_refused(pool):
    made = plan_corpus(pool.assets, CONFIG)
    fewer = AssetPool(pool.folder, pool.assets[1:])
    with pytest.raises(UserError, match=f"no longer has {pool.assets[0].name}"):
        assembly_jobs(Path("c"), made, Sources(fewer, ComposeConfig(), SMALL))


def test_nothing_assembled_is_nothing_to_run(tmp_path, pool):
    hands = Executor(lambda: local_worker_pool(1, 1, tmp_path / "logs"), silent, silent)
    with pytest.raises(UserError, match="not a corpus"):
        run_corpus(tmp_path, RunConfig(), Settings(), hands)
    with pytest.raises(UserError, match="no usable asset"):
        empty = Sources(AssetPool(tmp_path, ()), ComposeConfig(), SMALL)
        assemble_corpus(tmp_path, CONFIG, empty, hands)


@pytest.mark.slow
def test_a_corpus_comes_out_of_a_pool_and_is_neither_made_nor_run_twice(tmp_path, pool):
    few, sources, said = replace(CONFIG, scenes=3), Sources(pool, ComposeConfig(), SMALL), []
    hands = Executor(lambda: local_worker_pool(2, 1, tmp_path / "logs"), silent, said.append)
    rows = assemble_corpus(tmp_path, few, sources, hands)
    assert {r.status for r in rows.values()} == {"finished"}, rows
    for scene in read_plan(tmp_path).scenes:
        place = tmp_path / "scenes" / scene.name
        made = json.loads((place / "composition.json").read_text())
        assert made["interaction"] == scene.interaction
        assert [o["asset"] for o in made["objects"]] == list(scene.assets)
        proof = json.loads((place / "certificate.json").read_text())
        assert proof["drift_m"] < 1e-3 * proof["extent_m"]
        assert (place / "views" / "transforms.json").exists()
    with pytest.raises(UserError, match="planned with other settings"):
        assemble_corpus(tmp_path, replace(few, seed=8), sources, hands)
    more = Sources(AssetPool(pool.folder, (*pool.assets, replace(pool.assets[0], name="new"))),
                   ComposeConfig(), SMALL)  # fmt: skip
    assert assemble_corpus(tmp_path, few, more, hands) == rows, "a plan is kept"
    settings = Settings(assemble=AssembleConfig(duration=0.1), video=VideoConfig(width=64, height=48))
    ran = run_corpus(tmp_path, RunConfig(first=1), settings, hands)
    assert [r.status for r in ran.values()] == ["finished"], ran
    said.clear()
    assert run_corpus(tmp_path, RunConfig(first=1), settings, hands) == ran
    assert said == ["1 of 1 are done already."]
    page = report_corpus(tmp_path, silent)[0].read_text()
    assert page.count("data:image/jpeg") == 3, "a video, and views of what was not run"


def test_beginning_anew_forgets_what_was_finished_and_begun(tmp_path):
    run = tmp_path / "a"
    for folder in (run, run / "7-fill", run / "8-simulate"):
        store.finish_result(folder, "k", {}, 1.0)
    (run / "8-simulate" / "checkpoint.npz").touch()
    job = Job("a", run_scene, run, "k")
    assert job.done
    forget_runs([job, Job("b", run_scene, tmp_path / "b", "k")])
    assert not job.done and not (run / "8-simulate").exists()
    assert not store.is_fresh(run / "7-fill", "k") and not (tmp_path / "b").exists()
