"""The block drop: cubes of one material that fall a tenth of a cell and slide along the floor.

They slide a cell every thirty substeps or so, so the particles have to be sorted again and again,
and they are in contact with the floor throughout.
"""

from dataclasses import dataclass, replace

import numpy as np

from corporeal.core.types import Law
from corporeal.mpm.problem import Body, Plane, Problem

CELL = 1.0 / 64.0
"""[m]"""
YOUNG_PA, POISSON, DENSITY = 1e5, 0.3, 1000.0
"""[Pa], [-], [kg/m³]"""
SPEED = 1.0
"""Along the floor [m/s]."""
STEP = 4e-4
"""What an engine that does not choose its steps is given [s]; the stable one is 5e-4 s."""
HEIGHT = 0.1 * CELL
"""[m]"""
GAPS = {True: 0.1, False: 1.0}
"""Between neighbours in a heap, and side by side: in contact, and near enough to be looked at
[cells]."""
FLOOR = Plane((0.0, 0.0, 1.0), 0.0)


@dataclass(frozen=True)
class Drop:
    """One measurement: what falls, and on how many threads it is stepped."""

    law: Law = Law.COROTATED
    across: int = 23
    """Cells along the side of one object; eight particles to the cell."""
    objects: int = 1
    heap: bool = False
    """Stacked and touching, or side by side on the floor."""
    threads: int = 1
    extent: int = 0
    """Cells across which the objects are spread as they fly apart; 0: a heap."""
    floor: bool = True
    device: str = "cpu"

    @property
    def particles(self) -> int:
        """Of all objects together."""
        return self.objects * 8 * self.across**3


def drop_of(particles: int, **given) -> Drop:
    """Return the drop that comes closest to so many particles."""
    drop = Drop(**given)
    return replace(drop, across=max(2, round(np.cbrt(particles / drop.objects / 8))))


def problem_of(drop: Drop) -> Problem:
    """Build the bodies of a drop and the floor under them."""
    places = _places(drop)
    bodies = tuple(_body(drop, f"block_{k}", place) for k, place in enumerate(places))
    planes = (FLOOR,) if drop.floor else ()
    count = len(bodies) + len(planes)
    return Problem(
        bodies, CELL, friction=np.full((count, count), 0.1), restitution=np.zeros((count, count)), planes=planes
    )


def _places(drop: Drop) -> np.ndarray:
    """Lowest corner of every object [cells], (objects, 3)."""
    stacked = drop.heap or drop.extent > 0
    side = int(np.ceil(drop.objects ** (1 / 3 if stacked else 1 / 2) - 1e-9))
    numbers = np.arange(drop.objects)
    grid = np.stack([numbers % side, numbers // side % side, numbers // side**2], axis=1)
    pitch = drop.across + GAPS[drop.heap]
    if drop.extent:
        pitch = (drop.extent - drop.across) / max(side - 1, 1)
    return grid * pitch + [0.0, 0.0, HEIGHT / CELL]


def _body(drop: Drop, name: str, place: np.ndarray) -> Body:
    axis = (np.arange(2 * drop.across) + 0.5) / 2
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    one = np.ones(len(points))
    velocity = np.array([SPEED, 0.0, 0.0])
    if drop.extent:
        velocity = SPEED * np.sign(place - 0.5 * (drop.extent - drop.across))
    return Body(
        name=name,
        position=(points + place) * CELL,
        velocity=np.tile(velocity, (len(points), 1)),
        volume=one * (CELL / 2) ** 3,
        density=one * DENSITY,
        law=np.full(len(points), drop.law.value),
        young_pa=one * YOUNG_PA,
        poisson=one * POISSON,
        yield_stress=one * 100.0,
        hardening=one * 0.0,
        friction_angle=one * np.radians(32.0),
        cohesion=one * 0.0,
        loss=one * 0.0,
        vibration=one,
    )
