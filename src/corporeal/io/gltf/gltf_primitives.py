"""Primitives of a glTF mesh as indexed triangles. glTF 2.0 specification, section 3.7.2."""

from dataclasses import dataclass

import DracoPy
import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.core.types import NoteKind
from corporeal.io.gltf.gltf_accessors import accessor_rows, rows_as_floats
from corporeal.io.gltf.gltf_document import GltfEntry
from corporeal.io.gltf.gltf_materials import TexturedFinish

MAX_DRACO_VERTICES = 20_000_000
DRACO_ADVICE = "Export the model without Draco compression."


def decode_draco(primitive: GltfEntry, packed: GltfEntry) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the triangles (T, 3) and each attribute's values (V, width) as real numbers."""
    view = packed.refer("bufferView", "bufferViews") or packed.fail("'bufferView' is missing.")
    data = bytes(packed.document.view(view))
    _check_claims(primitive, packed, len(data))
    faces = _claimed_faces(data)
    if faces is not None:
        packed.document.spend(packed, 3 * faces)
    try:
        mesh = DracoPy.decode(data)
        triangles = np.asarray(mesh.faces, np.int64).reshape(-1, 3)
    except Exception as problem:  # the binding raises bare exceptions
        packed.fail(f"the Draco data cannot be decoded ({str(problem)[:60]}).", DRACO_ADVICE)
    return triangles, _attributes(primitive, packed, mesh)


def _check_claims(primitive: GltfEntry, packed: GltfEntry, size: int) -> None:
    """Reject absurd counts before the decoder allocates them."""
    accessors = [primitive.refer("indices", "accessors")]
    attributes = primitive.needed("attributes")
    accessors += [attributes.refer(name, "accessors") for name in attributes.value]
    for accessor in filter(None, accessors):
        if accessor.whole("count") > min(3 * MAX_DRACO_VERTICES, 1000 * size):
            accessor.fail(f"claims more values than {size} bytes of Draco data can hold.")


def _claimed_faces(data: bytes) -> int | None:
    """Return the face count in a Draco mesh header, None where it is not one we know.

    Header (Draco bitstream specification 2.2, sections 4 and 5): "DRACO", version (2 bytes),
    geometry type, method (0 sequential, 1 edgebreaker), flags (2 bytes); then for edgebreaker
    the traversal's kind and the numbers of vertices and faces, for sequential the number of faces.
    """
    if data[:5] != b"DRACO" or len(data) < 16 or data[5] < 2 or data[10] & 0x80:
        return None
    if data[8] == 0:
        return _varint(data, 11)[0]
    return _varint(data, _varint(data, 12)[1])[0]


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """Return a little-endian base-128 number and the place behind it."""
    value = 0
    for shift in range(0, 64, 7):
        byte = data[at] if at < len(data) else 0
        value |= (byte & 0x7F) << shift
        at += 1
        if not byte & 0x80:
            break
    return value, at


def _attributes(primitive: GltfEntry, packed: GltfEntry, mesh) -> dict[str, np.ndarray]:
    declared = primitive.needed("attributes")
    ids = packed.needed("attributes")
    values = {}
    for name in ids.value:
        found = mesh.get_attribute_by_unique_id(ids.whole(name))
        if found is None:
            ids.fail(f"the Draco data has no attribute {ids.whole(name)} for {name}.", DRACO_ADVICE)
        rows = np.asarray(found["data"])
        rows = rows.reshape(len(rows), -1)
        accessor = declared.refer(name, "accessors")
        values[name] = rows_as_floats(rows, accessor is not None and accessor.flag("normalized"))
    return values


UNREAD_PRIMITIVE_MODES = {0: "points", 1: "lines", 2: "a line loop", 3: "a line strip"}
MODE_TRIANGLES, MODE_TRIANGLE_STRIP, MODE_TRIANGLE_FAN = 4, 5, 6
MAX_GLTF_COORDINATE = 1e9
"""[file units]; beyond it single precision means nothing, and cubes overflow."""


@dataclass(frozen=True)
class GltfPrimitive:
    """One primitive in its mesh's own frame."""

    vertices: np.ndarray
    """(V, 3) as in the file."""
    triangles: np.ndarray
    """(T, 3)"""
    normals: np.ndarray | None
    """(V, 3)"""
    uv: np.ndarray | None
    """(V, 2), the finish's texture transform applied."""
    colours: np.ndarray | None
    """(V, 3 or 4) linear."""
    joints: np.ndarray | None = None
    """(V, 4) numbers within the node's skin."""
    weights: np.ndarray | None = None
    """(V, 4) of these joints."""


def read_primitive(primitive: GltfEntry, mesh: str, dress: TexturedFinish) -> GltfPrimitive | None:
    """Return the primitive's triangles; None, with a warning, where it has none."""
    document = primitive.document
    mode = primitive.whole("mode", MODE_TRIANGLES)
    if mode in UNREAD_PRIMITIVE_MODES:
        document.warn(f"mesh {mesh!r} holds {UNREAD_PRIMITIVE_MODES[mode]}; only triangles are used.")
        return None
    if mode not in (MODE_TRIANGLES, MODE_TRIANGLE_STRIP, MODE_TRIANGLE_FAN):
        primitive.fail(f"unknown 'mode' {mode}.")
    if "targets" in primitive.value:
        document.warn(f"mesh {mesh!r} can morph; its rest shape is used.")
    source = _PrimitiveSource(primitive, mesh)
    if source.count == 0:
        document.warn(f"mesh {mesh!r} has a primitive without vertices; it is left out.", NoteKind.LEFT_OUT)
        return None
    triangles = _without_degenerate(source.triangles(mode))
    if not len(triangles):
        document.warn(f"mesh {mesh!r} has a primitive without triangles; it is left out.", NoteKind.LEFT_OUT)
        return None
    used, triangles = _renumber_used_vertices(triangles, source.count, primitive)
    document.spend(primitive, len(used))
    return GltfPrimitive(
        vertices=_finite(source.positions(used), primitive, mesh),
        triangles=triangles,
        normals=source.optional("NORMAL", (3,), used),
        uv=_transform_uv(source.optional(f"TEXCOORD_{dress.uv_set}", (2,), used), dress),
        colours=_in_unit(source.optional("COLOR_0", (3, 4), used)),
        joints=source.optional("JOINTS_0", (4,), used),
        weights=source.optional("WEIGHTS_0", (4,), used),
    )


class _PrimitiveSource:
    """Where a primitive's arrays come from: plain accessors, or Draco."""

    def __init__(self, primitive: GltfEntry, mesh: str) -> None:
        self.primitive = primitive
        self.mesh = mesh
        self.attributes = primitive.needed("attributes")
        packed = primitive.extension("KHR_draco_mesh_compression")
        self.faces, self.decoded = decode_draco(primitive, packed) if packed else (None, {})
        self._position = self._stored("POSITION", (3,))
        self.count = len(self._position.rows) if self._position else 0

    def positions(self, used: np.ndarray) -> np.ndarray:
        """Return the places of some vertices."""
        assert self._position is not None
        return self._position.real(used)

    def triangles(self, mode: int) -> np.ndarray:
        """Return (T, 3), whatever way the file lists them."""
        if self.faces is not None:
            return self.faces
        accessor = self.primitive.refer("indices", "accessors")
        if accessor is None:
            self.primitive.document.spend(self.primitive, self.count)
            order = np.arange(self.count)
        else:
            order = _whole_numbers(accessor)
        return _triangles_of_mode(order, mode, self.primitive, self.mesh)

    def optional(self, name: str, widths: tuple[int, ...], used: np.ndarray) -> np.ndarray | None:
        """Return an attribute that a surface can do without; a broken one is left out."""
        document = self.primitive.document
        try:
            stored = self._stored(name, widths)
        except BadFileError as problem:
            document.warn_of(f"{name} of mesh {self.mesh!r}", problem)
            return None
        if stored is None:
            return None
        values = stored.real(used) if len(stored.rows) == self.count else None
        if values is None or not np.isfinite(values).all():
            why = "it does not fit" if values is None else "it holds NaN"
            document.warn(f"{name} of mesh {self.mesh!r} is left out: {why}.", NoteKind.LEFT_OUT)
            return None
        return values

    def _stored(self, name: str, widths: tuple[int, ...]) -> "_StoredArray | None":
        if name in self.decoded:
            rows = self.decoded[name]
            return _StoredArray(rows, False) if rows.shape[1] in widths else None
        accessor = self.attributes.refer(name, "accessors")
        if accessor is None:
            return None
        rows = accessor_rows(accessor)
        if rows.shape[1] not in widths:
            wanted = " or ".join(map(str, widths))
            accessor.fail(f"{name} has {rows.shape[1]} numbers a row, not {wanted}.")
        return _StoredArray(rows, accessor.flag("normalized"))


@dataclass(frozen=True)
class _StoredArray:
    """An array as stored: many primitives may share it, each converts what it uses."""

    rows: np.ndarray
    normalized: bool

    def real(self, used: np.ndarray) -> np.ndarray:
        return rows_as_floats(self.rows[used], self.normalized)


def _whole_numbers(accessor: GltfEntry) -> np.ndarray:
    rows = accessor_rows(accessor)
    if rows.dtype.kind != "u" or rows.shape[1] != 1:
        accessor.fail("indices must be single unsigned integers.")
    accessor.document.spend(accessor, len(rows))
    return rows[:, 0].astype(np.int64)


def _triangles_of_mode(order: np.ndarray, mode: int, primitive: GltfEntry, mesh: str) -> np.ndarray:
    """Return triangles from a list, strip or fan of vertex numbers (glTF 2.0, 3.7.2.1)."""
    if mode == MODE_TRIANGLES:
        whole = len(order) // 3 * 3
        if whole != len(order):
            left = len(order) - whole
            primitive.document.warn(f"the last {left} indices of mesh {mesh!r} are no triangle.")
        return order[:whole].reshape(-1, 3)
    if len(order) < 3:
        return np.zeros((0, 3), np.int64)
    i = np.arange(len(order) - 2)
    if mode == MODE_TRIANGLE_STRIP:
        odd = i % 2
        return np.stack([order[i], order[i + 1 + odd], order[i + 2 - odd]], axis=1)
    return np.stack([order[i + 1], order[i + 2], np.full_like(i, order[0])], axis=1)


def _without_degenerate(t: np.ndarray) -> np.ndarray:
    return t[(t[:, 0] != t[:, 1]) & (t[:, 1] != t[:, 2]) & (t[:, 2] != t[:, 0])]


def _renumber_used_vertices(triangles: np.ndarray, count: int, primitive: GltfEntry) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices in use, and the triangles numbered among them."""
    if triangles.max() >= count:
        primitive.fail(f"index {triangles.max()} is beyond the {count} vertices.")
    used, numbers = np.unique(triangles, return_inverse=True)
    return used, numbers.reshape(-1, 3)


def _finite(vertices: np.ndarray, primitive: GltfEntry, mesh: str) -> np.ndarray:
    good = np.all(np.abs(vertices) < MAX_GLTF_COORDINATE, axis=1)
    if not good.all():
        x = vertices[~good][0]
        primitive.fail(
            f"mesh {mesh!r} has {np.sum(~good)} of {len(vertices)} vertices at impossible places, "
            f"such as ({x[0]:.3g}, {x[1]:.3g}, {x[2]:.3g}).",
            "Repair the mesh in a modelling program, then export it again.",
        )
    return vertices


def _transform_uv(uv: np.ndarray | None, dress: TexturedFinish) -> np.ndarray | None:
    if uv is None or dress.uv_matrix is None:
        return uv
    return uv @ dress.uv_matrix[:, :2].T + dress.uv_matrix[:, 2]


def _in_unit(colours: np.ndarray | None) -> np.ndarray | None:
    return None if colours is None else np.clip(colours, 0.0, 1.0)
