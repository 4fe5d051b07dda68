"""Settings of the stage assemble."""

from dataclasses import dataclass
from typing import Literal

from corporeal.core.errors import check_range
from corporeal.io.length_units import LengthUnit


@dataclass(frozen=True)
class AssembleConfig:
    """How files become a scene."""

    objects: Literal["auto", "one", "nodes"] = "auto"
    """Grouping of a file into objects: the nodes that state a class, else the pieces that touch no other or are named
    as objects of their own (auto); the whole file (one); every branch below the root (nodes).
    """
    stack: bool = False
    """Put the files above each other, the first at the bottom, instead of side by side."""
    drop: float = 0.0
    """Raise each object above what it stands on by this many times its own size."""
    lift: tuple[str, ...] = ()
    """Raise an object above where it stands, such as "duck=0.5" [m]."""
    velocity: tuple[str, ...] = ()
    """An object's initial velocity, such as "duck=1,0,-2" [m/s]."""
    extent: tuple[str, ...] = ()
    """Largest real extent of an object, such as "duck=0.1" [m]."""
    unit: LengthUnit = "auto"
    """Length of one unit of a mesh file; auto: as stated, else what its size makes likely."""
    working_extent: float | None = None
    """Scale the whole scene so that its largest extent is this [m]."""
    duration: float | None = None
    """Simulated time [s]; by default from the scene file, else long enough for all falls."""
    fps: int | None = None
    """Frames per second of the video; by default from the scene file, else 30."""


def validate(config: AssembleConfig) -> None:
    """Raise UserError where a setting is invalid for any scene."""
    from corporeal.discretization.object_scaling import parse_extent
    from corporeal.scene.initial_state import (  # NumPy: help needs none
        parse_initial_velocity,
        parse_lift,
    )

    check_range("The drop", config.drop, 0.0, 100.0)
    check_range("The working extent", config.working_extent, 1e-3, 1e3)
    check_range("The duration", config.duration, 0.01, 60.0)
    check_range("The fps", config.fps, 1, 1000)
    for text in config.extent:
        parse_extent(text, "it")
    for text in config.lift:
        parse_lift(text)
    for text in config.velocity:
        parse_initial_velocity(text)
