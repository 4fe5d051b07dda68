"""The block drop in genesis-world; runs in an environment of its own, one batch per line asked.

    python genesis_block.py THREADS ACROSS CELL STEP YOUNG_PA POISSON DENSITY SPEED HEIGHT

Prints one line once it is ready, with the number of particles; then, for each line of standard
input that asks for so many substeps, the seconds that they took.
"""

import json
import os
import sys
import time

threads, across = int(sys.argv[1]), int(sys.argv[2])
cell, step = float(sys.argv[3]), float(sys.argv[4])
os.environ["QD_NUM_THREADS"] = os.environ["TI_CPU_MAX_NUM_THREADS"] = str(threads)
os.environ["OMP_NUM_THREADS"] = str(threads)
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)  # what the engine prints is no answer

import genesis as gs  # noqa: E402

YOUNG_PA, POISSON, DENSITY, SPEED, HEIGHT = (float(word) for word in sys.argv[5:10])
PER_CALL = 10
"""Substeps that one call of the engine takes."""


def answer(**said) -> None:
    """Write one line to whoever asked."""
    answers.write(json.dumps(said) + "\n")
    answers.flush()


gs.init(backend=gs.cpu, precision="32", logging_level="error", performance_mode=True)
size = across * cell
margin = 3 * cell
"""Cells that this engine keeps free at the border of its grid."""
scene = gs.Scene(
    sim_options=gs.options.SimOptions(dt=step * PER_CALL, substeps=PER_CALL, gravity=(0.0, 0.0, -9.81)),
    mpm_options=gs.options.MPMOptions(
        lower_bound=(-0.5, -0.5, 0.0), upper_bound=(0.5, 0.5, 1.0), grid_density=1.0 / cell, particle_size=cell / 2
    ),
    show_viewer=False,
)
block = scene.add_entity(
    material=gs.materials.MPM.Elastic(E=YOUNG_PA, nu=POISSON, rho=DENSITY, sampler="regular", model="corotation"),
    morph=gs.morphs.Box(pos=(0.0, 0.0, margin + HEIGHT + size / 2), size=(size, size, size)),
)
scene.build()
block.set_velocity((SPEED, 0.0, 0.0))
for _ in range(2):
    scene.step()
answer(version=gs.__version__, particles=int(block.n_particles))
for line in sys.stdin:
    calls = max(1, int(line) // PER_CALL)
    start, busy = time.perf_counter(), time.process_time()
    for _ in range(calls):
        scene.step()
    wall, cpu = time.perf_counter() - start, time.process_time() - busy
    answer(substeps=calls * PER_CALL, seconds=wall, cpu=cpu)
