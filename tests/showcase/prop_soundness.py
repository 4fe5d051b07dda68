"""Validation of props: closedness, winding, volume, material, overlap."""

from collections.abc import Sequence
from dataclasses import dataclass

import manifold3d as m3
import numpy as np
import trimesh

from corporeal.showcase.prop_mesh import PropMesh, PropPart, weld_vertices


@dataclass(frozen=True)
class PropSoundness:
    """What a part is like as a body."""

    triangles: int
    pieces: int
    closed: bool
    """Watertight, every triangle wound alike and outwards."""
    shaded_outwards: float
    """Share of corners whose shading normal looks out of its triangle's front."""
    volume: float
    """Enclosed [m³]."""
    matter: float
    """Volume of its substance: of the wall where it is a shell [m³]."""
    size: tuple[float, float, float]
    """Extents [m]."""


def measure_soundness(part: PropPart) -> PropSoundness:
    """Weld a part by position and measure it."""
    v, f = weld_vertices(part.mesh.vertices, part.mesh.faces)
    body = trimesh.Trimesh(v, f, process=False)
    volume = float(body.volume)
    x, y, z = (float(e) for e in np.ptp(v, axis=0))
    return PropSoundness(
        triangles=len(part.mesh.faces),
        pieces=int(body.body_count),
        closed=bool(body.is_watertight and body.is_winding_consistent and volume > 0),
        shaded_outwards=_outward_shading_fraction(part.mesh),
        volume=volume,
        matter=float(body.area) * part.shell if part.shell else volume,
        size=(x, y, z),
    )


def overlap_fraction(parts: Sequence[PropPart]) -> float:
    """Volume that is counted twice where parts intrude on each other, as a share of the whole."""
    solids = []
    for part in parts:
        v, f = weld_vertices(part.mesh.vertices, part.mesh.faces)
        solids.append(m3.Manifold(m3.Mesh(v.astype(np.float32), f.astype(np.uint32))))
    apart = sum(s.volume() for s in solids)
    return apart / m3.Manifold.batch_boolean(solids, m3.OpType.Add).volume() - 1


def _outward_shading_fraction(mesh: PropMesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    front = np.cross(b - a, c - a)
    facing = [(mesh.normals[mesh.faces[:, i]] * front).sum(1) > -1e-12 for i in range(3)]
    return float(np.mean(facing))
