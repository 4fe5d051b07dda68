"""OBJ, PLY, STL, OFF, 3MF and DAE, read by trimesh, in the axes and the unit of the file.

Companions (.mtl, pictures) are taken from the file's own folder only.

Conversion of relative OBJ indices to absolute ones.

``f -3 -2 -1`` means the last three vertices *so far* (Wavefront, "Object Files", 1995: reference
numbers). Readers that count back from the end of the file join other vertices wherever vertices
and faces alternate.
"""

import io
import re
import zipfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image
from trimesh.resolvers import Resolver
from trimesh.visual.color import to_rgba
from trimesh.visual.material import PBRMaterial, SimpleMaterial

from corporeal.core.errors import BadFileError
from corporeal.core.types import Finish, Surface
from corporeal.geometry.srgb import srgb_to_linear
from corporeal.io.gltf.gltf_container import MAX_MODEL_FILE_BYTES, read_file_bytes
from corporeal.io.gltf.gltf_materials import DEFAULT_FINISH
from corporeal.io.image_decoder import as_reduced_array
from corporeal.io.mesh.ply_faces import triangulate_mixed_faces
from corporeal.io.mesh.raw_mesh import MAX_PIECES, MESH_EXPORT_ADVICE, NODE_NAMES_KEY, RawMesh
from corporeal.io.referenced_files import read_beside

GENERIC_NODE_PATTERN = re.compile(r"(?i)(?:instance|group|component)(?:[_ #]?\d+)?")
"""Default name of a node that places a component (SketchUp)."""

PieceNames = tuple[tuple[str, ...], str]
"""Names from the file's root to a piece, and that of its material; "": it states none."""


def read_dae_names(data: bytes) -> dict[str, PieceNames]:
    """Return the names of each piece, by what trimesh calls it: the id of its geometry, counted.

    A piece is called as the node that places it, or, where that one is but counted, as the
    component that it places; where a geometry has several materials, each is a piece, called as its
    material. Nodes beside each other that have one name are numbered, and so
    are the places of a geometry that no node names.
    """
    from collada import Collada
    from collada.common import DaeError
    from collada.polylist import Polylist
    from collada.triangleset import TriangleSet

    document: Any = Collada(io.BytesIO(data), ignore=[DaeError])
    shapes, found = (Polylist, TriangleSet), dict[str, PieceNames]()
    counts: dict[str | None, int] = {}
    unnamed, numbers = set[str](), dict[str | None, int]()
    for along, placed in _geometry_places(document.scene.nodes, ()):
        geometry = placed.geometry
        looks = {m.symbol: str(m.target.name or "") for m in placed.materials}
        pieces = [p for p in geometry.primitives if isinstance(p, shapes) and p.vertex is not None]
        own = along or _unique_name(str(geometry.name or geometry.id), unnamed, numbers)
        for piece in pieces:
            key = trimesh.util.unique_name(geometry.id, contains=found, counts=counts)
            look = looks.get(piece.material, "")
            last = (look or key,) if len(pieces) > 1 else ()
            found[key] = ((*own, *last), look)
    return found


def _unique_name(name: str, taken: set[str], counts: dict[str | None, int]) -> tuple[str]:
    """Return a name that nothing has yet, and note it."""
    own = trimesh.util.unique_name(name, contains=taken, counts=counts)
    taken.add(own)
    return (own,)


def _geometry_places(nodes: Iterable[Any], along: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Return every place of a geometry, and the names of the nodes above it."""
    from collada.scene import GeometryNode, Node, NodeNode

    taken: dict[str | None, int] = {}
    seen: set[str] = set()
    for node in nodes:
        if isinstance(node, GeometryNode):
            yield along, node
        elif isinstance(node, Node):
            said = node.node if isinstance(node, NodeNode) else node
            name = str(said.name or "")
            if GENERIC_NODE_PATTERN.fullmatch(name):
                name = _component_name(node) or name
            if name:
                (name,) = _unique_name(name, seen, taken)
            yield from _geometry_places(node.children or (), (*along, name) if name else along)


def _component_name(node: Any) -> str:
    """Return the name of the one component that a node places; "": it places none, or several."""
    from collada.scene import NodeNode

    children = node.children or ()
    placed = [child.node.name for child in children if isinstance(child, NodeNode)]
    return str(placed[0] or "") if len(placed) == len(children) == 1 else ""


INDEX_SLOT_OF_KEYWORD = {b"v": 0, b"vt": 1, b"vn": 2}
"""What corners refer to, by their place in ``v/vt/vn``."""
OBJ_ELEMENT_KEYWORDS = (b"f", b"fo", b"l", b"p")
RELATIVE_INDEX_PATTERN = re.compile(rb"(?m)^[ \t]*fo?[ \t](?:[^\r\n]*[ \t/])?-\d")
"""A face that counts back."""
LINE_CONTINUATION_PATTERN = re.compile(rb"\\[ \t]*(?:\r\n|\r|\n)")


def with_absolute_indices(data: bytes) -> bytes:
    """Return an OBJ in which no corner counts back; one that has none is returned as it is."""
    whole = LINE_CONTINUATION_PATTERN.sub(b" ", data) if b"\\" in data else data
    if RELATIVE_INDEX_PATTERN.search(whole) is None:
        return data
    so_far, lines = [0, 0, 0], []
    for line in whole.splitlines():
        words = line.split()
        kind = words[0] if words else b""
        if kind in INDEX_SLOT_OF_KEYWORD:
            so_far[INDEX_SLOT_OF_KEYWORD[kind]] += 1
        elif kind in OBJ_ELEMENT_KEYWORDS and b"-" in line:
            line = b" ".join([kind, *(_absolute_corner(word, so_far) for word in words[1:])])
        lines.append(line)
    return b"\n".join([*lines, b""])


def _absolute_corner(corner: bytes, so_far: list[int]) -> bytes:
    """Return a corner ``v/vt/vn``; what is no number stays, for the reader to refuse."""
    places = corner.split(b"/")
    for k, place in enumerate(places[: len(so_far)]):
        if re.fullmatch(rb"-\d{1,18}", place):
            places[k] = b"%d" % (so_far[k] + 1 + int(place))
    return b"/".join(places)


MAX_ZIP_UNPACKED_BYTES = 2**29
"""What a ZIP may unpack to [bytes]."""
Z_UP_COMMENT_PATTERN = re.compile(r"(?i)\b\+?z[ _-]+(?:axis[ _-]+)?(?:is[ _-]+)?up\b|\bup[ _-]*axis\W{1,3}\+?z\b")
COMMENT_HEAD_CHARACTERS = 2000
"""Characters at the beginning of a file where comments say how it was written."""
UP_OF_DAE_AXIS = {"X_UP": "+x", "Y_UP": "+y", "Z_UP": "+z"}


class _CompanionResolver(Resolver):
    """Companions of a file: from its folder, and never from elsewhere."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def get(self, key: str) -> bytes:
        return read_beside(self.folder, key.strip(), MAX_MODEL_FILE_BYTES)

    def write(self, name: str, data) -> None:
        raise PermissionError(f"{name} is not written: companions are only read")

    def namespaced(self, namespace: str) -> "_CompanionResolver":
        return self

    def keys(self) -> list[str]:
        return [p.name for p in self.folder.iterdir()]


class _ObjMaterials(_CompanionResolver):
    """Also what an OBJ calls materials that its .mtl does not have, if there is one."""

    def __init__(self, folder: Path, used: set[bytes]) -> None:
        super().__init__(folder)
        self.used = used
        self.lost: list[str] = []

    def get(self, key: str) -> bytes:
        if not key.strip().lower().endswith(".mtl"):
            return super().get(key)
        try:
            text = super().get(key)
        except ValueError as problem:
            self.lost.append(f"colours and pictures ({problem})")
            text = b""
        colour = " ".join(f"{c:g}" for c in DEFAULT_FINISH.colour[:3])
        unknown = self.used - _names_in_obj(text, b"newmtl")
        named = [b"newmtl %b\nKd %b" % (name, colour.encode()) for name in sorted(unknown)]
        return b"\n".join([text, *named])


def read_obj(path: Path) -> RawMesh:
    """Read a Wavefront OBJ with its materials; its unit is unknown, its up axis at most a comment.

    Its objects (``o``) have names; where it has none, its groups (``g``) have: most programs write but one of the two.
    """
    data = with_absolute_indices(bytes(read_file_bytes(path)))
    named = b"o" if _names_in_obj(data, b"o") else b"g"
    few = len(_names_in_obj(data, named)) <= MAX_PIECES
    looks = _ObjMaterials(path.parent, _names_in_obj(data, b"usemtl"))
    split = {"split_objects": named == b"o", "split_groups": named == b"g" and few}
    scene = _load_with_trimesh(path, "obj", data, resolver=looks, **split)
    z_up = _comment_says_z_up(data[:COMMENT_HEAD_CHARACTERS].decode(errors="replace"))
    return RawMesh(
        *_finished_meshes(scene, _object_and_material),
        up="+z" if z_up else None,
        up_note="+z is up, as its comment states; override with --up." if z_up else "",
        lost=tuple(looks.lost),
    )


def read_ply(path: Path) -> RawMesh:
    """Read a PLY with faces; unit and up axis unknown."""
    data, lost = triangulate_mixed_faces(path, read_file_bytes(path))
    scene = _load_with_trimesh(path, "ply", data)
    return RawMesh(*_finished_meshes(scene, lambda *_: (path.stem,)), lost=lost)


def read_stl(path: Path) -> RawMesh:
    """Read an STL, in text or in bytes; unit and up axis unknown."""
    return RawMesh(*_finished_meshes(_load_with_trimesh(path, "stl"), lambda *_: (path.stem,)))


def read_off(path: Path) -> RawMesh:
    """Read an OFF; unit and up axis unknown."""
    return RawMesh(*_finished_meshes(_load_with_trimesh(path, "off"), lambda *_: (path.stem,)))


def read_3mf(path: Path) -> RawMesh:
    """Read a 3MF: its unit is stated, millimetres where it is not (3MF core 1.3, 3.4); +z is up."""
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
    except zipfile.BadZipFile as problem:
        raise BadFileError(path, f"cannot be read as 3MF ({problem}).", MESH_EXPORT_ADVICE) from problem
    if size > MAX_ZIP_UNPACKED_BYTES:
        raise BadFileError(path, f"unpacks to {size / 2**30:.1f} GiB.", "Split it into several.")
    scene = _load_with_trimesh(path, "3mf")
    unit = trimesh.units.unit_conversion(scene.units or "millimeters", "meters")
    return RawMesh(*_finished_meshes(scene), up="+z", unit=float(unit))


def read_dae(path: Path) -> RawMesh:
    """Read a COLLADA with its unit and its up axis, which is y where it states none (1.4.1)."""
    scene = _load_with_trimesh(path, "dae")
    unit, axis = _asset_of_dae(path)
    if axis not in UP_OF_DAE_AXIS:
        raise BadFileError(path, f"states an unknown up axis {axis[:20]!r}.", MESH_EXPORT_ADVICE)
    names = read_dae_names(bytes(read_file_bytes(path)))
    for piece, (_, look) in names.items():
        material = getattr(getattr(scene.geometry.get(piece), "visual", None), "material", None)
        if material is not None and look:
            material.name = look
    named = _finished_meshes(scene, lambda piece, _: names[piece][0])
    return RawMesh(*named, up=UP_OF_DAE_AXIS[axis], unit=unit)  # pyright: ignore[reportArgumentType]


def _load_with_trimesh(
    path: Path, kind: str, data: bytes | None = None, resolver: Resolver | None = None, **options: Any
) -> trimesh.Scene:
    data = bytes(read_file_bytes(path)) if data is None else data
    return trimesh.load_scene(
        trimesh.util.wrap_as_stream(data),
        file_type=kind,
        resolver=resolver or _CompanionResolver(path.parent),
        process=False,
        **options,
    )


def _asset_of_dae(path: Path) -> tuple[float | None, str]:
    """Return what ``asset`` says of unit [m] and up axis."""
    from lxml import etree  # pyright: ignore[reportAttributeAccessIssue]

    unit, axis = None, "Y_UP"
    reading = etree.iterparse(str(path), resolve_entities=False, no_network=True, recover=True)
    for _, element in reading:
        name = etree.QName(element).localname
        if name == "unit":
            unit = float(element.get("meter", "1"))
        elif name == "up_axis":
            axis = (element.text or "").strip()
        elif name == "asset":
            break
    if unit is not None and not 0 < unit < np.inf:
        raise BadFileError(path, f"states that a unit is {unit:g} m.", MESH_EXPORT_ADVICE)
    return unit, axis


def _names_in_obj(data: bytes, keyword: bytes) -> set[bytes]:
    """Return the names that stand after a keyword of an OBJ."""
    return set(re.findall(rb"(?m)^" + keyword + rb"[ \t]+(\S[^\r\n]*?)[ \t\r]*$", data))


def _comment_says_z_up(text: str) -> bool:
    """Return whether a comment (``#``) at the beginning of an OBJ says that +z is up."""
    lines = text[:COMMENT_HEAD_CHARACTERS].splitlines()
    return any(Z_UP_COMMENT_PATTERN.search(line) for line in lines if line.lstrip().startswith("#"))


def _object_and_material(node: str, mesh: trimesh.Trimesh) -> tuple[str, ...]:
    """Return the names of an OBJ's object and surface: trimesh joins them with the material's."""
    material = str(getattr(getattr(mesh.visual, "material", None), "name", None) or "")
    owner = node.removesuffix(f"_{material}")
    return (node,) if owner in ("", node) else (owner, node)


def _finished_meshes(
    scene: trimesh.Scene, named: Callable[[str, trimesh.Trimesh], tuple[str, ...]] | None = None
) -> tuple[tuple[Surface, ...], tuple[Finish, ...]]:
    """Return every mesh at every place where the scene shows it, and what each looks like."""
    surfaces, finishes = [], []
    for node, to_world, mesh in _placed_meshes(scene):
        finishes.append(_finish(mesh.visual))
        uv = getattr(mesh.visual, "uv", None)
        along = named(node, mesh) if named else (node,)
        triangles = np.asarray(mesh.faces, np.int64)
        mirrored = np.linalg.det(to_world[:3, :3]) < 0
        surfaces.append(
            Surface(
                name=along[-1],
                object=0,
                finish=len(finishes) - 1,
                vertices=trimesh.transform_points(np.asarray(mesh.vertices, float), to_world),
                triangles=np.ascontiguousarray(triangles[:, ::-1] if mirrored else triangles),
                uv=None if uv is None or len(uv) != len(mesh.vertices) else _flip_v(uv),
                colours=_colours(mesh.visual),
                extras={NODE_NAMES_KEY: list(along)},
            )
        )
    return tuple(surfaces), tuple(finishes)


def _placed_meshes(scene: trimesh.Scene) -> Iterator[tuple[str, np.ndarray, trimesh.Trimesh]]:
    for node in scene.graph.nodes_geometry:
        to_world, name = scene.graph[node]
        mesh = scene.geometry[name]
        if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
            yield str(node), np.asarray(to_world, float), mesh


def _flip_v(uv: np.ndarray) -> np.ndarray:
    """Turn v, which runs up in these files, to run down as in glTF."""
    return np.asarray(uv, np.float64) * (1, -1) + (0, 1)


def _colours(visual) -> np.ndarray | None:
    """Return colours of vertices, linear RGBA (V, 4), where the file has some."""
    if visual.kind != "vertex":
        return None
    srgb = np.asarray(visual.vertex_colors, float) / 255
    return np.concatenate([srgb_to_linear(srgb[:, :3]), srgb[:, 3:]], axis=1)


def _finish(visual) -> Finish:
    material = getattr(visual, "material", None)
    if visual.kind == "vertex":
        return Finish("painted", roughness=DEFAULT_FINISH.roughness)
    if not isinstance(material, SimpleMaterial | PBRMaterial):
        return DEFAULT_FINISH
    name = str(material.name or DEFAULT_FINISH.name)[:120]
    simple = isinstance(material, SimpleMaterial)
    picture = _diffuse_image(material.image if simple else material.baseColorTexture)
    if picture is not None:
        return Finish(name, texture=picture, roughness=DEFAULT_FINISH.roughness)
    colour = material.diffuse if simple else material.baseColorFactor
    if colour is None:
        return Finish(name, colour=DEFAULT_FINISH.colour, roughness=DEFAULT_FINISH.roughness)
    r, g, b, a = (float(c) / 255 for c in to_rgba(colour))
    return Finish(name, colour=(r, g, b, a), roughness=DEFAULT_FINISH.roughness)


def _diffuse_image(image: Image.Image | None) -> np.ndarray | None:
    """Return the picture of the diffuse colour; None where there is none that can be read."""
    try:
        return None if image is None else as_reduced_array(image)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
