"""Merging of models into one GLB; pictures and arrays are copied byte for byte.

One root, below it one named node per object with its place and its ``extras``, below that the object's own tree as its
file has it. Names, samplers, textures, materials with their extensions, skins and extras survive; animations, cameras
and lights do not. A model that occurs twice is stored once. The same input gives the same bytes. ``read_glb`` reads the
file as one of our own.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.types import NoteKind, Vector
from corporeal.io.gltf.glb_writer import GLB_GENERATOR
from corporeal.io.gltf.gltf_container import pack_glb
from corporeal.io.gltf.gltf_copy import GltfCopier, MergedDocument, copy_without_extensions
from corporeal.io.gltf.gltf_document import GltfDocument, GltfEntry
from corporeal.io.gltf.gltf_extras import object_credit
from corporeal.io.gltf.gltf_nodes import PlacedNode, node_numbers, placed_nodes
from corporeal.io.gltf.gltf_reader import check_extensions
from corporeal.recognition.readable_names import everyday_words

DROPPED_GLTF_LISTS = ("animations", "cameras")
"""Lists of a file that are left behind."""


@dataclass(frozen=True)
class MergeMember:
    """One object of the scene to be made: a file and the place of its content."""

    file: Path
    """.glb, or .gltf with its companions beside it."""
    name: str
    """The object's, ``<class>_<k>``; no two of a scene are the same."""
    position: Vector
    """World position [m] of the file's origin, Z up."""
    quaternion: tuple[float, float, float, float]
    """World from file (w, x, y, z), both read Z up."""
    scale: float = 1.0
    """World size over the file's: world = position + R (scale · x)."""
    extras: dict = field(default_factory=dict)
    """What the object's node says of it: object_id, class, asset_sha256, source, licence, attribution, real_extent_m,
    scale …"""


def merge_glb_files(path: Path, members: Sequence[MergeMember], name: str, extras: dict) -> tuple[str, ...]:
    """Write one GLB of all members.

    Args:
        path: Where to.
        members: The objects, in the scene's order.
        name: The scene's.
        extras: What the root says: gravity_m_s2, duration_s, fps …

    Returns:
        What a reader of the report should know about what was left out, in sentences.

    Raises:
        BadFileError: A member's file cannot be used.
        UserError: There is none, two have one name, a pose or an extra is no finite number, or the file would be too
            large.
    """
    _check_members(members)
    merged = MergedDocument()
    models = {file: _SourceModel(file, merged) for file in dict.fromkeys(m.file for m in members)}
    objects = [merged.add("nodes", models[m.file].placed(m)) for m in members]
    root = {"name": name, "extras": dict(extras), "children": objects}
    merged.json["scene"] = 0
    merged.json["scenes"] = [{"name": name, "nodes": [merged.add("nodes", root)]}]
    store.write_bytes(path, _file_bytes(path, merged))
    return tuple(w for model in models.values() for w in model.document.warnings)


def _check_members(members: Sequence[MergeMember]) -> None:
    if not members:
        raise UserError("There is nothing to merge. Name at least one object.")
    names = [m.name for m in members]
    for m in members:
        if names.count(m.name) > 1:
            raise UserError(f"Two objects are named {m.name!r}. Number them.")
        size = math.hypot(*m.quaternion)
        good = all(map(math.isfinite, m.position)) and 1e-6 < size < 1e6
        if not good or not 0 < m.scale < math.inf:
            raise UserError(
                f"Object {m.name!r} stands at {m.position}, turned by {m.quaternion}, scaled by "
                f"{m.scale}. Give finite numbers, a rotation, and a scale above 0."
            )


class _SourceModel:
    """One file, to be placed once or several times."""

    def __init__(self, file: Path, merged: MergedDocument) -> None:
        self.document = GltfDocument(Path(file))
        check_extensions(self.document)
        self.merged = merged
        self.tree = list(placed_nodes(self.document))
        if not any(p.node.has("mesh") for p in self.tree):
            self.document.root.fail("the scene shows no mesh.", "Export it with its mesh.")
        self.assets = GltfCopier(self.document, merged)
        for group in DROPPED_GLTF_LISTS:
            if self.document.root.has(group):
                self.document.warn(f"its {group} are left out.", NoteKind.LEFT_OUT)

    def placed(self, member: MergeMember) -> dict:
        """Copy the file's tree; return the node of the object above it."""
        w, x, y, z = (c / math.hypot(*member.quaternion) for c in member.quaternion)
        return {
            "name": member.name,
            # The one place where our Z-up becomes the file's Y-up: (x, y, z) → (x, z, -y).
            "translation": [member.position[0], member.position[2], -member.position[1]],
            "rotation": [x, z, -y, w],
            "scale": [member.scale] * 3,
            "children": self._copied(),
            "extras": self._extras(member),
        }

    def _extras(self, member: MergeMember) -> dict:
        extras = {"class": everyday_words(member.name) or member.name} | member.extras
        asset = self.document.root.child("asset")
        copyright = asset.text("copyright") if asset else ""
        if copyright and not object_credit(extras):
            extras["attribution"] = copyright
        return extras

    def _copied(self) -> list[int]:
        """Copy every node; return the roots."""
        first = len(self.merged.json.get("nodes", []))
        number = {p.number: first + k for k, p in enumerate(self.tree)}
        skins: dict[str, int | None] = {}
        for p in self.tree:
            self.merged.add("nodes", self._node(p, number, skins))
        return [number[p.number] for p in self.tree if p.parent is None]

    def _node(self, p: PlacedNode, number: dict[int, int], skins: dict[str, int | None]) -> dict:
        item = copy_without_extensions(p.node, "camera", "skin", "mesh", "children")
        below = node_numbers(p.node, "children", len(self.document.entries("nodes")))
        if below:
            item["children"] = [number[c] for c in below]
        mesh = p.node.refer("mesh", "meshes")
        if mesh is None:
            return item
        item["mesh"] = self.assets.mesh(mesh)
        skin = p.node.refer("skin", "skins")
        if skin and skin.pointer not in skins:
            skins[skin.pointer] = self._skin(skin, number)
        if skin and skins[skin.pointer] is not None:
            item["skin"] = skins[skin.pointer]
        return item

    def _skin(self, skin: GltfEntry, number: dict[int, int]) -> int | None:
        """Copy a skeleton onto the copied nodes; None where some of its joints are not shown."""
        joints = node_numbers(skin, "joints", len(self.document.entries("nodes")))
        if not joints or not all(j in number for j in joints):
            self.document.warn("a skeleton is left out: its joints are not in the scene.", NoteKind.LEFT_OUT)
            return None
        item = copy_without_extensions(skin, "skeleton") | {"joints": [number[j] for j in joints]}
        inverse = skin.refer("inverseBindMatrices", "accessors")
        if inverse:
            item["inverseBindMatrices"] = self.assets.accessor(inverse)
        above = skin.whole("skeleton") if skin.has("skeleton") else -1
        if above in number:
            item["skeleton"] = number[above]
        return self.merged.add("skins", item)


def _file_bytes(path: Path, merged: MergedDocument) -> bytes:
    nodes = merged.json["nodes"]
    heads = [nodes[k] for k in nodes[-1]["children"]]
    credits = sorted({c for head in heads if (c := object_credit(head["extras"]))})
    asset = {"version": "2.0", "generator": GLB_GENERATOR}
    asset |= {"copyright": "; ".join(credits)} if credits else {}
    lists = {"extensionsUsed": sorted(merged.used), "extensionsRequired": sorted(merged.required)}
    document = {"asset": asset} | merged.json | {k: x for k, x in lists.items() if x}
    try:
        return pack_glb(document, merged.binary)
    except (ValueError, RecursionError) as problem:
        what = "something in it is nested too deeply for JSON"
        if isinstance(problem, ValueError):
            what = "a number in it is NaN or infinite, which JSON cannot say"
        step = "Look at the extras of its objects and of their files."
        raise UserError(f"{path} is not written: {what}. {step}") from None
