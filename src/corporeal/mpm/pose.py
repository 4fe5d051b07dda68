"""Pose the problem: turn a scene filled with particles into what an engine is given."""

from dataclasses import dataclass
from math import pi, sqrt
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm.gaps import pair_gaps
from corporeal.mpm.problem import FLOOR, NO_FACES, Body, Faces, Problem
from corporeal.types import Law, Material, MaterialField, Particles, Scene, Treatment

RAMP = 0.1
"""Time over which gravity grows where everything starts at rest in contact [s]."""
DAMPING_LIMIT = 0.25
"""Largest viscosity as a fraction of ρ c dx: more would shorten the step noticeably."""


@dataclass(frozen=True)
class Posed:
    """A problem, and how its particles are ordered."""

    problem: Problem
    order: Int[np.ndarray, " P"]
    """Number in ``Particles`` of each particle of the problem: body after body."""
    rigid: Bool[np.ndarray, " B"]


def pose(
    scene: Scene,
    particles: Particles,
    field: MaterialField,
    contact: Literal["multi", "single"] = "multi",
) -> Posed:
    """Build the problem that an engine solves; one body per object, in the scene's order."""
    count = len(scene.objects)
    members = [np.flatnonzero(particles.object == b) for b in range(count)]
    bodies = tuple(body_of(scene, particles, field, b, members[b]) for b in range(count))
    weights = part_weights(particles, len(field.materials), count)
    footing = footing_weights(particles, weights)
    problem = Problem(
        bodies=bodies,
        cell=particles.cell,
        friction=pair_values(field.friction, weights, footing),
        restitution=pair_values(field.restitution, weights, footing),
        planes=(FLOOR,),
        gravity=scene.gravity,
        gravity_ramp=RAMP if starts_settled(scene, particles) else 0.0,
        contact=contact,
    )
    return Posed(problem, np.concatenate(members), np.array([b.rigid for b in bodies]))


def body_of(
    scene: Scene, particles: Particles, field: MaterialField, number: int, mine: np.ndarray
) -> Body:
    """One object with the simulated numbers of its parts."""
    part = particles.part[mine]
    extent = float(np.ptp(particles.position[mine], axis=0).max())
    rows = [
        numbers(m, t, extent, particles.cell)
        for m, t in zip(field.materials, particles.treatments, strict=True)
    ]
    column = {name: np.array([row[name] for row in rows])[part] for name in rows[0]}
    thing = scene.objects[number]
    return Body(
        name=thing.name,
        position=particles.position[mine].astype(float),
        velocity=particles.velocity[mine].astype(float),
        volume=particles.volume[mine].astype(float),
        density=particles.density[mine].astype(float),
        law=column.pop("law").astype(np.int64),
        rigid=all(particles.treatments[k].kind == "rigid" for k in np.unique(part)),
        surface=particles.surface[particles.object_of_surface == number].astype(float),
        push=thing.push,
        wind=thing.wind,
        faces=faces_of(particles, mine) if thing.wind is not None else NO_FACES,
        **column,
    )


def faces_of(particles: Particles, mine: Int[np.ndarray, " N"]) -> Faces:
    """Faces that some particles show to the air, numbered among them; ``mine`` rises."""
    own = np.isin(particles.particle_of_face, mine)
    bearer = np.searchsorted(mine, particles.particle_of_face[own])
    return Faces(area=particles.face[own].astype(float), particle=bearer)


def numbers(
    material: Material, treatment: Treatment, extent: float, cell: float
) -> dict[str, float]:
    """Constitutive numbers of one part; what the treatment scaled, scales its companions.

    The hardening modulus is a stiffness and follows E; cohesion is a strength and follows
    √(E_sim/E), as the yield stress does.
    """
    softer = treatment.young / treatment.young_real
    return {
        "law": float(material.law.value),
        "young": treatment.young,
        "poisson": treatment.poisson,
        "yield_stress": treatment.yield_stress or 0.0,
        "hardening": material.hardening * softer,
        "friction_angle": material.friction_angle or 0.0,
        "cohesion": (material.cohesion or 0.0) * sqrt(softer),
        "viscosity": 0.0
        if treatment.kind == "rigid"
        else viscosity(material, treatment, extent, cell),
    }


def viscosity(material: Material, treatment: Treatment, extent: float, cell: float) -> float:
    """Kelvin–Voigt viscosity η [Pa s] with the material's loss factor at the slowest vibration.

    tan δ = ω η/μ, with ω = π √(μ/ρ)/L the fundamental of a free bar of the object's length in
    shear. η is bounded by the grid: a stronger damping would only shorten the time step.
    """
    if material.law is Law.DRUCKER_PRAGER:
        return 0.0  # grains lose energy by sliding, which the law itself accounts for
    shear = treatment.young / (2 * (1 + treatment.poisson))
    slowest = pi * sqrt(shear / treatment.density) / extent
    limit = DAMPING_LIMIT * treatment.density * treatment.wave_speed * cell
    return min(material.loss * shear / slowest, limit)


# ------------------------------------------------------------------ pairs


def part_weights(particles: Particles, parts: int, objects: int) -> Float[np.ndarray, "B K"]:
    """Share of each part in its object's surface [-], taken as volume^(2/3)."""
    volume = np.zeros((objects, parts))
    np.add.at(volume, (particles.object, particles.part), particles.volume)
    area = volume ** (2 / 3)
    return area / area.sum(axis=1, keepdims=True)


def footing_weights(
    particles: Particles, weights: Float[np.ndarray, "B K"]
) -> Float[np.ndarray, "B K"]:
    """Share of each part in the lowest cell of its object [-]: what meets the floor."""
    share = np.zeros_like(weights)
    for b in range(len(weights)):
        mine = np.flatnonzero(particles.object == b)
        height = particles.position[mine, 2]
        low = mine[height <= height.min() + particles.cell]
        np.add.at(share[b], particles.part[low], particles.volume[low])
    return share / share.sum(axis=1, keepdims=True)


def pair_values(
    table: Float[np.ndarray, "K+1 K+1"],
    weights: Float[np.ndarray, "B K"],
    footing: Float[np.ndarray, "B K"],
) -> Float[np.ndarray, "B+1 B+1"]:
    """Average a table over parts into one over objects and the floor."""
    between = weights @ table[:-1, :-1] @ weights.T
    floor = footing @ table[:-1, -1]
    corner = np.array([[table[-1, -1]]])
    value = np.block([[between, floor[:, None]], [floor[None, :], corner]])
    return 0.5 * (value + value.T)


# ------------------------------------------------------------------ at rest or not


def starts_settled(scene: Scene, particles: Particles) -> bool:
    """Whether nothing moves, is pushed or blown, and every object stands on something.

    Then gravity grows over a tenth of a second: switched on at once it would set off vibrations
    in which bodies hop by less than a grid cell.
    """
    moving = np.abs(particles.velocity).max(initial=0.0) > 0.0
    if moving or any(o.push or o.wind for o in scene.objects):
        return False
    near = 0.5 * particles.cell
    bodies = [particles.position[particles.object == b] for b in range(len(scene.objects))]
    gap, _ = pair_gaps(bodies, particles.cell)
    standing = {b for b, x in enumerate(bodies) if x[:, 2].min() < near}
    while True:
        carried = {
            b
            for b in range(len(bodies))
            for a in standing
            if b not in standing and gap[a, b] < near
        }
        if not carried:
            return len(standing) == len(bodies)
        standing |= carried
