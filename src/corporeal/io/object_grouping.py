"""Grouping of a file's pieces into objects.

Pieces that touch are one object, as the legs and the seat of a chair are, unless their names say that each is an object
by itself, as a cup and its saucer are. Why so: decision objects-counting.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import igl
import numpy as np

from corporeal.core.types import Scene
from corporeal.geometry import box_placement
from corporeal.geometry.connected_components import connected_components
from corporeal.geometry.mesh import Mesh, join_meshes
from corporeal.geometry.point_sampling import sample_surface
from corporeal.geometry.scene_transforms import is_object_inside, object_boxes, surfaces_bounding_box
from corporeal.io.mesh.raw_mesh import MAX_PIECES
from corporeal.recognition.readable_names import everyday_words
from corporeal.recognition.typical_extents import class_name_words, typical_extent

TOUCH_GAP_FRACTION = 0.05
"""Pieces closer than this touch, over the longest side of the smaller: models have gaps where objects are glued, and
pieces that hang in the air are farther apart than that [-].
"""
SURFACE_SAMPLES_PER_PIECE = 1500
"""Points on a piece, beside its vertices, whose distances to another are measured."""
USUAL_PART_CLASSES = frozenset({"wheel", "tire", "drawer", "mirror", "key", "light bulb", "foam"})
"""Objects of the table of sizes that are usually found as parts of others."""


def group_pieces_into_objects(whole: Scene, pieces: Scene) -> Scene:
    """Return a file's scene with the objects that its pieces make.

    Args:
        whole: The file as one object.
        pieces: The same file with one object for every piece; surfaces in any order.
    """
    if not 1 < len(pieces.objects) <= MAX_PIECES:
        return whole
    group = _group_of_piece(pieces)
    return whole if not group.any() else _merge_groups(pieces, group)


def _group_of_piece(scene: Scene) -> np.ndarray:
    """Return the object of each piece, counted in the order of their first pieces."""
    boxes, count = object_boxes(scene), len(scene.objects)
    margins = TOUCH_GAP_FRACTION * np.ptp(boxes, axis=1).max(axis=1)
    grown = boxes + margins[:, None, None] * np.array([-1.0, 1.0])[:, None]
    things = _are_named_as_objects(scene)
    meshes = [join_meshes([s for s in scene.surfaces if s.object == k]) for k in range(count)]
    bound = [
        (a, b)
        for a, b in box_placement.overlapping_boxes(grown)
        if _are_touching(meshes[a], meshes[b], min(margins[a], margins[b]))
        and not (things[a] and things[b] and not (is_object_inside(scene, a, b) or is_object_inside(scene, b, a)))
    ]
    rows, columns = np.array(bound, dtype=int).reshape(-1, 2).T
    return connected_components(rows, columns, count)


def _are_touching(a: Mesh, b: Mesh, margin: float) -> bool:
    """Return whether two pieces come closer than a margin [m] to each other."""
    return bool(_surface_gap(a, b) < margin or _surface_gap(b, a) < margin)


def _surface_gap(a: Mesh, b: Mesh) -> float:
    """Return the distance from points of ``a`` to the surface of ``b`` [m]."""
    spread = sample_surface(a, SURFACE_SAMPLES_PER_PIECE, np.random.default_rng(0))[0]
    corners = a.vertices[:: max(1, len(a.vertices) // SURFACE_SAMPLES_PER_PIECE)]
    squared = igl.point_mesh_squared_distance(np.concatenate([corners, spread]), b.vertices, b.triangles)[0]
    return float(np.sqrt(np.min(squared)))


def _are_named_as_objects(scene: Scene) -> list[bool]:
    """Tell of each piece whether its name says that it is an object by itself.

    It does where its noun is a known object and not that of the whole: "cup" in tea_set.glb, but not "lamp glass" in a
    file called lamp, nor where all others are of a lamp, too.
    """
    whole = _whole_words(scene)
    return [_is_named_as_object(o.class_name, whole) for o in scene.objects]


def _is_named_as_object(name: str, whole: frozenset[str]) -> bool:
    known, words = typical_extent(name), class_name_words(name)
    if known is None or known.part or known.words in USUAL_PART_CLASSES or whole & set(words):
        return False
    return words[-1] in known.words.split()  # the lid of a teapot is none


def _whole_words(scene: Scene) -> frozenset[str]:
    """Return the known objects that the file's name or all its pieces' names speak of.

    A file called "bricks", or pieces that differ by their numbers alone, speak of several objects of one kind and not
    of a whole.
    """
    stem = everyday_words(Path(scene.source).stem)
    said = {w for w in re.findall(r"[^\W\d_]+", stem.lower()) if w in class_name_words(w)}
    named = [frozenset(class_name_words(o.class_name)) for o in scene.objects]
    common = frozenset.intersection(*named) if len(set(named)) > 1 else frozenset()
    return frozenset(w for w in said | common if typical_extent(w))


def _merge_groups(scene: Scene, group: np.ndarray) -> Scene:
    """Return the scene with one object for each group, called as the largest of its pieces."""
    volume = np.ptp(object_boxes(scene), axis=1).prod(axis=1)
    things = []
    for k in range(group.max() + 1):
        mine = np.flatnonzero(group == k)
        largest = scene.objects[max(mine, key=lambda n: volume[n])]
        box = surfaces_bounding_box([s for s in scene.surfaces if group[s.object] == k])
        things.append(replace(largest, real_extent=float(np.ptp(box, axis=0).max())))
    surfaces = (replace(s, object=int(group[s.object])) for s in scene.surfaces)
    ordered = sorted(surfaces, key=lambda s: s.object)
    hint = _grouping_note([o.name for o in things], Path(scene.source).name)
    return replace(scene, objects=tuple(things), surfaces=tuple(ordered), hints=(hint,))


def _grouping_note(names: Sequence[str], file: str) -> str:
    shown = ", ".join(names[:4]) + (", …" if len(names) > 4 else "")
    return (
        f"{file} was split into {len(names)} objects ({shown}), because they do not touch or are "
        "named as different objects. --objects one keeps the file together."
    )
