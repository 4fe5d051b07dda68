"""Open exported files with real readers and measure what they hold.

A reader that is not installed is named, and nothing is measured then.
"""

# The readers are optional, and compiled modules without stubs.
# pyright: reportAttributeAccessIssue=false, reportMissingImports=false, reportIndexIssue=false

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from corporeal.export.alembic_film import Y_UP
from corporeal.export.mjcf import write_mjcf
from corporeal.export.read_glb_film import read_film
from corporeal.export.solids import PhysicalScene, Solid
from corporeal.export.target import Asked, Target
from corporeal.io.splats import read_splat

REST = 2.0
"""How long a settled scene must stay where it is [s]."""


@dataclass(frozen=True)
class Found:
    """What a reader found."""

    measured: Mapping[str, float] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()
    """In sentences."""


def check(target: Target, folder: Path, asked: Asked) -> Found:
    """Read one target's files again.

    Args:
        target: What they are.
        folder: Where they are.
        asked: What they should hold.

    """
    reader, judge = CHECKS[target]
    if reader is None:
        return judge(folder, asked)
    try:
        import_module(reader)
    except ImportError:
        doubt = f"Not checked: {reader} is not installed (pip install 'corporeal[export]')."
        return Found(doubts=(doubt,))
    return judge(folder, asked)


# ---------------------------------------------------------------- USD


def check_usd(folder: Path, asked: Asked) -> Found:
    """Ask OpenUSD's own validators, and compare every body's mass and inertia."""
    from pxr import Usd, UsdPhysics, UsdValidation

    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    complaints: list[str] = []
    stages = sorted(folder.glob("*.usda"))
    for path in (p for p in stages if p.stem in ("sim", "film")):
        errors = context.Validate(Usd.Stage.Open(str(path)))
        complaints += [f"{path.name}: {e.GetErrorAsString()}" for e in errors]
    stage = Usd.Stage.Open(str(folder / "sim.usda"))
    differences = [0.0]
    for solid in (s for s in asked.scene.solids if s.rigid):
        body = UsdPhysics.MassAPI(stage.GetPrimAtPath(f"/World/{solid.name}"))
        moments = np.array(body.GetDiagonalInertiaAttr().Get())
        differences.append(abs(body.GetMassAttr().Get() / solid.mass - 1))
        differences.append(_moments_off(moments, solid))
    measured = {"findings": float(len(complaints)), "mass_and_inertia_off": max(differences)}
    return Found(measured, tuple(complaints))


def _moments_off(moments: np.ndarray, solid: Solid) -> float:
    """Relative difference of principal moments, in any order [-]."""
    wanted = np.linalg.eigvalsh(solid.inertia)
    return float(np.abs(np.sort(moments) / wanted - 1).max())


# ---------------------------------------------------------------- MuJoCo


def check_mjcf(folder: Path, asked: Asked) -> Found:
    """Load the scene in MuJoCo; what lies at rest must stay."""
    import mujoco

    scene = asked.scene
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    rigid = [s for s in scene.solids if s.rigid]
    off = [body_off(model.body(s.name), s) for s in rigid]
    measured = {"mass_and_inertia_off": max(off, default=0.0)}
    if not scene.settled or not rigid:
        return Found(measured)
    drift = drift_in_mujoco(_rigid_alone(asked), rigid, REST)
    measured |= {f"drift_m {name}": far for name, far in drift.items()}
    return Found(measured, _left_out(scene))


def _rigid_alone(asked: Asked):
    """Compile the scene without what can deform, which would take hours to rest."""
    import mujoco

    config = replace(asked.config, soft="none")
    with TemporaryDirectory(prefix="corporeal-") as name:
        write_mjcf(replace(asked, config=config), Path(name))
        return mujoco.MjModel.from_xml_path(str(Path(name) / "scene.xml"))


def check_urdf(folder: Path, asked: Asked) -> Found:
    """Load every body in MuJoCo, which reads URDF too."""
    off = [0.0]
    for solid in (s for s in asked.scene.solids if s.rigid):
        model = urdf_in_mujoco(folder / f"{solid.name}.urdf")
        off.append(body_off(model.body("body"), solid))
    return Found({"mass_and_inertia_off": max(off)})


def urdf_in_mujoco(path: Path):
    """Compile a URDF; its one link stays a body of its own."""
    import mujoco

    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.fusestatic = False
    spec.strippath = False
    return spec.compile()


def body_off(body, solid: Solid) -> float:
    """Largest relative difference of mass and principal moments of a body in MuJoCo [-]."""
    mass = abs(float(body.mass[0]) / solid.mass - 1)
    return max(mass, _moments_off(np.asarray(body.inertia), solid))


def drift_in_mujoco(model, rigid: list[Solid], seconds: float) -> dict[str, float]:
    """How far each rigid body's centre goes in so long [m]."""
    import mujoco

    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bodies = {s.name: model.body(s.name).id for s in rigid}
    start = data.xpos.copy()
    while data.time < seconds:
        mujoco.mj_step(model, data)
    far = np.linalg.norm(data.xpos - start, axis=1)
    return {name: float(far[k]) for name, k in bodies.items()}


def _left_out(scene: PhysicalScene) -> tuple[str, ...]:
    soft = [s.title for s in scene.solids if not s.rigid]
    if not soft:
        return ()
    names = ", ".join(soft)
    return (f"Drift is measured without {names}, which can deform: what lies on it falls.",)


# ---------------------------------------------------------------- motion and data


def check_glb(folder: Path, asked: Asked) -> Found:
    """Open the film as a viewer does, and pose it at every frame."""
    motion, film = asked.motion, read_film(folder / "film.glb")
    if not motion.moves:
        return Found()
    shapes = motion.shapes(asked.scene.solids)
    numbers = [n for s in asked.scene.solids for n in s.surface_numbers]
    wanted = np.concatenate([shapes.of(n)[0] for n in numbers], axis=1)
    off = [np.linalg.norm(film.vertices(k) - wanted[k], axis=1).max() for k in range(len(wanted))]
    return Found({"vertex_off_m": float(max(off))})


def check_h5(folder: Path, asked: Asked) -> Found:
    """Open the data set and compare masses and the last positions."""
    import h5py

    assert asked.played is not None, "only what moved has a table"
    particles = asked.played.prepared.particles
    last = asked.motion.frames[len(asked.motion.time) - 1].position
    with h5py.File(folder / "train.h5") as file:
        run = file["00000"]
        off = np.abs(run["position"][-1] - last).max()
        weight = float(np.abs(np.array(run["mass"]) - particles.mass).max())
    return Found({"position_off_m": float(off), "mass_off_kg": weight})


def check_alembic(folder: Path, asked: Asked) -> Found:
    """Open the archive and compare every surface at the last frame."""
    from alembic3d import Abc, AbcGeom

    top = Abc.IArchive(str(folder / "film.abc")).getTop()
    shapes = asked.motion.shapes(asked.scene.solids)
    last, off = len(asked.motion.time) - 1, [0.0]
    for solid in asked.scene.solids:
        node = AbcGeom.IXform(top, solid.name)
        for number in solid.surface_numbers:
            schema = AbcGeom.IPolyMesh(node, f"surface_{number}").getSchema()
            found = np.array(schema.getValue(Abc.ISampleSelector(last)).getPositions())
            wanted = shapes.of(number)[0][last] @ Y_UP.T
            off.append(float(np.abs(found - wanted).max()))
    return Found({"vertex_off_m": max(off)})


def check_splats(folder: Path, asked: Asked) -> Found:
    """Open the first and the last picture with our own reader of splats."""
    files = sorted(folder.glob("*.ply"))
    counts = {read_splat(f).count for f in (files[0], files[-1])}
    missing = len(asked.motion.time) - len(files)
    return Found({"frames_missing": float(missing), "counts": float(len(counts))})


def check_nothing(folder: Path, asked: Asked) -> Found:
    """Say that there is no reader to ask."""
    return Found(doubts=("Not checked: the loader of geoelements/gns is no package.",))


CHECKS: dict[Target, tuple[str | None, Callable[[Path, Asked], Found]]] = {
    "usd": ("pxr", check_usd),
    "mjcf": (None, check_mjcf),
    "urdf": (None, check_urdf),
    "glb": (None, check_glb),
    "splats": (None, check_splats),
    "h5": ("h5py", check_h5),
    "npz": (None, check_nothing),
    "abc": ("alembic3d", check_alembic),
}
"""Target → the module that its reader needs beyond corporeal's own, and what asks it."""
