"""Arrays of a glTF file: strided, normalised, sparse. glTF 2.0 specification, section 3.6.2."""

from typing import NoReturn

import numpy as np

from corporeal.io.gltf.gltf_document import GltfEntry

DTYPE_OF_COMPONENT_TYPE = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTH_OF_ACCESSOR_TYPE = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
MAX_ROWS_WITHOUT_DATA = 10_000_000
"""An accessor without bytes is all zeros, of any length it likes to claim; this is accepted."""


def accessor_rows(accessor: GltfEntry) -> np.ndarray:
    """Return (count, width) of the stored type; a view of the file's bytes where possible."""
    component, width = _kind(accessor)
    count = accessor.whole("count")
    view = accessor.refer("bufferView", "bufferViews")
    sparse = accessor.child("sparse")
    if view is not None:
        start = accessor.whole("byteOffset", 0)
        rows = _strided(accessor, view, start, (count, width), component)
    else:
        if count > MAX_ROWS_WITHOUT_DATA:
            accessor.fail(f"claims {count} values but holds none.")
        rows = np.broadcast_to(np.zeros(1, component), (count, width))
    return _with_sparse(rows, sparse, component) if sparse else rows


def rows_as_floats(rows: np.ndarray, normalized: bool) -> np.ndarray:
    """Return float64; normalised integers become [0, 1] or [-1, 1] (glTF 2.0, 3.6.2.2)."""
    with np.errstate(invalid="ignore"):  # signalling NaNs; whoever uses the values looks for NaN
        values = rows.astype(np.float64)
    if normalized and rows.dtype.kind in "iu":
        values = np.maximum(values / np.iinfo(rows.dtype).max, -1.0)
    return values


def _kind(accessor: GltfEntry) -> tuple[np.dtype, int]:
    component = DTYPE_OF_COMPONENT_TYPE.get(accessor.whole("componentType"))
    width = WIDTH_OF_ACCESSOR_TYPE.get(accessor.text("type"))
    if component is None:
        accessor.fail(f"unknown 'componentType' {accessor.whole('componentType')}.")
    if width is None:
        accessor.fail(f"'type' {accessor.text('type')[:20]!r} is not one of {', '.join(WIDTH_OF_ACCESSOR_TYPE)}.")
    return np.dtype(component), width


def _strided(
    accessor: GltfEntry, view: GltfEntry, start: int, shape: tuple[int, int], component: np.dtype
) -> np.ndarray:
    data = accessor.document.view(view)
    count, width = shape
    size = width * component.itemsize
    stride = view.whole("byteStride", size)
    if stride < size:
        view.fail(f"'byteStride' {stride} is smaller than one row of {size} bytes.")
    if count and start + (count - 1) * stride + size > len(data):
        _too_short(accessor, count, len(data))
    return np.ndarray(shape, component, data, start, (stride, component.itemsize))


def _with_sparse(rows: np.ndarray, sparse: GltfEntry, component: np.dtype) -> np.ndarray:
    """Replace some rows by others (glTF 2.0, 3.6.2.3)."""
    count = sparse.whole("count", most=len(rows))
    places, values = sparse.needed("indices"), sparse.needed("values")
    kind = DTYPE_OF_COMPONENT_TYPE.get(places.whole("componentType"), "")
    if "u" not in kind:
        places.fail("sparse indices must be unsigned integers.")
    where = _packed(places, (count, 1), np.dtype(kind))[:, 0]
    if count and where.max() >= len(rows):
        places.fail(f"index {where.max()} is beyond the {len(rows)} rows.")
    sparse.document.spend(sparse, len(rows))
    replaced = rows.copy()
    replaced[where] = _packed(values, (count, rows.shape[1]), component)
    return replaced


def _packed(entry: GltfEntry, shape: tuple[int, int], component: np.dtype) -> np.ndarray:
    view = entry.refer("bufferView", "bufferViews") or entry.fail("'bufferView' is missing.")
    return _strided(entry, view, entry.whole("byteOffset", 0), shape, component)


def _too_short(accessor: GltfEntry, count: int, length: int) -> NoReturn:
    accessor.fail(f"claims {count} values, more than its {length} bytes hold.")
