"""Checks of exported files with independent readers.

A reader that is not installed is named, and nothing is measured then.
"""

# The readers are optional, and compiled modules without stubs.
# pyright: reportAttributeAccessIssue=false, reportMissingImports=false, reportIndexIssue=false

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from corporeal.core.registry import load_function
from corporeal.export.alembic_writer import Z_UP_TO_Y_UP
from corporeal.export.animated_glb_reader import read_animated_glb
from corporeal.export.export_target import EXPORT_WRITERS, ExportRequest, ExportTarget
from corporeal.export.exported_solids import ExportedSolid, PhysicalScene
from corporeal.export.mjcf_writer import write_mjcf
from corporeal.io.splat.load_splat import load_splat

REST_CHECK_S = 2.0
"""How long a settled scene must stay where it is [s]."""


@dataclass(frozen=True)
class ReaderFindings:
    """What a reader found."""

    measured: Mapping[str, float] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()
    """In sentences."""


def check_target(target: ExportTarget, folder: Path, asked: ExportRequest) -> ReaderFindings:
    """Read one target's files again."""
    writer = EXPORT_WRITERS[target]
    try:
        import_module(writer.check_package or "corporeal")
    except ImportError:
        what = f"Not checked: {writer.check_package} is not installed"
        return ReaderFindings(doubts=(f"{what} (pip install 'corporeal[export]').",))
    return load_function(writer.check)(folder, asked)


def check_usd(folder: Path, asked: ExportRequest) -> ReaderFindings:
    """Ask OpenUSD's own validators, and compare every body's mass and inertia."""
    from pxr import Usd, UsdPhysics, UsdValidation

    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    complaints: list[str] = []
    stages = sorted(folder.glob("*.usda"))
    for path in (p for p in stages if p.stem in ("sim", "video")):
        errors = context.Validate(Usd.Stage.Open(str(path)))
        complaints += [f"{path.name}: {e.GetErrorAsString()}" for e in errors]
    stage = Usd.Stage.Open(str(folder / "sim.usda"))
    differences = [0.0]
    for solid in (s for s in asked.scene.solids if s.rigid):
        body = UsdPhysics.MassAPI(stage.GetPrimAtPath(f"/World/{solid.name}"))
        moments = np.array(body.GetDiagonalInertiaAttr().Get())
        differences.append(abs(body.GetMassAttr().Get() / solid.mass - 1))
        differences.append(_moment_error(moments, solid))
    measured = {"findings": float(len(complaints)), "mass_and_inertia_off": max(differences)}
    return ReaderFindings(measured, tuple(complaints))


def _moment_error(moments: np.ndarray, solid: ExportedSolid) -> float:
    """Relative difference of principal moments, in any order [-]."""
    wanted = np.linalg.eigvalsh(solid.inertia)
    return float(np.abs(np.sort(moments) / wanted - 1).max())


def check_mjcf(folder: Path, asked: ExportRequest) -> ReaderFindings:
    """Load the scene in MuJoCo; what lies at rest must stay."""
    import mujoco

    scene = asked.scene
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    rigid = [s for s in scene.solids if s.rigid]
    off = [body_mass_error(model.body(s.name), s) for s in rigid]
    measured = {"mass_and_inertia_off": max(off, default=0.0)}
    if not scene.settled or not rigid:
        return ReaderFindings(measured)
    drift = drift_in_mujoco(_rigid_only_model(asked), rigid, REST_CHECK_S)
    measured |= {f"drift_m {name}": far for name, far in drift.items()}
    return ReaderFindings(measured, _surfaces_left_out(scene))


def _rigid_only_model(asked: ExportRequest):
    """Compile the scene without what can deform, which would take hours to rest."""
    import mujoco

    config = replace(asked.config, soft="none")
    with TemporaryDirectory(prefix="corporeal-") as name:
        write_mjcf(replace(asked, config=config), Path(name))
        return mujoco.MjModel.from_xml_path(str(Path(name) / "scene.xml"))


def check_urdf(folder: Path, asked: ExportRequest) -> ReaderFindings:
    """Load every body in MuJoCo, which reads URDF too."""
    off = [0.0]
    for solid in (s for s in asked.scene.solids if s.rigid):
        model = urdf_in_mujoco(folder / f"{solid.name}.urdf")
        off.append(body_mass_error(model.body("body"), solid))
    return ReaderFindings({"mass_and_inertia_off": max(off)})


def urdf_in_mujoco(path: Path):
    """Compile a URDF; its one link stays a body of its own."""
    import mujoco

    spec = mujoco.MjSpec.from_file(str(path))
    spec.compiler.fusestatic = False
    spec.strippath = False
    return spec.compile()


def body_mass_error(body, solid: ExportedSolid) -> float:
    """Largest relative difference of mass and principal moments of a body in MuJoCo [-]."""
    mass = abs(float(body.mass[0]) / solid.mass - 1)
    return max(mass, _moment_error(np.asarray(body.inertia), solid))


def drift_in_mujoco(model, rigid: list[ExportedSolid], seconds: float) -> dict[str, float]:
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


def _surfaces_left_out(scene: PhysicalScene) -> tuple[str, ...]:
    soft = [s.title for s in scene.solids if not s.rigid]
    if not soft:
        return ()
    names = ", ".join(soft)
    return (f"Drift is measured without {names}, which can deform: objects on it fall.",)


def check_glb(folder: Path, asked: ExportRequest) -> ReaderFindings:
    """Open the video as a viewer does, and pose it at every frame."""
    motion, video = asked.motion, read_animated_glb(folder / "video.glb")
    if not motion.moves:
        return ReaderFindings()
    shapes = motion.shapes(asked.scene.solids)
    numbers = [n for s in asked.scene.solids for n in s.surface_numbers]
    wanted = np.concatenate([shapes.of(n)[0] for n in numbers], axis=1)
    off = [np.linalg.norm(video.vertices(k) - wanted[k], axis=1).max() for k in range(len(wanted))]
    return ReaderFindings({"vertex_off_m": float(max(off))})


def check_h5(folder: Path, asked: ExportRequest) -> ReaderFindings:
    """Open the data set and compare masses and the last positions."""
    import h5py

    assert asked.played is not None, "only what moved has a table"
    particles = asked.played.prepared.particles
    last = asked.motion.frames[len(asked.motion.time) - 1].position
    with h5py.File(folder / "train.h5") as file:
        run = file["00000"]
        off = np.abs(run["position"][-1] - last).max()
        weight = float(np.abs(np.array(run["mass"]) - particles.mass).max())
    return ReaderFindings({"position_off_m": float(off), "mass_off_kg": weight})


def check_alembic(folder: Path, asked: ExportRequest) -> ReaderFindings:
    """Open the archive and compare every surface at the last frame."""
    from alembic3d import Abc, AbcGeom

    top = Abc.IArchive(str(folder / "video.abc")).getTop()
    shapes = asked.motion.shapes(asked.scene.solids)
    last, off = len(asked.motion.time) - 1, [0.0]
    for solid in asked.scene.solids:
        node = AbcGeom.IXform(top, solid.name)
        for number in solid.surface_numbers:
            schema = AbcGeom.IPolyMesh(node, f"surface_{number}").getSchema()
            found = np.array(schema.getValue(Abc.ISampleSelector(last)).getPositions())
            wanted = shapes.of(number)[0][last] @ Z_UP_TO_Y_UP.T
            off.append(float(np.abs(found - wanted).max()))
    return ReaderFindings({"vertex_off_m": max(off)})


def check_splats(folder: Path, asked: ExportRequest) -> ReaderFindings:
    """Open the first and the last picture with our own reader of splats."""
    files = sorted(folder.glob("*.ply"))
    counts = {load_splat(f).count for f in (files[0], files[-1])}
    missing = len(asked.motion.time) - len(files)
    return ReaderFindings({"frames_missing": float(missing), "counts": float(len(counts))})


def check_without_reader(folder: Path, asked: ExportRequest) -> ReaderFindings:
    """State that there is no reader to ask."""
    return ReaderFindings(doubts=("Not checked: the loader of geoelements/gns is not a package.",))
