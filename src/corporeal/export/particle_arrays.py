"""A run as arrays of particles with the type numbers of learning data sets.

Kinds are those of DeepMind's data sets (Sanchez-Gonzalez et al. 2020): 0 rigid, 6 sand, 7 goop; 8
is ours, for metal. 3 is an obstacle to both loaders, and never used.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import Discretization, Law
from corporeal.export.export_target import ExportRequest, NothingToWriteError

GNS_PARTICLE_TYPES = {
    Law.COROTATED: 7,
    Law.NEO_HOOKEAN: 7,
    Law.HENCKY: 7,
    Law.DRUCKER_PRAGER: 6,
    Law.VON_MISES: 8,
}
RIGID_PARTICLE_TYPE = 0


@dataclass(frozen=True)
class ParticleTable:
    """One run as arrays; F frames, P particles."""

    position: Float[np.ndarray, "F P 3"]
    """[m]"""
    kind: Int[np.ndarray, " P"]
    columns: Mapping[str, np.ndarray]
    """What else is known of every particle, one value each."""
    provenance: str
    """JSON: range, source and reason of every value of every part."""
    step: float
    """Between frames [s]."""
    cell: float
    """[m]"""


def read_particle_table(asked: ExportRequest) -> ParticleTable:
    """Read all frames of a run.

    Raises:
        NothingToWriteError: Nothing moves.

    """
    if asked.played is None or not asked.motion.moves:
        raise NothingToWriteError("Nothing was simulated, and there is no motion to learn from.")
    motion, particles = asked.motion, asked.played.prepared.particles
    matter = asked.scene.matter
    position = np.stack([frame.position for frame in motion.frames]).astype(np.float32)
    law = np.array([m.material.law.value for m in matter])[particles.part]
    soft = ~motion.rigid[particles.object]
    kind = np.array([GNS_PARTICLE_TYPES[m.material.law] for m in matter])[particles.part]
    columns = {
        "object": particles.object,
        "part": particles.part,
        "mass": particles.mass,
        "volume": particles.volume,
        "density": particles.density,
        "law": law,
    }
    treatments = [m.treatment for m in matter]
    columns |= {k: v[particles.part] for k, v in _part_values(treatments).items()}
    return ParticleTable(
        position=position,
        kind=np.where(soft, kind, RIGID_PARTICLE_TYPE),
        columns=columns,
        provenance=json.dumps([m.provenance for m in matter], ensure_ascii=False, allow_nan=False),
        step=float(np.diff(motion.time).mean()),
        cell=particles.cell,
    )


def _part_values(treatments: list[Discretization]) -> dict[str, np.ndarray]:
    """Values of every part as simulated; what does not yield has an infinite yield stress."""
    return {
        "simulated_young_pa": np.array([t.simulated_young_pa for t in treatments]),
        "young_pa": np.array([t.young_pa for t in treatments]),
        "poisson": np.array([t.poisson for t in treatments]),
        "yield_stress": np.array([t.yield_stress or np.inf for t in treatments]),
    }
