"""Which files a scene is made of: a result is stale when any of them changes."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal

from corporeal.core.errors import UserError
from corporeal.core.types import Note, NoteKind
from corporeal.io.gltf_document import Document
from corporeal.io.mesh_suffixes import is_mesh, kind_of_ply
from corporeal.io.meshes import companions
from corporeal.io.picture_names import HEIC, IMAGES, INSTANCES, MASKS, OTHERS, SHOWN
from corporeal.io.resources import beside
from corporeal.io.scene_file import read_scene_file
from corporeal.recognition.words import safe, writable

GLTF = (".glb", ".gltf")
SPLATS = (".ply", ".spz", ".sog", ".splat", ".ksplat")
FILMS = (".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm")
SOG = "meta.json"
"""Of an unpacked SOG."""
Kind = Literal["model", "photographs", "splat"]


def kind_of(inputs: Sequence[Path]) -> Kind:
    """Say what the inputs are, by their names; what is nothing else is taken for a model.

    Raises:
        UserError: Photographs or a splat are named beside something else.

    """
    kinds: list[Kind] = [_kind(Path(path)) for path in inputs]
    if len(kinds) > 1 and set(kinds) != {"model"}:
        strange = next(p for p, kind in zip(inputs, kinds, strict=True) if kind != "model")
        raise stands_alone(strange)
    return kinds[0] if kinds else "model"


def stands_alone(path: Path) -> UserError:
    """Return what to say of photographs or a splat among models, and how they come together."""
    name = called(path)
    return UserError(
        f"{path} is a whole scene ({_kind(path)}), which stands alone. Name it by itself; or run "
        f"it, and name what that writes, runs/{name}/0-reconstruct/{safe(name)}.glb, in its place. "
        "One such scene may be the `file` of a scene.toml, with models as its [[object]]s."
    )


def pictured(inputs: Sequence[Path]) -> Path | None:
    """Return the photographs or the splat that the input is, or that a scene file names.

    None: the inputs are models.
    """
    if kind_of(inputs) == "model":
        return None
    return _file_of(inputs[0]) if inputs[0].suffix.lower() == ".toml" else inputs[0]


def _file_of(scene: Path) -> Path | None:
    """Return what a scene file names as its file; None where it cannot be read."""
    try:
        return read_scene_file(scene).file
    except UserError:
        return None  # whoever assembles it says why


def _kind(path: Path) -> Kind:
    if path.suffix.lower() == ".toml":
        file = _file_of(path) if path.is_file() else None
        if file is None or file.suffix.lower() == ".toml":
            return "model"
        return _kind(file)
    if path.is_dir():
        return _kind_of_folder(path)
    if path.suffix.lower() == ".ply":
        return "splat" if kind_of_ply(path) == "splat" else "model"
    if path.suffix.lower() in SPLATS or path.name == SOG:
        return "splat"
    return "photographs" if path.suffix.lower() in (".json", *FILMS) else "model"


def _kind_of_folder(folder: Path) -> Kind:
    if _gltf_in(folder):
        return "model"
    if _is_sog(folder):
        return "splat"
    if _has_poses(folder):
        return "photographs"
    return "photographs" if photographs_in(folder) and not models_in(folder) else "model"


def _has_poses(folder: Path) -> bool:
    # Lenses and lines of sight take a third of a second to import; models have neither.
    from corporeal.io.photographs import holds_photographs

    return holds_photographs(folder)


def _is_sog(folder: Path) -> bool:
    return (folder / SOG).is_file() and any(folder.glob("means*"))


def sources(inputs: Iterable[Path]) -> list[Path]:
    """Return all files that the inputs name, directly or within; broken ones name nothing more."""
    found: dict[Path, None] = {}
    for path in inputs:
        for file in _named_by(Path(path)):
            found.setdefault(file)
    return list(found)


def called(path: Path) -> str:
    """Return what a scene is called: a file's name without its suffix, a folder's name whole."""
    path = path.resolve()
    return path.name if path.is_dir() else path.stem


def models_in(folder: Path) -> list[Path]:
    """Return the models that lie in a folder, by name: glTF, or where there is none, meshes."""
    return _gltf_in(folder) or sorted(p for p in folder.iterdir() if is_mesh(p))


def _gltf_in(folder: Path) -> list[Path]:
    return sorted(p for p in folder.iterdir() if p.suffix.lower() in GLTF)


def pictures_in(folder: Path) -> list[Path]:
    """Return the pictures that lie in a folder or up to two below, by name."""
    found = [p for depth in ("*", "*/*", "*/*/*") for p in folder.glob(depth)]
    return sorted(p for p in found if _named(p, (*SHOWN, *HEIC, *OTHERS)) and p.is_file())


def films_in(folder: Path) -> list[Path]:
    """Return the films that lie in a folder, by name."""
    return sorted(p for p in folder.iterdir() if _named(p, FILMS))


def photographs_in(folder: Path) -> list[Path]:
    """Return the photographs of a folder, by name: its own, or where it has none, of ``images``.

    Those of a kind that is not read only where there are no others, as beside raw pictures.
    """
    places = [folder / name for name in ("", *IMAGES) if (folder / name).is_dir()]
    for kinds in ((*SHOWN, *HEIC), OTHERS):
        for place in places:
            found = sorted(p for p in place.iterdir() if _named(p, kinds))
            if found:
                return found
    return []


def not_read_beside(photographs: Sequence[Path]) -> list[str]:
    """Say which pictures of a kind that is not read lie beside photographs, if they are no copies.

    Args:
        photographs: Of one folder; what has the name of one but for its suffix is its raw picture.

    """
    if not photographs:
        return []
    known = {file.stem for file in photographs}
    folder = photographs[0].parent
    others = sorted(p for p in folder.iterdir() if _named(p, OTHERS) and p.stem not in known)
    if not others:
        return []
    kinds = ", ".join(sorted({p.suffix[1:].upper() for p in others}))
    count = "1 more picture is" if len(others) == 1 else f"{len(others)} more pictures are"
    what = f"{count} of a kind that is not read ({kinds}), such as {writable(others[0].name)}"
    return [f"{what}: convert what is to be used to JPEG."]


def below(folder: Path, photographs: Sequence[Path]) -> list[Path]:
    """Return the pictures in folders of a folder that are neither its photographs nor masks.

    Args:
        folder: What lies in it, up to two below, is looked at; not where systems hide copies.
        photographs: Those that are used, all of one place.

    """
    aside = {file.parent for file in photographs}
    return [
        file
        for file in pictures_in(folder)
        if file.parent not in (folder, *aside)
        and not any(_set_aside(name) for name in file.relative_to(folder).parts[:-1])
    ]


def _set_aside(name: str) -> bool:
    return name in (*MASKS, *INSTANCES) or name.startswith((".", "__"))


def not_read_below(folder: Path, photographs: Sequence[Path]) -> list[str]:
    """Say which pictures lie in folders below photographs and are not used, if they are no copies.

    Args:
        folder: Of the photographs.
        photographs: Those that are used; what has the name of one is it in another size or kind.

    """
    known = {file.stem for file in photographs}
    more = [file for file in below(folder, photographs) if file.stem not in known]
    if not more:
        return []
    one = len(more) == 1
    count, left = (
        ("1 more picture lies", "was") if one else (f"{len(more)} more pictures lie", "were")
    )
    where = writable(str(more[0].relative_to(folder)))
    return [
        Note(
            f"{count} in folders below and {left} left out, such as {where}: what shows the same "
            "thing belongs beside the others.",
            NoteKind.LEFT_OUT,
        )
    ]


def _named(path: Path, kinds: Sequence[str]) -> bool:
    """Whether a file has a suffix, and is none that systems hide beside it (``._a.jpg``)."""
    return path.suffix.lower() in kinds and not path.name.startswith(".")


def unposed(path: Path) -> bool:
    """Whether pictures come without the places that they were taken from."""
    return path.suffix.lower() in FILMS or (path.is_dir() and not _has_poses(path))


def _named_by(path: Path) -> list[Path]:
    if not path.exists():
        return []  # whoever reads it says so
    if path.suffix.lower() != ".toml" and _kind(path) != "model":
        alone = path.is_dir() or path.suffix.lower() in (*SPLATS, *FILMS)
        return [path if alone else path.parent]
    if path.is_dir():
        return [f for model in models_in(path) for f in _named_by(model)]
    try:
        if path.suffix.lower() == ".toml":
            scene = read_scene_file(path)
            files = [scene.file, *(o.file for o in scene.objects)]
            return [path, *(f for model in files if model for f in _named_by(model))]
        return [path, *_companions(path)]
    except UserError:
        return [path]


def _companions(path: Path) -> list[Path]:
    if is_mesh(path):
        return companions(path)
    if path.suffix.lower() != ".gltf":
        return []
    document = Document(path)
    entries = document.entries("buffers") + document.entries("images")
    uris = [e.text("uri") for e in entries]
    files = [beside(path.parent, u) for u in uris if u and u[:5].lower() != "data:"]
    return [f for f in files if f is not None]
