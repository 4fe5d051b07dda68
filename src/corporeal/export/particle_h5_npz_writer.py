"""Particle trajectories for learning: HDF5 of LagrangeBench, NPZ of geoelements/gns.

Both loaders take positions and the kind of each particle. HDF5 has beside them what no other data set does: mass,
volume, moduli, law, object, part, deformation gradients, and where every number comes from.

A run as arrays of particles with the type numbers of learning data sets.

Kinds are those of DeepMind's data sets (Sanchez-Gonzalez et al. 2020): 0 rigid, 6 sand, 7 goop; 8 is ours, for metal. 3
is an obstacle to both loaders, and never used.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.errors import UserError
from corporeal.core.store import require_disk_space, write_json
from corporeal.core.types import Discretization, Law
from corporeal.export.export_target import ExportRequest, NothingToWriteError, WrittenTarget
from corporeal.simulation.simulation_result import SimulationResult

GNS_PARTICLE_TYPES = {Law.COROTATED: 7, Law.NEO_HOOKEAN: 7, Law.HENCKY: 7, Law.DRUCKER_PRAGER: 6, Law.VON_MISES: 8}
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


CONNECTIVITY_RADIUS_DX = 1.5
"""Default radius of connectivity [cells]: holds the 26 neighbours of two points a cell."""


class DatasetStatistics:
    """What both loaders ask of a data set: bounds, steps, and how positions change; run by run."""

    def __init__(self) -> None:
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)
        self.changes = {"vel": _DifferenceStatistics(1), "acc": _DifferenceStatistics(2)}
        self.cells: list[float] = []
        self.steps: list[float] = []
        self.lengths: list[int] = []
        self.particles: list[int] = []

    def add(self, table: ParticleTable) -> None:
        """Take one more run into account."""
        self.low = np.minimum(self.low, table.position.min(axis=(0, 1)))
        self.high = np.maximum(self.high, table.position.max(axis=(0, 1)))
        for change in self.changes.values():
            change.add(table.position)
        self.cells.append(table.cell)
        self.steps.append(table.step)
        self.lengths.append(len(table.position))
        self.particles.append(table.position.shape[1])

    def metadata(self) -> dict[str, Any]:
        """Return the contents of ``metadata.json``."""
        cell = float(np.median(self.cells))
        rows = {
            "dim": 3,
            "dt": float(np.median(self.steps)),
            "write_every": 1,
            "sequence_length": min(self.lengths),
            "num_particles_max": max(self.particles),
            "dx": cell,
            "default_connectivity_radius": CONNECTIVITY_RADIUS_DX * cell,
            "bounds": np.stack([self.low, self.high], axis=1),
            "periodic_boundary_conditions": [False] * 3,
        }
        for name, change in self.changes.items():
            rows |= {f"{name}_mean": change.mean, f"{name}_std": change.spread}
        return rows


class _DifferenceStatistics:
    """Mean and standard deviation of differences from frame to frame [m per frame^order]."""

    def __init__(self, order: int) -> None:
        self.order, self.count = order, 0
        self.total, self.square = np.zeros(3), np.zeros(3)

    def add(self, position: Float[np.ndarray, "F P 3"]) -> None:
        for k in range(len(position) - self.order):
            step = np.diff(position[k : k + self.order + 1].astype(float), self.order, axis=0)[0]
            self.count += len(step)
            self.total += step.sum(axis=0)
            self.square += (step**2).sum(axis=0)

    @property
    def mean(self) -> np.ndarray:
        return self.total / max(self.count, 1)

    @property
    def spread(self) -> np.ndarray:
        return np.sqrt(np.maximum(self.square / max(self.count, 1) - self.mean**2, 0.0))


H5_FILE_NAME, NPZ_FILE_NAME, METADATA_FILE_NAME = "train.h5", "train.npz", "metadata.json"


def write_h5(asked: ExportRequest, folder: Path) -> WrittenTarget:
    """Write ``train.h5`` and ``metadata.json`` of one run.

    Raises:
        NothingToWriteError: Nothing moves.
        UserError: The library is not installed.
    """
    return save_h5(folder, [asked])


def write_npz(asked: ExportRequest, folder: Path) -> WrittenTarget:
    """Write ``train.npz`` and ``metadata.json`` of one run.

    Raises:
        NothingToWriteError: Nothing moves.
    """
    return save_npz(folder, [asked])


def save_h5(folder: Path, runs: Iterable[ExportRequest]) -> WrittenTarget:
    """Write runs as groups 00000, 00001 and so on, one at a time in memory.

    Raises:
        NothingToWriteError: Nothing moves.
        UserError: The library is not installed, or the disk has no room for a run.
    """
    h5py, statistics = import_hdf5(), DatasetStatistics()
    with h5py.File(folder / H5_FILE_NAME, "w") as file:
        for number, asked in enumerate(runs):
            table = read_particle_table(asked)
            assert asked.played is not None, "only what moved has a table"
            # The library cannot close its file where the disk is full, and ends the process.
            require_disk_space(folder, _uncompressed_bytes(table))
            add_run(file, number, table, asked.played)
            statistics.add(table)
    write_json(folder / METADATA_FILE_NAME, statistics.metadata())
    return WrittenTarget((), _statistics_measures(statistics))


def save_npz(folder: Path, runs: Iterable[ExportRequest]) -> WrittenTarget:
    """Write runs as the array of tuples that the loader of geoelements/gns takes.

    A particle's one property is log₁₀ E, E in Pa. The format holds all runs in memory.

    Raises:
        NothingToWriteError: Nothing moves.
    """
    statistics, provenance = DatasetStatistics(), []
    rows: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for asked in runs:
        table = read_particle_table(asked)
        rows.append((table.position, table.kind, np.log10(table.columns["simulated_young_pa"])))
        provenance.append(table.provenance)
        statistics.add(table)
    items = np.empty(len(rows), dtype=object)
    items[:] = rows
    np.savez_compressed(folder / NPZ_FILE_NAME, gns_data=items, corporeal=np.array(provenance))
    write_json(folder / METADATA_FILE_NAME, statistics.metadata())
    lost = "The loader reads positions, kinds and one number a particle; HDF5 has all others."
    return WrittenTarget((lost,), _statistics_measures(statistics))


def _uncompressed_bytes(table: ParticleTable) -> int:
    """Size of a run before it is compressed [bytes]; gradients are half precision."""
    gradients = 3 * table.position.size * np.dtype(np.float16).itemsize
    columns = sum(np.asarray(values).nbytes for values in table.columns.values())
    return table.position.nbytes + gradients + columns


def _statistics_measures(statistics: DatasetStatistics) -> dict[str, float]:
    return {"runs": float(len(statistics.lengths)), "particles": float(sum(statistics.particles))}


def import_hdf5() -> Any:
    """Return the library.

    Raises:
        UserError: It is not installed.
    """
    try:
        import h5py
    except ImportError as error:
        raise UserError("HDF5 needs h5py. Install it with: pip install 'corporeal[export]'.") from error
    return h5py


def add_run(file: Any, number: int, table: ParticleTable, played: SimulationResult) -> None:
    """Add a run to an open data set as group 00000, 00001 and so on."""
    group = file.create_group(f"{number:05d}")
    frames, particles, _ = table.position.shape
    packed = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
    group.create_dataset("position", data=table.position, chunks=(1, particles, 3), **packed)
    shape = (frames, particles, 3, 3)
    gradient = group.create_dataset("deformation", shape, np.float16, chunks=(1, *shape[1:]), **packed)
    for k, frame in enumerate(played.trajectory.frames):
        gradient[k] = frame.deformation.astype(np.float16)
    group.create_dataset("particle_type", data=table.kind)
    group.create_dataset("time", data=played.trajectory.time)
    for name, values in table.columns.items():
        group.create_dataset(name, data=values)
    group.attrs["name"] = played.prepared.scene.name
    group.attrs["corporeal"] = table.provenance
