"""Read a glTF 2.0 scene (.glb, .gltf) as a Scene: Z up, metres as in the file.

Triangles, looks, names and extras are kept. Skins and morphs are left at rest, animations out. Any file gives a scene
or one ``BadFileError`` that names the place in the file.
"""

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from corporeal.core.types import NoteKind, ObjectGrouping, Scene, Surface
from corporeal.geometry.crease_normals import add_crease_normals
from corporeal.io.gltf.gltf_document import GltfDocument, GltfEntry
from corporeal.io.gltf.gltf_extras import is_own_file, object_from_extras, scene_from_extras
from corporeal.io.gltf.gltf_materials import FinishReader
from corporeal.io.gltf.gltf_nodes import PlacedNode, placed_nodes
from corporeal.io.gltf.gltf_primitives import GltfPrimitive, read_primitive
from corporeal.io.gltf.gltf_skinning import SkinPoses, transform_primitive
from corporeal.recognition.readable_names import everyday_words, numbered_names, safe_name, unique_names

READABLE_EXTENSION_PREFIXES = (
    "KHR_materials_",
    "KHR_texture_",
    "KHR_lights_",
    "EXT_texture_webp",
    "KHR_mesh_quantization",
    "KHR_draco_mesh_compression",
    "KHR_xmp",
)
"""Beginnings of extensions that are understood, or that can be left out without changing shapes."""
MAX_SURFACES = 10_000


@dataclass(frozen=True)
class _PlacedPrimitive:
    """One placed primitive, before it is known to which object it belongs."""

    node: int
    name: str
    finish: int
    piece: GltfPrimitive
    extras: dict


@dataclass(frozen=True)
class _FinishedPrimitive:
    """One primitive of a mesh, wherever it is shown."""

    finish: int
    piece: GltfPrimitive


@dataclass(frozen=True)
class LoadedModel:
    """A scene as read, and whether its motion is the file's own word or a default."""

    scene: Scene
    ours: bool
    """Our writer made the file: gravity, duration, velocities and pushes are stated in it."""
    metric: bool = True
    """Whether the scene is in metres; else it is in the file's unit, which is unknown."""
    stated: bool = False
    """Whether the file itself says what its objects are."""


def read_glb(path: Path, objects: ObjectGrouping = "auto") -> Scene:
    """Read one file.

    Args:
        path: A .glb or .gltf file; its companions must lie beside it.
        objects: "one": the whole file is one object. "nodes": every node on the first level that branches is one.
            "auto": the nodes that say their class in their extras, as our own files do; without any, the whole file.

    Raises:
        BadFileError: The file cannot be used.
    """
    return read_gltf_model(path, objects).scene


def read_gltf_model(path: Path, objects: ObjectGrouping = "auto") -> LoadedModel:
    """Do as ``read_glb``, and tell whether the file is one of our own."""
    document = GltfDocument(Path(path))
    check_extensions(document)
    tree = list(placed_nodes(document))
    wardrobe = FinishReader(document)
    shapes = _placed_primitives(document, tree, wardrobe)
    if not shapes:
        document.root.fail(
            "the scene holds no triangles of any size.", "Export a mesh; points, lines and splats are not used."
        )
    owner = _object_of_node(tree, {s.node for s in shapes}, objects)
    scene = _assembled_scene(document, tree, shapes, owner)
    finishes, warnings = tuple(wardrobe.finishes), tuple(document.warnings)
    scene = replace(scene, finishes=finishes, warnings=warnings)
    ours = is_own_file(document)
    return LoadedModel(scene, ours, stated=ours or bool(_nodes_with_class(tree)))


def check_extensions(document: GltfDocument) -> None:
    """Reject a file that means something else without an extension that is not understood."""
    for name in document.required:
        if not name.startswith(READABLE_EXTENSION_PREFIXES) and "meshopt" not in name:
            document.root.fail(
                f"the file needs the extension {name[:60]!r}, which is not supported.",
                "Export it without that extension.",
            )


def _placed_primitives(
    document: GltfDocument, tree: list[PlacedNode], wardrobe: FinishReader
) -> list[_PlacedPrimitive]:
    """Return every primitive at every place where the scene shows it."""
    if document.root.has("animations"):
        document.warn("is animated; its rest pose is used.")
    _warn_of_unplaced_meshes(document, tree)
    shown = [(p, m) for p in tree if (m := p.node.refer("mesh", "meshes")) is not None]
    meshes = {m.pointer: m for _, m in shown}
    pieces = {pointer: _finished_primitives(m, wardrobe) for pointer, m in meshes.items()}
    _check_total(document, [pieces[m.pointer] for _, m in shown])
    skeletons = SkinPoses(document, tree)
    shapes = []
    for placed, mesh in shown:
        name, bones = _most_telling_name(placed.node, mesh), skeletons.bones(placed)
        extras = placed.node.value.get("extras")
        for dressed in pieces[mesh.pointer]:
            there = transform_primitive(dressed.piece, placed, bones)
            if not np.ptp(there.vertices, axis=0).any():
                document.warn(f"surface {name!r} has no size; it is left out.", NoteKind.LEFT_OUT)
                continue
            kept = dict(extras) if isinstance(extras, dict) else {}
            shapes.append(_PlacedPrimitive(placed.number, name, dressed.finish, there, kept))
    return shapes


def _warn_of_unplaced_meshes(document: GltfDocument, tree: list[PlacedNode]) -> None:
    """Warn of meshes that no node of the file's scene places."""
    placed = {p.number for p in tree}
    nodes = enumerate(document.entries("nodes"))
    left = [n for k, n in nodes if k not in placed and "mesh" in n.value]
    if left:
        names = ", ".join(safe_name(n.text("name")) or "nameless" for n in left[:3])
        more = ", …" if len(left) > 3 else ""
        are = "nodes with meshes are" if len(left) > 1 else "node with a mesh is"
        document.warn(f"{len(left)} {are} not in its scene and left out: {names}{more}.", NoteKind.LEFT_OUT)


def _check_total(document: GltfDocument, shown: list[list[_FinishedPrimitive]]) -> None:
    """Reject a small file that shows its meshes at a million places, before any is placed."""
    if sum(map(len, shown)) > MAX_SURFACES:
        what = f"the scene has more than {MAX_SURFACES} pieces."
        document.root.fail(what, "Join its meshes first.")
    for pieces in shown:
        for dressed in pieces:
            piece = dressed.piece
            document.spend(document.root, len(piece.vertices) + len(piece.triangles))


def _finished_primitives(mesh: GltfEntry, wardrobe: FinishReader) -> list[_FinishedPrimitive]:
    name = mesh.text("name")[:80] or mesh.pointer
    pieces = []
    for primitive in mesh.children("primitives"):
        finish, dress = wardrobe.dress(primitive)
        piece = read_primitive(primitive, name, dress)
        if piece is not None:
            pieces.append(_FinishedPrimitive(finish, piece))
    return pieces


def _most_telling_name(node: GltfEntry, mesh: GltfEntry) -> str:
    """Return the name that says most: the node's, unless only the mesh's has an everyday word."""
    own, other = node.text("name"), mesh.text("name")
    if everyday_words(own) or not everyday_words(other):
        return safe_name(own) or safe_name(other) or "surface"
    return safe_name(other)


def _object_of_node(tree: list[PlacedNode], shaped: set[int], objects: ObjectGrouping) -> dict[int, int]:
    """Return, for each node with triangles, the node that is its object; -1: the whole file."""
    if objects == "one":
        return dict.fromkeys(shaped, -1)
    heads = _branching_nodes(tree, shaped) if objects == "nodes" else _nodes_with_class(tree)
    owner: dict[int | None, int] = {None: -1}
    for p in tree:
        above = owner[p.parent]
        owner[p.number] = p.number if above < 0 and p.number in heads else above
    found = {k: owner[k] for k in shaped}
    if set(found.values()) == {-1}:
        return found
    # What hangs outside every object becomes one of its own, node by node.
    return {k: (k if o < 0 else o) for k, o in found.items()}


def _nodes_with_class(tree: list[PlacedNode]) -> set[int]:
    """Return the nodes whose extras name a class."""
    extras = {p.number: p.node.value.get("extras") for p in tree}
    return {k for k, e in extras.items() if isinstance(e, dict) and isinstance(e.get("class"), str)}


def _branching_nodes(tree: list[PlacedNode], shaped: set[int]) -> set[int]:
    """Return the nodes on the first level, from the root down, where the shapes part ways."""
    below = Counter()
    for p in reversed(tree):
        below[p.number] += p.number in shaped
        if p.parent is not None:
            below[p.parent] += below[p.number]
    children: dict[int | None, list[int]] = {}
    for p in tree:
        if below[p.number]:
            children.setdefault(p.parent, []).append(p.number)
    level = children.get(None, [])
    while len(level) == 1 and level[0] not in shaped:
        level = children.get(level[0], [])
    return set(level)


def _assembled_scene(
    document: GltfDocument, tree: list[PlacedNode], shapes: list[_PlacedPrimitive], owner: dict[int, int]
) -> Scene:
    """Gather the shapes under their objects, in the file's order."""
    nodes: dict[int, GltfEntry | None] = {-1: None} | {p.number: p.node for p in tree}
    groups: dict[int, list[_PlacedPrimitive]] = {}
    for shape in shapes:
        groups.setdefault(owner[shape.node], []).append(shape)
    things = [object_from_extras(document, nodes[h], _extent(g)) for h, g in groups.items()]
    heads = [nodes[h] for h in groups]
    titles = [head.text("name") if head else "" for head in heads]
    counted = numbered_names([t.class_name for t in things], titles)
    names = unique_names([t.name or n for t, n in zip(things, counted, strict=True)])
    return Scene(
        name=safe_name(document.path.stem) or "scene",
        source=str(document.path),
        objects=tuple(replace(t, name=n) for t, n in zip(things, names, strict=True)),
        surfaces=tuple(_surface(s, k) for k, g in enumerate(groups.values()) for s in g),
        finishes=(),
        **scene_from_extras(document, tree[0].node),
    )


def _extent(shapes: list[_PlacedPrimitive]) -> float:
    low = np.min([s.piece.vertices.min(axis=0) for s in shapes], axis=0)
    high = np.max([s.piece.vertices.max(axis=0) for s in shapes], axis=0)
    return float(np.max(high - low))


def _surface(shape: _PlacedPrimitive, k: int) -> Surface:
    piece = shape.piece
    made = Surface(
        name=shape.name,
        object=k,
        finish=shape.finish,
        vertices=piece.vertices,
        triangles=np.ascontiguousarray(piece.triangles),
        normals=piece.normals,
        uv=piece.uv,
        colours=piece.colours,
        extras=shape.extras,
    )
    return add_crease_normals(made)
