"""Conservation audit of a finished simulation, with a sentence for every violation.

It is computed from the frames and the ledger on the disk.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from corporeal.core.audit_data import Audit, EnergyGain, Expectation, PartAudit, SettlingOutcome
from corporeal.core.types import Ledger, MaterialField, Particles, Scene, SceneObject, Trajectory
from corporeal.discretization.filled_shells import acting_material
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.simulation.audit_findings import audit_findings
from corporeal.simulation.audit_messages import (
    ALLOWED_BREACHES,
    breach_messages,
    equilibrium_warnings,
    finding_warnings,
    passage_message,
    surface_warnings,
)
from corporeal.simulation.energy_gain import energy_gain
from corporeal.simulation.fracture_prediction import predict_breakage
from corporeal.simulation.mesh_gaps import surface_pairs


def audit(
    scene: Scene,
    particles: Particles,
    field: MaterialField,
    trajectory: Trajectory,
    settling: SettlingOutcome | None = None,
) -> Audit:
    """Check a run against conservation laws.

    Args:
        scene: What was simulated.
        particles: Its material points.
        field: What every part is made of.
        trajectory: How they moved, with the ledger.
        settling: How everything found its balance before time 0; None: it did not.
    """
    ledger, cell = trajectory.ledger, particles.cell
    floor = float(ledger.plane_depth.max(initial=0.0))
    pair = float(ledger.overlap.max(initial=0.0))
    unbooked = unbooked_loss(ledger, scene, cell)
    of_solids = max(0.0, unbooked - energy_share_of_flows(ledger, scene, particles, field))
    surfaces = surface_pairs(scene, particles, trajectory)
    found = Audit(
        particles=particles.count,
        objects=len(scene.objects),
        frames=len(trajectory.time),
        cell_m=cell,
        steps=int(ledger.steps[-1]),
        dt_min=float(ledger.dt_min[-1]),
        dt_max=float(ledger.dt_max[-1]),
        nan_count=int(ledger.nan.max()) + count_not_finite(ledger),
        particles_out_of_domain=int(ledger.lost.max()),
        momentum_residual=momentum_residual(ledger, scene, cell),
        energy_growth=energy_growth(ledger, scene, cell),
        mechanical_growth=energy_growth(ledger, scene, cell, with_losses=False),
        energy_gain=object_gaining_energy(ledger, scene, cell),
        unbooked_loss=unbooked,
        impact_loss=impact_loss(ledger, scene, cell),
        impact_gain=impact_gain(ledger, scene, cell),
        surfaces=surfaces,
        mass_error=mass_error(particles),
        max_penetration_m=max(floor, pair),
        max_penetration_dx=max(floor, pair) / cell,
        floor_penetration_m=floor,
        pair_penetration_m=pair,
        start_penetration_m=float(ledger.overlap[0].max(initial=0.0)),
        parts=part_rows(scene, particles, field),
        breakage=predict_breakage(scene, particles, field, trajectory),
        settling=settling,
        findings=audit_findings(scene, particles, field, trajectory, of_solids, surfaces),
        warnings=(),
    )
    warnings = (
        *particles.warnings,
        *equilibrium_warnings(settling),
        *breach_messages(found),
        *surface_warnings(found.surfaces),
        *finding_warnings(found.findings),
    )
    return found.noting(warnings)


LEDGER_QUANTITIES = (
    *("momentum", "angular_momentum", "kinetic", "elastic", "potential"),
    *("external_impulse", "plane_impulse", "pair_impulse", "push_work"),
    *("friction_loss", "impact_loss", "plastic_loss", "viscous_loss"),
)
"""Quantities of the ledger that must be finite."""


def count_not_finite(ledger: Ledger) -> int:
    """Count values of the ledger that are not finite."""
    return sum(int(np.count_nonzero(~np.isfinite(getattr(ledger, name)))) for name in LEDGER_QUANTITIES)


def momentum_residual(ledger: Ledger, scene: Scene, cell: float) -> float:
    """‖ΔP - impulses of gravity, pushes and walls‖ / max Σ m|v|, its largest over time [-].

    Where nothing moves, Σ m|v| is taken as that of a fall through one cell.
    """
    gained = ledger.momentum.sum(axis=1) - ledger.momentum[0].sum(axis=0)
    given = ledger.external_impulse.sum(axis=1) + ledger.plane_impulse.sum(axis=(1, 2))
    residual = np.linalg.norm(gained - given, axis=1).max()
    still = ledger.mass[0].sum() * np.sqrt(2 * float(np.linalg.norm(scene.gravity)) * cell)
    scale = max(float(ledger.flow.sum(axis=1).max()), still)
    return float(residual / scale) if scale > 0 else 0.0


def energy_growth(ledger: Ledger, scene: Scene, cell: float, with_losses: bool = True) -> float:
    """(max(E + dissipated - external work) - E₀) / max(E₀, work of gravity), relative [-].

    E is kinetic (with its affine part) and elastic; gravity's work is what the potential energy lost. Where neither is
    there to compare with, a fall through one cell is. Without the losses it is the growth of what moves and is strained
    alone: that no booking can hide or feign.
    """
    balance, scale = energy_balance(ledger, scene, cell)
    if with_losses:
        balance = balance + dissipated_energy(ledger)
    growth = max(0.0, float((balance - balance[0]).max()))
    return growth / scale if scale > 0 else 0.0


def dissipated_energy(ledger: Ledger) -> Float[np.ndarray, " F"]:
    """Energy that friction, plastic flow and viscosity took [J]."""
    return ledger.friction_loss + ledger.plastic_loss + ledger.viscous_loss


def available_energy(ledger: Ledger, scene: Scene, cell: float) -> float:
    """Available energy [J]: initial energy plus the work of gravity and forces.

    At least that of a fall through one cell.
    """
    start = float((ledger.kinetic + ledger.elastic)[0].sum())
    fallen = float((ledger.potential[0].sum() - ledger.potential.sum(axis=1)).max())
    small = float(ledger.mass[0].sum()) * float(np.linalg.norm(scene.gravity)) * cell
    return max(start + fallen + max(0.0, float(ledger.push_work.max())), small)


def unbooked_loss(ledger: Ledger, scene: Scene, cell: float) -> float:
    """Energy missing from the balance, over the available energy [-].

    It is lost numerically, in transfers between particles and grid.
    """
    balance = energy_balance(ledger, scene, cell)[0] + dissipated_energy(ledger)
    balance = balance + ledger.impact_loss
    lost, whole = float((balance[0] - balance).max()), available_energy(ledger, scene, cell)
    return max(0.0, lost) / whole if whole > 0 else 0.0


def energy_share_of_flows(ledger: Ledger, scene: Scene, particles: Particles, field: MaterialField) -> float:
    """Largest kinetic energy of all objects of liquids or grains, over the available energy [-].

    So much of the unbooked loss may be theirs.
    """
    loose = np.array([CONSTITUTIVE_LAWS[m.law].loose for m in field.materials], dtype=bool)[particles.part]
    flows = np.array([loose[particles.object == k].any() for k in range(len(scene.objects))], dtype=bool)
    whole = available_energy(ledger, scene, particles.cell)
    most = float(ledger.kinetic[:, : len(flows)][:, flows].max(axis=0, initial=0.0).sum())
    return most / whole if whole > 0 else 0.0


def impact_loss(ledger: Ledger, scene: Scene, cell: float) -> float:
    """Loss by normal contact over the available energy [-].

    Pairs that gained hide nothing of it.
    """
    whole = available_energy(ledger, scene, cell)
    lost = float(ledger.impact_loss[-1]) + impact_gain(ledger, scene, cell) * whole
    return lost / whole if whole > 0 else 0.0


def impact_gain(ledger: Ledger, scene: Scene, cell: float) -> float:
    """Energy that normal contact gave to pairs which have more from it than it took, relative [-]."""
    taken, whole = np.triu(ledger.impact_of_pair[-1]), available_energy(ledger, scene, cell)
    return float(-taken[taken < 0.0].sum()) / whole if whole > 0 else 0.0


def energy_balance(ledger: Ledger, scene: Scene, cell: float) -> tuple[Float[np.ndarray, " F"], float]:
    """Kinetic and elastic energy minus external work, and the reference energy [J].

    See ``energy_growth``.
    """
    energy = (ledger.kinetic + ledger.elastic).sum(axis=1)
    fallen = ledger.potential[0].sum() - ledger.potential.sum(axis=1)
    small = ledger.mass[0].sum() * float(np.linalg.norm(scene.gravity)) * cell
    scale = max(float(energy[0]), float(fallen.max()), float(ledger.push_work.max()), small)
    return energy - ledger.push_work - fallen, scale


def object_gaining_energy(ledger: Ledger, scene: Scene, cell: float) -> EnergyGain | None:
    """Return the object with an energy gain beyond the tolerance, if any."""
    balance, scale = energy_balance(ledger, scene, cell)
    names = [thing.name for thing in scene.objects]
    return energy_gain(ledger, names, balance, ALLOWED_BREACHES["mechanical_growth"] * scale)


def reject_expectations(seen: Iterable[Expectation], found: Audit) -> tuple[Expectation, ...]:
    """Mark expectations as not met in an unphysical run.

    That is a run with an energy gain, or with an object that passed through another.
    """
    through = [pair for pair in found.surfaces if pair.passed]
    if through:
        doubt = f"but {passage_message(through[0])}"
    elif found.mechanical_growth > ALLOWED_BREACHES["mechanical_growth"]:
        doubt = f"but energy grew by {found.mechanical_growth:.1%}"
    else:
        return tuple(seen)
    return tuple(replace(e, value=f"{e.value}; {doubt}", met=False) for e in seen)


def mass_error(particles: Particles) -> float:
    """Largest relative difference of a part's particles from its estimated mass [-]."""
    mass = np.bincount(particles.part, particles.mass, minlength=len(particles.mass_real))
    real = np.array(particles.mass_real)
    return float(np.max(np.abs(mass - real) / np.where(real > 0, real, 1.0), initial=0.0))


def part_rows(scene: Scene, particles: Particles, field: MaterialField) -> tuple[PartAudit, ...]:
    """One row per part: real and simulated numbers side by side."""
    first = {int(k): int(p) for p, k in reversed(list(enumerate(particles.part)))}
    owner = {k: scene.objects[particles.object[p]] for k, p in first.items()}
    return tuple(part_row(k, owner.get(k), particles, field) for k in range(len(particles.treatments)))


def part_row(k: int, owner: SceneObject | None, particles: Particles, field: MaterialField) -> PartAudit:
    """Real and simulated values of one part; owner: None where it has no particles."""
    material, structure, mass = field.materials[k], field.structures[k], particles.mass_real[k]
    treatment = particles.treatments[k]
    acts = acting_material(material, structure, treatment)
    return PartAudit(
        name=field.words[k].name,
        object=None if owner is None else owner.name,
        material=material.name,
        law=acts.law.name.lower(),
        treatment=treatment.kind,
        structure=structure.kind,
        young_pa=treatment.young_pa,
        simulated_young_pa=treatment.simulated_young_pa,
        nu=acts.poisson,
        density=material.density,
        density_sim=treatment.density,
        yield_stress=material.yield_stress,
        yield_stress_sim=treatment.yield_stress,
        thickness_m=structure.thickness,
        contents=structure.contents.name if structure.contents else None,
        fill=structure.fill if structure.contents else None,
        thickness_sim_m=treatment.thickness,
        mass_kg=mass,
        real_mass_kg=None if owner is None else mass / owner.scale**3,
        reason=treatment.reason,
    )
