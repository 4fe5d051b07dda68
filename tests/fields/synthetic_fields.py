"""Made-up outputs of other methods on our props: E one decade apart from part to part."""

from dataclasses import dataclass

import numpy as np

from corporeal.geometry.mesh import join_meshes
from corporeal.geometry.point_sampling import sample_surface
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.segment import segment
from corporeal.showcase.showcase_scenes import prop_scene

VOXELS = 64
"""Along the longest side."""
SCATTER = 1.6
"""Factor by which E scatters within a part."""
FRAMES = {
    "z-up": np.eye(3),
    "y-up": np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0.0]]),
    "x-up": np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]]),
}
"""How the file's frame comes from ours; each is also scaled and shifted."""


@dataclass(frozen=True)
class Thing:
    """A prop and voxels on its surface."""

    scene: object
    inventory: object
    parts: object
    points: np.ndarray
    """Spread over the surface [m]."""
    part_of_point: np.ndarray
    voxel: np.ndarray
    """[m]"""
    part_of_voxel: np.ndarray
    young_pa: np.ndarray
    """Of each voxel [Pa]."""


def thing(name):
    rng = np.random.default_rng(0)
    scene = prop_scene(name)
    inventory = describe(scene)
    parts = segment(scene, inventory)
    points, triangle = sample_surface(join_meshes(scene.surfaces), 12_000, rng)
    mixed = rng.permutation(len(points))  # whoever comes first has the voxel
    points, own = points[mixed], parts.part_of_point[triangle[mixed]]
    cell = np.ptp(points, axis=0).max() / VOXELS
    first = np.unique(np.round(points / cell).astype(int), axis=0, return_index=True)[1]
    young_pa = 10.0 ** (5 + own[first]) * np.exp(rng.normal(0, np.log(SCATTER), len(first)))
    voxel = np.round(points[first] / cell) * cell
    return Thing(scene, inventory, parts, points, own, voxel, own[first], young_pa)


def placed(points, frame):
    """Bring points into a file's frame: turned, of another size, elsewhere."""
    return points @ FRAMES[frame].T / np.ptp(points, axis=0).max() + [0.3, -2, 1]


def write_vomp(path, position, young_pa, poisson=0.3, density=900.0):
    names = ("x", "y", "z", "youngs_modulus", "poissons_ratio", "density")
    rows = np.zeros(len(position), [(n, "<f4") for n in names] + [("segment_id", "<U32")])
    rows["x"], rows["y"], rows["z"] = position.T
    rows["youngs_modulus"], rows["poissons_ratio"], rows["density"] = young_pa, poisson, density
    np.savez_compressed(path, voxel_data=rows)


def write_pixie(path, position, young_pa, kind=0, poisson=0.3, density=900.0):
    colours = [(n, "u1") for n in ("red", "green", "blue", "alpha")]
    names = [*((n, "<f4") for n in "xyz"), *colours, ("part_label", "<i4"), ("density", "<f4")]
    names += [("E", "<f4"), ("nu", "<f4"), ("material_id", "<i4"), ("conf", "<f4")]
    rows = np.zeros(len(position), names)
    rows["x"], rows["y"], rows["z"] = position.T
    rows["E"], rows["nu"], rows["density"], rows["material_id"] = young_pa, poisson, density, kind
    words = {"<f4": "float", "u1": "uchar", "<i4": "int"}
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    head += [f"property {words[kind]} {name}" for name, kind in names] + ["end_header"]
    path.write_bytes("\n".join(head).encode() + b"\n" + rows.tobytes())
