"""Boxes, transforms and overlaps of the objects of a scene."""

from collections.abc import Sequence
from dataclasses import replace

import igl
import numpy as np
from jaxtyping import Float

from corporeal.core.types import Scene, SceneObject, Surface, Vector
from corporeal.geometry import box_placement
from corporeal.geometry.mesh import join_meshes

OVERLAP_SAMPLES_COUNT = 2000
"""Vertices of an object, and places on its triangles, that are looked up in another."""
MAX_TOUCHING_FRACTION = 0.01
"""Share of them that may lie inside before the two are taken to overlap."""
MAX_SINK_DEPTH_FRACTION = 2e-3
"""What rests on another may sink in so far, over the size of the smaller."""


def surfaces_bounding_box(surfaces: Sequence[Surface]) -> Float[np.ndarray, "2 3"]:
    """Return the low and the high corner [m]."""
    low = np.min([s.vertices.min(axis=0) for s in surfaces], axis=0)
    return np.stack([low, np.max([s.vertices.max(axis=0) for s in surfaces], axis=0)])


def object_boxes(scene: Scene) -> Float[np.ndarray, "N 2 3"]:
    """Return the box of every object [m]."""
    return np.stack([surfaces_bounding_box(_surfaces_of_object(scene, k)) for k in range(len(scene.objects))])


def underside_centre(scene: Scene, k: int) -> Vector:
    """Middle of the underside of an object's box [m]."""
    low, high = surfaces_bounding_box(_surfaces_of_object(scene, k))
    x, y = (low + high)[:2] / 2
    return (float(x), float(y), float(low[2]))


def move_scene(scene: Scene, shift: Vector | Float[np.ndarray, "3"], k: int | None = None) -> Scene:
    """Return the scene with object ``k``, or with everything, shifted [m]."""
    return _reshape_object(scene, k, lambda x: x + np.asarray(shift))


def resize_object(scene: Scene, k: int, extent: float) -> Scene:
    """Scale one object about the middle of its underside to its real extent [m]."""
    low, high = surfaces_bounding_box(_surfaces_of_object(scene, k))
    foot = np.array(underside_centre(scene, k))
    factor = extent / max(float((high - low).max()), 1e-12)
    thing = replace(scene.objects[k], real_extent=extent, scale=1.0)
    scene = replace(scene, objects=(*scene.objects[:k], thing, *scene.objects[k + 1 :]))
    return _reshape_object(scene, k, lambda x: foot + (x - foot) * factor)


def convert_scene_unit(scene: Scene, metres: float) -> Scene:
    """Return a scene whose file is in another unit: all lengths, real ones too, times ``metres``.

    About the origin; objects keep their arrangement.
    """
    things = (replace(o, real_extent=o.real_extent * metres) for o in scene.objects)
    scene = replace(scene, objects=tuple(things), metres_per_unit=scene.metres_per_unit * metres)
    return _reshape_object(scene, None, lambda x: x * metres)


def scale_scene(scene: Scene, factor: float) -> Scene:
    """Scale everything about the origin, which lies on the floor; real extents stay real."""
    scene = replace(
        scene,
        metres_per_unit=scene.metres_per_unit * factor,
        objects=tuple(_enlarge_object(o, factor) for o in scene.objects),
        walls=tuple(replace(w, point=_scale_point(w.point, factor)) for w in scene.walls),
    )
    return _reshape_object(scene, None, lambda x: x * factor)


def scale_to_life_size(scene: Scene) -> Scene:
    """Return the scene with each object at its real size, about the middle of its underside."""
    for k, thing in enumerate(scene.objects):
        if thing.scale != 1:
            foot = np.array(underside_centre(scene, k))
            scene = _reshape_object(scene, k, lambda x, foot=foot, thing=thing: foot + (x - foot) / thing.scale)
    return replace(scene, objects=tuple(replace(o, scale=1.0) for o in scene.objects))


def _enlarge_object(thing: SceneObject, factor: float) -> SceneObject:
    path = thing.path
    if path is not None:
        path = replace(path, shift=tuple(_scale_point(shift, factor) for shift in path.shift))
    return replace(thing, scale=thing.scale * factor, path=path)


def _scale_point(point: Vector, factor: float) -> Vector:
    x, y, z = point
    return (x * factor, y * factor, z * factor)


def overlapping_objects(scene: Scene) -> list[tuple[int, int]]:
    """Return the pairs of objects of which one holds parts of the other's surface.

    Vertices alone do not tell: of two bars that cross, none lies in the other.
    """
    pairs = box_placement.overlapping_boxes(object_boxes(scene))
    return [(a, b) for a, b in pairs if _surface_reaches_into(scene, a, b) or _surface_reaches_into(scene, b, a)]


def is_object_inside(scene: Scene, a: int, b: int) -> bool:
    """Return whether vertices of ``a`` lie within ``b``, deeper than what merely touches."""
    points = np.concatenate([s.vertices for s in _surfaces_of_object(scene, a)])
    return _points_within(points[:: max(1, len(points) // OVERLAP_SAMPLES_COUNT)], scene, a, b)


def _surface_reaches_into(scene: Scene, a: int, b: int) -> bool:
    """Return whether vertices of ``a``, or places on its triangles, lie within ``b``."""
    return is_object_inside(scene, a, b) or _points_within(
        _points_on_triangles(_surfaces_of_object(scene, a)), scene, a, b
    )


def _points_within(points: Float[np.ndarray, "N 3"], scene: Scene, a: int, b: int) -> bool:
    """Return whether some of the points of ``a`` lie within ``b``, whichever way its faces look."""
    winding, depth = np.zeros(len(points)), np.full(len(points), np.inf)
    for s in _surfaces_of_object(scene, b):
        winding += np.asarray(igl.fast_winding_number(s.vertices, s.triangles, points), float)
    held = np.abs(winding) > 0.5
    if held.mean() <= MAX_TOUCHING_FRACTION:
        return False
    for s in _surfaces_of_object(scene, b):
        squared = igl.point_mesh_squared_distance(points[held], s.vertices, s.triangles)[0]
        depth[held] = np.minimum(depth[held], np.sqrt(squared))
    sizes = [float(np.ptp(surfaces_bounding_box(_surfaces_of_object(scene, k)), axis=0).max()) for k in (a, b)]
    return bool(np.mean(held & (depth > MAX_SINK_DEPTH_FRACTION * min(sizes))) > MAX_TOUCHING_FRACTION)


def _points_on_triangles(surfaces: Sequence[Surface]) -> Float[np.ndarray, "N 3"]:
    """Return places all over some triangles, as many on each as its area asks for."""
    # It brings Numba, which assembling needs only where boxes of objects overlap.
    from corporeal.geometry.point_sampling import sample_surface

    return sample_surface(join_meshes(surfaces), OVERLAP_SAMPLES_COUNT, np.random.default_rng(0))[0]


def _surfaces_of_object(scene: Scene, k: int) -> list[Surface]:
    return [s for s in scene.surfaces if s.object == k]


def _reshape_object(scene: Scene, k: int | None, change) -> Scene:
    return replace(
        scene,
        surfaces=tuple(replace(s, vertices=change(s.vertices)) if k in (None, s.object) else s for s in scene.surfaces),
    )
