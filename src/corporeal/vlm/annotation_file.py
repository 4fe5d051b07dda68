"""Annotations of a scene's parts in a YAML file; they override every other answer."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any

import yaml

from corporeal.core.errors import BadFileError
from corporeal.core.types import PartDescription
from corporeal.recognition.stated_properties import MAX_INFLATION_PA, SEALABLE_STRUCTURES

ANNOTATION_KEYS = ("material", "structure", "thickness_mm", "contents", "fill", "solidity", "inflation_kPa", "values")
ANNOTATION_STRUCTURES = ("solid", "shell", "sheet", "hollow", "filled", "packed")
ANNOTATION_EXAMPLE = "For example: 'duck_0: soft_PVC', or 'duck_0: { material: soft_PVC, thickness_mm: 2 }'."


@dataclass(frozen=True)
class PartAnnotation:
    """Annotation of one part."""

    material: str | None = None
    structure: str | None = None
    """One of ``ANNOTATION_STRUCTURES``."""
    thickness: float | None = None
    """[m]"""
    contents: str | None = None
    """Contents behind the wall."""
    fill: float | None = None
    """Share of the cavity that the contents fill, above 0 and up to 1."""
    inflation: float | None = None
    """Gauge pressure of the air sealed behind the wall [Pa]."""
    solidity: float | None = None
    """Of what is packed: share of its shape that is material, above 0 and up to 1."""
    values: dict[str, float] = field(default_factory=dict)
    """Spelt as in the library, unit in the key: ``{"young_MPa": 5}``."""


def read_annotations(
    path: Path, scene: Mapping[str, Sequence[str]], free: Collection[str] = ()
) -> dict[tuple[str, str], PartAnnotation]:
    """Read the file and check it against the scene.

    Args:
        path: The YAML file.
        scene: Every object's name with its parts' names.
        free: Objects whose parts are not segmented yet: the file may name them.

    Returns:
        (object, part) → its annotation. That of an object holds for all its parts that are not named themselves.

    Raises:
        BadFileError: The file is not such a file, or names an object or part that does not exist.
    """
    annotations: dict[tuple[str, str], PartAnnotation] = {}
    for name, given in read_annotation_mapping(path).items():
        if name not in scene:
            raise _unknown(path, "object", name, scene)
        parts = given.pop("parts", {}) if isinstance(given, dict) else {}
        if not isinstance(parts, dict):
            raise BadFileError(path, f"'parts' of {name!r} must map part names.", ANNOTATION_EXAMPLE)
        parts = {str(part): answer for part, answer in parts.items()}
        for part in parts:
            if part not in scene[name] and name not in free:
                raise _unknown(path, f"part of {name!r}", part, scene[name])
        if given:
            annotations |= {(name, part): _annotation(path, name, given) for part in scene[name]}
        annotations |= {(name, p): _annotation(path, f"{name}: {p}", a) for p, a in parts.items()}
    return annotations


def read_annotation_mapping(path: Path) -> dict:
    """Read the annotations of each object, without validation.

    Raises:
        BadFileError: It cannot be read, or is not such a mapping.
    """
    try:
        parsed = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise BadFileError(path, f"cannot be read ({error}).") from error
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        first = (str(error) or "nested too deep").splitlines()[0]
        raise BadFileError(path, f"is not YAML ({first}).", ANNOTATION_EXAMPLE) from error
    if not isinstance(parsed, dict):
        raise BadFileError(path, "must map object names to what they are made of.", ANNOTATION_EXAMPLE)
    return {str(name): value for name, value in parsed.items()}


def _annotation(path: Path, where: str, given: Any) -> PartAnnotation:
    if isinstance(given, str):
        return PartAnnotation(material=given)
    if not isinstance(given, dict):
        raise BadFileError(path, f"{where}: must be a material's name or a mapping.", ANNOTATION_EXAMPLE)
    strange = [k for k in given if k not in ANNOTATION_KEYS]
    if strange:
        raise BadFileError(path, f"{where}: unknown key {strange[0]!r}.", f"Keys: {_list(ANNOTATION_KEYS)}.")
    structure = given.get("structure")
    if structure not in (None, *ANNOTATION_STRUCTURES):
        options = f"Choose one of: {', '.join(ANNOTATION_STRUCTURES)}."
        raise BadFileError(path, f"{where}: structure is {structure!r}.", options)
    for key in ("material", "contents"):
        if given.get(key) is not None and not isinstance(given[key], str):
            raise BadFileError(path, f"{where}: {key} must be a name, not {given[key]!r}.", ANNOTATION_EXAMPLE)
    thickness = _thickness(path, where, given.get("thickness_mm"))
    return PartAnnotation(
        material=given.get("material"),
        structure=structure,
        thickness=thickness,
        contents=given.get("contents"),
        fill=_share(path, where, "fill", given.get("fill")),
        solidity=_share(path, where, "solidity", given.get("solidity")),
        inflation=_inflation(path, where, given),
        values=_values(path, where, given.get("values")),
    )


def _thickness(path: Path, where: str, given: Any) -> float | None:
    if given is None:
        return None
    thickness = _number(path, f"{where}: thickness_mm", given) * 1e-3
    if thickness <= 0:
        raise BadFileError(path, f"{where}: thickness_mm must be above 0.")
    return thickness


def _share(path: Path, where: str, what: str, given: Any) -> float | None:
    if given is None:
        return None
    share = _number(path, f"{where}: {what}", given)
    if not 0 < share <= 1:
        raise BadFileError(path, f"{where}: {what} is a share: above 0 and up to 1, not {given!r}.")
    return share


def _inflation(path: Path, where: str, given: dict) -> float | None:
    if given.get("inflation_kPa") is None:
        return None
    pressure = _number(path, f"{where}: inflation_kPa", given["inflation_kPa"])
    if not 0 <= 1e3 * pressure <= MAX_INFLATION_PA:
        raise BadFileError(
            path,
            f"{where}: inflation_kPa is {pressure:g}.",
            f"Give the gauge pressure, from 0 (sealed) to {1e-3 * MAX_INFLATION_PA:g} kPa.",
        )
    if (given.get("structure") or "shell") not in SEALABLE_STRUCTURES or given.get("contents"):
        raise BadFileError(
            path,
            f"{where}: what is inflated is a wall with air behind it.",
            "Say structure: shell and no contents, or leave inflation_kPa out.",
        )
    return 1e3 * pressure


def _values(path: Path, where: str, given: Any) -> dict[str, float]:
    if given is None:
        return {}
    if not isinstance(given, dict):
        raise BadFileError(path, f"{where}: 'values' must map, such as {{ young_MPa: 5 }}.")
    return {str(k): _number(path, f"{where}: {k}", v) for k, v in given.items()}


def _number(path: Path, where: str, given: Any) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float) or not isfinite(given):
        raise BadFileError(path, f"{where} must be a number, not {given!r}.")
    return float(given)


def _unknown(path: Path, kind: str, name: object, real: object) -> BadFileError:
    return BadFileError(path, f"there is no {kind} called {name!r}.", f"There are: {_list(real)}.")


def _list(names: Any) -> str:
    return ", ".join(str(n) for n in names)


def apply_structure_annotation(annotation: PartAnnotation, words: PartDescription) -> PartDescription:
    """Apply the annotated structure of a part."""
    walled = annotation.thickness is not None or annotation.inflation is not None
    wall = "sheet" if words.structure == "sheet" and annotation.inflation is None else "shell"
    packed = "packed" if annotation.solidity else wall if walled else None
    implied = "filled" if annotation.contents else packed
    structure = annotation.structure or implied
    if structure is None:
        return words
    words = replace(words, built_by="annotation")
    if structure in ("solid", "packed"):
        bare = replace(words, structure=structure, thickness=None, contents=None, fill=None)
        solidity = annotation.solidity if structure == "packed" else None
        return replace(bare, solidity=solidity, inflation=None)
    words = replace(
        words,
        structure=structure,
        thickness=annotation.thickness or words.thickness,
        wall_usual=words.wall_usual and annotation.thickness is None,
    )
    pressure = words.inflation if annotation.inflation is None else annotation.inflation
    words = replace(words, inflation=pressure if structure in SEALABLE_STRUCTURES else None)
    if structure != "filled":
        return replace(words, contents=None, fill=None)
    return replace(words, contents=annotation.contents or words.contents, fill=annotation.fill or words.fill)


def annotated_pieces(
    annotations: Mapping[tuple[str, str], PartAnnotation], thing: str, parts: Sequence[str]
) -> list[PartDescription]:
    """Return annotated pieces of an object that are not segmented yet.

    Until they are found on its surface each has an equal share.
    """
    names = [part for name, part in annotations if name == thing and part not in parts]
    share = 1 / len(names) if names else 0.0
    return [PartDescription(name, None, volume_share=share, surface_share=share) for name in names]
