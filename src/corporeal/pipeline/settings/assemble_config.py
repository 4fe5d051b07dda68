"""Settings of the stage assemble."""

from dataclasses import dataclass
from typing import Literal

from corporeal.core.errors import check_range
from corporeal.io.length_units import LengthUnit


@dataclass(frozen=True)
class AssembleConfig:
    """How files become a scene."""

    objects: Literal["auto", "one", "nodes"] = "auto"
    """How a model file is split into objects. auto: one object per node that states a class; without any, per connected
    group of touching pieces, where two pieces named as objects stay apart. one: the whole file is one object.
    nodes: each branch below the root is one object.
    """
    stack: bool = False
    """Put the files above each other, the first at the bottom, instead of side by side."""
    drop: float = 0.0
    """Initial clearance of each object above its support, as a multiple of its own size."""
    lift: tuple[str, ...] = ()
    """Raise one object by a height, such as "duck=0.5" [m]."""
    velocity: tuple[str, ...] = ()
    """An object's initial velocity, such as "duck=1,0,-2" [m/s]."""
    extent: tuple[str, ...] = ()
    """Longest side of the real object's bounding box, such as "duck=0.1" [m]."""
    unit: LengthUnit = "auto"
    """Length of one unit of a mesh file; auto: as the file states, else the unit that gives a plausible size."""
    working_extent: float | None = None
    """Scale the whole scene so that its largest extent is this [m]."""
    duration: float | None = None
    """Simulated time [s]; by default from the scene file, else three times the longest fall plus 1 s (at most 3 s), and
    until the last force ends."""
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
