"""A scene in memory: load it, prepare it, pose it for an engine, or play it; no run's folder.

``pipeline.run`` does the same verbs in a folder and keeps what each one made.
"""

import shutil
import tempfile
import weakref
from collections.abc import Callable
from pathlib import Path

from corporeal.core import registry
from corporeal.core.errors import UserError
from corporeal.core.types import Scene
from corporeal.discretization.build_model import build_model
from corporeal.geometry.gaussian_transforms import UpAxisChoice, chosen_up_axis
from corporeal.io.input_files import input_kind
from corporeal.mpm.problem import ENGINES, Engine, Problem
from corporeal.pipeline.mass_posterior import ground_with_mass_posterior
from corporeal.pipeline.run_pipeline import Settings
from corporeal.pipeline.stages.assemble import AssembleConfig, assemble
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.fill import fill
from corporeal.pipeline.stages.segment import segment
from corporeal.pipeline.stages.simulate import SimulateConfig, simulate
from corporeal.scene.vessel_contents import add_vessel_contents
from corporeal.simulation.simulation_result import PreparedScene, SimulationResult

Progress = Callable[[float, str], None]
DEFAULT_SETTINGS = Settings()
DEFAULT_ENGINE = SimulateConfig().engine


def no_progress(fraction: float, words: str) -> None:
    """Tell nobody about progress."""


def load_scene(
    path: str | Path, config: AssembleConfig = DEFAULT_SETTINGS.assemble, up: UpAxisChoice = "auto"
) -> Scene:
    """Read a scene from a model (glTF or a mesh), a folder of them, or a ``scene.toml``.

    Args:
        path: The file or the folder.
        config: What counts as one object, sizes, duration.
        up: Which axis of a mesh points up; auto: as its file states, or as its kind usually has it.

    Returns:
        The scene in metres, +Z up, nothing below the floor at z = 0.

    Raises:
        UserError: There is no such file, or it cannot be used; photographs and splats hold no
            objects before they are reconstructed.

    """
    path = Path(path)
    if not path.exists():
        raise UserError(f"No such file: {path}. Check the path.")
    kind = input_kind([path])
    if kind != "model":
        raise UserError(
            f"{path} holds a {'splat' if kind == 'splat' else 'set of photographs'}, which must be "
            "reconstructed first: corporeal.run([path], folder) does everything."
        )
    return assemble([path], config, chosen_up_axis(up))


def prepare_scene(
    scene: Scene, settings: Settings = DEFAULT_SETTINGS, progress: Progress = no_progress
) -> PreparedScene:
    """Find the parts of a scene, give them materials, and fill them with material points.

    The verbs describe, segment, ground and fill, in this order.

    Args:
        scene: From ``load_scene`` or ``build_scene``.
        settings: Of the four verbs.
        progress: Told the fraction done and what is being done.

    Raises:
        UserError: A setting makes no sense, or the scene cannot be filled.

    """
    progress(0.0, "recognising")
    inventory = describe(scene, settings.describe, settings.ground.library)
    progress(0.3, "finding parts")
    parts = segment(scene, inventory, settings.segment)
    progress(0.5, "looking numbers up")
    field = ground_with_mass_posterior(scene, parts, inventory, settings.ground)
    progress(0.6, "filling with particles")
    particles = fill(scene, parts, field, settings.fill)
    whole = add_vessel_contents(scene, parts, field, particles.contents)
    return PreparedScene(whole.scene, inventory, whole.parts, whole.field, particles)


def pose_problem(prepared: PreparedScene, settings: Settings = DEFAULT_SETTINGS) -> Problem:
    """Return what an engine solves: bodies in the order of the scene's objects, and the floor.

    An object that is partly rigid gives a soft body and then each rigid inclusion.

    Args:
        prepared: The scene.
        settings: ``settings.simulate.contact`` is used.

    """
    contact = settings.simulate.contact
    return build_model(prepared.scene, prepared.particles, prepared.field, contact).problem


def build_engine(problem: Problem, engine: str = DEFAULT_ENGINE) -> Engine:
    """Return an engine at time 0 of a problem.

    Args:
        problem: From ``pose_problem``, or built by hand.
        engine: A name from ``corporeal.ENGINES``.

    Raises:
        UnknownChoiceError: There is no such engine.
        UserError: The engine does not work on this machine, or cannot solve the problem.

    """
    return registry.load_backend("engine", engine, ENGINES)(problem)


def simulate_scene(
    scene: Scene | PreparedScene,
    settings: Settings = DEFAULT_SETTINGS,
    folder: str | Path | None = None,
    progress: Progress = no_progress,
) -> SimulationResult:
    """Simulate a scene through its duration.

    Args:
        scene: As built or loaded, or prepared already.
        settings: Of the verbs from describe to simulate.
        folder: Where the frames go; None: a temporary folder that goes with the result.
        progress: Told the fraction done and what is being done.

    Raises:
        UserError: A setting makes no sense, or the scene cannot be filled.
        SimulationError: The state became impossible.

    """
    ready = scene if isinstance(scene, PreparedScene) else prepare_scene(scene, settings, progress)
    place = Path(tempfile.mkdtemp(prefix="corporeal-") if folder is None else folder)
    try:
        given = ready.scene, ready.particles, ready.field, settings.simulate
        trajectory = simulate(*given, place, progress)
    except BaseException:
        if folder is None:
            shutil.rmtree(place, ignore_errors=True)
        raise
    if folder is None:
        weakref.finalize(trajectory.frames, shutil.rmtree, place, ignore_errors=True)
    return SimulationResult(ready.broken(trajectory.breaks), trajectory)
