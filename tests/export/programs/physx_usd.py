"""PhysX on the processor reads stages: ``python physx_usd.py SECONDS SIM.usda …``.

Prints JSON, of each: masses, inertias about the world's axes and, where SECONDS is not 0, drift of
the centres of mass.
"""

import json
import sys
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import ovphysx
import ovstage
from ovphysx import PhysX
from ovphysx.types import TensorType

STEP = 1 / 240
"""[s]"""


def schemas():
    """Folders of the schemas that other packages bring, each with a plugInfo.json."""
    found = {
        str(Path(str(file.locate())).parent)
        for file in distribution("physx-usd-schemas").files or []
        if file.name == "plugInfo.json"
    }
    return [*sorted(found), str(ovphysx.newton_schema_root())]


def value(physx, kind, pattern="/World/*"):
    binding = physx.create_tensor_binding(pattern=pattern, tensor_type=kind)
    out = np.zeros(binding.shape, np.float32)
    binding.read(out)
    paths = list(binding.prim_paths)
    binding.destroy()
    return paths, out.astype(float)


def matrix(quaternion):
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def told(physx, path, seconds):
    stage = ovstage.Stage(f"read {path}")
    everything = ovstage.PopulationDomain.ALL
    ovstage.population.open_usd(stage, path, ordinal=1, domains=everything)
    stage.advance_write_floor(ordinal=1).wait()
    physx.wait_task(physx.attach_ovstage(stage, read_ordinal=1))
    physx.wait_all()
    paths, pose = value(physx, TensorType.RIGID_BODY_POSE)
    _, mass = value(physx, TensorType.RIGID_BODY_MASS)
    _, inertia = value(physx, TensorType.RIGID_BODY_INERTIA)
    bodies = {}
    for k, name in enumerate(paths):
        turn = matrix(pose[k, 3:])
        tensor = turn @ inertia[k].reshape(3, 3) @ turn.T
        bodies[name] = {
            "mass": float(mass.reshape(len(paths), -1)[k, 0]),
            "inertia": tensor.tolist(),
            "origin": pose[k, :3].tolist(),
        }
    said = {"bodies": bodies}
    if seconds:
        for _ in range(round(seconds / STEP)):
            physx.step_sync(STEP)
        _, after = value(physx, TensorType.RIGID_BODY_POSE)
        far = np.linalg.norm(after[:, :3] - pose[:, :3], axis=1)
        said["drift"] = dict(zip(paths, far.tolist(), strict=True))
    physx.wait_task(physx.detach_ovstage())
    stage.destroy()
    return said


PhysX.set_cpu_mode(True)
ovstage.population.register_usd_schemas(schemas())
engine = PhysX()
print(json.dumps([told(engine, path, float(sys.argv[1])) for path in sys.argv[2:]]))
engine.destroy()
