"""The gate: which models are good enough for a scene, and why the others are not."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import label

from corporeal.core.types import Scene, Surface
from corporeal.geometry.connected_components import connected_pieces
from corporeal.geometry.mesh import Mesh, join_meshes, weld_mesh
from corporeal.geometry.point_sampling import sample_surface
from corporeal.pool.mesh_decimation import decimate_scene

MAX_SLIVER_AREA_EXTENTS2 = 1e-12
"""Area, in squares of the extent, below which a triangle is degenerate: a millionth across."""
MIN_CLEANED_SLIVER_FRACTION = 0.01
"""Share of degenerate triangles from which a cleaned copy is kept."""
MAX_SLIVER_FRACTION = 0.5
"""Share of degenerate triangles from which a model is no model."""
MIN_MAIN_COMPONENT_FRACTION = 0.01
"""Share of the area that at least one connected component must have."""
MIN_OBJECT_GAP_FRACTION = 0.02
"""Gap that makes two objects of what one file holds, over its extent."""
MIN_ONE_OBJECT_FRACTION = 0.9
"""Share of the area that hangs together, within that gap, in one object."""
GATE_SURFACE_SAMPLES = 60_000
"""Points of the surface by which that is decided."""
MAX_PALETTE_COLOURS = 64
"""A picture with no more colours than this is a palette: its pixels carry no detail."""
MAX_FLAT_UV_AREA = 1e-6
"""Area in texture coordinates below which every triangle takes one colour off a picture."""
MAX_READ_TRIANGLES = 5_000_000
"""Triangles beyond which decimating takes more than about a minute."""
EXTENT_RANGE_UNITS = 1e-6, 1e6
"""Extents in any unit between which single precision places vertices well."""


@dataclass(frozen=True)
class GateConfig:
    """What a model must be like to get into the pool."""

    least_triangles: int = 12
    """Fewer make no object but a placeholder."""
    least_plain: int = 100
    """The same, of a model without any picture on it."""
    most_triangles: int = 200_000
    """A model with more is decimated, and the copy is kept."""
    least_texture: int = 512
    """Side of the finest base-colour picture, repeats counted [px]; plain colours need none."""


DEFAULT_GATE_CONFIG = GateConfig()


@dataclass(frozen=True)
class GatedModel:
    """What was measured on a model that passed."""

    scene: Scene
    """As it enters the pool."""
    changed: bool
    """Whether ``scene`` is cleaned or decimated."""
    mesh: str
    """Names the shape as found, whatever its look and file."""
    look: str
    """Names colours and pictures as found."""
    extent: float
    """Largest extent, in units of the file."""
    triangles: int
    open_edges: float
    texture: int


class ModelRejectedError(Exception):
    """The model stays outside; the message says why."""


def inspect_model(
    scene: Scene, config: GateConfig = DEFAULT_GATE_CONFIG, max_read_triangles: int = MAX_READ_TRIANGLES
) -> GatedModel:
    """Clean and decimate a model where it needs it, and measure it.

    Args:
        scene: The model.
        config: What is good enough.
        max_read_triangles: Models with more are not decimated but rejected.

    Raises:
        Rejected: It is not good enough.
    """
    count = sum(len(s.triangles) for s in scene.surfaces)
    if count > max_read_triangles:
        raise ModelRejectedError(f"has {count:,} triangles; at most {max_read_triangles:,} are decimated")
    extent = _scene_extent(scene)
    mesh_name, look = shape_fingerprint(scene), look_fingerprint(scene)
    cleaned = _without_slivers(scene, extent)
    changed = cleaned is not scene
    found = sum(len(s.triangles) for s in cleaned.surfaces)
    if found > config.most_triangles:
        cleaned, changed = decimate_scene(cleaned, config.most_triangles), True
        left = sum(len(s.triangles) for s in cleaned.surfaces)
        if left > config.most_triangles:
            raise ModelRejectedError(
                f"has {found:,} triangles and cannot be decimated below {left:,}; "
                f"at most {config.most_triangles:,} are of use"
            )
    texture = _finest_texture_px(cleaned)
    _check_count(found, texture, config)
    if 0 < texture < config.least_texture and not _are_textures_plain(cleaned):
        raise ModelRejectedError(
            f"its finest base-colour picture is {texture} px across; "
            f"{config.least_texture} px are needed, or plain colours"
        )
    mesh = _welded_mesh(cleaned)
    _check_components(mesh)
    return GatedModel(
        scene=cleaned,
        changed=changed,
        mesh=mesh_name,
        look=look,
        extent=extent,
        triangles=sum(len(s.triangles) for s in cleaned.surfaces),
        open_edges=open_edge_fraction(mesh),
        texture=texture,
    )


def shape_fingerprint(scene: Scene) -> str:
    """Name a shape by its corners and triangles; looks, names and the file's form don't count."""
    total = hashlib.sha256()
    for s in scene.surfaces:
        total.update(np.ascontiguousarray(s.vertices, "<f4").tobytes())
        total.update(np.ascontiguousarray(s.triangles, "<u4").tobytes())
    return total.hexdigest()[:20]


def look_fingerprint(scene: Scene) -> str:
    """Name what a shape wears, by colours, factors and pictures."""
    total = hashlib.sha256()
    for f in scene.finishes:
        total.update(repr((*f.colour, f.metallic, f.roughness, f.transmission)).encode())
        if f.texture is not None:
            total.update(repr(f.texture.shape).encode() + np.ascontiguousarray(f.texture).tobytes())
    return total.hexdigest()[:20]


def open_edge_fraction(mesh: Mesh) -> float:
    """Share of the edges that bound one triangle only [-]; 0 when watertight."""
    t = mesh.triangles
    edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    _, count = np.unique(edges[:, 0] * len(mesh.vertices) + edges[:, 1], return_counts=True)
    return float(np.mean(count == 1)) if len(count) else 0.0


def largest_component_fraction(mesh: Mesh) -> float:
    """Share of the area that the largest connected component has [-]."""
    areas = np.bincount(connected_pieces(mesh), mesh.areas)
    return float(areas.max() / areas.sum())


def separate_object_fractions(mesh: Mesh) -> Float[np.ndarray, " K"]:
    """Share of the area [-] of each object that stands clear of the others, the largest first.

    Told by voxels as large as the gap, which sampled points fill: what they bridge is one object, whether its pieces
    are joined or, as in most models, merely stuck together.
    """
    points, _ = sample_surface(mesh, GATE_SURFACE_SAMPLES, np.random.default_rng(0))
    low = points.min(axis=0)
    places = ((points - low) / (MIN_OBJECT_GAP_FRACTION * np.ptp(points, axis=0).max())).astype(int)
    taken = np.zeros(places.max(axis=0) + 1, dtype=bool)
    taken[tuple(places.T)] = True
    labels = np.empty(taken.shape, dtype=np.int32)
    label(taken, np.ones((3, 3, 3)), output=labels)
    counts = np.bincount(labels[tuple(places.T)])[1:]
    return np.sort(counts)[::-1] / GATE_SURFACE_SAMPLES


def _scene_extent(scene: Scene) -> float:
    """Return the largest extent; unlike NaN, 1e30 can be written in a file."""
    if not any(len(s.triangles) for s in scene.surfaces):
        raise ModelRejectedError("holds no triangles")
    corners = np.concatenate([s.vertices[_is_used(s)] for s in scene.surfaces])
    if not np.isfinite(corners).all():
        raise ModelRejectedError("has vertices that are not finite numbers")
    extent = float(np.ptp(corners, axis=0).max())
    low, high = EXTENT_RANGE_UNITS
    if not low <= extent <= high:
        raise ModelRejectedError(f"is {extent:.3g} units large; {low:g} to {high:g} can be an object")
    return extent


def _is_used(s: Surface) -> Bool[np.ndarray, " V"]:
    used = np.zeros(len(s.vertices), dtype=bool)
    used[s.triangles] = True
    return used


def _without_slivers(scene: Scene, extent: float) -> Scene:
    """Return the scene without degenerate triangles, where there are many of them."""
    kept = [_surface_triangle_areas(s) > MAX_SLIVER_AREA_EXTENTS2 * extent**2 for s in scene.surfaces]
    share = 1 - np.concatenate(kept).mean()
    if share > MAX_SLIVER_FRACTION:
        raise ModelRejectedError(f"{share:.0%} of its triangles have no area")
    if share < MIN_CLEANED_SLIVER_FRACTION:
        return scene
    surfaces = (surface_subset(s, k) for s, k in zip(scene.surfaces, kept, strict=True))
    return replace(scene, surfaces=tuple(s for s in surfaces if len(s.triangles)))


def surface_subset(surface: Surface, kept: Bool[np.ndarray, " T"]) -> Surface:
    """Return the chosen triangles of a surface, with the vertices that they need."""
    used, numbers = np.unique(surface.triangles[kept], return_inverse=True)
    rows = {
        name: None if (values := getattr(surface, name)) is None else values[used]
        for name in ("vertices", "normals", "uv", "colours")
    }
    return replace(surface, triangles=numbers.reshape(-1, 3), **rows)


def _surface_triangle_areas(s: Surface) -> Float[np.ndarray, " T"]:
    a, b, c = np.swapaxes(np.asarray(s.vertices, np.float64)[s.triangles], 0, 1)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def _check_count(triangles: int, texture: int, config: GateConfig) -> None:
    """Tell a placeholder from a simple object: a cardboard box has few triangles and a picture."""
    least = config.least_triangles if texture else config.least_plain
    if triangles < least:
        look = "" if texture else " and no picture"
        count = "1 triangle" if triangles == 1 else f"{triangles} triangles"
        raise ModelRejectedError(f"has {count}{look}: a placeholder (at least {least})")


def _finest_texture_px(scene: Scene) -> int:
    """Return the side of the finest picture, repeats counted [px]; 0: there is none."""
    sides = (max(picture.shape[:2]) * max(1.0, area**0.5) for picture, area in _textures_with_area(scene))
    return round(max(sides, default=0))


def _are_textures_plain(scene: Scene) -> bool:
    """Whether the pictures carry colours and no detail."""
    return all(area < MAX_FLAT_UV_AREA or _is_palette_texture(picture) for picture, area in _textures_with_area(scene))


def _textures_with_area(scene: Scene) -> Iterator[tuple[np.ndarray, float]]:
    """Every base-colour picture, with the area in its own coordinates that is put on surfaces."""
    for number in sorted({s.finish for s in scene.surfaces}):
        picture = scene.finishes[number].texture
        areas = [_uv_area(s) for s in scene.surfaces if s.finish == number and s.uv is not None]
        if picture is not None and areas:
            yield picture, sum(areas)


def _uv_area(s: Surface) -> float:
    assert s.uv is not None
    a, b, c = np.swapaxes(np.asarray(s.uv, np.float64)[s.triangles], 0, 1)
    (x, y), (u, v) = (b - a).T, (c - a).T
    return float(np.abs(x * v - y * u).sum() / 2)


def _is_palette_texture(picture: np.ndarray) -> bool:
    rows = picture.reshape(-1, picture.shape[2])[:, :3].astype(np.uint32)
    return len(np.unique(rows @ np.array([1, 1 << 8, 1 << 16], np.uint32))) <= MAX_PALETTE_COLOURS


def _welded_mesh(scene: Scene) -> Mesh:
    whole = join_meshes(scene.surfaces)
    return weld_mesh(whole.vertices, whole.triangles)[0]


def _check_components(mesh: Mesh) -> None:
    if not len(mesh.triangles):
        raise ModelRejectedError("none of its triangles has an area")
    share = largest_component_fraction(mesh)
    if share <= MIN_MAIN_COMPONENT_FRACTION:
        raise ModelRejectedError(f"falls into crumbs: its largest connected piece has {share:.2%} of the area")
    shares = separate_object_fractions(mesh)
    if shares[0] < MIN_ONE_OBJECT_FRACTION:
        raise ModelRejectedError(
            f"holds {len(shares)} objects that stand apart; the largest has {shares[0]:.0%} of the "
            "area. Save each in a file of its own"
        )
