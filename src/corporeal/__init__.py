"""Gives reconstructed scenes a body: what each point is made of, and how it all moves.

Everything in ``__all__`` is loaded when it is first used: ``import corporeal`` itself imports no
NumPy, no Warp, nothing of the package. ``docs/reference/api-on-one-page.md`` shows the
whole surface.
"""

# ruff: noqa: F401

import ast
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the public names: type checkers read these imports, and ``_read_homes`` does
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


def _read_homes() -> dict[str, tuple[str, str]]:
    """Return public name → module and attribute, from the imports above."""
    (block,) = (node for node in ast.parse(Path(__file__).read_text(encoding="utf-8")).body if isinstance(node, ast.If))
    imports = (line for line in block.body if isinstance(line, ast.ImportFrom))
    return {name.asname or name.name: (line.module or "", name.name) for line in imports for name in line.names}


_HOME = _read_homes()
__all__ = list(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'corporeal' has no attribute {name!r}")
    module, attribute = _HOME[name]
    value = getattr(import_module(module), attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, loaded or not."""
    return sorted({*globals(), *__all__})
