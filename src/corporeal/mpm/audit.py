"""The audit of a finished simulation, and what happened in it as numbers.

Everything is computed from what lies on disk: the frames and the ledger. ``audit`` says whether
the result can be trusted, with a sentence for every breach; ``outcome`` says what was seen.
"""

from typing import Any

import numpy as np

from corporeal.mpm.filled import acting
from corporeal.mpm.outcome import outcome
from corporeal.types import MaterialField, Particles, Scene, Trajectory

__all__ = ["audit", "outcome"]

ALLOWED = {
    "momentum_residual": 1e-3,
    "energy_growth": 0.05,
    "mechanical_growth": 0.01,
    "max_penetration_dx": 1.0,
    "mass_error": 0.01,
}
"""Beyond these, a sentence in the report says what it means for the result."""

Ledger = dict[str, np.ndarray]


def audit(
    scene: Scene,
    particles: Particles,
    field: MaterialField,
    trajectory: Trajectory,
    settling: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """Check a run against the laws it must obey. Field names are part of the interface.

    ``particles``, ``objects``, ``frames``, ``cell_m``, ``steps``, ``dt_min``, ``dt_max`` [s];
    ``nan_count`` and ``particles_out_of_domain`` (must be 0); ``momentum_residual``,
    ``energy_growth``, ``mechanical_growth`` (the same without booked losses), ``mass_error`` [-];
    ``max_penetration_m``, ``max_penetration_dx`` with
    ``floor_penetration_m`` and ``pair_penetration_m``; ``gravity_ramp_s``; ``parts``: one row
    each; ``settling``: how everything found its balance before time 0, None: it did not;
    ``warnings``: sentences.
    """
    ledger, cell = trajectory.ledger, particles.cell
    floor = float(ledger["plane_depth"].max(initial=0.0))
    pair = float(ledger["overlap"].max(initial=0.0))
    found: dict[str, Any] = {
        "particles": particles.count,
        "objects": len(scene.objects),
        "frames": len(trajectory.time),
        "cell_m": cell,
        "steps": int(ledger["steps"][-1]),
        "dt_min": float(ledger["dt_min"][-1]),
        "dt_max": float(ledger["dt_max"][-1]),
        "nan_count": int(ledger["nan"].max()),
        "particles_out_of_domain": int(ledger["lost"].max()),
        "momentum_residual": momentum_residual(ledger, scene, cell),
        "energy_growth": energy_growth(ledger, scene, cell),
        "mechanical_growth": energy_growth(ledger, scene, cell, with_losses=False),
        "mass_error": mass_error(particles),
        "max_penetration_m": max(floor, pair),
        "max_penetration_dx": max(floor, pair) / cell,
        "floor_penetration_m": floor,
        "pair_penetration_m": pair,
        "parts": part_rows(scene, particles, field),
        "settling": settling,
    }
    return found | {"warnings": [*particles.warnings, *unsettled(settling), *breaches(found)]}


# ------------------------------------------------------------------ laws


def momentum_residual(ledger: Ledger, scene: Scene, cell: float) -> float:
    """‖ΔP - impulses of gravity, pushes and walls‖ / max Σ m|v|, its largest over time [-].

    Where nothing moves, Σ m|v| is taken as that of a fall through one cell.
    """
    gained = ledger["momentum"].sum(axis=1) - ledger["momentum"][0].sum(axis=0)
    given = ledger["external_impulse"].sum(axis=1) + ledger["plane_impulse"].sum(axis=(1, 2))
    residual = np.linalg.norm(gained - given, axis=1).max()
    still = ledger["mass"][0].sum() * np.sqrt(2 * float(np.linalg.norm(scene.gravity)) * cell)
    scale = max(float(ledger["flow"].sum(axis=1).max()), still)
    return float(residual / scale) if scale > 0 else 0.0


def energy_growth(ledger: Ledger, scene: Scene, cell: float, with_losses: bool = True) -> float:
    """(max(E + dissipated - external work) - E₀) / max(E₀, work of gravity), relative [-].

    E is kinetic (with its affine part) and elastic; gravity's work is what the potential energy
    lost. Where neither is there to compare with, a fall through one cell is. Without the losses it
    is the growth of what moves and is strained alone: that no booking can hide or feign.
    """
    energy = (ledger["kinetic"] + ledger["elastic"]).sum(axis=1)
    fallen = ledger["potential"][0].sum() - ledger["potential"].sum(axis=1)
    lost = ledger["friction_loss"] + ledger["plastic_loss"] + ledger["viscous_loss"]
    lost = lost if with_losses else np.zeros_like(lost)
    balance = energy + lost - ledger["push_work"] - fallen
    small = ledger["mass"][0].sum() * float(np.linalg.norm(scene.gravity)) * cell
    scale = max(float(energy[0]), float(fallen.max()), float(ledger["push_work"].max()), small)
    growth = max(0.0, float((balance - balance[0]).max()))
    return growth / scale if scale > 0 else 0.0


def mass_error(particles: Particles) -> float:
    """Largest relative difference of a part's particles from its estimated mass [-]."""
    mass = np.bincount(particles.part, particles.mass, minlength=len(particles.mass_real))
    real = np.array(particles.mass_real)
    return float(np.max(np.abs(mass - real) / np.where(real > 0, real, 1.0), initial=0.0))


def part_rows(scene: Scene, particles: Particles, field: MaterialField) -> list[dict[str, Any]]:
    """One row per part: real and simulated numbers side by side (SI)."""
    first = {int(k): int(p) for p, k in reversed(list(enumerate(particles.part)))}
    owner = {k: scene.objects[particles.object[p]] for k, p in first.items()}
    return [
        {
            "name": words.name,
            "object": owner[k].name if k in owner else None,
            "material": material.name,
            "law": acting(material, structure, treatment).law.name.lower(),
            "treatment": treatment.kind,
            "structure": structure.kind,
            "E": treatment.young_real,
            "E_sim": treatment.young,
            "nu": acting(material, structure, treatment).poisson,
            "density": material.density,
            "density_sim": treatment.density,
            "yield_stress": material.yield_stress,
            "yield_stress_sim": treatment.yield_stress,
            "thickness_m": structure.thickness,
            "contents": structure.contents.name if structure.contents else None,
            "fill": structure.fill if structure.contents else None,
            "thickness_sim_m": treatment.thickness,
            "mass_kg": mass,
            "real_mass_kg": mass / owner[k].scale ** 3 if k in owner else None,
            "why": treatment.why,
        }
        for k, (words, material, treatment, structure, mass) in enumerate(
            zip(
                field.words,
                field.materials,
                particles.treatments,
                field.structures,
                particles.mass_real,
                strict=True,
            )
        )
    ]


# ------------------------------------------------------------------ sentences


def breaches(found: dict[str, Any]) -> list[str]:
    """Say in plain words what every breach means for the result."""
    depth = max(found["floor_penetration_m"], found["pair_penetration_m"])
    into = "the floor" if found["floor_penetration_m"] == depth else "each other"
    said = {
        "nan_count": "{0} numbers of the result are not numbers: the film shows nothing true. "
        "Report this.",
        "particles_out_of_domain": "{0} particles flew out of the scene: what they belonged to "
        "came apart for no physical reason.",
        "momentum_residual": "{0:.1%} of the momentum came from nowhere: speeds after impacts are "
        "off by about as much.",
        "energy_growth": "The books of energy do not close by {0:.1%}: more was booked as lost, "
        "mostly to friction where things settle, than motion and strain gave up.",
        "mechanical_growth": "Energy grew by {0:.1%}: something bounced higher or moved faster "
        "than it could in life.",
        "max_penetration_dx": f"Objects sink up to {{0:.1f}} grid cells ({depth * 1e3:.2g} mm) "
        f"into {into}: contacts are softer here than in life. A finer detail helps.",
        "mass_error": "A part's particles weigh {0:.0%} more or less than the part: its motion is "
        "off by about as much.",
    }
    limits = ALLOWED | {"nan_count": 0, "particles_out_of_domain": 0}
    return [text.format(found[key]) for key, text in said.items() if found[key] > limits[key]]


SAGGED, SEEN = 1.0, 0.1
"""Worth a warning, and worth telling at all [cells]."""


def unsettled(settling: dict[str, Any] | None) -> list[str]:
    """Say what settling changed that a person would see, and where it found no end."""
    if settling is None:
        return []
    said = [
        f"{row['name']} moved by {shift(row)} before the film begins: the pose in the file is not "
        "one in which everything bears its weight."
        for row in settling["objects"]
        if row["moved_dx"] > SAGGED
    ]
    if not settling["found"]:
        said.append(
            f"After {settling['seconds']:.2g} s of settling something still moved: the film begins "
            "before everything is at rest."
        )
    return said


def how_settled(settling: dict[str, Any] | None) -> str:
    """Say in a sentence how long things settled and how far each sank; "" where they did not."""
    if settling is None:
        return ""
    moved = [
        f"{row['name']} moved by {shift(row)}"
        for row in settling["objects"]
        if row["moved_dx"] > SEEN
    ]
    return (
        f"Before the film what lies or stands settled for {settling['seconds']:.2g} s: "
        f"{', '.join(moved) or 'nothing moved to speak of'}."
    )


def shift(row: dict[str, Any]) -> str:
    """How far the centre of mass of an object moved, in words."""
    metres = float(np.linalg.norm(row["moved_m"]))
    return f"{metres * 1e3:.2g} mm ({row['moved_dx']:.1f} cells)"
