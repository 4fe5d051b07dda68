"""Gives reconstructed scenes a body: what each point is made of, and how it all moves.

Everything in ``__all__`` is loaded when it is first used: ``import corporeal`` itself imports no
NumPy, no Warp, nothing of the package. ``docs/api.md`` shows the whole surface on one page.
"""

# ruff: noqa: F401

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the names of ``_HOME`` once more, for type checkers: a test holds them equal
    from corporeal.corpus.assemble import Sources, assemble_corpus
    from corporeal.corpus.local import local_hands
    from corporeal.corpus.plan import CorpusConfig
    from corporeal.corpus.report import report_corpus
    from corporeal.corpus.run import RunConfig, run_corpus
    from corporeal.description.describe_config import DescribeConfig
    from corporeal.errors import SimulationError, UserError
    from corporeal.evaluation.ensemble import ensemble
    from corporeal.export.export import export as export_scene
    from corporeal.export.target import ExportConfig
    from corporeal.formats.glb_writer import write_glb
    from corporeal.formats.transforms import write_views
    from corporeal.formats.usd_bodies import read_usd_physics
    from corporeal.in_memory import (
        build_engine,
        load_scene,
        play,
        pose_problem,
        prepare,
    )
    from corporeal.materials import citation, friction_between, library
    from corporeal.materials import find as material
    from corporeal.mpm.problem import FLOOR, Body, Engine, Plane, Problem
    from corporeal.mpm.problem import MENU as ENGINES
    from corporeal.pipeline import Settings, run
    from corporeal.pool.index import index as index_pool
    from corporeal.pool.index import read_pool
    from corporeal.reconstruction.reconstruct_config import ReconstructConfig
    from corporeal.scene_building import Solid, ball, box, build_scene, cylinder, solid
    from corporeal.showcase.scenes import build as showcase_scene
    from corporeal.stages.assemble import AssembleConfig, assemble
    from corporeal.stages.capture import CaptureConfig, capture
    from corporeal.stages.compose import ComposeConfig, compose
    from corporeal.stages.describe import describe
    from corporeal.stages.fill import FillConfig, fill
    from corporeal.stages.film import FilmConfig, film
    from corporeal.stages.ground import GroundConfig, ground
    from corporeal.stages.reconstruct import reconstruct
    from corporeal.stages.report import report
    from corporeal.stages.segment import SegmentConfig, segment
    from corporeal.stages.simulate import SimulateConfig, simulate
    from corporeal.trajectory.played import Played, Prepared
    from corporeal.types import Finish, Push, Scene, Wind
    from corporeal.version import __version__

_HOME = {
    # a scene: built from nouns, or loaded
    "Solid": "scene_building:Solid",
    "ball": "scene_building:ball",
    "box": "scene_building:box",
    "cylinder": "scene_building:cylinder",
    "solid": "scene_building:solid",
    "build_scene": "scene_building:build_scene",
    "load_scene": "in_memory:load_scene",
    "showcase_scene": "showcase.scenes:build",
    "write_glb": "formats.glb_writer:write_glb",
    "Scene": "types:Scene",
    "Push": "types:Push",
    "Wind": "types:Wind",
    "Finish": "types:Finish",
    # everything at once: in memory, or in a run's folder
    "prepare": "in_memory:prepare",
    "Prepared": "trajectory.played:Prepared",
    "play": "in_memory:play",
    "Played": "trajectory.played:Played",
    "run": "pipeline:run",
    "Settings": "pipeline:Settings",
    # the verbs one by one, and their settings
    "compose": "stages.compose:compose",
    "ComposeConfig": "stages.compose:ComposeConfig",
    "assemble": "stages.assemble:assemble",
    "AssembleConfig": "stages.assemble:AssembleConfig",
    "capture": "stages.capture:capture",
    "CaptureConfig": "stages.capture:CaptureConfig",
    "write_views": "formats.transforms:write_views",
    "reconstruct": "stages.reconstruct:reconstruct",
    "ReconstructConfig": "reconstruction.reconstruct_config:ReconstructConfig",
    "describe": "stages.describe:describe",
    "DescribeConfig": "description.describe_config:DescribeConfig",
    "segment": "stages.segment:segment",
    "SegmentConfig": "stages.segment:SegmentConfig",
    "ground": "stages.ground:ground",
    "GroundConfig": "stages.ground:GroundConfig",
    "fill": "stages.fill:fill",
    "FillConfig": "stages.fill:FillConfig",
    "simulate": "stages.simulate:simulate",
    "SimulateConfig": "stages.simulate:SimulateConfig",
    "film": "stages.film:film",
    "FilmConfig": "stages.film:FilmConfig",
    "report": "stages.report:report",
    # out into other tools
    "export_scene": "export.export:export",
    "ExportConfig": "export.target:ExportConfig",
    "read_usd_physics": "formats.usd_bodies:read_usd_physics",
    # the engine
    "pose_problem": "in_memory:pose_problem",
    "build_engine": "in_memory:build_engine",
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
    "ensemble": "evaluation.ensemble:ensemble",
    "index_pool": "pool.index:index",
    "read_pool": "pool.index:read_pool",
    "assemble_corpus": "corpus.assemble:assemble_corpus",
    "CorpusConfig": "corpus.plan:CorpusConfig",
    "Sources": "corpus.assemble:Sources",
    "local_hands": "corpus.local:local_hands",
    "run_corpus": "corpus.run:run_corpus",
    "RunConfig": "corpus.run:RunConfig",
    "report_corpus": "corpus.report:report_corpus",
    # what can go wrong
    "UserError": "errors:UserError",
    "SimulationError": "errors:SimulationError",
    "__version__": "version:__version__",
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
