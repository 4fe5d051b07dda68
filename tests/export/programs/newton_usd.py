"""Newton reads stages, and lets what is rigid lie: ``python newton_usd.py SECONDS SIM.usda …``.

Prints JSON, of each: masses, inertias about the world's axes, origins, frictions, particles, moduli
and, where SECONDS is not 0, drift.
"""

import json
import sys

import newton
import numpy as np
import warp as wp

STEP = 1e-3
"""[s]"""


def read(path):
    builder = newton.ModelBuilder()
    newton.solvers.SolverImplicitMPM.register_custom_attributes(builder)
    newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
    builder.add_usd(path)
    return builder


def matrix(quaternion):
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def bodies(builder, model):
    poses, com = model.body_q.numpy(), model.body_com.numpy()
    for k, label in enumerate(builder.body_label):
        turn = matrix(poses[k, 3:])
        inertia = turn @ np.array(model.body_inertia.numpy()[k], dtype=float) @ turn.T
        origin = poses[k, :3] + turn @ com[k]
        yield (
            label,
            {"mass": float(model.body_mass.numpy()[k]), "inertia": inertia.tolist(), "origin": origin.tolist()},
        )


def drift(model, seconds):
    """How far every body's origin goes in so long [m]."""
    solver = newton.solvers.SolverMuJoCo(model, use_mujoco_cpu=True, cone="elliptic", iterations=100, ls_iterations=50)
    now, then, control = model.state(), model.state(), model.control()
    start = now.body_q.numpy()[:, :3].copy()
    for _ in range(round(seconds / STEP)):
        now.clear_forces()
        contacts = model.collide(now)
        solver.step(now, then, control, contacts, STEP)
        now, then = then, now
    return np.linalg.norm(now.body_q.numpy()[:, :3] - start, axis=1)


def told(path, seconds):
    builder = read(path)
    model = builder.finalize(device="cpu")
    said = {"bodies": dict(bodies(builder, model)), "particles": model.particle_count}
    frictions = model.shape_material_mu.numpy().tolist()
    said["friction"] = dict(zip(builder.shape_label, frictions, strict=True))
    if model.particle_count:
        said["particle_mass"] = float(model.particle_mass.numpy().astype(float).sum())
        young_pa = model.mpm.young_modulus.numpy()
        values, counts = np.unique(young_pa, return_counts=True)
        said["simulated_young_pa"] = [[float(v), int(c)] for v, c in zip(values, counts, strict=True)]
    if seconds:
        moved = drift(model, seconds)
        said["drift"] = {n: float(m) for n, m in zip(builder.body_label, moved, strict=True)}
    return said


wp.config.quiet = True
print(json.dumps([told(path, float(sys.argv[1])) for path in sys.argv[2:]]))
