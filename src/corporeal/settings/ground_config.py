"""Where material numbers come from: what a person may ask."""

from dataclasses import dataclass


@dataclass(frozen=True)
class GroundConfig:
    """Where the numbers come from."""

    library: str = "default"
    """"default", "reference" (the 22 materials as first published), or the path of a TOML file."""
    floor: str = "concrete"
    """What the floor and the walls are made of, for friction and rebound."""
    neutral: str = "plastics-PP"
    """What stands in for a part of unknown material."""
    field: str = ""
    """Numbers of another method instead of ours: vomp:PATH, pixie:PATH or table:PATH.csv (a file of
    the scene, or a folder with one per object), one[:E=2e6,nu=.4,rho=200], or omniphysgs."""
