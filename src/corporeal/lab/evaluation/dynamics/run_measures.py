"""Measures of one run for comparison, stored as JSON: paths, outcome, audit."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from corporeal.core import store
from corporeal.core.audit_data import Expectation, Outcome, PartAudit
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError
from corporeal.core.types import Vector
from corporeal.lab.evaluation.dynamics.compared_methods import NUMBERS_FILE
from corporeal.materials import find_material, find_material_or_default
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.results import StageResults
from corporeal.showcase.scene_expectations import compare_with_expectations
from corporeal.simulation.audit import breach_messages, passage_message, reject_expectations
from corporeal.simulation.audit_file import read_audit


@dataclass(frozen=True)
class ObjectMeasures:
    """One object, and the path of its centre of mass."""

    name: str
    diagonal: float
    """Of its box at the start [m]."""
    path: tuple[Vector, ...]
    """One place per instant [m]."""
    young_pa: float
    """Of its materials, the mean of their logarithms by mass [Pa]: as they are in reality."""
    restitution: float
    """Of its heaviest part's material [-]."""
    groups: tuple[str, ...]
    """Material classes of its parts."""
    laws: tuple[str, ...]
    """Laws of its parts, as simulated."""

    @property
    def places(self) -> Float[np.ndarray, "F 3"]:
        """The path as an array [m]."""
        return np.array(self.path)


@dataclass(frozen=True)
class RunMeasures:
    """One run, as it is compared with others."""

    time: tuple[float, ...]
    """[s]"""
    bodies: tuple[ObjectMeasures, ...]
    outcome: Outcome
    faults: tuple[str, ...]
    """What the audit finds wrong, in sentences; empty: it is clean."""
    growth: float
    """Of kinetic and elastic energy from nowhere, relative [-]."""
    overlap_dx: float
    """Deepest, of objects or with the floor [cells]."""
    expectations: tuple[Expectation, ...]
    """Of scenes of the showcase."""
    seconds: float
    """Of computing the simulation [s]."""
    particles: int
    steps: int
    notes: tuple[str, ...] = ()
    """What was borrowed, in sentences."""
    source: str = ""
    """Names the state of the code that simulated it; empty: not known."""


def measure_run(folder: Path) -> RunMeasures:
    """Measure a run that is done up to simulate.

    Raises:
        BadFileError: Its audit cannot be read.
    """
    made = run_pipeline.read_run(folder)
    simulated = folder / run_pipeline.STAGE_FOLDERS["simulate"]
    audit = read_audit(simulated)
    happened = made.played.outcome
    ran = {row.verb: row.seconds for row in run_pipeline.stage_states(folder)}
    library = run_pipeline.read_run_request(folder).settings.ground.library
    passed = tuple(f"{passage_message(pair)}." for pair in audit.surfaces if pair.passed)
    trajectory = made.trajectory
    return RunMeasures(
        time=tuple(trajectory.time.tolist()),
        bodies=tuple(_body(made, k, audit.parts, library) for k in range(len(made.scene.objects))),
        outcome=happened,
        faults=(*breach_messages(audit), *passed),
        growth=audit.mechanical_growth,
        overlap_dx=audit.max_penetration_dx,
        expectations=reject_expectations(compare_with_expectations(made.scene.name, happened), audit),
        seconds=ran["simulate"] or 0.0,
        particles=audit.particles,
        steps=audit.steps,
        notes=made.field.notes,
        source=store.read_meta(simulated).source,
    )


def _body(made: StageResults, number: int, rows: tuple[PartAudit, ...], library: str) -> ObjectMeasures:
    thing, particles = made.scene.objects[number], made.particles
    own = [k for k, part in enumerate(made.parts.catalogue) if part.object == number]
    mass = np.array([particles.mass_real[k] for k in own])
    start = particles.position[particles.object == number]
    path = made.trajectory.ledger.centre[:, number]
    young_pa = np.array([rows[k].young_pa for k in own])
    heaviest = made.field.materials[own[int(mass.argmax())]]
    return ObjectMeasures(
        name=thing.name,
        diagonal=float(np.linalg.norm(np.ptp(start, axis=0))),
        path=tuple((x, y, z) for x, y, z in path.tolist()),
        young_pa=float(np.exp(np.average(np.log(young_pa), weights=np.maximum(mass, 1e-30)))),
        restitution=heaviest.restitution,
        groups=tuple(dict.fromkeys(_group(rows[k].material, library) for k in own)),
        laws=tuple(
            dict.fromkeys("rigid body" if rows[k].treatment == "rigid" else rows[k].law.replace("_", " ") for k in own)
        ),
    )


def _group(material: str, library: str) -> str:
    return find_material_or_default(material, library).group or find_material(material).group


def write_run_measures(folder: Path, numbers: RunMeasures) -> None:
    """Keep what is compared of a run in its folder."""
    store.write_json(folder / NUMBERS_FILE, numbers)


def read_run_measures(folder: Path) -> RunMeasures:
    """Read back what is compared of a run.

    Raises:
        BadFileError: It is absent or damaged.
    """
    path = folder / NUMBERS_FILE
    try:
        return from_plain(RunMeasures, store.read_json(path))
    except (ValueError, TypeError, AttributeError) as error:
        what = f"is not a file of this version ({error})."
        raise BadFileError(path, what, f"Remove {folder}; it is then run again.") from error
