"""Meshes, parts and models of props."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import manifold3d as m3
import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from corporeal.core.types import Finish
from corporeal.geometry.srgb import srgb_to_linear

PropPoint = tuple[float, float, float]
ZERO_OFFSET: PropPoint = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class PropMesh:
    """A closed triangle surface. Vertices on seams are doubled at identical positions."""

    vertices: Float[np.ndarray, "V 3"]
    """Position [m]; z is up and the floor is z = 0."""
    faces: Int[np.ndarray, "T 3"]
    """Vertex numbers, anticlockwise seen from outside."""
    normals: Float[np.ndarray, "V 3"]
    """Unit shading normal."""
    uv: Float[np.ndarray, "V 2"]
    """Texture coordinates; v runs up."""
    colours: Float[np.ndarray, "V 3"]
    """Linear RGB that multiplies the finish."""

    def moved(self, by: ArrayLike = ZERO_OFFSET, turn: ArrayLike = ZERO_OFFSET) -> "PropMesh":
        """Turn by xyz Euler angles [degrees], then shift [m]."""
        rotation = Rotation.from_euler("xyz", np.asarray(turn), degrees=True).as_matrix()
        return replace(
            self, vertices=self.vertices @ rotation.T + np.asarray(by, float), normals=self.normals @ rotation.T
        )

    def tinted(self, colours: ArrayLike) -> "PropMesh":
        """Multiply the finish by one linear colour, or by one per vertex."""
        return replace(self, colours=np.broadcast_to(colours, self.vertices.shape).astype(float))


@dataclass(frozen=True)
class PropPart:
    """One closed piece of one substance."""

    name: str
    mesh: PropMesh
    finish: Finish
    substance: str
    """A name from the material library."""
    shell: float = 0.0
    """Wall of what is hollow in reality but modelled by its outside [m]; 0: solid as modelled."""
    contents: str = ""
    """What is in the vessel that it is, from the library; "": nothing."""
    fill: float = 0.0
    """Share of its room that they take up."""


@dataclass(frozen=True)
class PropModel:
    """An object: its parts, standing on z = 0 and facing +x."""

    name: str
    parts: tuple[PropPart, ...]

    def moved(self, by: ArrayLike = ZERO_OFFSET, turn: ArrayLike = ZERO_OFFSET) -> "PropModel":
        """Turn by xyz Euler angles [degrees], then shift [m]."""
        return replace(self, parts=tuple(replace(p, mesh=p.mesh.moved(by, turn)) for p in self.parts))

    def bounds(self) -> Float[np.ndarray, "2 3"]:
        """Lowest and highest corner [m]."""
        points = np.concatenate([p.mesh.vertices for p in self.parts])
        return np.stack([points.min(0), points.max(0)])


def plain_finish(name: str, colour: str, roughness: float, metallic: float = 0.0, emission: float = 0.0) -> Finish:
    """Make a finish of one colour, given as '#rrggbb' in sRGB."""
    rgb = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    red, green, blue = (float(x) for x in srgb_to_linear(rgb).round(6))
    return Finish(name, (red, green, blue, 1.0), metallic=metallic, roughness=roughness, emission=emission)


def textured_finish(name: str, texture: UInt8[np.ndarray, "H W 3"], roughness: float, metallic: float = 0.0) -> Finish:
    """Make a finish that carries a picture."""
    return Finish(name, texture=texture, metallic=metallic, roughness=roughness)


def make_mesh(
    vertices: ArrayLike, faces: ArrayLike, uv: ArrayLike | None = None, normals: ArrayLike | None = None
) -> PropMesh:
    """Fill in what is missing: smooth normals over welded positions, zero UV; colour white."""
    v, f = np.asarray(vertices, float), np.asarray(faces, np.int64)
    n = welded_vertex_normals(v, f) if normals is None else np.asarray(normals, float)
    t = np.zeros((len(v), 2)) if uv is None else np.asarray(uv, float)
    return PropMesh(v, f, n, t, np.ones_like(v))


def weld_vertices(
    vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "T 3"]
) -> tuple[Float[np.ndarray, "W 3"], Int[np.ndarray, "S 3"]]:
    """Merge vertices at the same position (to 1e-7 m); drop triangles that collapse."""
    _, first, number = np.unique(np.round(vertices, 7), axis=0, return_index=True, return_inverse=True)
    f = number.reshape(-1)[faces]
    return vertices[first], f[_proper_triangles(f)]


def welded_vertex_normals(
    vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "T 3"]
) -> Float[np.ndarray, "V 3"]:
    """Area-weighted vertex normals, shared by all vertices at one position."""
    _, number = np.unique(np.round(vertices, 7), axis=0, return_inverse=True)
    number = number.reshape(-1)
    shared = number[faces]
    keep = _proper_triangles(shared)
    return corner_normals(vertices, faces[keep], shared[keep], number.max() + 1)[number]


def corner_normals(
    vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "T 3"], numbers: Int[np.ndarray, "T 3"], count: int
) -> Float[np.ndarray, "count 3"]:
    """Area-weighted unit normals of ``count`` points; ``numbers`` says which point a corner is."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    total = np.zeros((count, 3))
    for i in range(3):
        np.add.at(total, numbers[:, i], np.cross(b - a, c - a))
    return unit_vectors(total)


def unit_vectors(vectors: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    """Scale to length one; zero stays zero."""
    return vectors / (np.linalg.norm(vectors, axis=-1, keepdims=True) + 1e-30)


def concatenate_meshes(meshes: Sequence[PropMesh]) -> PropMesh:
    """Concatenate without any boolean: for pieces that stay apart, such as leaves."""
    start = np.cumsum([0] + [len(m.vertices) for m in meshes])
    return PropMesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.faces + s for m, s in zip(meshes, start, strict=False)]),
        np.concatenate([m.normals for m in meshes]),
        np.concatenate([m.uv for m in meshes]),
        np.concatenate([m.colours for m in meshes]),
    )


def mesh_union(meshes: Sequence[PropMesh]) -> PropMesh:
    """Boolean union; normals, UV and colours ride along."""
    return _mesh_of_manifold(m3.Manifold.batch_boolean([_manifold_of_mesh(m) for m in meshes], m3.OpType.Add))


def mesh_difference(mesh: PropMesh, *away: PropMesh) -> PropMesh:
    """Boolean difference. Walls that ``away`` leaves face its inside: its normals turn round."""
    solid = _manifold_of_mesh(mesh)
    for other in away:
        solid = solid - _manifold_of_mesh(replace(other, normals=-other.normals))
    return _mesh_of_manifold(solid)


def _proper_triangles(faces: Int[np.ndarray, "T 3"]) -> np.ndarray:
    """Which triangles have three different corners."""
    a, b, c = faces.T
    return (a != b) & (b != c) & (c != a)


def _manifold_of_mesh(mesh: PropMesh) -> m3.Manifold:
    properties = np.hstack([mesh.vertices, mesh.normals, mesh.uv, mesh.colours])
    surface = m3.Mesh(properties.astype(np.float32), mesh.faces.astype(np.uint32))
    surface.merge()
    solid = m3.Manifold(surface)
    if solid.status() != m3.Error.NoError or solid.is_empty():
        raise ValueError(f"This mesh bounds no solid ({solid.status()}). Close it first.")
    return solid


def _mesh_of_manifold(solid: m3.Manifold) -> PropMesh:
    surface = solid.to_mesh()
    p = np.asarray(surface.vert_properties, float)
    faces = np.asarray(surface.tri_verts, np.int64)
    return PropMesh(p[:, :3], faces, unit_vectors(p[:, 3:6]), p[:, 6:8], p[:, 8:11])
