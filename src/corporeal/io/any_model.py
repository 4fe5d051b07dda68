"""Read a model of any kind: glTF, or a mesh file in a child process."""

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from PIL import Image

from corporeal.core.errors import BadFileError, UserError
from corporeal.core.types import Objects
from corporeal.geometry.arrangement import in_unit
from corporeal.geometry.gaussians import Up
from corporeal.io import glb
from corporeal.io.glb import Model
from corporeal.io.images import FORMATS
from corporeal.io.mesh_suffixes import is_mesh, kind_of_ply
from corporeal.io.meshes import read_mesh
from corporeal.io.own_objects import own_objects
from corporeal.io.picture_names import HEIC, OTHERS, SHOWN
from corporeal.io.sources import GLTF, kind_of, stands_alone
from corporeal.io.unit import METRES, Unit

READ = ".glb, .gltf, .obj, .ply, .stl, .off, .3mf, .dae, .usd"
BLENDER = {
    ".fbx": "import bpy; bpy.ops.wm.read_factory_settings(use_empty=True); "
    "bpy.ops.import_scene.fbx(filepath={0!r}); bpy.ops.export_scene.gltf(filepath={1!r})",
    ".blend": "import bpy; bpy.ops.wm.open_mainfile(filepath={0!r}); "
    "bpy.ops.export_scene.gltf(filepath={1!r})",
}
"""What Blender does to write a GLB of what nothing else reads."""


@dataclass(frozen=True)
class Frame:
    """What a person says of the axes and the unit of a mesh file."""

    up: Up | None = None
    """Axis of the file that points up; None: as the file states, or as its kind usually has it."""
    unit: Unit = "auto"
    """What one unit is; auto: what the file states, else what its size makes likely."""


AS_STATED = Frame()
ALL_AROUND = "Take 40 to 80 photographs from all around, and name the folder that they lie in."


def read_model(path: Path, objects: Objects = "auto", frame: Frame = AS_STATED) -> Model:
    """Read one file, +Z up.

    Args:
        path: A model; its companions must lie beside it.
        objects: As ``glb.read_glb`` has it; of mesh files only USD states bodies for "auto". Where
            the file does not state its objects, "auto" finds them as ``own_objects`` has it.
        frame: Of mesh files; glTF states both.

    Raises:
        BadFileError: The file cannot be used, or is a glTF and ``frame`` says something.

    """
    model = _read(Path(path), objects, frame)
    if objects != "auto" or model.stated or len(model.scene.surfaces) == 1:
        return model
    pieces = _read(Path(path), "nodes", frame).scene
    return replace(model, scene=own_objects(model.scene, pieces))


def _read(path: Path, objects: Objects, frame: Frame) -> Model:
    if path.suffix.lower() in GLTF or not path.exists():
        if frame != AS_STATED:
            step = "Leave --up and --unit out; --extent gives things another size."
            raise BadFileError(path, "glTF has +Y up and is in metres.", step)
        return glb.read_model(path, objects)
    if not is_mesh(path):
        raise _not_read(path)
    mesh = read_mesh(path, objects, frame.up)
    if frame.unit == "auto":
        return Model(mesh.scene, mesh.ours, mesh.metric, mesh.stated)
    scene = in_unit(mesh.scene, METRES[frame.unit] / mesh.scene.metres_per_unit)
    return Model(scene, ours=False, stated=mesh.stated)


def _not_read(path: Path) -> UserError:
    kind = path.suffix.lower()
    if path.is_dir() and kind_of([path]) != "model":
        return stands_alone(path)
    if kind == ".ply":
        held = "a Gaussian splat" if kind_of_ply(path) == "splat" else "points without triangles"
        return BadFileError(path, f"holds {held}, not a mesh.", "Name a mesh.")
    if kind in BLENDER:
        made = path.with_suffix(".glb")
        words = BLENDER[kind].format(str(path), str(made))
        command = f'blender --background --python-expr "{words}"'
        return BadFileError(path, f"{kind} is read by Blender only.", f"Convert it: {command}")
    if kind == ".gif":
        return BadFileError(path, "is a GIF.", f"Convert it to MP4 if it moves. {ALL_AROUND}")
    if kind in SHOWN and not _opens(path):
        from corporeal.io.shots import unreadable  # with it come lenses, which models lack

        return BadFileError(path, f"{unreadable(path)}.", ALL_AROUND)
    if kind in SHOWN and _moves(path):
        return BadFileError(path, "is a picture that moves.", f"Convert it to MP4. {ALL_AROUND}")
    if kind in (*SHOWN, *HEIC, *OTHERS):
        return BadFileError(path, "is a single picture, which shows no depth.", ALL_AROUND)
    return BadFileError(path, f"is no model ({READ} are read).", "Convert it to .glb.")


def _opens(path: Path) -> bool:
    """Whether a file begins as a picture that is read."""
    with suppress(Exception), Image.open(path, formats=FORMATS):  # Pillow raises almost anything
        return True
    return False


def _moves(path: Path) -> bool:
    """Whether a picture that is read has several frames, as an animated WebP or PNG has."""
    with suppress(Exception), Image.open(path, formats=FORMATS) as picture:
        return getattr(picture, "n_frames", 1) > 1
    return False
