"""Particle trajectories for learning: HDF5 of LagrangeBench, NPZ of geoelements/gns.

Both loaders take positions and the kind of each particle. HDF5 has beside them what no other data
set does: mass, volume, moduli, law, object, part, deformation gradients, and where every number
comes from.
"""

# The library is optional.
# pyright: reportMissingImports=false

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.store import require_disk_space, write_json
from corporeal.export.dataset_statistics import DatasetStatistics
from corporeal.export.export_target import ExportRequest, WrittenTarget
from corporeal.export.particle_arrays import ParticleTable, read_particle_table
from corporeal.simulation.simulation_result import SimulationResult

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
        raise UserError(
            "HDF5 needs h5py. Install it with: pip install 'corporeal[export]'."
        ) from error
    return h5py


def add_run(file: Any, number: int, table: ParticleTable, played: SimulationResult) -> None:
    """Add a run to an open data set as group 00000, 00001 and so on."""
    group = file.create_group(f"{number:05d}")
    frames, particles, _ = table.position.shape
    packed = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
    group.create_dataset("position", data=table.position, chunks=(1, particles, 3), **packed)
    shape = (frames, particles, 3, 3)
    gradient = group.create_dataset(
        "deformation", shape, np.float16, chunks=(1, *shape[1:]), **packed
    )
    for k, frame in enumerate(played.trajectory.frames):
        gradient[k] = frame.deformation.astype(np.float16)
    group.create_dataset("particle_type", data=table.kind)
    group.create_dataset("time", data=played.trajectory.time)
    for name, values in table.columns.items():
        group.create_dataset(name, data=values)
    group.attrs["name"] = played.prepared.scene.name
    group.attrs["corporeal"] = table.provenance
