"""Data sets, read again as the loaders of GNS and LagrangeBench read them."""

import json

import numpy as np
import pytest

from corporeal.core.types import Law
from corporeal.export.check_exports import check_target
from corporeal.export.export_target import NothingToWriteError
from corporeal.export.particle_h5_npz_writer import (
    GNS_PARTICLE_TYPES,
    DatasetStatistics,
    read_particle_table,
    write_h5,
    write_npz,
)

OBSTACLE = 3
"""What both loaders hold still."""


def test_particles_have_the_kinds_that_the_loaders_know(asked, played):
    table, particles = read_particle_table(asked), played.prepared.particles
    laws = [m.material.law for m in asked.scene.matter]
    for k, solid in enumerate(asked.scene.solids):
        kinds = set(table.kind[particles.object == k].tolist())
        assert kinds == ({0} if solid.rigid else {GNS_PARTICLE_TYPES[laws[solid.heaviest]]})
    assert GNS_PARTICLE_TYPES[Law.DRUCKER_PRAGER] == 6 and OBSTACLE not in GNS_PARTICLE_TYPES.values()


def test_the_loader_of_gns_reads_positions_kinds_and_a_property(written, asked, played):
    folder = written(write_npz)
    # As gns.data_loader does: allow_pickle, then a list of tuples.
    with np.load(folder / "train.npz", allow_pickle=True) as file:
        ((position, kind, stiffness),) = file["gns_data"]
        said = json.loads(str(file["corporeal"][0]))
    frames, particles = len(asked.motion.time), played.prepared.particles.count
    assert position.shape == (frames, particles, 3) and position.dtype == np.float32
    assert kind.shape == stiffness.shape == (particles,)
    young_pa = np.array([m.treatment.simulated_young_pa for m in asked.scene.matter])
    np.testing.assert_allclose(10**stiffness, young_pa[played.prepared.particles.part])
    assert said[0]["values"]["young_pa"]["source"]


def test_metadata_are_moments_of_what_happens_from_frame_to_frame(written, asked):
    folder = written(write_npz)
    said = json.loads((folder / "metadata.json").read_text())
    position = read_particle_table(asked).position.astype(float)
    velocity, acceleration = np.diff(position, axis=0), np.diff(position, 2, axis=0)
    np.testing.assert_allclose(said["vel_mean"], velocity.mean(axis=(0, 1)), atol=1e-9)
    np.testing.assert_allclose(said["vel_std"], velocity.std(axis=(0, 1)), rtol=1e-5)
    np.testing.assert_allclose(said["acc_std"], acceleration.std(axis=(0, 1)), rtol=1e-5)
    assert said["dt"] == pytest.approx(1 / 40) and said["dim"] == 3
    assert said["sequence_length"] == 5
    low, high = np.array(said["bounds"]).T
    assert (low <= position).all() and (position <= high).all()


def test_two_runs_count_together(asked):
    table, both = read_particle_table(asked), DatasetStatistics()
    both.add(table)
    both.add(table)
    one = DatasetStatistics()
    one.add(table)
    np.testing.assert_allclose(both.metadata()["vel_mean"], one.metadata()["vel_mean"])
    assert len(both.lengths) == 2


def test_hdf5_keeps_what_others_forget(written, asked, played):
    h5py = pytest.importorskip("h5py", reason="pip install 'corporeal[export]'")
    folder = written(write_h5)
    particles = played.prepared.particles
    with h5py.File(folder / "train.h5") as file:
        run = file["00000"]
        np.testing.assert_array_equal(run["mass"], particles.mass)
        np.testing.assert_array_equal(run["object"], particles.object)
        last = played.trajectory.frames[-1]
        np.testing.assert_array_equal(run["position"][-1], last.position)
        np.testing.assert_allclose(run["deformation"][-1], last.deformation, atol=2e-3)
        assert json.loads(run.attrs["corporeal"])[0]["values"]["density"]["source"]
    assert check_target("h5", folder, asked).measured == {"position_off_m": 0.0, "mass_off_kg": 0.0}


def test_one_changed_mass_is_found(written, asked):
    h5py = pytest.importorskip("h5py", reason="pip install 'corporeal[export]'")
    folder = written(write_h5)
    with h5py.File(folder / "train.h5", "r+") as file:
        file["00000/mass"][3] *= 2
    assert check_target("h5", folder, asked).measured["mass_off_kg"] > 0


@pytest.mark.slow
def test_a_still_is_no_data(settled, tmp_path):
    with pytest.raises(NothingToWriteError, match="no motion to learn from"):
        write_npz(settled, tmp_path)
