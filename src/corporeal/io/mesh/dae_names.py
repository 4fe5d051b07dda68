"""Names of pieces and materials of COLLADA files, which trimesh drops."""

import io
import re
from collections.abc import Iterable, Iterator
from typing import Any

import trimesh

GENERIC_NODE_PATTERN = re.compile(r"(?i)(?:instance|group|component)(?:[_ #]?\d+)?")
"""What programs call a node that places a component, when nobody named it (SketchUp)."""

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


def _geometry_places(
    nodes: Iterable[Any], along: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], Any]]:
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
