"""Where material numbers come from: what a person may ask."""

from dataclasses import dataclass
from typing import Annotated

from corporeal.core.errors import UserError
from corporeal.core.setting_types import ReadsPath

SHIPPED_LIBRARIES = ("default", "reference")
FIELD_FILES = ("vomp", "pixie", "table")
"""Kinds of fields that are read from files."""


@dataclass(frozen=True)
class GroundConfig:
    """Where the numbers come from."""

    library: Annotated[str, ReadsPath(names=SHIPPED_LIBRARIES)] = "default"
    """"default", "reference" (the 22 materials as first published), or the path of a TOML file."""
    floor: str = "concrete"
    """What the floor and the walls are made of, for friction and rebound."""
    neutral: str = "plastics-PP"
    """What stands in for a part of unknown material."""
    field: Annotated[str, ReadsPath(prefixes=FIELD_FILES)] = ""
    """Numbers of another method instead of ours: vomp:PATH, pixie:PATH or table:PATH.csv (a file of
    the scene, or a folder with one per object), one[:E=2e6,nu=.4,rho=200], or omniphysgs."""


def validate(config: GroundConfig) -> None:
    """Raise UserError where a material or a file is unknown, or cannot be what it is to be."""
    from corporeal.fields.field_specification import (
        parse_field_specification,  # help reads no library
    )
    from corporeal.materials.range_placement import library_entry

    library_entry(config.floor, config.library)
    if library_entry(config.neutral, config.library).group == "liquid":
        raise UserError(f"--neutral {config.neutral} is a liquid, of which no part can be made.")
    parse_field_specification(config.field)
