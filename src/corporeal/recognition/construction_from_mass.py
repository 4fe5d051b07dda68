"""Construction of weights whose name states the mass."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import inf

from corporeal.core.types import STATED_MATTER_KEY, SUBSTANCE_KEY, ObjectDescription, PartDescription, Scene
from corporeal.recognition.lexicon import head_noun_in, name_tokens, substance_terms
from corporeal.recognition.mass_from_name import MASS_AGREEMENT_RATIO, mass_from_name

GOOD_MASS_FIT_RATIO = 1.2
"""Factor of a mass within which the commoner way is taken."""
SOURCES_WITHOUT_LOOKING = frozenset(("metadata", "unknown"))
"""Sources that the mass in a name overrides."""
EXTRAS_STATING_CONSTRUCTION = (SUBSTANCE_KEY, STATED_MATTER_KEY, "shell_thickness_m")
"""In a surface's extras: its file says how it is made."""


@dataclass(frozen=True)
class ConstructionHypotheses:
    """Of one part that is a whole object."""

    mass: float
    """That its name states [kg]."""
    words: tuple[PartDescription, ...]
    """The first: as it was recognised."""


def construction_hypotheses(scene: Scene, number: int, described: ObjectDescription) -> ConstructionHypotheses | None:
    """Return the hypotheses of construction, among which the mass in the name chooses.

    None: its name states no mass, it is no weight, or its construction is stated.
    """
    thing = scene.objects[number]
    names = (thing.name, thing.stem)
    mass = mass_from_name(*names)
    if mass is None or len(described.parts) != 1:
        return None
    (part,) = described.parts
    worn = [s.extras for s in scene.surfaces if s.object == number]
    if not {part.answered_by, part.built_by} <= SOURCES_WITHOUT_LOOKING or any(
        k in e for k in EXTRAS_STATING_CONSTRUCTION for e in worn
    ):
        return None
    named = [name_tokens(name) for name in names]
    row = next((r for r in construction_table() for n in named if head_noun_in(n, r["words"])), None)
    if row is None:
        return None
    own = {t.material for n in named for t in substance_terms(n)}
    ways = [way for way in row["ways"] if not own or way["material"] in own]
    return ConstructionHypotheses(mass, (part, *(_constructed_part(part, way, mass) for way in ways)))


def best_mass_fit(masses: Sequence[float], said: float) -> int:
    """Return which way fits a mass: the first that does well, else the nearest that does at all.

    Where none does, the first, as it was recognised.

    Args:
        masses: Of the object, made in each way [kg].
        said: Stated by its name [kg].
    """
    off = [max(mass / said, said / mass) if mass > 0 else inf for mass in masses]
    well = [k for k, far in enumerate(off) if far <= GOOD_MASS_FIT_RATIO]
    nearest = min(range(len(off)), key=off.__getitem__)
    return well[0] if well else nearest if off[nearest] <= MASS_AGREEMENT_RATIO else 0


def _constructed_part(part: PartDescription, way: dict, mass: float) -> PartDescription:
    wall, solidity, contents = way.get("thickness_mm"), way.get("solidity"), way.get("contents")
    walled = "filled" if contents else "shell"
    return PartDescription(
        part.name,
        way["material"],
        structure=walled if wall else "packed" if solidity else "solid",
        thickness=wall * 1e-3 if wall else None,
        answered_by="metadata",
        margin=part.margin or 0.35,
        reason=f"Its name says {mass:.3g} kg, which this construction fits best.",
        contents=contents,
        fill=way.get("fill", 1.0) if contents else None,
        solidity=solidity,
        built_by="metadata",
    )


@cache
def construction_table() -> list[dict]:
    """Read the ways in which weights are built."""
    path = files("corporeal.recognition").joinpath("construction_from_mass.toml")
    (rows,) = tomllib.loads(path.read_text(encoding="utf-8")).values()
    return rows
