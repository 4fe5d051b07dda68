"""The node tree of a glTF scene, with world transforms. glTF 2.0 specification, section 3.5."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from corporeal.io.gltf.gltf_document import GltfDocument, GltfEntry

Z_UP_FROM_Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1.0, 0], [0, 1.0, 0, 0], [0, 0, 0, 1.0]])
"""(x, y, z) → (x, -z, y): the one place where the file's Y-up becomes Z-up."""
MAX_NODES = 100_000
TRANSFORM_KEYS = {"matrix", "translation", "rotation", "scale"}
IDENTITY_MATRIX = tuple(np.eye(4).ravel().tolist())


@dataclass(frozen=True)
class PlacedNode:
    """A node with its place in the world."""

    number: int
    node: GltfEntry
    world_from_node: np.ndarray
    """(4, 4); metres as in the file, Z up."""
    parent: int | None
    """Number of the node above."""


def placed_nodes(document: GltfDocument) -> Iterator[PlacedNode]:
    """Yield every node of the file's scene, parents before children, in the file's order.

    Raises:
        BadFileError: A node has two parents or is its own ancestor.
    """
    nodes = document.entries("nodes") or _implied_nodes(document)
    if len(nodes) > MAX_NODES:
        document.root.fail(f"has more than {MAX_NODES} nodes.", "Join its meshes first.")
    seen: set[int] = set()
    stack: list[tuple[int, np.ndarray, int | None]]
    stack = [(k, Z_UP_FROM_Y_UP, None) for k in reversed(_roots(document, len(nodes)))]
    while stack:
        k, above, parent = stack.pop()
        if k in seen:
            nodes[k].fail("the node hangs in the tree twice, or below itself.")
        seen.add(k)
        with np.errstate(all="ignore"):  # what grows beyond bounds is refused where it is used
            placed = PlacedNode(k, nodes[k], above @ local_matrix(nodes[k]), parent)
        yield placed
        children = node_numbers(nodes[k], "children", len(nodes))
        stack += [(c, placed.world_from_node, k) for c in reversed(children)]


def node_numbers(entry: GltfEntry, key: str, count: int) -> list[int]:
    """Return a checked list of node numbers."""
    numbers = entry.sequence(key)
    for x in numbers:
        if not isinstance(x, int) or isinstance(x, bool) or not 0 <= x < count:
            entry.fail(f"{key!r} names a node {str(x)[:20]!r} that does not exist.")
    return numbers


def local_matrix(node: GltfEntry) -> np.ndarray:
    """Return (4, 4) of a node's own matrix, or of its translation · rotation · scale."""
    if not TRANSFORM_KEYS & node.value.keys():
        return np.eye(4)
    if node.has("matrix"):
        matrix = np.array(node.numbers("matrix", IDENTITY_MATRIX)).reshape(4, 4).T
        return _affine(matrix, node)
    x, y, z, w = node.numbers("rotation", (0.0, 0.0, 0.0, 1.0))
    length = np.sqrt(x * x + y * y + z * z + w * w)
    if not 1e-6 < length < 1e6:
        node.fail("'rotation' is not a unit quaternion.")
    x, y, z, w = (c / length for c in (x, y, z, w))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.array(node.numbers("scale", (1.0, 1.0, 1.0)))
    matrix[:3, 3] = node.numbers("translation", (0.0, 0.0, 0.0))
    return _affine(matrix, node)


def _affine(matrix: np.ndarray, node: GltfEntry) -> np.ndarray:
    if np.abs(matrix).max() > 1e12 or np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-6:
        node.fail("the node's transform is not an affine one of sensible size.")
    return matrix


def _implied_nodes(document: GltfDocument) -> list[GltfEntry]:
    """Return a node for every mesh of a file without any nodes, which is a library of meshes."""
    meshes = document.entries("meshes")
    return [GltfEntry(document, {"mesh": k}, m.pointer) for k, m in enumerate(meshes)]


def _roots(document: GltfDocument, count: int) -> list[int]:
    """Return the root nodes of the default scene; without scenes, all nodes without a parent."""
    if not document.entries("nodes"):
        return list(range(count))
    scene = document.root.refer("scene", "scenes")
    if scene is None and document.entries("scenes"):
        scene = document.entries("scenes")[0]
    if scene is not None:
        return node_numbers(scene, "nodes", count)
    nodes = document.entries("nodes")
    inner = {c for n in nodes for c in node_numbers(n, "children", count)}
    return [k for k in range(count) if k not in inner]
