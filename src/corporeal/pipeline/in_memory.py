"""In-memory pipeline: load, prepare and simulate a scene without a run's folder.

``pipeline.run`` runs the same stages in a folder and stores their results.
"""

import shutil
import tempfile
import weakref
from pathlib import Path

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress
from corporeal.core.types import Scene
from corporeal.discretization.build_model import build_model
from corporeal.geometry.gaussian_transforms import UpAxisChoice, chosen_up_axis
from corporeal.io.input_files import input_kind
from corporeal.mpm.problem import Problem
from corporeal.pipeline.mass_posterior import ground_with_mass_posterior
from corporeal.pipeline.run_pipeline import Settings
from corporeal.pipeline.stages.assemble import AssembleConfig, assemble
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.fill import fill
from corporeal.pipeline.stages.segment import segment
from corporeal.pipeline.stages.simulate import simulate
from corporeal.scene.vessel_contents import add_vessel_contents
from corporeal.simulation.simulation_result import PreparedScene, SimulationResult

DEFAULT_SETTINGS = Settings()


def no_progress(fraction: float, words: str) -> None:
    """Ignore progress."""


def load_scene(
    path: str | Path, config: AssembleConfig = DEFAULT_SETTINGS.assemble, up: UpAxisChoice = "auto"
) -> Scene:
    """Read a scene from a model (glTF or a mesh), a folder of them, or a ``scene.toml``.

    Args:
        path: The file or the folder.
        config: Grouping into objects, sizes, duration.
        up: Which axis of a mesh points up; auto: as its file states, or as its kind usually has it.

    Returns:
        The scene in metres, +Z up, nothing below the floor at z = 0.

    Raises:
        UserError: The file does not exist or cannot be used; photographs and splats hold no
            objects before they are reconstructed.
    """
    path = Path(path)
    if not path.exists():
        raise UserError(f"No such file: {path}. Check the path.")
    kind = input_kind([path])
    if kind != "model":
        raise UserError(
            f"{path} holds a {'splat' if kind == 'splat' else 'set of photographs'}, which must be "
            "reconstructed first: use corporeal.run([path], folder)."
        )
    return assemble([path], config, chosen_up_axis(up))


def prepare_scene(
    scene: Scene, settings: Settings = DEFAULT_SETTINGS, progress: Progress = no_progress
) -> PreparedScene:
    """Find the parts of a scene, give them materials, and fill them with material points.

    The stages describe, segment, ground and fill, in this order.

    Args:
        scene: From ``load_scene`` or ``build_scene``.
        settings: Of the four stages.
        progress: Called with the fraction done and a description.

    Raises:
        UserError: A setting is invalid, or the scene cannot be filled.
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
    """Return the problem for an engine: bodies in the order of the scene's objects, and the floor.

    A partly rigid object gives a soft body, followed by its rigid frames.

    Args:
        prepared: The scene.
        settings: ``settings.simulate.contact`` is used.
    """
    contact = settings.simulate.contact
    return build_model(prepared.scene, prepared.particles, prepared.field, contact).problem


def simulate_scene(
    scene: Scene | PreparedScene,
    settings: Settings = DEFAULT_SETTINGS,
    folder: str | Path | None = None,
    progress: Progress = no_progress,
) -> SimulationResult:
    """Simulate a scene through its duration.

    Args:
        scene: As built or loaded, or prepared already.
        settings: Of the stages from describe to simulate.
        folder: Folder of the frames; None: a temporary folder that is deleted with the result.
        progress: Called with the fraction done and a description.

    Raises:
        UserError: A setting is invalid, or the scene cannot be filled.
        SimulationError: The simulation diverged.
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
