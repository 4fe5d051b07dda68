"""Gives reconstructed scenes a body: what each point is made of, and how it all moves.

Everything in ``__all__`` is loaded when it is first used: ``import corporeal`` itself imports no
NumPy, no Warp, nothing of the package. ``docs/api.md`` shows the whole surface on one page.
"""

# ruff: noqa: F401

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the names of ``_HOME`` once more, for type checkers: a test holds them equal
    from corporeal.core.errors import SimulationError, UserError
    from corporeal.core.types import Finish, Push, Scene, Wind
    from corporeal.core.version import __version__
    from corporeal.description.describe_config import DescribeConfig
    from corporeal.export.export import export as export_scene
    from corporeal.export.target import ExportConfig
    from corporeal.io.glb_writer import write_glb
    from corporeal.io.transforms import write_views
    from corporeal.io.usd_bodies import read_usd_physics
    from corporeal.jobs.local import local_hands
    from corporeal.lab.corpus.assemble import Sources, assemble_corpus
    from corporeal.lab.corpus.plan import CorpusConfig
    from corporeal.lab.corpus.report import report_corpus
    from corporeal.lab.corpus.run import RunConfig, run_corpus
    from corporeal.lab.evaluation.ensemble import ensemble
    from corporeal.materials import citation, friction_between, library
    from corporeal.materials import find as material
    from corporeal.mpm.problem import FLOOR, Body, Engine, Plane, Problem
    from corporeal.mpm.problem import MENU as ENGINES
    from corporeal.pipeline.in_memory import (
        build_engine,
        load_scene,
        play,
        pose_problem,
        prepare,
    )
    from corporeal.pipeline.runner import Settings, run
    from corporeal.pipeline.stages.assemble import AssembleConfig, assemble
    from corporeal.pipeline.stages.capture import CaptureConfig, capture
    from corporeal.pipeline.stages.compose import ComposeConfig, compose
    from corporeal.pipeline.stages.describe import describe
    from corporeal.pipeline.stages.fill import FillConfig, fill
    from corporeal.pipeline.stages.film import FilmConfig, film
    from corporeal.pipeline.stages.ground import GroundConfig, ground
    from corporeal.pipeline.stages.reconstruct import reconstruct
    from corporeal.pipeline.stages.report import report
    from corporeal.pipeline.stages.segment import SegmentConfig, segment
    from corporeal.pipeline.stages.simulate import SimulateConfig, simulate
    from corporeal.pool.index import index as index_pool
    from corporeal.pool.index import read_pool
    from corporeal.reconstruction.reconstruct_config import ReconstructConfig
    from corporeal.scene.scene_building import Solid, ball, box, build_scene, cylinder, solid
    from corporeal.showcase.scenes import build as showcase_scene
    from corporeal.simulation.played import Played, Prepared

_HOME = {
    # a scene: built from nouns, or loaded
    "Solid": "scene.scene_building:Solid",
    "ball": "scene.scene_building:ball",
    "box": "scene.scene_building:box",
    "cylinder": "scene.scene_building:cylinder",
    "solid": "scene.scene_building:solid",
    "build_scene": "scene.scene_building:build_scene",
    "load_scene": "pipeline.in_memory:load_scene",
    "showcase_scene": "showcase.scenes:build",
    "write_glb": "io.glb_writer:write_glb",
    "Scene": "core.types:Scene",
    "Push": "core.types:Push",
    "Wind": "core.types:Wind",
    "Finish": "core.types:Finish",
    # everything at once: in memory, or in a run's folder
    "prepare": "pipeline.in_memory:prepare",
    "Prepared": "simulation.played:Prepared",
    "play": "pipeline.in_memory:play",
    "Played": "simulation.played:Played",
    "run": "pipeline.runner:run",
    "Settings": "pipeline.runner:Settings",
    # the verbs one by one, and their settings
    "compose": "pipeline.stages.compose:compose",
    "ComposeConfig": "pipeline.stages.compose:ComposeConfig",
    "assemble": "pipeline.stages.assemble:assemble",
    "AssembleConfig": "pipeline.stages.assemble:AssembleConfig",
    "capture": "pipeline.stages.capture:capture",
    "CaptureConfig": "pipeline.stages.capture:CaptureConfig",
    "write_views": "io.transforms:write_views",
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
    "film": "pipeline.stages.film:film",
    "FilmConfig": "pipeline.stages.film:FilmConfig",
    "report": "pipeline.stages.report:report",
    # out into other tools
    "export_scene": "export.export:export",
    "ExportConfig": "export.target:ExportConfig",
    "read_usd_physics": "io.usd_bodies:read_usd_physics",
    # the engine
    "pose_problem": "pipeline.in_memory:pose_problem",
    "build_engine": "pipeline.in_memory:build_engine",
    "ENGINES": "mpm.problem:MENU",
    "Engine": "mpm.problem:Engine",
    "Problem": "mpm.problem:Problem",
    "Body": "mpm.problem:Body",
    "Plane": "mpm.problem:Plane",
    "FLOOR": "mpm.problem:FLOOR",
    # the material library
    "library": "materials:library",
    "material": "materials:find",
    "friction_between": "materials:friction_between",
    "citation": "materials:citation",
    # many scenes, and one scene many times
    "ensemble": "lab.evaluation.ensemble:ensemble",
    "index_pool": "pool.index:index",
    "read_pool": "pool.index:read_pool",
    "assemble_corpus": "lab.corpus.assemble:assemble_corpus",
    "CorpusConfig": "lab.corpus.plan:CorpusConfig",
    "Sources": "lab.corpus.assemble:Sources",
    "local_hands": "jobs.local:local_hands",
    "run_corpus": "lab.corpus.run:run_corpus",
    "RunConfig": "lab.corpus.run:RunConfig",
    "report_corpus": "lab.corpus.report:report_corpus",
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
