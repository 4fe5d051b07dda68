"""Input files of a scene, whose content is part of the freshness keys."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal

from corporeal.core.errors import UserError
from corporeal.core.registry import load_function
from corporeal.core.types import Note, NoteKind
from corporeal.io.mesh.mesh_loader import companions_in_child
from corporeal.io.photos.photo_file_names import (
    HEIC_SUFFIXES,
    IMAGE_FOLDERS,
    INSTANCE_FOLDERS,
    MASK_FOLDERS,
    READABLE_IMAGE_SUFFIXES,
    UNREAD_IMAGE_SUFFIXES,
)
from corporeal.io.registry import ReaderKind, reader_of, readers_of, suffixes_of
from corporeal.io.scene_toml import SceneFile
from corporeal.recognition.readable_names import safe_name, single_line_text

VIDEO_SUFFIXES = (".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm")
InputKind = Literal["model", "photographs", "splat"]


def input_kind(inputs: Sequence[Path]) -> InputKind:
    """Describe what the inputs are, by their names; what is nothing else is taken for a model.

    Raises:
        UserError: Photographs or a splat are named beside something else.
    """
    kinds: list[InputKind] = [_path_kind(Path(path)) for path in inputs]
    if len(kinds) > 1 and set(kinds) != {"model"}:
        strange = next(p for p, kind in zip(inputs, kinds, strict=True) if kind != "model")
        raise separate_input_error(strange)
    return kinds[0] if kinds else "model"


def separate_input_error(path: Path) -> UserError:
    """Return what to say of photographs or a splat among models, and how they come together."""
    name = scene_name(path)
    return UserError(
        f"{path} is a whole scene ({_path_kind(path)}), which stands alone. Name it by itself; or run "
        f"it, and name what that writes, runs/{name}/0-reconstruct/{safe_name(name)}.glb, in its place. "
        "One such scene may be the `file` of a scene.toml, with models as its [[object]]s."
    )


def photographed_input(inputs: Sequence[Path]) -> Path | None:
    """Return the photographs or the splat that the input is, or that a scene file names.

    None: the inputs are models.
    """
    if input_kind(inputs) == "model":
        return None
    return _model_of_scene_file(inputs[0]) if is_scene_file(inputs[0]) else inputs[0]


def is_scene_file(path: Path) -> bool:
    """Whether a file says of other files what happens with them, as ``scene.toml`` does."""
    return reader_of(path, "scene") is not None


def is_model_file(path: Path) -> bool:
    """Whether a file is a model: glTF or a mesh."""
    reader = reader_of(path)
    return reader is not None and reader.kind in ("model", "mesh")


def read_scene(path: Path) -> SceneFile:
    """Read a scene file of any format.

    Raises:
        UserError: It cannot be used.
    """
    reader = reader_of(path, "scene")
    assert reader is not None, "only scene files are read"
    return load_function(reader.read)(path)


def _model_of_scene_file(scene: Path) -> Path | None:
    """Return what a scene file names as its file; None where it cannot be read."""
    try:
        return read_scene(scene).file
    except UserError:
        return None  # whoever assembles it says why


def _path_kind(path: Path) -> InputKind:
    if is_scene_file(path):
        file = _model_of_scene_file(path) if path.is_file() else None
        return "model" if file is None or is_scene_file(file) else _path_kind(file)
    if path.is_dir():
        return _folder_kind(path)
    reader = reader_of(path)
    if reader is not None:
        return "splat" if reader.kind == "splat" else "model"
    return "photographs" if path.suffix.lower() in (".json", *VIDEO_SUFFIXES) else "model"


def _folder_kind(folder: Path) -> InputKind:
    if _files_of_kind(folder, "model"):
        return "model"
    if _is_unpacked_splat(folder):
        return "splat"
    if _has_poses(folder):
        return "photographs"
    return "photographs" if photos_in_folder(folder) and not model_files_in(folder) else "model"


def _has_poses(folder: Path) -> bool:
    # Lenses and lines of sight take a third of a second to import; models have neither.
    from corporeal.io.photos.posed_photos import has_posed_photos

    return has_posed_photos(folder)


def _is_unpacked_splat(folder: Path) -> bool:
    return any(
        all(any(folder.glob(pattern)) for pattern in reader.folder_files)
        for reader in readers_of("splat")
        if reader.folder_files
    )


def list_input_files(inputs: Iterable[Path]) -> list[Path]:
    """Return all files that the inputs name, directly or within; broken ones name nothing more."""
    found: dict[Path, None] = {}
    for path in inputs:
        for file in _files_named_in(Path(path)):
            found.setdefault(file)
    return list(found)


def scene_name(path: Path) -> str:
    """Return what a scene is called: a file's name without its suffix, a folder's name whole."""
    path = path.resolve()
    return path.name if path.is_dir() else path.stem


def model_files_in(folder: Path) -> list[Path]:
    """Return the models that lie in a folder, by name: glTF, or where there is none, meshes."""
    return _files_of_kind(folder, "model") or _files_of_kind(folder, "mesh")


def _files_of_kind(folder: Path, kind: ReaderKind) -> list[Path]:
    return sorted(p for p in folder.iterdir() if (r := reader_of(p)) and r.kind == kind)


def images_in_folder(folder: Path) -> list[Path]:
    """Return the pictures that lie in a folder or up to two below, by name."""
    found = [p for depth in ("*", "*/*", "*/*/*") for p in folder.glob(depth)]
    return sorted(
        p
        for p in found
        if _has_suffix(p, (*READABLE_IMAGE_SUFFIXES, *HEIC_SUFFIXES, *UNREAD_IMAGE_SUFFIXES)) and p.is_file()
    )


def videos_in_folder(folder: Path) -> list[Path]:
    """Return the videos that lie in a folder, by name."""
    return sorted(p for p in folder.iterdir() if _has_suffix(p, VIDEO_SUFFIXES))


def photos_in_folder(folder: Path) -> list[Path]:
    """Return the photographs of a folder, by name: its own, or where it has none, of ``images``.

    Those of a kind that is not read only where there are no others, as beside raw pictures.
    """
    places = [folder / name for name in ("", *IMAGE_FOLDERS) if (folder / name).is_dir()]
    for kinds in ((*READABLE_IMAGE_SUFFIXES, *HEIC_SUFFIXES), UNREAD_IMAGE_SUFFIXES):
        for place in places:
            found = sorted(p for p in place.iterdir() if _has_suffix(p, kinds))
            if found:
                return found
    return []


def unread_images_note(photographs: Sequence[Path]) -> list[str]:
    """Return which pictures of a kind that is not read lie beside photographs, if they are no copies.

    Args:
        photographs: Of one folder; what has the name of one but for its suffix is its raw picture.
    """
    if not photographs:
        return []
    known = {file.stem for file in photographs}
    folder = photographs[0].parent
    others = sorted(p for p in folder.iterdir() if _has_suffix(p, UNREAD_IMAGE_SUFFIXES) and p.stem not in known)
    if not others:
        return []
    kinds = ", ".join(sorted({p.suffix[1:].upper() for p in others}))
    count = "1 more picture is" if len(others) == 1 else f"{len(others)} more pictures are"
    what = f"{count} of a kind that is not read ({kinds}), such as {single_line_text(others[0].name)}"
    return [f"{what}: convert what is to be used to JPEG."]


def nested_images(folder: Path, photographs: Sequence[Path]) -> list[Path]:
    """Return the pictures in folders of a folder that are neither its photographs nor masks.

    Args:
        folder: What lies in it, up to two below, is looked at; not where systems hide copies.
        photographs: Those that are used, all of one place.
    """
    aside = {file.parent for file in photographs}
    return [
        file
        for file in images_in_folder(folder)
        if file.parent not in (folder, *aside)
        and not any(_is_excluded_folder(name) for name in file.relative_to(folder).parts[:-1])
    ]


def _is_excluded_folder(name: str) -> bool:
    return name in (*MASK_FOLDERS, *INSTANCE_FOLDERS) or name.startswith((".", "__"))


def unused_nested_images_note(folder: Path, photographs: Sequence[Path]) -> list[str]:
    """Return which pictures lie in folders below photographs and are not used, if they are no copies.

    Args:
        folder: Of the photographs.
        photographs: Those that are used; what has the name of one is it in another size or kind.
    """
    known = {file.stem for file in photographs}
    more = [file for file in nested_images(folder, photographs) if file.stem not in known]
    if not more:
        return []
    one = len(more) == 1
    count, left = ("1 more picture lies", "was") if one else (f"{len(more)} more pictures lie", "were")
    where = single_line_text(str(more[0].relative_to(folder)))
    return [
        Note(
            f"{count} in folders below and {left} left out, such as {where}: what shows the same "
            "object belongs beside the others.",
            NoteKind.LEFT_OUT,
        )
    ]


def _has_suffix(path: Path, kinds: Sequence[str]) -> bool:
    """Whether a file has a suffix, and is none that systems hide beside it (``._a.jpg``)."""
    return path.suffix.lower() in kinds and not path.name.startswith(".")


def lacks_poses(path: Path) -> bool:
    """Whether pictures come without the places that they were taken from."""
    return path.suffix.lower() in VIDEO_SUFFIXES or (path.is_dir() and not _has_poses(path))


def _files_named_in(path: Path) -> list[Path]:
    if not path.exists():
        return []  # whoever reads it says so
    if not is_scene_file(path) and _path_kind(path) != "model":
        alone = path.is_dir() or path.suffix.lower() in (*suffixes_of("splat"), *VIDEO_SUFFIXES)
        return [path if alone else path.parent]
    if path.is_dir():
        return [f for model in model_files_in(path) for f in _files_named_in(model)]
    try:
        if is_scene_file(path):
            scene = read_scene(path)
            files = [scene.file, *(o.file for o in scene.objects)]
            return [path, *(f for model in files if model for f in _files_named_in(model))]
        return [path, *list_companions(path)]
    except UserError:
        return [path]


def list_companions(path: Path) -> list[Path]:
    """Return the files beside it that a model file is made of, or that these name in turn.

    Raises:
        UserError: The file cannot be read.
    """
    reader = reader_of(path)
    if reader is None or not reader.companions:
        return []
    if reader.companions_in_child:
        return companions_in_child(path, reader)
    return list(dict.fromkeys(load_function(reader.companions)(path)))
