"""The formats that are read, one row each, and the types of the rows of readers and writers.

A row is all that the package has to know of a format: which files are distinguished from it by name, which suffixes
errors list, how a file is recognised by its content, and which function reads it. Nothing is imported before a file
asks for it. Writers are listed in ``export.export_target``.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

from corporeal.core.errors import BadFileError
from corporeal.core.registry import load_function
from corporeal.geometry.gaussian_transforms import UpAxis

ReaderKind = Literal["scene", "model", "mesh", "splat"]
MAX_HEAD_BYTES = 2**16
"""Of a file whose suffix several formats share, what is looked at to tell its format [bytes]."""
SIGNATURE_SEARCH_BYTES = 64
"""Where a signature may begin after white space [bytes]."""


@dataclass(frozen=True)
class Reader:
    """One format that is read. Functions are named as ``"module:function"``."""

    name: str
    """For error messages."""
    kind: ReaderKind
    """What ``read`` does:

    - scene: path → ``SceneFile``.
    - model: path, ``ObjectGrouping`` → ``LoadedModel``, of a format with fixed axes and unit.
    - mesh: path → ``RawMesh``; it runs in a child process with limits of time and memory.
    - splat: path, bytes of the file → ``Gaussians``, unchecked."""
    suffixes: tuple[str, ...]
    """In lower case, with the dot."""
    read: str
    signatures: tuple[bytes, ...] = ()
    """First bytes of its files, white space left out. A splat that has one is of this format, or broken."""
    matches: str = ""
    """Bytes of a file → whether it is of this format; where there is no signature, or where several formats share a
    suffix."""
    usual_up: UpAxis = "+y"
    """Axis that points up in files that do not state it."""
    folder_files: tuple[str, ...] = ()
    """Patterns of the files in an unpacked folder; the first is the name of the file to read."""
    companions: str = ""
    """Path → paths of the files beside it, all there, that it is made of."""
    companions_in_child: bool = False
    """Whether ``companions`` needs the library that reads the file, and so the child process."""
    packages: tuple[str, ...] = ()
    """Modules that ``read`` needs beyond the package's own requirements."""
    extra: str = ""
    """The extra of corporeal that installs them."""


@dataclass(frozen=True)
class Writer:
    """One format that is written. Functions are named as ``"module:function"``."""

    name: str
    write: str
    """A ``TargetWriter``."""
    check: str
    """Reads the files again and measures what they hold."""
    check_package: str = ""
    """Module that ``check`` needs beyond the package's own requirements."""
    write_dataset: str = ""
    """Writes many runs into one file; empty: every run has files of its own."""


_TRIMESH, _COMPANIONS = "corporeal.io.mesh.mesh_trimesh", "corporeal.io.mesh.mesh_companions"
_USD, _SPLAT = "corporeal.io.usd.usd_meshes", "corporeal.io.splat"
SCENE_TOML_READER = Reader("scene file", "scene", (".toml",), "corporeal.io.scene_toml:read_scene_file")
GLTF_READER = Reader(
    "glTF",
    "model",
    (".glb", ".gltf"),
    "corporeal.io.gltf.gltf_reader:read_gltf_model",
    companions="corporeal.io.gltf.gltf_document:gltf_companions",
)
READERS: tuple[Reader, ...] = (
    SCENE_TOML_READER,
    GLTF_READER,
    Reader("OBJ", "mesh", (".obj",), f"{_TRIMESH}:read_obj", companions=f"{_COMPANIONS}:obj_companions"),
    Reader(
        "PLY",
        "mesh",
        (".ply",),
        f"{_TRIMESH}:read_ply",
        matches="corporeal.io.ply_container:is_mesh_ply",
        usual_up="+z",
        companions=f"{_COMPANIONS}:ply_companions",
    ),
    Reader("STL", "mesh", (".stl",), f"{_TRIMESH}:read_stl", usual_up="+z"),
    Reader("OFF", "mesh", (".off",), f"{_TRIMESH}:read_off", usual_up="+z"),
    Reader("3MF", "mesh", (".3mf",), f"{_TRIMESH}:read_3mf", packages=("lxml", "networkx"), extra="meshes"),
    Reader(
        "DAE",
        "mesh",
        (".dae",),
        f"{_TRIMESH}:read_dae",
        companions=f"{_COMPANIONS}:dae_companions",
        packages=("lxml", "collada"),
        extra="meshes",
    ),
    Reader(
        "USD",
        "mesh",
        (".usd", ".usda", ".usdc", ".usdz"),
        f"{_USD}:read_usd",
        companions=f"{_USD}:usd_companions",
        companions_in_child=True,
        packages=("pxr",),
        extra="usd",
    ),
    Reader(
        "PLY (INRIA's layout or compressed)",
        "splat",
        (".ply",),
        f"{_SPLAT}.splat_compressed_ply:read_splat_ply",
        signatures=(b"ply",),
        matches="corporeal.io.ply_container:is_splat_ply",
        usual_up="-y",
    ),
    Reader("SPZ", "splat", (".spz",), f"{_SPLAT}.spz:read_spz", signatures=(b"NGSP", b"\x1f\x8b")),
    Reader(
        "SOG",
        "splat",
        (".sog",),
        f"{_SPLAT}.sog:read_sog",
        signatures=(b"PK\x03\x04", b"{"),
        usual_up="-y",
        folder_files=("meta.json", "means*"),
    ),
    Reader(
        ".ksplat",
        "splat",
        (".ksplat",),
        f"{_SPLAT}.ksplat:read_ksplat",
        matches=f"{_SPLAT}.ksplat:is_ksplat",
        usual_up="-y",
    ),
    Reader(
        ".splat",
        "splat",
        (".splat",),
        f"{_SPLAT}.splat_antimatter15:read_antimatter15",
        matches=f"{_SPLAT}.splat_antimatter15:is_antimatter15",
        usual_up="-y",
    ),
)
"""Of those that fit a file, the first reads it."""


def readers_of(*kinds: ReaderKind) -> Iterator[Reader]:
    """Yield the readers of some kinds; of none named, all."""
    return (r for r in READERS if not kinds or r.kind in kinds)


def suffixes_of(*kinds: ReaderKind) -> tuple[str, ...]:
    """Return the suffixes of the files that the readers of some kinds read."""
    return tuple(suffix for reader in readers_of(*kinds) for suffix in reader.suffixes)


def reader_of(path: Path, *kinds: ReaderKind) -> Reader | None:
    """Return what reads a file, by its name; by its content where several formats share a suffix.

    Args:
        path: It may be absent.
        kinds: The readers that are asked; without any, all.
    """
    suffix = path.suffix.lower()
    fitting = [r for r in readers_of(*kinds) if suffix in r.suffixes or path.name in r.folder_files[:1]]
    if len(fitting) < 2:
        return fitting[0] if fitting else None
    head = _file_head(path)
    return next((r for r in fitting if load_function(r.matches)(head)), None)


def reader_of_content(data: memoryview, kind: ReaderKind) -> Reader | None:
    """Return what reads a file, by its content only: its signature, else what it is like."""
    head = bytes(data[:SIGNATURE_SEARCH_BYTES]).lstrip()
    signed = (r for r in readers_of(kind) if head.startswith(r.signatures))
    alike = (r for r in readers_of(kind) if not r.signatures and load_function(r.matches)(data))
    return next(signed, None) or next(alike, None)


def require_packages(reader: Reader, path: Path) -> None:
    """Refuse a file whose reader needs what is not installed.

    Raises:
        BadFileError: A package is missing.
    """
    missing = [name for name in reader.packages if find_spec(name) is None]
    if missing:
        what = f"reading {path.suffix} needs {' and '.join(missing)}."
        raise BadFileError(path, what, f"Install with: pip install 'corporeal[{reader.extra}]'.")


def _file_head(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            return stream.read(MAX_HEAD_BYTES)
    except OSError:
        return b""  # whoever reads it says why
