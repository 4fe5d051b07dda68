"""What other programs read in our files, each run by a Python of its own.

A program is looked for in ``.readers/NAME`` of the checkout, a virtual environment that
``.ci/run`` makes; where it is not, its tests skip and say how to make it. What is changed in a file
by one number must be found by the same comparison.
"""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from export_helpers import asked_of, replaced, rigid, soft

from corporeal.export.alembic_writer import write_alembic
from corporeal.export.animated_glb_writer import write_animated_glb
from corporeal.export.particle_h5_npz_writer import write_h5, write_npz
from corporeal.export.simplify_colliders import solid_colliders
from corporeal.export.urdf_writer import write_urdf
from corporeal.export.usd_geometry import named_colliders
from corporeal.export.usd_physics import fit_friction
from corporeal.export.usd_writer import write_usd

ROOT = Path(__file__).parents[2]
PROGRAMS = Path(__file__).parent / "programs"
READERS = {
    "newton": "pip install 'newton[sim]' 'usd-core<26.9' newton-usd-schemas scipy",
    "ovphysx": "pip install ovphysx physx-usd-schemas newton-usd-schemas",
    "bpy": "pip install bpy",
    "pybullet": "pip install pybullet numpy",
    "lagrangebench": "pip install lagrangebench 'jax==0.4.13' 'jaxlib==0.4.13' 'numpy<2'",
}
"""Program → what makes its environment."""
GNS = ROOT / ".readers" / "gns"


def run(python, script, *arguments):
    command = [str(python), str(PROGRAMS / script), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def told(program, script, *arguments):
    """What a program prints of a file, as JSON on its last line."""
    return json.loads(run(python_of(program), script, *arguments).strip().splitlines()[-1])


def python_of(program):
    place = ROOT / ".readers" / program
    if not (place / "bin" / "python").exists():
        install = READERS[program].replace("pip", f".readers/{program}/bin/pip", 1)
        pytest.skip(f"no {program}: python3 -m venv .readers/{program} && {install}")
    return place / "bin" / "python"


# ---------------------------------------------------------------- simulators


def names_of(solid):
    return [name for name, _ in named_colliders(solid)]


def compare_rigid(said, asked):
    """Masses, inertias about the world's axes, origins."""
    assert set(said["bodies"]) == {f"/World/{s.name}" for s in rigid(asked)}
    for solid in rigid(asked):
        body = said["bodies"][f"/World/{solid.name}"]
        assert body["mass"] == pytest.approx(solid.mass, rel=1e-6)
        scale = np.abs(solid.inertia).max()
        np.testing.assert_allclose(body["inertia"], solid.inertia, rtol=0, atol=1e-6 * scale)
        np.testing.assert_allclose(body["origin"], solid.origin, rtol=0, atol=1e-6)


def compare_with_newton(said, asked):
    """Also frictions, the particles' mass, and how many have which modulus."""
    compare_rigid(said, asked)
    surfaces = fit_friction(asked.scene, asked.config.friction_for).coefficient
    for solid in rigid(asked):
        for name, collider in zip(names_of(solid), solid_colliders(solid), strict=True):
            found = said["friction"][f"/World/{solid.name}/colliders/{name}"]
            assert found == pytest.approx(surfaces[collider.part], rel=1e-6)
    masses = sum(s.grains.mass.sum() for s in soft(asked))
    assert said["particle_mass"] == pytest.approx(masses, rel=1e-6)
    counts = {}
    for solid in soft(asked):
        for part in solid.parts:
            young_pa = asked.scene.matter[part].treatment.simulated_young_pa
            counts[young_pa] = counts.get(young_pa, 0) + int((solid.grains.part == part).sum())
    wanted = sorted(counts.items())
    assert [c for _, c in said["simulated_young_pa"]] == [c for _, c in wanted]
    np.testing.assert_allclose([e for e, _ in said["simulated_young_pa"]], [e for e, _ in wanted], rtol=1e-6)


def physics(old, new):
    """Change a number of ``physics.usda``."""
    return lambda folder: replaced(folder / "physics.usda", old, new)


def raise_the_first(folder):
    """Put the first body 20 cm higher than it was."""
    path = folder / "geometry.usda"
    text = path.read_text(encoding="utf-8")
    old = text.split("xformOp:translate = (")[1].split(")")[0]
    x, y, z = old.split(", ")
    replaced(path, f"({old})", f"({x}, {y}, {float(z) + 0.2})")


CHANGES = {
    "a mass": physics("float physics:mass = ", "float physics:mass = 9"),
    "an inertia": physics("physics:diagonalInertia = (", "physics:diagonalInertia = (9"),
    "a friction": physics("physics:dynamicFriction = 0", "physics:dynamicFriction = 3"),
    "a modulus": physics("newton:mpm:youngsModulus = ", "newton:mpm:youngsModulus = 9"),
    "a frame": raise_the_first,
}
"""What is changed → what changes it in a folder."""


@pytest.mark.slow
def test_newton_reads_what_was_simulated_and_a_changed_number_is_found(written, asked):
    python_of("newton")
    folders = [written(write_usd) for _ in range(1 + len(CHANGES))]
    for folder, change in zip(folders[1:], CHANGES.values(), strict=True):
        change(folder)
    stages = [folder / "sim.usda" for folder in folders]
    first, *others = told("newton", "newton_usd.py", 0, *stages)
    compare_with_newton(first, asked)
    for changed, said in zip(CHANGES, others, strict=True):
        assert set(said["bodies"]) == set(first["bodies"])
        with pytest.raises(AssertionError):
            compare_with_newton(said, asked)
            pytest.fail(f"{changed} was changed, and nobody noticed")


def test_physx_reads_what_was_simulated_and_a_changed_number_is_found(written, asked):
    python_of("ovphysx")
    changes = [CHANGES[what] for what in ("a mass", "an inertia", "a frame")]
    folders = [written(write_usd) for _ in range(1 + len(changes))]
    for folder, change in zip(folders[1:], changes, strict=True):
        change(folder)
    stages = [folder / "sim.usda" for folder in folders]
    first, *others = told("ovphysx", "physx_usd.py", 0, *stages)
    compare_rigid(first, asked)
    for said in others:
        assert set(said["bodies"]) == set(first["bodies"])
        with pytest.raises(AssertionError):
            compare_rigid(said, asked)


def compare_with_bullet(said, asked, folder):
    for solid in rigid(asked):
        body = said[str(folder / f"{solid.name}.urdf")]
        assert body["mass"] == pytest.approx(solid.mass, rel=1e-5)
        wanted = np.linalg.eigvalsh(solid.inertia)
        np.testing.assert_allclose(np.sort(body["moments"]), wanted, rtol=1e-5)


def test_pybullet_loads_every_urdf(written, asked):
    python_of("pybullet")
    folder = written(write_urdf)
    paths = [folder / f"{s.name}.urdf" for s in rigid(asked)]
    compare_with_bullet(told("pybullet", "pybullet_urdf.py", *paths), asked, folder)
    replaced(paths[0], '<mass value="', '<mass value="1')
    with pytest.raises(AssertionError):
        compare_with_bullet(told("pybullet", "pybullet_urdf.py", *paths), asked, folder)


# ---------------------------------------------------------------- videos in Blender

FRAMES = (0, 2, 4)


def posed_in_blender(path, asked, tmp_path):
    """For each of three frames the vertices of every mesh, in the world."""
    seconds = [asked.motion.time[k] for k in FRAMES]
    run(python_of("bpy"), "blender_video.py", path, tmp_path / "posed.npz", 40, *seconds)
    with np.load(tmp_path / "posed.npz") as file:
        return [[file[name] for name in file.files if name.startswith(f"{number}|")] for number in range(len(FRAMES))]


def largest_error(posed, asked):
    """How far any vertex is from where it was, each surface beside the mesh that it is [m]."""
    shapes, worst = asked.motion.shapes(asked.scene.solids), 0.0
    for number, frame in enumerate(FRAMES):
        for solid in asked.scene.solids:
            for surface in solid.surface_numbers:
                wanted = shapes.of(surface)[0][frame]
                alike = [mesh for mesh in posed[number] if len(mesh) == len(wanted)]
                assert alike, f"no mesh of {len(wanted)} vertices"
                far = [np.linalg.norm(mesh - wanted, axis=1).max() for mesh in alike]
                worst = max(worst, float(min(far)))
    return worst


@pytest.mark.parametrize(
    ("writer", "name", "bound"),
    [(write_usd, "video.usda", 1e-5), (write_alembic, "video.abc", 1e-5), (write_animated_glb, "video.glb", 1e-3)],
    ids=["usd", "alembic", "glb"],
)
def test_blender_shows_every_vertex_where_it_was(written, asked, tmp_path, writer, name, bound):
    python_of("bpy")
    if writer is write_alembic:
        pytest.importorskip("alembic3d", reason="pip install 'corporeal[export]'")
    posed = posed_in_blender(written(writer) / name, asked, tmp_path)
    assert largest_error(posed, asked) < bound
    # The control: the frames in another order are not where they were.
    assert largest_error(posed[::-1], asked) > 10 * bound


# ---------------------------------------------------------------- loaders of data sets


def compare_windows(said, asked, frame):
    """The kinds, and the positions that a loader returns last."""
    last = asked.motion.frames[frame].position
    np.testing.assert_allclose(said["last"], last.mean(axis=0), atol=1e-6)
    assert said["shape"][0] == len(last)
    assert said["kinds"] == [0, 6, 7]  # rigid, sand, flesh


def test_the_data_set_of_lagrangebench_opens_ours(written, asked):
    python_of("lagrangebench")
    pytest.importorskip("h5py", reason="pip install 'corporeal[export]'")
    folder, length = written(write_h5), 2
    said = told("lagrangebench", "lagrangebench_h5.py", folder, length)
    assert said["windows"] == len(asked.motion.time) - length - 1
    compare_windows(said, asked, said["windows"] - 1 + length)  # it leaves the last frame out
    assert said["trajectory"] == [said["shape"][0], len(asked.motion.time), 3]


def test_the_loader_of_gns_opens_ours(written, asked):
    pytest.importorskip("torch", reason="the loader of geoelements/gns is a data set of torch")
    if not (GNS / "gns" / "data_loader.py").exists():
        pytest.skip("no loader: git clone https://github.com/geoelements/gns .readers/gns")
    import sys

    folder, length = written(write_npz), 2
    out = run(sys.executable, "gns_npz.py", GNS, folder / "train.npz", length)
    said = json.loads(out)
    assert said["samples"] == len(asked.motion.time) - length
    compare_windows(said, asked, len(asked.motion.time) - 1)
    young_pa = sorted({m.treatment.simulated_young_pa for m in asked.scene.matter})
    np.testing.assert_allclose(said["simulated_young_pa"], young_pa, rtol=1e-6)


def test_another_start_is_another_file(played, written):
    """A control of all above: what is exported at the end is elsewhere."""
    start, end = (rigid(asked_of(played, at=at))[0].origin for at in ("start", "end"))
    assert np.linalg.norm(end - start) > 0.05
