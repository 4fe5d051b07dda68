"""Pictures of one object for recognition of its materials."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from corporeal.core.process_resources import usable_cores
from corporeal.core.types import Scene, Vector
from corporeal.geometry.scene_transforms import move_scene, surfaces_bounding_box
from corporeal.render.camera_placement import CameraAim, fit_camera
from corporeal.render.embree import identify_triangles, render_image
from corporeal.render.ray_scene import RayScene, StudioLight

DIRECTION_COUNT = 8
"""Even set of views about the vertical, alternately low and high."""
ELEVATION_TANGENTS = (0.25, 0.85)
"""Tangent of the two angles above the horizon."""
PICTURE_FILL_FRACTION = 0.9
PART_COLOURS: dict[str, Vector] = {
    # name → linear RGB: far apart, and words that everybody has
    "red": (0.80, 0.03, 0.03),
    "blue": (0.03, 0.10, 0.80),
    "yellow": (0.85, 0.65, 0.02),
    "green": (0.03, 0.45, 0.06),
    "magenta": (0.70, 0.04, 0.55),
    "cyan": (0.03, 0.60, 0.65),
    "orange": (0.85, 0.25, 0.02),
    "white": (0.85, 0.85, 0.85),
    "black": (0.02, 0.02, 0.02),
    "brown": (0.20, 0.09, 0.03),
    "pink": (0.90, 0.40, 0.50),
    "grey": (0.22, 0.22, 0.22),
}


@dataclass(frozen=True)
class PortraitOptions:
    """How an object is to be pictured."""

    count: int = 4
    """Views, out of the even set."""
    size: int = 512
    """Height and width [px]."""
    seed: int = 0
    """Chooses the views."""

    @property
    def words(self) -> str:
        """Describe in words how the pictures are taken."""
        return f"{self.count} of {DIRECTION_COUNT} views, {self.size} px, seed {self.seed}"


def part_colour_names(parts: int) -> list[str]:
    """Name a colour for each part, in order; parts beyond the last colour share it."""
    names = list(PART_COLOURS)
    return [names[min(k, len(names) - 1)] for k in range(parts)]


def render_portraits(
    scene: Scene, part_of_surface: list[int | None], portrait: PortraitOptions
) -> tuple[np.ndarray, ...]:
    """Picture an object alone from several sides, and once more with each part in its colour.

    Args:
        scene: Holds the object.
        part_of_surface: For each surface of the scene, which of the object's parts it is, counted from 0; None: it
            belongs to another object.
        portrait: How many views, how large.

    Returns:
        (size, size, 3) uint8 each. The coloured picture comes last, where there are several parts.
    """
    stage, box, parts = _isolated_object(scene, part_of_surface)
    size = (portrait.size, portrait.size)
    cameras = [fit_camera(box[None, None], size, view, PICTURE_FILL_FRACTION) for view in _directions(portrait)]
    # One thread a picture: the bands that several share would leave their number in the bytes, by which answers are
    # cached.
    with ThreadPoolExecutor(usable_cores()) as pool:
        pictures = list(pool.map(lambda camera: render_image(stage, camera, "draft", 1), cameras))
    if parts.max(initial=0) > 0:
        colours = np.array([PART_COLOURS[c] for c in part_colour_names(1 + int(parts.max()))])
        painted = stage.painted(colours.astype(np.float32), parts, StudioLight())
        pictures.append(render_image(painted, max(cameras, key=lambda c: _visible_parts(stage, c, parts)), "draft", 1))
    return tuple(pictures)


def _visible_parts(stage: RayScene, camera: CameraAim, parts: np.ndarray) -> tuple[int, float]:
    """How many parts a camera sees, and the share of the object that the least of them takes."""
    seen, _ = identify_triangles(stage, camera)
    share = np.bincount(parts[seen[seen >= 0]], minlength=int(parts.max()) + 1)
    return int((share > 0).sum()), float(share.min() / max(share.sum(), 1))


def _isolated_object(scene: Scene, part_of_surface: list[int | None]) -> tuple[RayScene, np.ndarray, np.ndarray]:
    """Stand the object on the floor by itself: stage, box (2, 3) [m], part of each triangle."""
    kept = [k for k, part in enumerate(part_of_surface) if part is not None]
    worn = sorted({scene.surfaces[k].finish for k in kept})  # textures of others cost seconds
    surfaces = tuple(replace(scene.surfaces[k], finish=worn.index(scene.surfaces[k].finish)) for k in kept)
    finishes = tuple(scene.finishes[f] for f in worn)
    box = surfaces_bounding_box(surfaces)
    foot = np.array([*box.mean(axis=0)[:2], box[0, 2]])
    alone = move_scene(replace(scene, surfaces=surfaces, finishes=finishes), -foot)
    parts = np.repeat(np.array([part_of_surface[k] for k in kept], dtype=int), [len(s.triangles) for s in surfaces])
    return RayScene(alone), box - foot, parts


def _directions(portrait: PortraitOptions) -> list[Vector]:
    """Choose views from the even set, in order round the object."""
    random = np.random.default_rng(portrait.seed)
    chosen = sorted(random.permutation(DIRECTION_COUNT)[: portrait.count].tolist())
    angles = [2 * np.pi * k / DIRECTION_COUNT for k in chosen]
    heights = [ELEVATION_TANGENTS[k % 2] for k in chosen]
    return [(float(np.cos(a)), float(np.sin(a)), h) for a, h in zip(angles, heights, strict=True)]
