"""Controls that are simulated: the reference's own scene, with one fault.

``single`` and ``capped`` are settings of the simulation; ``halfgravity`` is another scene; ``wrong`` exchanges stiff
and soft materials. Each is an ordinary run in a folder of its own, so what is finished is not done again.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from corporeal.core import store
from corporeal.core.types import MaterialField, Parts, Scene
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import Settings
from corporeal.simulation.simulation_result import SimulationResult

SIMULATED_CONTROLS = ("halfgravity", "wrong", "single", "capped")
REMAINING_GRAVITY_FRACTION = 0.5
"""Of gravity that is left in the control "halfgravity" [-]."""


@dataclass(frozen=True)
class ControlRequest:
    """What a control's run is asked to do."""

    inputs: list[Path]
    settings: Settings


def order_control(control: str, reference: Path, folder: Path) -> ControlRequest | None:
    """Write down how a control of a reference run is simulated; None: it does not apply.

    Args:
        control: One of ``SIMULATED_CONTROLS``.
        reference: Folder of our own run.
        folder: Where files that only the control needs are kept.

    Raises:
        UserError: The reference is not a finished run.

    """
    asked = run_pipeline.read_run_request(reference)
    settings = asked.settings
    if control == "single":
        return ControlRequest(asked.inputs, replace(settings, simulate=replace(settings.simulate, contact="single")))
    if control == "capped":
        return ControlRequest(asked.inputs, replace(settings, fill=replace(settings.fill, stiffness="capped")))
    made = run_pipeline.read_run(reference)
    if control == "halfgravity":
        return ControlRequest([_lighter(made.scene, folder)], settings)
    said = exchange_materials(made.scene, made.parts, made.field)
    if not said:
        return None
    store.write_bytes(folder / "exchanged.yaml", yaml.safe_dump(said).encode())
    describe = replace(settings.describe, annotations=folder / "exchanged.yaml")
    return ControlRequest(asked.inputs, replace(settings, describe=describe))


def simulate_control(
    control: str, reference: Path, folder: Path, tell: run_pipeline.ProgressOfStage = run_pipeline.no_progress_of_stage
) -> SimulationResult | None:
    """Simulate a control, or read it back where it is finished; None: it does not apply.

    Args:
        control: One of ``SIMULATED_CONTROLS``.
        reference: Folder of our own run.
        folder: Of the control's run.
        tell: Progress callback of each stage.

    Raises:
        UserError: The scene cannot be simulated so.

    """
    order = order_control(control, reference, folder.parent / f"{folder.name}-input")
    if order is None:
        return None
    run_pipeline.run(order.inputs, folder, order.settings, tell, until="simulate")
    return run_pipeline.read_run(folder).played


def exchange_materials(scene: Scene, parts: Parts, field: MaterialField) -> dict[str, dict]:
    """Give the stiffest part the softest part's material, and so on; annotations of all parts.

    Parts of liquids and grains keep theirs. Nothing is returned where all others are alike.
    """
    solid = [k for k, m in enumerate(field.materials) if not CONSTITUTIVE_LAWS[m.law].loose]
    order = sorted(solid, key=lambda k: (field.materials[k].young_pa, k))
    said: dict[str, dict] = {}
    for mine, theirs in zip(order, reversed(order), strict=True):
        if field.materials[mine].name == field.materials[theirs].name:
            continue
        part = parts.catalogue[mine]
        of_object = said.setdefault(scene.objects[part.object].name, {"parts": {}})
        of_object["parts"][part.name] = {"material": field.materials[theirs].name, "structure": "solid"}
    return said


def _lighter(scene: Scene, folder: Path) -> Path:
    x, y, z = (REMAINING_GRAVITY_FRACTION * g for g in scene.gravity)
    path = folder / f"{scene.name}.glb"
    with store.disk_errors(path):
        folder.mkdir(parents=True, exist_ok=True)
        write_glb(path, replace(scene, gravity=(x, y, z)))
    return path
