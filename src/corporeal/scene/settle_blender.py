"""Settling of bodies in Blender through BlenderProc, in a separate process.

A job goes out as a file and a result comes back as one; both are data. Blender is GPL and is never imported. All is
computed in a scene of one size, as in ``mujoco.py``, because Bullet's margins and thresholds are absolute: the scene's
unit is ``BLENDER_SCENE_SIZE`` long, and times are longer by
    its root.
"""

import json
import os
import signal
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import GRAVITY_M_S2
from corporeal.scene.settle_mujoco import DroppedBodies
from corporeal.scene.settling_body import UNKNOWN_FRICTION, BodyPose, SettlingBody, scene_unit_of

BLENDER_SCRIPT = Path(__file__).with_name("blender_script.py")
BLENDER_SCENE_SIZE = 10.0
"""Of the scene's unit, in Blender's."""
COLLISION_MARGIN_BLENDER_UNITS = 5e-4
"""Around pieces, in Blender's unit: objects hover by this."""
UNIT_QUATERNION_TOLERANCE = 1e-3
"""How far the norm of a quaternion may be from one."""
LOG_TAIL_LINES = 5
"""Lines of the log that an error repeats."""
INSTALL_BLENDERPROC = (
    "Install BlenderProc (pip install blenderproc: version 2.8 fetches its own Blender 4.2), "
    "or a commit of it that takes bpy 4.2 (USE_EXTERNAL_BPY_MODULE=1), so that "
    "`blenderproc --version` works, or settle with mujoco."
)


@dataclass(frozen=True)
class BlenderConfig:
    """How long to wait, and what counts as rest, in a scene of unit size."""

    program: str = "blenderproc"
    """Found on the PATH, or a path."""
    patience: float = 600.0
    """How long the process may take [s]."""
    longest: float = 8.0
    """Simulated [s]."""
    hold: float = 0.25
    """How long objects must stay where they are [s] …"""
    shift: float = 1e-4
    """… but for so much [m]."""
    fps: int = 60
    substeps: int = 30
    iterations: int = 50
    """Of the contact solver, in each substep."""
    damping: float = 0.1
    """Share of the velocity taken away in a second of Blender's."""


DEFAULT_BLENDER_CONFIG = BlenderConfig()


class BlenderError(UserError):
    """BlenderProc does not work: whatever else is tried, it will not."""


def drop_in_blender(
    bodies: Sequence[SettlingBody], poses: Sequence[BodyPose], config: BlenderConfig = DEFAULT_BLENDER_CONFIG
) -> DroppedBodies:
    """Drop bodies and wait until all are at rest; not the same bits on every machine.

    Raises:
        BlenderError: BlenderProc is not installed, fails, takes too long or writes nonsense.
    """
    with tempfile.TemporaryDirectory(prefix="corporeal-settle-") as name:
        folder = Path(name)
        text = json.dumps(_blender_job(bodies, poses, config))
        (folder / "job.json").write_text(text, encoding="utf-8")
        _run_blender(folder, config)
        result = _read_result(folder / "result.json", config.program)
    return _dropped_bodies(result, bodies, config.program)


def _blender_job(bodies: Sequence[SettlingBody], poses: Sequence[BodyPose], config: BlenderConfig) -> dict[str, Any]:
    """Describe what falls, about its centres of mass and in Blender's units."""
    scale = BLENDER_SCENE_SIZE / scene_unit_of(bodies)
    lightest = min(b.mass for b in bodies)
    entries = []
    for number, (body, pose) in enumerate(zip(bodies, poses, strict=True)):
        arms = [(p.vertices - body.centre) * scale for p in body.pieces]
        pieces = [
            {"vertices": a.tolist(), "triangles": p.triangles.tolist()} for a, p in zip(arms, body.pieces, strict=True)
        ]
        entries.append(
            {
                "name": str(number),
                "mass": body.mass / lightest,
                "radius": float(np.linalg.norm(np.concatenate(arms), axis=1).max()),
                "position": (pose.world(body.centre[None])[0] * scale).tolist(),
                "quaternion": list(pose.quaternion),
                "pieces": pieces,
            }
        )
    slower = BLENDER_SCENE_SIZE**0.5
    return {
        "bodies": entries,
        "gravity": GRAVITY_M_S2,
        "friction": UNKNOWN_FRICTION**0.5,  # Bullet multiplies the two of a contact
        "margin": COLLISION_MARGIN_BLENDER_UNITS,
        "floor": 10 * BLENDER_SCENE_SIZE,
        "damping": config.damping,
        "longest": config.longest * slower,
        "hold": config.hold * slower,
        "shift": config.shift * BLENDER_SCENE_SIZE,
        "fps": config.fps,
        "substeps": config.substeps,
        "iterations": config.iterations,
    }


def _run_blender(folder: Path, config: BlenderConfig) -> None:
    """Run the script in Blender until it ends or patience does."""
    files = [str(folder / name) for name in ("job.json", "result.json")]
    path = folder / "log.txt"
    with path.open("wb") as log:
        try:
            process = subprocess.Popen(
                [config.program, "run", str(BLENDER_SCRIPT), *files],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        except OSError as error:
            raise BlenderError(
                f"{config.program}: cannot be started ({error.strerror}). {INSTALL_BLENDERPROC}"
            ) from error
        try:
            code = process.wait(config.patience)
        except subprocess.TimeoutExpired as late:
            raise BlenderError(
                f"{config.program}: no rest within {config.patience:g} s of work. Settle fewer or "
                f"simpler objects, or settle with mujoco. {_log_tail(path)}"
            ) from late
        finally:
            _kill_blender(process)
    # The result appears whole or not at all, and bpy 4.2 may crash when it has nothing left to do.
    if not (folder / "result.json").exists():
        how = f"failed with code {code}" if code else "wrote no result"
        raise BlenderError(
            f"{config.program}: {how}. {_log_tail(path)} Check that it runs: "
            f"{config.program} quickstart. Or settle with mujoco."
        )


def _kill_blender(process: "subprocess.Popen[bytes]") -> None:
    """End a process that still runs, and the Blender that it started."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def _log_tail(log: Path) -> str:
    lines = [line for line in log.read_text(errors="replace").splitlines() if line.strip()]
    return f"Its last output: {' | '.join(lines[-LOG_TAIL_LINES:])}." if lines else "It printed nothing."


def _read_result(path: Path, program: str) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise _nonsense_error(program, f"no JSON ({error})") from error


def _dropped_bodies(result: Any, bodies: Sequence[SettlingBody], program: str) -> DroppedBodies:
    """Check what came back and say it in metres, of the bodies' own frames."""
    if not isinstance(result, Mapping) or not isinstance(result.get("bodies"), list):
        raise _nonsense_error(program, "no bodies")
    entries = result["bodies"]
    names = [e.get("name") if isinstance(e, Mapping) else None for e in entries]
    wanted = [str(k) for k in range(len(bodies))]
    if sorted(map(str, names)) != sorted(wanted):
        raise _nonsense_error(program, f"bodies {names} in place of {wanted}")
    seconds, quiet = _finite_numbers([result.get("seconds")], 1), result.get("quiet")
    if not isinstance(quiet, bool) or not seconds or seconds[0] < 0:
        raise _nonsense_error(program, f"seconds = {result.get('seconds')}, quiet = {quiet}")
    by_name = {str(e["name"]): e for e in entries}
    scale = scene_unit_of(bodies) / BLENDER_SCENE_SIZE
    poses = [_pose_of_entry(by_name[k], b, scale, program) for k, b in zip(wanted, bodies, strict=True)]
    return DroppedBodies(poses, seconds[0] / BLENDER_SCENE_SIZE**0.5, quiet)


def _pose_of_entry(entry: Mapping[str, Any], body: SettlingBody, scale: float, program: str) -> BodyPose:
    where, turn = (_finite_numbers(entry.get("position"), 3), _finite_numbers(entry.get("quaternion"), 4))
    if where is None or turn is None:
        pose = f"{entry.get('position')}, turned by {entry.get('quaternion')}"
        raise _nonsense_error(program, f"{body.name} is at {pose}")
    norm = float(np.linalg.norm(turn))
    if abs(norm - 1) > UNIT_QUATERNION_TOLERANCE:
        raise _nonsense_error(program, f"{body.name} is turned by {turn}, which is no rotation")
    w, x, y, z = (v / norm for v in turn)
    about = BodyPose((0.0, 0.0, 0.0), (w, x, y, z))
    return about.moved(np.array(where) * scale - about.world(body.centre[None])[0])


def _finite_numbers(values: Any, count: int) -> list[float] | None:
    """Return so many plain finite numbers, or None where they are none."""
    if not isinstance(values, list) or len(values) != count:
        return None
    if any(isinstance(v, bool) or not isinstance(v, int | float) for v in values):
        return None
    return [float(v) for v in values] if all(map(isfinite, values)) else None


def _nonsense_error(program: str, what: str) -> BlenderError:
    return BlenderError(
        f"{program}: its result is invalid: {what}. Install a BlenderProc of Blender 4.2, or settle with mujoco."
    )
