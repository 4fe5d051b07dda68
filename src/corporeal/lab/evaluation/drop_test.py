"""Simulated drop tests of the objects in ``life.toml``."""

from dataclasses import dataclass, replace

import numpy as np

from corporeal.core.types import GRAVITY_M_S2, Scene
from corporeal.lab.evaluation.rebound_data import MeasuredRebound
from corporeal.mpm.engines import build_engine
from corporeal.mpm.problem import Diagnostics, Engine
from corporeal.pipeline.in_memory import pose_problem, prepare_scene
from corporeal.pipeline.run_pipeline import Settings
from corporeal.scene.scene_building import ball, box, build_scene

START_GAP_DIAMETERS = 0.1
"""How far above what it strikes a ball begins, over its diameter [-]."""
CHECKS_PER_DIAMETER = 2000
"""How often the ball is looked at while it falls its own diameter at its speed of impact."""


@dataclass(frozen=True)
class DropResult:
    """One object that was dropped in the simulation."""

    name: str
    detail: str
    seed: int
    restitution: float
    """Speed after over speed before [-]."""
    contact: float
    """How long it touched [s]."""
    treatment: str
    young_ratio: float
    """Simulated over real Young's modulus [-]."""
    unbooked: float
    """Energy lost that no loss accounts for, over that of the impact [-]; rigid ones lose theirs in their restitution,
    and have none.
    """
    steps: int


def drop_scene(row: MeasuredRebound) -> Scene:
    """Put the ball just above what it strikes, as fast as its fall has made it there."""
    radius, gap = 0.5 * row.diameter, START_GAP_DIAMETERS * row.diameter
    ground = row.on.size[2] if row.on else 0.0
    speed = np.sqrt(max(row.speed**2 - 2.0 * GRAVITY_M_S2 * gap, 0.0))
    material = row.material or "rubber"
    thing = ball(material, radius, (0.0, 0.0, ground + gap + radius), (0.0, 0.0, -speed), row.name)
    below = [box(row.on.material, row.on.size, name="block")] if row.on else []
    scene = build_scene(thing, *below, name="life", duration=0.1)
    said: dict = {"substance": row.material} if row.material else {}
    said |= {} if row.wall is None else {"shell_thickness_m": row.wall}
    said |= {} if row.inflation is None else {"inflation_kPa": 1e-3 * row.inflation}
    first, *others = scene.surfaces
    return replace(scene, surfaces=(replace(first, extras=said), *others))


def simulate_drop(row: MeasuredRebound, settings: Settings) -> DropResult:
    """Drop one object and watch until it has left what it struck.

    Raises:
        UserError: The settings don't go with it, or the simulation cannot go on.
    """
    settings = replace(settings, ground=replace(settings.ground, floor=row.floor))
    prepared = prepare_scene(drop_scene(row), settings)
    problem = pose_problem(prepared, settings)
    engine = build_engine(problem)
    first = engine.measure()
    speed = row.speed
    last = advance_until_rise(engine, row.diameter / speed / CHECKS_PER_DIAMETER * 10, 30.0 * row.diameter / speed)
    treatment = prepared.particles.treatments[0]
    met = contact_interval(last)
    after = last.momentum[0, 2] / last.mass[0] + GRAVITY_M_S2 * (last.time - met[1])
    rigid = treatment.kind == "rigid"
    return DropResult(
        row.name,
        settings.fill.detail,
        settings.fill.seed,
        float(max(after, 0.0) / speed),
        met[1] - met[0],
        treatment.kind,
        treatment.simulated_young_pa / treatment.young_pa if not rigid else 1.0,
        0.0 if rigid else unbooked_energy(first, last) / float(0.5 * first.mass[0] * speed**2),
        engine.steps.count,
    )


def contact_interval(now: Diagnostics) -> tuple[float, float]:
    """First and last instant [s] at which the ball touched anything; nan: it has not."""
    first, last = now.first_contact[0], now.last_contact[0]
    if not np.isfinite(first).any():
        return np.nan, np.nan
    return float(np.nanmin(first)), float(np.nanmax(last))


def advance_until_rise(engine: Engine, look: float, longest: float) -> Diagnostics:
    """Go on until the ball rises and has touched nothing for a fifth of the time it touched.

    Args:
        engine: At time 0.
        look: How often it is looked at [s].
        longest: What has not risen by then does not [s].
    """
    while engine.time < longest:
        engine.advance(engine.time + look)
        now = engine.measure()
        began, ended = contact_interval(now)
        rises = now.momentum[0, 2] > 0.0
        if rises and now.time - ended > max(0.2 * (ended - began), 2.0 * look):
            return now
    return engine.measure()


def unbooked_energy(first: Diagnostics, last: Diagnostics) -> float:
    """Energy [J] that is neither in motion, strain or height nor booked as lost."""
    energy = [m.kinetic.sum() + m.elastic.sum() + m.potential.sum() for m in (first, last)]
    booked = last.friction_loss + last.impact_loss + last.plastic_loss + last.viscous_loss
    return float(energy[0] - energy[1] - booked)
