"""Settings of the stage ground."""

from dataclasses import dataclass
from typing import Annotated

from corporeal.core.errors import UserError
from corporeal.core.setting_types import ReadsPath

SHIPPED_LIBRARIES = ("default", "reference")
FIELD_FILES = ("vomp", "pixie", "table")
"""Kinds of fields that are read from files."""


@dataclass(frozen=True)
class GroundConfig:
    """Sources of material values."""

    library: Annotated[str, ReadsPath(names=SHIPPED_LIBRARIES)] = "default"
    """Material library: "default", "reference" (22 materials as first published, a baseline), or a TOML file."""
    floor: str = "concrete"
    """Material of the floor and the walls, for friction and restitution."""
    neutral: str = "plastics-PP"
    """Material assumed for parts of unknown material; plastics-PP is polypropylene."""
    field: Annotated[str, ReadsPath(prefixes=FIELD_FILES)] = ""
    """Material parameters from another method: vomp:PATH, pixie:PATH or table:PATH.csv (one file for the scene, or a
    folder with one file per object); one[:E=2e6,nu=.4,rho=200] for the same values everywhere; omniphysgs for the
    constants in its code (E 2 MPa, ν 0.4, ρ 1000 kg/m³).
    """


def validate(config: GroundConfig) -> None:
    """Raise UserError where a material or a file is unknown or unsuitable."""
    from corporeal.fields.field_specification import (
        parse_field_specification,  # help reads no library
    )
    from corporeal.materials.range_placement import library_entry

    library_entry(config.floor, config.library)
    if library_entry(config.neutral, config.library).group == "liquid":
        raise UserError(f"--neutral {config.neutral} is a liquid and cannot be the material of a part.")
    parse_field_specification(config.field)
