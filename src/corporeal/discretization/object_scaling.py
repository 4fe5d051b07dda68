"""Relative scaling of objects in a scene, walls included.

A duck beside a couch is a dot. A power law between 0 (all of one size) and 1 (true relative sizes) brings objects
nearer to each other and keeps their order. An object that is not life-size is the real one with all its lengths scaled,
walls included: made of the same material, it weighs scale³ times as much.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal.core.errors import UserError
from corporeal.core.types import (
    Material,
    MaterialField,
    PartComponent,
    PartDescription,
    Parts,
    Scene,
    SceneObject,
    Structure,
)

LIFE_SIZE_TOLERANCE = 5e-3
"""Difference of a scale from 1 that need not be reported: files round their extents."""


@dataclass(frozen=True)
class SceneSizing:
    """How real sizes become sizes in a scene."""

    gamma: float = 0.35
    """Exponent of relative sizes: 0 makes all objects equally large, 1 keeps true proportions."""
    metric: bool = False
    """Keep true metres; gamma, working extent and fraction then say nothing."""
    working_extent: float = 1.0
    """L: how large the scene is to be [m]."""
    fraction: float = 0.5
    """f: share of it that the largest object takes up [-]."""


DEFAULT_SCENE_SIZING = SceneSizing()


def scene_extents(real: Sequence[float], sizing: SceneSizing = DEFAULT_SCENE_SIZING) -> Float[np.ndarray, " N"]:
    """Return the largest extent of each of N objects in their scene [m].

    e_i = s_i^γ / max_j s_j^γ · f L

    Args:
        real: Largest extent s_i of each real object [m].
        sizing: γ, L and f, or true metres.

    Raises:
        UserError: γ, L or f cannot be used, or a real extent is no length.
    """
    _check_sizing(sizing)
    sizes = np.asarray(real, dtype=np.float64)
    if not len(sizes) or not (np.isfinite(sizes) & (sizes > 0)).all():
        raise UserError(f"The real extents are {list(real)}. Each must be a length above 0 m.")
    if sizing.metric:
        return sizes
    return (sizes / sizes.max()) ** sizing.gamma * (sizing.fraction * sizing.working_extent)


def _check_sizing(sizing: SceneSizing) -> None:
    for name, value, low, high in (
        ("gamma", sizing.gamma, 0.0, 1.0),
        ("working extent", sizing.working_extent, 1e-3, 1e3),
        ("fraction", sizing.fraction, 1e-2, 1.0),
    ):
        if not low <= value <= high:
            raise UserError(f"The {name} is {value}. Give a number from {low:g} to {high:g}.")


def parse_extent(text: str, only: str = "") -> tuple[str, float]:
    """Return name and metres of "duck=0.1", or of "0.1" where there is only one object.

    Args:
        text: Value of --extent.
        only: Name of the only object there is; "": there are several.

    Raises:
        UserError: The format is invalid.
    """
    name, _, number = text.rpartition("=")
    try:
        metres = float(number)
    except ValueError:
        metres = math.nan
    name = name or only
    if not name or not 1e-4 <= metres <= 1000:
        raise UserError(f"--extent {text!r}: write NAME=METRES, for example duck=0.1.")
    return name, metres


def part_scales(scene: Scene, parts: Parts) -> tuple[float, ...]:
    """Return scene size over real size of each part's object."""
    return tuple(scene.objects[part.object].scale for part in parts.catalogue)


def is_not_life_size(scale: float) -> bool:
    """Return whether an object is noticeably not life-size."""
    return abs(scale - 1) > LIFE_SIZE_TOLERANCE


def describe_scales(objects: Sequence[SceneObject]) -> str:
    """Say in a sentence or two what is not life-size, and what follows; "" where all is."""
    odd = [own for own in objects if is_not_life_size(own.scale)]
    if not odd:
        return ""
    sizes = "; ".join(
        f"{o.name.replace('_', ' ')} at {o.scale:.3g} times its real {_centimetres_text(o.real_extent)}"
        + (f" ({o.sized_by})" if o.sized_by else "")
        for o in odd
    )
    return (
        f"Not life-size: {sizes}. Walls are scaled with their object; lengths, masses and all that "
        "follows from them are those of the scene, and the real masses stand in brackets."
    )


def describe_mass(mass: float, scale: float) -> str:
    """Write a mass in the scene [kg], and in brackets that of the real object where it differs."""
    return f"{mass:.3g} ({mass / scale**3:.3g} in reality)" if is_not_life_size(scale) else f"{mass:.3g}"


def _centimetres_text(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 else f"{100 * metres:.3g} cm"


def field_in_scene_scale(field: MaterialField, scales: Sequence[float]) -> MaterialField:
    """Return what parts are made of with their walls as thick as in the scene.

    Lengths that were stated or looked up are real ones; in the scene they are scaled with the rest.
    """
    if all(scale == 1 for scale in scales):
        return field
    rows = zip(field.materials, field.structures, field.words, scales, strict=True)
    made = [_scaled_spec(*row) for row in rows]
    shared = zip(field.pieces, scales, strict=True) if field.pieces else ()
    return replace(
        field,
        materials=tuple(m for m, _, _ in made),
        structures=tuple(s for _, s, _ in made),
        words=tuple(w for _, _, w in made),
        pieces=tuple(tuple(_scaled_piece(p, k) for p in pieces) for pieces, k in shared),
    )


def _scaled_piece(piece: PartComponent, scale: float) -> PartComponent:
    material, structure, words = _scaled_spec(piece.material, piece.structure, piece.words, scale)
    return PartComponent(words, material, structure)


def _scaled_spec(
    material: Material, structure: Structure, words: PartDescription, scale: float
) -> tuple[Material, Structure, PartDescription]:
    return (
        replace(material, shell_thickness=_scaled_length(material.shell_thickness, scale)),
        replace(structure, thickness=_scaled_length(structure.thickness, scale)),
        replace(words, thickness=_scaled_length(words.thickness, scale)),
    )


def _scaled_length(length: float | None, scale: float) -> float | None:
    return None if length is None else length * scale
