"""Plants that grow from another object: their buried foot.

Photographs end where the ground begins. A sapling that ended there, too, would fall over.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from corporeal.core.types import MaterialField, Parts, Scene
from corporeal.discretization.foliage import WOOD_MATERIALS, is_leafy
from corporeal.geometry.mesh import Mesh, join_meshes
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

GUESSED_BURIED_DEPTH_RATIO = 0.2
"""Assumed depth of a plant's foot in the ground over its height above it."""
DRAWN_FOOT_HEIGHT_FRACTION = 0.05
"""Height of what is drawn out downwards, over the plant's."""
MAX_FOOT_DEPTH_FRACTION = 0.9
"""No foot reaches deeper, of what the ground is deep."""
GROUND_DIRECTIONS_COUNT = 16
"""Directions in which the ground's height is looked for about a foot."""


@dataclass(frozen=True)
class _RootlessPlant:
    number: int
    """Of the object."""
    wood: list[Bool[np.ndarray, " V"]]
    """Which vertices of each of the scene's surfaces are its wood's."""


def extend_plants_into_ground(scene: Scene, parts: Parts, field: MaterialField) -> tuple[Scene, tuple[str, ...]]:
    """Let plants whose foot ends on another object's sand or soil reach down into it.

    Returns:
        The scene, and what was done to whom, in words.
    """
    warnings = []
    for plant in _rootless_plants(scene, parts, field):
        depth = _extra_foot_depth(scene, parts, field, plant)
        if depth > 0:
            scene = _extended_scene(scene, plant, depth)
            warnings.append(
                f"{scene.objects[plant.number].name} grows from what it stands on, but ends there: "
                f"its foot is assumed to reach {depth:.2g} m below the visible end."
            )
    return scene, tuple(warnings)


def _rootless_plants(scene: Scene, parts: Parts, field: MaterialField) -> list[_RootlessPlant]:
    """Return what is made of leaves and wood alone: neither pot nor soil of its own."""
    found = []
    for number in range(len(scene.objects)):
        mine = [k for k, part in enumerate(parts.catalogue) if part.object == number]
        wood = [k for k in mine if field.materials[k].name in WOOD_MATERIALS]
        leaves = [k for k in mine if is_leafy(field.materials[k])]
        if wood and leaves and len(wood) + len(leaves) == len(mine):
            found.append(_RootlessPlant(number, _vertices_of(scene, parts, wood)))
    return found


def _vertices_of(scene: Scene, parts: Parts, chosen: list[int]) -> list[np.ndarray]:
    """Return which vertices of each surface belong to triangles of these parts."""
    ends = np.cumsum([len(s.triangles) for s in scene.surfaces])[:-1]
    masks = []
    for surface, part in zip(scene.surfaces, np.split(parts.part_of_point, ends), strict=True):
        mask = np.zeros(len(surface.vertices), dtype=bool)
        mask[surface.triangles[np.isin(part, chosen)]] = True
        masks.append(mask)
    return masks


def _extra_foot_depth(scene: Scene, parts: Parts, field: MaterialField, plant: _RootlessPlant) -> float:
    """Return how much deeper a plant's foot is than its surface [m]; 0: it ends in no ground.

    It does where the ground about it is as high as its lowest point.
    """
    points = np.concatenate([s.vertices for s in scene.surfaces if s.object == plant.number])
    low, high = points[:, 2].min(), points[:, 2].max()
    wood = [s.vertices[m] for s, m in zip(scene.surfaces, plant.wood, strict=True)]
    foot = np.concatenate(wood)
    foot = foot[foot[:, 2] < low + DRAWN_FOOT_HEIGHT_FRACTION * (high - low)]
    for k, part in enumerate(parts.catalogue):
        if part.object == plant.number or not CONSTITUTIVE_LAWS[field.materials[k].law].granular:
            continue
        ground = join_meshes(scene.surfaces).only(parts.part_of_point == k)
        if len(foot) and abs(_ground_height(ground, foot) - low) < DRAWN_FOOT_HEIGHT_FRACTION * (high - low):
            bottom = float(ground.corners[..., 2].min())
            return max(min(GUESSED_BURIED_DEPTH_RATIO * (high - low), MAX_FOOT_DEPTH_FRACTION * (low - bottom)), 0.0)
    return 0.0


def _ground_height(ground: Mesh, foot: Float[np.ndarray, "N 3"]) -> float:
    """Return how high the ground is about a foot, or below it if higher [m]; nan: there is none.

    Below it is a stump where the lowest end of a trunk was taken for ground.
    """
    middle = foot[:, :2].mean(axis=0)
    radius = np.linalg.norm(foot[:, :2] - middle, axis=1).max()
    turn = 2 * np.pi * np.arange(GROUND_DIRECTIONS_COUNT) / GROUND_DIRECTIONS_COUNT
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    top = float(ground.corners[..., 2].max()) + 0.1 * ground.extent
    shape, heights = QueryMesh(ground), []
    for reach in (0.25 * radius, 1.5 * radius):
        start = np.column_stack([middle + reach * around, np.full(GROUND_DIRECTIONS_COUNT, top)])
        fall = shape.reach(start, np.tile([0.0, 0.0, -1.0], (GROUND_DIRECTIONS_COUNT, 1)))
        fall = fall[np.isfinite(fall)]
        heights.append(top - float(np.median(fall)) if len(fall) > GROUND_DIRECTIONS_COUNT / 2 else np.nan)
    return max(heights) if np.isfinite(heights).all() else np.nan


def _extended_scene(scene: Scene, plant: _RootlessPlant, depth: float) -> Scene:
    """Draw the lowest end of a plant's wood downwards."""
    points = np.concatenate([s.vertices for s in scene.surfaces if s.object == plant.number])
    low, height = points[:, 2].min(), np.ptp(points[:, 2])
    surfaces = []
    for surface, mask in zip(scene.surfaces, plant.wood, strict=True):
        vertices = surface.vertices.copy()
        share = np.clip(
            (low + DRAWN_FOOT_HEIGHT_FRACTION * height - vertices[:, 2]) / (DRAWN_FOOT_HEIGHT_FRACTION * height), 0, 1
        )
        vertices[:, 2] -= depth * share * mask
        surfaces.append(replace(surface, vertices=vertices) if mask.any() else surface)
    return replace(scene, surfaces=tuple(surfaces))
