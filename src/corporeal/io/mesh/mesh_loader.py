"""Loading of OBJ, PLY, STL, OFF, 3MF, DAE and USD as a Scene, +Z up.

The libraries that read them run in a child process with limits of time and memory; what it hands over is checked as any
file's. Facts of each kind, docs/reference/input-files.md, "Meshes".
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from corporeal.core import store
from corporeal.core.errors import BadFileError
from corporeal.core.types import Note, NoteKind, ObjectGrouping, Scene, SceneObject, Surface
from corporeal.geometry.crease_normals import add_crease_normals
from corporeal.geometry.gaussian_transforms import UpAxis, rotation_to_z_up
from corporeal.io.gltf.gltf_container import read_file_bytes
from corporeal.io.mesh.mesh_bodies import apply_body_statements, apply_scene_statements
from corporeal.io.mesh.mesh_reader_process import (
    COMPANIONS_FILE,
    MAX_MESH_READ_MEMORY_BYTES,
    MAX_MESH_READ_S,
    RAW_MESH_FILE,
    REFUSAL_FILE,
)
from corporeal.io.mesh.raw_mesh import MESH_EXPORT_ADVICE, NODE_NAMES_KEY, RawMesh, read_raw_mesh
from corporeal.io.mesh.up_axis_inference import infer_up_axis
from corporeal.io.registry import Reader, reader_of, require_packages
from corporeal.recognition.readable_names import everyday_words, numbered_names, safe_name

MAX_MESH_COORDINATE = 1e12
"""Coordinates beyond which a file is broken, in its own unit."""


@dataclass(frozen=True)
class MeshFile:
    """What a file holds."""

    scene: Scene
    """+Z up, in metres where ``metric``, else in the file's unit."""
    metric: bool
    """Whether the file states its unit."""
    ours: bool = False
    """Our own exporter made it: gravity, duration and the like are stated in it."""
    stated: bool = False
    """Whether the file itself says what its objects are."""


def load_mesh(
    path: Path, objects: ObjectGrouping = "one", up: UpAxis | None = None, max_seconds: int = MAX_MESH_READ_S
) -> MeshFile:
    """Read one file.

    Args:
        path: Its suffix says what it is; its companions must lie beside it.
        objects: "one": the whole file is one object. "nodes": every named object on the first level that branches is
            one. "auto": the bodies that the file states (USD); without any, the whole file.
        up: Axis of the file that points up; None: the one it states, else its kind's usual one.
        max_seconds: Reading it may take so long [s].

    Raises:
        BadFileError: The file cannot be used.
    """
    path = Path(path)
    read_file_bytes(path)  # refuses what is absent, empty, or too large to be read
    reader = reader_of(path, "mesh")
    if reader is None:
        raise BadFileError(path, "is no mesh that is read.", MESH_EXPORT_ADVICE)
    with tempfile.TemporaryDirectory(prefix="corporeal-") as folder:
        _run_reader_process(path, Path(folder), reader, reader.read, max_seconds)
        raw = read_raw_mesh(Path(folder) / RAW_MESH_FILE)
    _check_numbers(path, raw)
    taken, of_up = (up, ()) if up else _assumed_up_axis(path, raw, reader.usual_up)
    turn = rotation_to_z_up(taken)
    turned = _to_z_up(raw, turn, raw.unit or 1.0)
    bodies = raw.bodies if objects == "auto" else {}
    owners = _body_of_surface(turned, bodies) if bodies else _object_of_surface(turned, objects == "nodes")
    scene = _scene(path, turned, owners, raw)
    scene = replace(scene, warnings=(*scene.warnings, *of_up))
    if bodies:
        scene = apply_body_statements(scene, list(dict.fromkeys(owners)), bodies, turn)
    ours = bool(raw.custom) and objects == "auto"
    scene = apply_scene_statements(scene, raw.custom) if ours else scene
    return MeshFile(scene, raw.unit is not None, ours, stated=bool(raw.bodies))


def companions_in_child(path: Path, reader: Reader) -> list[Path]:
    """Return the files that a mesh file is made of, as the library that reads it says."""
    with tempfile.TemporaryDirectory(prefix="corporeal-") as folder:
        try:
            _run_reader_process(path, Path(folder), reader, reader.companions)
        except BadFileError:
            return []  # whoever reads it says why
        return [Path(name) for name in store.read_json(Path(folder) / COMPANIONS_FILE)]


def _run_reader_process(
    path: Path, folder: Path, reader: Reader, function: str, max_seconds: int = MAX_MESH_READ_S
) -> None:
    """Let a child process call a function of a reader, and write what it returns into a folder.

    Raises:
        BadFileError: It cannot, or not within the limits.
    """
    require_packages(reader, path)
    command = [sys.executable, "-P", "-m", "corporeal.io.mesh.mesh_reader_process", function]
    # One thread each: every further one takes its share of the address space.
    threads = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL")}
    try:
        done = subprocess.run(
            [*command, str(path), str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            env=os.environ | threads,
            timeout=max_seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        what = f"is not read within {max_seconds} s."
        raise BadFileError(path, what, "Simplify the model, or export it as .glb.") from None
    if (folder / REFUSAL_FILE).exists():
        raise BadFileError(path, store.read_json(folder / REFUSAL_FILE))
    if done.returncode:
        _reader_process_error(path, done)


def _reader_process_error(path: Path, done: subprocess.CompletedProcess[bytes]) -> NoReturn:
    last = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or [""]
    if "MemoryError" in last[0] or "bad_alloc" in last[0]:
        what = f"does not fit into {MAX_MESH_READ_MEMORY_BYTES >> 30} GiB while it is read."
        raise BadFileError(path, what, "Simplify the model, or export it as .glb.")
    what = f"its reader ended without a result (exit status {done.returncode})."
    raise BadFileError(path, what, MESH_EXPORT_ADVICE)


def _check_numbers(path: Path, raw: RawMesh) -> None:
    """Reject numbers that cannot be.

    Raises:
        BadFileError: There are some, or there are no triangles.
    """
    if not raw.surfaces:
        raise BadFileError(path, "holds no triangles.", MESH_EXPORT_ADVICE)
    for s in raw.surfaces:
        if s.vertices.ndim != 2 or s.vertices.shape[1] != 3:
            raise BadFileError(path, "has vertices that are not places in space.", MESH_EXPORT_ADVICE)
        if s.triangles.min() < 0 or s.triangles.max() >= len(s.vertices):
            raise BadFileError(path, "has a face without corners.", MESH_EXPORT_ADVICE)
        if not np.isfinite(s.vertices).all():
            raise BadFileError(path, "has vertices that are not finite numbers.", MESH_EXPORT_ADVICE)
    places = np.concatenate([s.vertices for s in raw.surfaces])
    if np.abs(places).max() > MAX_MESH_COORDINATE:
        raise BadFileError(path, "has vertices at impossible places.", MESH_EXPORT_ADVICE)
    if not np.ptp(places, axis=0).max() > 0:
        raise BadFileError(path, "has no size.", MESH_EXPORT_ADVICE)


def _assumed_up_axis(path: Path, raw: RawMesh, usual: UpAxis) -> tuple[UpAxis, tuple[str, ...]]:
    """Return the assumed up axis if none is stated, with notes."""
    if raw.up is not None:
        said = (Note(f"{path.name}: {raw.up_note}", NoteKind.ASSUMED),) if raw.up_note else ()
        return raw.up, said
    before = np.cumsum([0, *(len(s.vertices) for s in raw.surfaces)])
    vertices = np.concatenate([s.vertices for s in raw.surfaces])
    pairs = zip(raw.surfaces, before, strict=False)
    triangles = np.concatenate([s.triangles + n for s, n in pairs])
    likelier = infer_up_axis(vertices, triangles, usual)
    if likelier is None:
        return usual, ()
    axis, why = likelier
    kind = path.suffix.lower()
    said = f"{path.name} does not state what is up. {usual} was taken, as is usual in {kind}, "
    return usual, (Note(f"{said}{why}. If it lies on its side, use --up {axis[1]}.", NoteKind.ASSUMED),)


def _to_z_up(raw: RawMesh, turn: np.ndarray, unit: float) -> list[Surface]:
    return [add_crease_normals(replace(s, vertices=unit * s.vertices @ turn.T)) for s in raw.surfaces]


def _object_of_surface(surfaces: list[Surface], nodes: bool) -> list[str]:
    """Return the name of the object of each surface; "": the whole file is one."""
    paths = [tuple(map(str, s.extras[NODE_NAMES_KEY])) for s in surfaces]
    if not nodes:
        return [""] * len(paths)
    level = _branching_level(paths)
    return [p[min(level, len(p) - 1)] for p in paths]


def _branching_level(paths: Sequence[tuple[str, ...]]) -> int:
    """Return the first level on which paths differ, or below which one of them has nothing."""
    level = 0
    while all(len(p) > level + 1 for p in paths) and len({p[level] for p in paths}) == 1:
        level += 1
    return level


def _body_of_surface(surfaces: list[Surface], bodies: Mapping[str, Any]) -> list[str]:
    """Return the path of each surface's body; of what belongs to none, that of its branch."""
    paths = [tuple(map(str, s.extras[NODE_NAMES_KEY])) for s in surfaces]
    level, found = _branching_level(paths), []
    for along in paths:
        own = "/" + "/".join(along)
        about = [b for b in bodies if own == b or own.startswith(f"{b}/")]
        found.append(max(about, key=len, default="/" + "/".join(along[: level + 1])))
    return found


def _scene(path: Path, surfaces: list[Surface], owners: list[str], raw: RawMesh) -> Scene:
    name, names = safe_name(path.stem) or "object", list(dict.fromkeys(owners))
    words = [everyday_words(owner.rsplit("/", 1)[-1]) for owner in names]  # a path, or a name
    classes = [name or everyday_words(path.stem) or "object" for name in words]
    called = [name] if names == [""] else numbered_names(classes, names)
    things = []
    for owner, own_name, kind in zip(names, called, classes, strict=True):
        places = np.concatenate([s.vertices for s, o in _pairs(surfaces, owners) if o == owner])
        extent = float(np.ptp(places, axis=0).max())
        things.append(SceneObject(own_name, kind, extent, source=str(path)))
    return Scene(
        name,
        str(path),
        tuple(things),
        tuple(
            replace(
                s,
                object=names.index(o),
                name=safe_name(s.name) or "surface",
                extras={k: v for k, v in s.extras.items() if k != NODE_NAMES_KEY},
            )
            for s, o in _pairs(surfaces, owners)
        ),
        raw.finishes,
        metres_per_unit=raw.unit or 1.0,
        warnings=(Note(f"{path.name}: left out: {', '.join(raw.lost)}.", NoteKind.LEFT_OUT),) if raw.lost else (),
    )


def _pairs(surfaces: list[Surface], owners: list[str]) -> zip:
    return zip(surfaces, owners, strict=True)
