"""Reader of animated GLB, evaluated at keyframes: nodes, then morph targets."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float

from corporeal.geometry.rotation import matrix_from_quaternion
from corporeal.io.gltf.gltf_accessors import accessor_rows, rows_as_floats
from corporeal.io.gltf.gltf_document import GltfDocument
from corporeal.io.gltf.gltf_nodes import placed_nodes


@dataclass(frozen=True)
class AnimatedGlb:
    """A file whose channels all have one row of keyframes."""

    document: GltfDocument
    tracks: dict[tuple[int, str], np.ndarray] = field(default_factory=dict)
    """(node, path) → values (F, n)."""

    def vertices(self, frame: int) -> Float[np.ndarray, "V 3"]:
        """Vertices of all meshes in the order of the nodes, +Z up [m]."""
        nodes = [entry.value for entry in self.document.entries("nodes")]
        parent = {child: k for k, node in enumerate(nodes) for child in node.get("children", ())}
        found = []
        for k in self._order:
            if "mesh" in nodes[k]:
                points = self._shape(nodes[k]["mesh"], k, frame)
                at: int | None = k
                while at is not None:
                    points = self._moved(nodes[at], at, frame, points)
                    at = parent.get(at)
                found.append(points)
        return np.concatenate(found) @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])

    @cached_property
    def _order(self) -> list[int]:
        return [placed.number for placed in placed_nodes(self.document)]

    def _shape(self, number: int, node: int, frame: int) -> np.ndarray:
        mesh = self.document.entries("meshes")[number].value
        (primitive,) = mesh["primitives"]
        points = self._values(primitive["attributes"]["POSITION"]).copy()
        still = np.array(mesh.get("weights", ()))
        weights = self.tracks.get((node, "weights"))
        row = still if weights is None else weights.reshape(-1, len(still))[frame]
        for weight, target in zip(row, primitive.get("targets", ()), strict=True):
            points += weight * self._values(target["POSITION"])
        return points

    def _moved(self, node: dict, number: int, frame: int, points: np.ndarray) -> np.ndarray:
        if "matrix" in node:
            whole = np.array(node["matrix"]).reshape(4, 4).T
            return points @ whole[:3, :3].T + whole[:3, 3]
        at_rest = {"scale": [1, 1, 1], "rotation": [0, 0, 0, 1], "translation": [0, 0, 0]} | node
        now = {
            path: self.tracks[number, path][frame] if (number, path) in self.tracks else at_rest[path]
            for path in ("scale", "rotation", "translation")
        }
        x, y, z, w = now["rotation"]
        turn = matrix_from_quaternion(np.array([w, x, y, z]))
        return (points * now["scale"]) @ turn.T + now["translation"]

    def _values(self, accessor: int) -> np.ndarray:
        entry = self.document.entries("accessors")[accessor]
        return rows_as_floats(accessor_rows(entry), bool(entry.value.get("normalized")))


def read_animated_glb(path: Path) -> AnimatedGlb:
    """Open a video.

    Raises:
        BadFileError: It cannot be read.
    """
    video = AnimatedGlb(GltfDocument(path))
    for animation in video.document.entries("animations"):
        samplers = animation.value["samplers"]
        for channel in animation.value["channels"]:
            target = channel["target"]
            values = video._values(samplers[channel["sampler"]]["output"])
            video.tracks[target["node"], target["path"]] = values
    return video
