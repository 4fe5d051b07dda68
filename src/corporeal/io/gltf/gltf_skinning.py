"""Transforms of meshes to world coordinates, by node or by skeleton at rest.

glTF 2.0 specification, sections 3.5.2 and 3.7.3 (skins; a skinned mesh ignores its node's place).
"""

from dataclasses import replace

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.io.gltf.gltf_accessors import accessor_rows, rows_as_floats
from corporeal.io.gltf.gltf_document import GltfDocument
from corporeal.io.gltf.gltf_nodes import PlacedNode, node_numbers
from corporeal.io.gltf.gltf_primitives import MAX_GLTF_COORDINATE, GltfPrimitive


class SkinPoses:
    """The rest poses of one file's skins."""

    def __init__(self, document: GltfDocument, tree: list[PlacedNode]) -> None:
        self.document = document
        self.world = {p.number: p.world_from_node for p in tree}

    def bones(self, placed: PlacedNode) -> np.ndarray | None:
        """Return (J, 4, 4), the world from the bind pose by each joint; None without a skin."""
        if not placed.node.has("skin"):
            return None
        self.document.warn("is skinned; it stands as its skeleton rests.")
        try:
            return self._rest(placed)
        except BadFileError as problem:
            self.document.warn_of("a skeleton", problem)
            return None

    def _rest(self, placed: PlacedNode) -> np.ndarray:
        skin = placed.node.refer("skin", "skins") or placed.node.fail("'skin' is missing.")
        joints = node_numbers(skin, "joints", len(self.document.entries("nodes")))
        if not joints or not all(j in self.world for j in joints):
            skin.fail("its joints are not in the scene.")
        world = np.stack([self.world[j] for j in joints])
        accessor = skin.refer("inverseBindMatrices", "accessors")
        if accessor is None:
            return world
        inverse = rows_as_floats(accessor_rows(accessor)[: len(joints)], False)
        if inverse.shape != (len(joints), 16) or not np.isfinite(inverse).all():
            accessor.fail("is not a list of one finite 4 × 4 matrix for each joint.")
        return world @ inverse.reshape(-1, 4, 4).transpose(0, 2, 1)


def transform_primitive(piece: GltfPrimitive, placed: PlacedNode, bones: np.ndarray | None) -> GltfPrimitive:
    """Return the piece in the world; a mirrored one keeps its outside out."""
    with np.errstate(all="ignore"):
        world = _skinning_matrices(piece, bones)
        world = placed.world_from_node[:3] if world is None else world
        linear, shift = world[..., :3], world[..., 3]
        vertices = _transform_vectors(linear, piece.vertices) + shift
        turns = np.linalg.det(linear) < 0
        mirrored = np.count_nonzero(turns) * 2 > turns.size
    if not np.all(np.abs(vertices) < MAX_GLTF_COORDINATE):
        placed.node.fail("its transform moves the mesh out of any reasonable place.")
    return replace(
        piece,
        vertices=vertices,
        triangles=piece.triangles[:, ::-1] if mirrored else piece.triangles,
        normals=_transform_normals(piece.normals, linear),
    )


def _skinning_matrices(piece: GltfPrimitive, bones: np.ndarray | None) -> np.ndarray | None:
    """Return (V, 3, 4), each vertex's joints weighted: linear blend skinning."""
    if bones is None or piece.joints is None or piece.weights is None:
        return None
    joints = piece.joints.astype(np.int64)
    total = piece.weights.sum(axis=1, keepdims=True)
    if joints.max() >= len(bones) or joints.min() < 0 or not (total > 1e-6).all():
        return None
    return np.einsum("vk,vkij->vij", piece.weights / total, bones[joints][:, :, :3])


def _transform_vectors(linear: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return vectors @ linear.T if linear.ndim == 2 else np.einsum("vij,vj->vi", linear, vectors)


def _transform_normals(normals: np.ndarray | None, linear: np.ndarray) -> np.ndarray | None:
    """Return unit normals under linear maps (their cofactors); None where they are not unit."""
    if normals is None:
        return None
    a, b, c = (linear[..., k] for k in range(3))
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-1)
    sign = np.where(np.linalg.det(linear) < 0, -1.0, 1.0)
    turned = _transform_vectors(cofactors * sign[..., None, None], normals)
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    if not (length > 1e-12).all():
        return None
    # Normals that are unit already pass unrounded, so that reading what we wrote changes nothing.
    return turned if np.allclose(length, 1, atol=1e-4) else turned / length
