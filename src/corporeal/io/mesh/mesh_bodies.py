"""Conversion of bodies and scene data of a mesh file to a Scene."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import Any

import numpy as np

from corporeal.core.types import Scene, SceneObject, Vector, Wall
from corporeal.recognition.readable_names import everyday_words, safe_name, unique_names


def apply_body_statements(
    scene: Scene, owners: Sequence[str], bodies: Mapping[str, Mapping[str, Any]], turn: np.ndarray
) -> Scene:
    """Let objects have the names, masses, velocities and sizes that their bodies state.

    Args:
        scene: As the shapes alone give it, +Z up.
        owners: Path of the body of each object; other paths are shapes of no body.
        bodies: As ``mesh_raw.RawMesh`` has them.
        turn: Rotation from the axes of the file.
    """
    pairs = list(zip(scene.objects, owners, strict=True))
    named = [safe_name(str(bodies[p]["title"])) if p in bodies else o.name for o, p in pairs]
    names = unique_names([name or o.name for (o, _), name in zip(pairs, named, strict=True)])
    things = [
        _apply_body(replace(o, name=name), bodies[path], turn) if path in bodies else replace(o, name=name)
        for (o, path), name in zip(pairs, names, strict=True)
    ]
    loose = [name for (_, path), name in zip(pairs, names, strict=True) if path not in bodies]
    fixed = (f"{', '.join(loose)}: no rigid bodies in the file; they are movable here.",) if loose else ()
    return replace(scene, objects=tuple(things), warnings=(*scene.warnings, *fixed))


def apply_scene_statements(scene: Scene, stated: Mapping[str, Any]) -> Scene:
    """Take over gravity, walls, duration and the like from a file of ours."""
    walls = [_wall(row) for row in _rows(stated.get("walls"))]
    gravity = _vector(stated.get("gravity_m_s2"))
    return replace(
        scene,
        gravity=gravity or scene.gravity,
        walls=tuple(w for w in walls if w),
        duration=_positive(stated.get("duration_s")) or scene.duration,
        fps=int(_positive(stated.get("fps")) or scene.fps),
        settled=stated.get("settled") is True,
    )


def _apply_body(thing: SceneObject, body: Mapping[str, Any], turn: np.ndarray) -> SceneObject:
    stated = body["custom"]
    velocity = _vector(stated.get("velocity_m_s")) or _rotate_vector(body["velocity"], turn)
    extent = thing.real_extent
    real = _positive(stated.get("real_extent_m")) or extent
    return replace(
        thing,
        class_name=str(stated.get("class") or everyday_words(thing.name) or thing.class_name)[:60],
        real_extent=real,
        scale=_positive(stated.get("scale")) or extent / real,
        velocity=velocity,
        source=str(stated.get("source") or thing.source)[:500],
        credit=str(stated.get("credit") or "")[:500],
        sized_by=str(stated.get("sized_by") or "")[:500],
        mass=_positive(body["mass"]),
    )


def _rotate_vector(vector: Sequence[float], turn: np.ndarray) -> Vector:
    x, y, z = (float(v) for v in turn @ np.asarray(vector, dtype=float))
    return (x, y, z)


def _rows(stated: Any) -> list[Mapping[str, Any]]:
    """Return a list of mappings, which USD keeps as a mapping of numbers."""
    rows = list(stated.values()) if isinstance(stated, Mapping) else []
    return [row for row in rows if isinstance(row, Mapping)]


def _wall(stated: Mapping[str, Any]) -> Wall | None:
    normal, point = _vector(stated.get("normal")), _vector(stated.get("point_m"))
    return Wall(normal, point) if normal and point else None


def _vector(stated: Any) -> Vector | None:
    good = isinstance(stated, list | tuple) and len(stated) == 3 and all(map(_is_number, stated))
    return (float(stated[0]), float(stated[1]), float(stated[2])) if good else None


def _positive(stated: Any) -> float | None:
    return float(stated) if _is_number(stated) and stated > 0 else None


def _is_number(stated: Any) -> bool:
    return isinstance(stated, int | float) and not isinstance(stated, bool) and isfinite(stated)
