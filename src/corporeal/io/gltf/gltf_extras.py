"""``extras`` of glTF files: class and size, and motion in files written here."""

import math
from itertools import pairwise

from corporeal.core.types import GRAVITY_VECTOR, Keyframes, Push, SceneObject, Wind
from corporeal.io.gltf.glb_writer import GLB_GENERATOR
from corporeal.io.gltf.gltf_credits import Credit, credit_of_document
from corporeal.io.gltf.gltf_document import GltfDocument, GltfEntry
from corporeal.recognition.readable_names import everyday_words, safe_name

NO_MOTION = (0.0, 0.0, 0.0)
MIN_SCALE_RATIO = 1e-6
"""Scales beyond it, and beyond its inverse, are slips."""


def is_own_file(document: GltfDocument) -> bool:
    """Return whether the extras mean what our writer means by them."""
    asset = document.root.child("asset")
    return asset is not None and asset.text("generator") == GLB_GENERATOR


def scene_from_extras(document: GltfDocument, root: GltfEntry) -> dict:
    """Return scene data of a file written here; empty for other files."""
    if not is_own_file(document) or not isinstance(root.value.get("extras"), dict):
        return {}
    extras = root.needed("extras")
    return {
        "gravity": extras.numbers("gravity_m_s2", GRAVITY_VECTOR),
        "duration": extras.number("duration_s", 2.0),
        "fps": extras.whole("fps", 60, most=1000) or 60,
        "settled": extras.flag("settled"),
    }


def object_from_extras(document: GltfDocument, head: GltfEntry | None, extent: float) -> SceneObject:
    """Return an object as its node describes it; ``head`` None: the whole file is the object.

    A name stays empty where the file gives none of use; the extent is the mesh's own [m].
    """
    extras = _extras(document, head)
    ours = is_own_file(document)
    # A file of ours states the credit of each object; its copyright sums up all of them.
    whole = "" if ours else credit_of_document(document).words
    real = _real_extent(extras) or extent
    return SceneObject(
        name=safe_name(head.text("name")) if head and extras.text("class") else "",
        class_name=_class_name(document, head, extras),
        real_extent=real,
        scale=_scale(extras, extent / real if extent > 0 else 1.0, ours),
        velocity=_vector(extras.numbers("velocity_m_s", NO_MOTION)) if ours else NO_MOTION,
        push=_push(extras) if ours else None,
        wind=_wind(extras) if ours else None,
        path=_path(extras) if ours else None,
        source=extras.text("source") or str(document.path),
        credit=(object_credit(extras.value) or whole)[:500],
        sized_by=extras.text("sized_by")[:500] if ours else "",
    )


def object_credit(extras: dict) -> str:
    """Return whom to thank for an object, and under which licence it may be used, if it says so."""
    whole, *fields = (
        x if isinstance(x := extras.get(key), str) else "" for key in ("credit", "licence", "attribution")
    )
    return whole or Credit(*fields).words


def _extras(document: GltfDocument, head: GltfEntry | None) -> GltfEntry:
    if head is not None and isinstance(head.value.get("extras"), dict):
        return head.needed("extras")
    return GltfEntry(document, {}, head.pointer if head else "")


def _class_name(document: GltfDocument, head: GltfEntry | None, extras: GltfEntry) -> str:
    name = " ".join(extras.text("class").split())[:60]
    if name:
        return name
    stem = everyday_words(document.path.stem)
    if head is None:
        return stem or _first_word(document) or "object"
    return everyday_words(head.text("name")) or _mesh_word(head) or stem or "object"


def _mesh_word(node: GltfEntry) -> str:
    mesh = node.refer("mesh", "meshes")
    return everyday_words(mesh.text("name")) if mesh else ""


def _first_word(document: GltfDocument) -> str:
    """Return the first everyday word among nodes and meshes, for a file called scene.glb."""
    for group in ("nodes", "meshes"):
        for entry in document.entries(group):
            if everyday_words(entry.text("name")):
                return everyday_words(entry.text("name"))
    return ""


def _real_extent(extras: GltfEntry) -> float | None:
    """Return the largest stated extent [m]; a nonsensical one counts as not stated."""
    stated = extras.value.get("real_extent_m")
    values = stated if isinstance(stated, list) else [stated]
    numbers = [x for x in values if isinstance(x, int | float) and not isinstance(x, bool)]
    good = [float(x) for x in numbers if 0 < x < 1e6]
    return max(good) if good and len(good) == len(values) else None


def _scale(extras: GltfEntry, measured: float, ours: bool) -> float:
    """Return scene size over real size; a nonsensical one counts as not stated."""
    stated = extras.number("scale", measured) if ours else measured
    return stated if MIN_SCALE_RATIO <= stated <= 1 / MIN_SCALE_RATIO else measured


def _push(extras: GltfEntry) -> Push | None:
    push = extras.child("push")
    if push is None:
        return None
    acceleration = _vector(push.numbers("acceleration_m_s2", NO_MOTION))
    return Push(acceleration, *_window(push))


def _wind(extras: GltfEntry) -> Wind | None:
    wind = extras.child("wind")
    if wind is None:
        return None
    velocity = _vector(wind.numbers("velocity_m_s", NO_MOTION))
    return Wind(velocity, wind.number("gust", 0.0), *_window(wind))


def _path(extras: GltfEntry) -> Keyframes | None:
    path = extras.child("path")
    if path is None:
        return None
    time = path.numbers("time_s", (0.0,) * len(path.sequence("time_s")))
    columns = [path.numbers(key, (0.0,) * (3 * len(time))) for key in ("shift_m", "turn_rad")]
    if not time or any(b <= a for a, b in pairwise(time)):
        path.fail("'time_s' does not rise.")
    shift, turn = (tuple(_vector(c[k : k + 3]) for k in range(0, len(c), 3)) for c in columns)
    return Keyframes(time, shift, turn)


def _window(force: GltfEntry) -> tuple[float, float]:
    endless = force.value.get("end_s") is None
    return force.number("start_s", 0.0), math.inf if endless else force.number("end_s", 0.0)


def _vector(numbers: tuple[float, ...]) -> tuple[float, float, float]:
    x, y, z = numbers
    return (x, y, z)
