"""Meshes compressed with Draco (KHR_draco_mesh_compression)."""

import DracoPy
import numpy as np

from corporeal.io.gltf.gltf_accessors import rows_as_floats
from corporeal.io.gltf.gltf_document import GltfEntry

MAX_DRACO_VERTICES = 20_000_000
DRACO_ADVICE = "Export the model without Draco compression."


def decode_draco(
    primitive: GltfEntry, packed: GltfEntry
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
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
