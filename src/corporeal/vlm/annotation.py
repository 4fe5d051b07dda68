"""What a person says about a scene's parts, in a YAML file. It is believed before anybody else."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Any

import yaml

from corporeal.errors import BadFileError
from corporeal.types import PartWords
from corporeal.vlm.metadata import HIGHEST_INFLATION, SEALABLE

KEYS = (
    "material",
    "structure",
    "thickness_mm",
    "contents",
    "fill",
    "solidity",
    "inflation_kPa",
    "values",
)
BUILDS = ("solid", "shell", "sheet", "hollow", "filled", "packed")
EXAMPLE = "For example: 'duck_0: soft_PVC', or 'duck_0: { material: soft_PVC, thickness_mm: 2 }'."


@dataclass(frozen=True)
class Annotation:
    """What is said of one part."""

    material: str | None = None
    structure: str | None = None
    """One of ``BUILDS``."""
    thickness: float | None = None
    """[m]"""
    contents: str | None = None
    """What is behind the wall."""
    fill: float | None = None
    """Share of the room there that it takes up, above 0 and up to 1."""
    inflation: float | None = None
    """Gauge pressure of the air sealed behind the wall [Pa]."""
    solidity: float | None = None
    """Of what is packed: share of its shape that is matter, above 0 and up to 1."""
    values: dict[str, float] = field(default_factory=dict)
    """Spelt as in the library, unit in the key: ``{"young_MPa": 5}``."""


def read_annotations(
    path: Path, scene: Mapping[str, Sequence[str]], free: Collection[str] = ()
) -> dict[tuple[str, str], Annotation]:
    """Read the file and check it against the scene.

    Args:
        path: The YAML file.
        scene: Every object's name with its parts' names.
        free: Objects whose parts nobody has segmented yet: the file may name them.

    Returns:
        (object, part) → what is said of it. What is said of an object holds for all its parts that
        are not named themselves.

    Raises:
        BadFileError: The file is not such a file, or names an object or part that does not exist.

    """
    told: dict[tuple[str, str], Annotation] = {}
    for name, said in mapping_of(path).items():
        if name not in scene:
            raise _nobody(path, "object", name, scene)
        parts = said.pop("parts", {}) if isinstance(said, dict) else {}
        if not isinstance(parts, dict):
            raise BadFileError(path, f"'parts' of {name!r} must map part names.", EXAMPLE)
        parts = {str(part): answer for part, answer in parts.items()}
        for part in parts:
            if part not in scene[name] and name not in free:
                raise _nobody(path, f"part of {name!r}", part, scene[name])
        if said:
            told |= {(name, part): _annotation(path, name, said) for part in scene[name]}
        told |= {(name, p): _annotation(path, f"{name}: {p}", a) for p, a in parts.items()}
    return told


def mapping_of(path: Path) -> dict:
    """Read what a file says of each object, as yet unchecked.

    Raises:
        BadFileError: It cannot be read, or is no such mapping.

    """
    try:
        said = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise BadFileError(path, f"cannot be read ({error}).") from error
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        first = (str(error) or "nested too deep").splitlines()[0]
        raise BadFileError(path, f"is not YAML ({first}).", EXAMPLE) from error
    if not isinstance(said, dict):
        raise BadFileError(path, "must map object names to what they are made of.", EXAMPLE)
    return {str(name): value for name, value in said.items()}


def _annotation(path: Path, where: str, said: Any) -> Annotation:
    if isinstance(said, str):
        return Annotation(material=said)
    if not isinstance(said, dict):
        raise BadFileError(path, f"{where}: must be a material's name or a mapping.", EXAMPLE)
    strange = [k for k in said if k not in KEYS]
    if strange:
        raise BadFileError(path, f"{where}: unknown key {strange[0]!r}.", f"Keys: {_list(KEYS)}.")
    structure = said.get("structure")
    if structure not in (None, *BUILDS):
        options = f"Say one of: {', '.join(BUILDS)}."
        raise BadFileError(path, f"{where}: structure is {structure!r}.", options)
    for key in ("material", "contents"):
        if said.get(key) is not None and not isinstance(said[key], str):
            raise BadFileError(path, f"{where}: {key} must be a name, not {said[key]!r}.", EXAMPLE)
    thickness = _thickness(path, where, said.get("thickness_mm"))
    return Annotation(
        material=said.get("material"),
        structure=structure,
        thickness=thickness,
        contents=said.get("contents"),
        fill=_share(path, where, "fill", said.get("fill")),
        solidity=_share(path, where, "solidity", said.get("solidity")),
        inflation=_inflation(path, where, said),
        values=_values(path, where, said.get("values")),
    )


def _thickness(path: Path, where: str, said: Any) -> float | None:
    if said is None:
        return None
    thickness = _number(path, f"{where}: thickness_mm", said) * 1e-3
    if thickness <= 0:
        raise BadFileError(path, f"{where}: thickness_mm must be above 0.")
    return thickness


def _share(path: Path, where: str, what: str, said: Any) -> float | None:
    if said is None:
        return None
    share = _number(path, f"{where}: {what}", said)
    if not 0 < share <= 1:
        raise BadFileError(path, f"{where}: {what} is a share: above 0 and up to 1, not {said!r}.")
    return share


def _inflation(path: Path, where: str, said: dict) -> float | None:
    if said.get("inflation_kPa") is None:
        return None
    pressure = _number(path, f"{where}: inflation_kPa", said["inflation_kPa"])
    if not 0 <= 1e3 * pressure <= HIGHEST_INFLATION:
        raise BadFileError(
            path,
            f"{where}: inflation_kPa is {pressure:g}.",
            f"Give the gauge pressure, from 0 (sealed) to {1e-3 * HIGHEST_INFLATION:g} kPa.",
        )
    if (said.get("structure") or "shell") not in SEALABLE or said.get("contents"):
        raise BadFileError(
            path,
            f"{where}: what is inflated is a wall with air behind it.",
            "Say structure: shell, and no contents; or leave inflation_kPa out.",
        )
    return 1e3 * pressure


def _values(path: Path, where: str, said: Any) -> dict[str, float]:
    if said is None:
        return {}
    if not isinstance(said, dict):
        raise BadFileError(path, f"{where}: 'values' must map, such as {{ young_MPa: 5 }}.")
    return {str(k): _number(path, f"{where}: {k}", v) for k, v in said.items()}


def _number(path: Path, where: str, said: Any) -> float:
    if isinstance(said, bool) or not isinstance(said, int | float) or not isfinite(said):
        raise BadFileError(path, f"{where} must be a number, not {said!r}.")
    return float(said)


def _nobody(path: Path, kind: str, name: object, real: object) -> BadFileError:
    return BadFileError(path, f"there is no {kind} called {name!r}.", f"There are: {_list(real)}.")


def _list(names: Any) -> str:
    return ", ".join(str(n) for n in names)


def built(said: Annotation, words: PartWords) -> PartWords:
    """Take over how a person says that a part is built."""
    walled = said.thickness is not None or said.inflation is not None
    packed = "packed" if said.solidity else "shell" if walled else None
    implied = "filled" if said.contents else packed
    structure = said.structure or implied
    if structure is None:
        return words
    words = replace(words, built_by="annotation")
    if structure in ("solid", "packed"):
        bare = replace(words, structure=structure, thickness=None, contents=None, fill=None)
        solidity = said.solidity if structure == "packed" else None
        return replace(bare, solidity=solidity, inflation=None)
    words = replace(words, structure=structure, thickness=said.thickness or words.thickness)
    pressure = words.inflation if said.inflation is None else said.inflation
    words = replace(words, inflation=pressure if structure in SEALABLE else None)
    if structure != "filled":
        return replace(words, contents=None, fill=None)
    return replace(words, contents=said.contents or words.contents, fill=said.fill or words.fill)


def named_pieces(
    told: Mapping[tuple[str, str], Annotation], thing: str, parts: Sequence[str]
) -> list[PartWords]:
    """Return what a person names of an object beside its parts: pieces that nobody segmented yet.

    Until they are found on its surface each has an equal share.
    """
    names = [part for name, part in told if name == thing and part not in parts]
    share = 1 / len(names) if names else 0.0
    return [PartWords(name, None, volume_share=share, surface_share=share) for name in names]
