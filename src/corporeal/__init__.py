"""Gives reconstructed scenes a body: what each point is made of, and how it all moves.

Everything in ``__all__`` is loaded when it is first used: ``import corporeal`` itself imports no
NumPy, no Warp, nothing of the package. ``docs/reference/api-on-one-page.md`` shows the
whole surface.
"""

# ruff: noqa: F401

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the names of ``_HOME`` once more, for type checkers: a test holds them equal
    from corporeal.core.errors import SimulationError, UserError
    from corporeal.core.types import Finish, Push, Scene, Wind
    from corporeal.core.version import __version__
    from corporeal.description.describe_config import DescribeConfig
    from corporeal.export.export_scene import export_scene as export_scene
    from corporeal.export.export_target import ExportConfig
    from corporeal.io.gltf.glb_writer import write_glb
    from corporeal.io.photos.transforms_json import write_views
    from corporeal.io.usd.usd_bodies import read_usd_physics
    from corporeal.jobs.local_workers import local_executor
    from corporeal.lab.corpus.assemble_corpus import Sources, assemble_corpus
    from corporeal.lab.corpus.corpus_plan import CorpusConfig
    from corporeal.lab.corpus.corpus_report import report_corpus
    from corporeal.lab.corpus.run_corpus import RunConfig, run_corpus
    from corporeal.lab.evaluation.outcome_ensemble import simulate_ensemble
    from corporeal.materials import citation, friction_between, library
    from corporeal.materials import find_material as material
    from corporeal.mpm.engines import build_engine
    from corporeal.mpm.problem import ENGINES as ENGINES
    from corporeal.mpm.problem import FLOOR, Body, Engine, Plane, Problem
    from corporeal.pipeline.in_memory import load_scene, pose_problem, prepare_scene, simulate_scene
    from corporeal.pipeline.run_pipeline import Settings, run
    from corporeal.pipeline.stages.assemble import AssembleConfig, assemble
    from corporeal.pipeline.stages.capture import CaptureConfig, capture
    from corporeal.pipeline.stages.compose import ComposeConfig, compose
    from corporeal.pipeline.stages.describe import describe
    from corporeal.pipeline.stages.fill import FillConfig, fill
    from corporeal.pipeline.stages.ground import GroundConfig, ground
    from corporeal.pipeline.stages.reconstruct import reconstruct
    from corporeal.pipeline.stages.report import report
    from corporeal.pipeline.stages.segment import SegmentConfig, segment
    from corporeal.pipeline.stages.simulate import SimulateConfig, simulate
    from corporeal.pipeline.stages.video import VideoConfig, render_video
    from corporeal.pool.pool_index import index_pool as index_pool
    from corporeal.pool.pool_index import read_pool
    from corporeal.reconstruction.reconstruct_config import ReconstructConfig
    from corporeal.scene.scene_building import Solid, ball, box, build_scene, cylinder, solid
    from corporeal.showcase.showcase_scenes import build_showcase_scene as showcase_scene
    from corporeal.simulation.simulation_result import PreparedScene, SimulationResult

_HOME = {
    # a scene: built from nouns, or loaded
    "Solid": "scene.scene_building:Solid",
    "ball": "scene.scene_building:ball",
    "box": "scene.scene_building:box",
    "cylinder": "scene.scene_building:cylinder",
    "solid": "scene.scene_building:solid",
    "build_scene": "scene.scene_building:build_scene",
    "load_scene": "pipeline.in_memory:load_scene",
    "showcase_scene": "showcase.showcase_scenes:build_showcase_scene",
    "write_glb": "io.gltf.glb_writer:write_glb",
    "Scene": "core.types:Scene",
    "Push": "core.types:Push",
    "Wind": "core.types:Wind",
    "Finish": "core.types:Finish",
    # everything at once: in memory, or in a run's folder
    "prepare_scene": "pipeline.in_memory:prepare_scene",
    "PreparedScene": "simulation.simulation_result:PreparedScene",
    "simulate_scene": "pipeline.in_memory:simulate_scene",
    "SimulationResult": "simulation.simulation_result:SimulationResult",
    "run": "pipeline.run_pipeline:run",
    "Settings": "pipeline.run_pipeline:Settings",
    # the verbs one by one, and their settings
    "compose": "pipeline.stages.compose:compose",
    "ComposeConfig": "pipeline.stages.compose:ComposeConfig",
    "assemble": "pipeline.stages.assemble:assemble",
    "AssembleConfig": "pipeline.stages.assemble:AssembleConfig",
    "capture": "pipeline.stages.capture:capture",
    "CaptureConfig": "pipeline.stages.capture:CaptureConfig",
    "write_views": "io.photos.transforms_json:write_views",
    "reconstruct": "pipeline.stages.reconstruct:reconstruct",
    "ReconstructConfig": "reconstruction.reconstruct_config:ReconstructConfig",
    "describe": "pipeline.stages.describe:describe",
    "DescribeConfig": "description.describe_config:DescribeConfig",
    "segment": "pipeline.stages.segment:segment",
    "SegmentConfig": "pipeline.stages.segment:SegmentConfig",
    "ground": "pipeline.stages.ground:ground",
    "GroundConfig": "pipeline.stages.ground:GroundConfig",
    "fill": "pipeline.stages.fill:fill",
    "FillConfig": "pipeline.stages.fill:FillConfig",
    "simulate": "pipeline.stages.simulate:simulate",
    "SimulateConfig": "pipeline.stages.simulate:SimulateConfig",
    "render_video": "pipeline.stages.video:render_video",
    "VideoConfig": "pipeline.stages.video:VideoConfig",
    "report": "pipeline.stages.report:report",
    # out into other tools
    "export_scene": "export.export_scene:export_scene",
    "ExportConfig": "export.export_target:ExportConfig",
    "read_usd_physics": "io.usd.usd_bodies:read_usd_physics",
    # the engine
    "pose_problem": "pipeline.in_memory:pose_problem",
    "build_engine": "mpm.engines:build_engine",
    "ENGINES": "mpm.problem:ENGINES",
    "Engine": "mpm.problem:Engine",
    "Problem": "mpm.problem:Problem",
    "Body": "mpm.problem:Body",
    "Plane": "mpm.problem:Plane",
    "FLOOR": "mpm.problem:FLOOR",
    # the material library
    "library": "materials:library",
    "material": "materials:find_material",
    "friction_between": "materials:friction_between",
    "citation": "materials:citation",
    # many scenes, and one scene many times
    "simulate_ensemble": "lab.evaluation.outcome_ensemble:simulate_ensemble",
    "index_pool": "pool.pool_index:index_pool",
    "read_pool": "pool.pool_index:read_pool",
    "assemble_corpus": "lab.corpus.assemble_corpus:assemble_corpus",
    "CorpusConfig": "lab.corpus.corpus_plan:CorpusConfig",
    "Sources": "lab.corpus.assemble_corpus:Sources",
    "local_executor": "jobs.local_workers:local_executor",
    "run_corpus": "lab.corpus.run_corpus:run_corpus",
    "RunConfig": "lab.corpus.run_corpus:RunConfig",
    "report_corpus": "lab.corpus.corpus_report:report_corpus",
    # what can go wrong
    "UserError": "core.errors:UserError",
    "SimulationError": "core.errors:SimulationError",
    "__version__": "core.version:__version__",
}
"""Public name → "module:attribute" within the package."""

__all__ = list(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'corporeal' has no attribute {name!r}")
    module, _, attribute = _HOME[name].partition(":")
    value = getattr(import_module(f"corporeal.{module}"), attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted({*globals(), *__all__})
