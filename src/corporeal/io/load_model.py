"""Loading of models: glTF, or mesh files in a child process."""

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from PIL import Image

from corporeal.core.errors import BadFileError, UserError
from corporeal.core.registry import load_function
from corporeal.core.types import ObjectGrouping
from corporeal.geometry.gaussian_transforms import UpAxis
from corporeal.geometry.scene_transforms import convert_scene_unit
from corporeal.io.gltf.gltf_container import read_file_bytes
from corporeal.io.gltf.gltf_reader import LoadedModel
from corporeal.io.image_decoder import IMAGE_FORMATS
from corporeal.io.input_files import input_kind, separate_input_error
from corporeal.io.length_units import METRES_OF_LENGTH_UNIT, LengthUnit
from corporeal.io.mesh.mesh_loader import load_mesh
from corporeal.io.object_grouping import group_pieces_into_objects
from corporeal.io.photos.photo_file_names import HEIC_SUFFIXES, READABLE_IMAGE_SUFFIXES, UNREAD_IMAGE_SUFFIXES
from corporeal.io.registry import reader_of, suffixes_of

BLENDER_CONVERT_SCRIPTS = {
    ".fbx": "import bpy; bpy.ops.wm.read_factory_settings(use_empty=True); "
    "bpy.ops.import_scene.fbx(filepath={0!r}); bpy.ops.export_scene.gltf(filepath={1!r})",
    ".blend": "import bpy; bpy.ops.wm.open_mainfile(filepath={0!r}); bpy.ops.export_scene.gltf(filepath={1!r})",
}
"""What Blender does to write a GLB of what nothing else reads."""


@dataclass(frozen=True)
class MeshFrame:
    """Axes and unit of a mesh file as given by the user."""

    up: UpAxis | None = None
    """Axis of the file that points up; None: as the file states, or as its kind usually has it."""
    unit: LengthUnit = "auto"
    """What one unit is; auto: what the file states, else what its size makes likely."""


FRAME_AS_STATED = MeshFrame()
PHOTOGRAPH_ADVICE = "Take 40 to 80 photographs from all around, and name the folder that they lie in."


def load_model(path: Path, objects: ObjectGrouping = "auto", frame: MeshFrame = FRAME_AS_STATED) -> LoadedModel:
    """Read one file, +Z up.

    Args:
        path: A model; its companions must lie beside it.
        objects: As ``glb.read_glb`` has it; of mesh files only USD states bodies for "auto". Where the file does not
            state its objects, "auto" finds them as ``group_pieces_into_objects`` has it.
        frame: Of mesh files; glTF states both.

    Raises:
        BadFileError: The file cannot be used, or is a glTF and ``frame`` says something.
    """
    model = _read_by_suffix(Path(path), objects, frame)
    if objects != "auto" or model.stated or len(model.scene.surfaces) == 1:
        return model
    pieces = _read_by_suffix(Path(path), "nodes", frame).scene
    return replace(model, scene=group_pieces_into_objects(model.scene, pieces))


def _read_by_suffix(path: Path, objects: ObjectGrouping, frame: MeshFrame) -> LoadedModel:
    if not path.exists():
        read_file_bytes(path)  # says so
    reader = reader_of(path)
    if reader is None or reader.kind not in ("model", "mesh"):
        raise _not_read_error(path)
    if reader.kind == "model":
        if frame != FRAME_AS_STATED:
            step = "Leave --up and --unit out; --extent gives objects another size."
            raise BadFileError(path, f"the axes and the unit of {reader.name} are fixed.", step)
        return load_function(reader.read)(path, objects)
    mesh = load_mesh(path, objects, frame.up)
    if frame.unit == "auto":
        return LoadedModel(mesh.scene, mesh.ours, mesh.metric, mesh.stated)
    scene = convert_scene_unit(mesh.scene, METRES_OF_LENGTH_UNIT[frame.unit] / mesh.scene.metres_per_unit)
    return LoadedModel(scene, ours=False, stated=mesh.stated)


def _not_read_error(path: Path) -> UserError:
    kind = path.suffix.lower()
    if path.is_dir() and input_kind([path]) != "model":
        return separate_input_error(path)
    if kind == ".ply":
        held = "a Gaussian splat" if reader_of(path) else "points without triangles"
        return BadFileError(path, f"holds {held}, not a mesh.", "Name a mesh.")
    if kind in BLENDER_CONVERT_SCRIPTS:
        made = path.with_suffix(".glb")
        words = BLENDER_CONVERT_SCRIPTS[kind].format(str(path), str(made))
        command = f'blender --background --python-expr "{words}"'
        return BadFileError(path, f"{kind} is read by Blender only.", f"Convert it: {command}")
    if kind == ".gif":
        return BadFileError(path, "is a GIF.", f"Convert it to MP4 if it moves. {PHOTOGRAPH_ADVICE}")
    if kind in READABLE_IMAGE_SUFFIXES and not _is_readable_image(path):
        from corporeal.io.photos.image_loader import unreadable_reason  # with it come lenses, which models lack

        return BadFileError(path, f"{unreadable_reason(path)}.", PHOTOGRAPH_ADVICE)
    if kind in READABLE_IMAGE_SUFFIXES and _is_animated_image(path):
        return BadFileError(path, "is a picture that moves.", f"Convert it to MP4. {PHOTOGRAPH_ADVICE}")
    if kind in (*READABLE_IMAGE_SUFFIXES, *HEIC_SUFFIXES, *UNREAD_IMAGE_SUFFIXES):
        return BadFileError(path, "is a single picture, which shows no depth.", PHOTOGRAPH_ADVICE)
    return BadFileError(path, f"is not a model ({readable_model_formats()} are read).", "Convert it to .glb.")


def readable_model_formats() -> str:
    """Return the suffixes of all models, for error messages."""
    return ", ".join(suffixes_of("model", "mesh"))


def _is_readable_image(path: Path) -> bool:
    """Whether a file begins as a picture that is read."""
    with suppress(Exception), Image.open(path, formats=IMAGE_FORMATS):  # Pillow raises almost anything
        return True
    return False


def _is_animated_image(path: Path) -> bool:
    """Whether a picture that is read has several frames, as an animated WebP or PNG has."""
    with suppress(Exception), Image.open(path, formats=IMAGE_FORMATS) as picture:
        return getattr(picture, "n_frames", 1) > 1
    return False
