"""A glass of water: a rigid tumbler, its wall thinner than a cell, and what stands in it."""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from corporeal.core.types import Law
from corporeal.mpm.physics.liquid_stiffness import bulk_modulus, elastic_moduli
from corporeal.mpm.problem import Engine, Problem, WettedSurface
from laws.bodies import G, Stuff, body, floor, problem

GLASS = 2500.0
"""[kg/m³]"""
WATER = 1000.0
"""[kg/m³]"""


@dataclass(frozen=True)
class Tumbler:
    """A glass that stands on the floor; SI."""

    cell: float
    """Grid spacing dx [m]."""
    radius: float = 0.035
    height: float = 0.08
    wall: float = 0.003
    base: float = 0.005
    level: float = 0.05
    """Of the water over the base [m]."""
    wetted: bool = True
    """Whether the glass says where liquids touch it."""

    @property
    def inner(self) -> float:
        """Radius of its hollow [m]."""
        return self.radius - self.wall

    def posed(self) -> Problem:
        """Give the problem: glass, then water; gravity grows over a tenth of a second."""
        points, normals = self.surface()
        inner, outer, h = self.inner, self.radius, self.cell / 2
        volume = pi * (outer**2 - inner**2) * self.height + pi * inner**2 * self.base
        # As ``fill`` does: points half a cell apart, one layer in the wall and one in the base.
        middle = 0.5 * (inner + outer)
        matter = [_ring(middle, z, h) for z in _between(0, self.height, h)]
        matter += [_disc(inner, z, h) for z in _between(0, self.base, h)]
        glass = body(
            np.concatenate(matter),
            volume,
            Stuff(density=GLASS),
            name="glass",
            rigid=True,
            surface=points,
            wetted_surface=WettedSurface(points, normals) if self.wetted else None,
        )
        levels = _between(self.base, self.base + self.level, h)
        poured = np.concatenate([_disc(inner, z, h) for z in levels])
        young_pa, poisson = elastic_moduli(bulk_modulus(WATER, sqrt(2 * G * self.level)))
        stuff = Stuff(Law.FLUID, young_pa, poisson, WATER, yield_stress=0.0, consistency=1e-3, flow_index=1.0)
        water = body(poured, pi * inner**2 * self.level, stuff, name="water")
        friction = np.array([[0, 0, 0.5], [0, 0, 0], [0.5, 0, 0]])
        down = (0.0, 0.0, -G)
        return problem(
            glass, water, cell=self.cell, friction=friction, planes=[floor()], gravity=down, gravity_ramp=0.1
        )

    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        """Points on all faces of the glass [m], and their normals."""
        step, faces = self.cell / 2.5, []
        for radius, low, side in ((self.radius, 0.0, 1.0), (self.inner, self.base, -1.0)):
            for z in _between(low, self.height, step):
                ring = _ring(radius, z, step)
                faces.append((ring, side * ring * [1, 1, 0] / radius))
        for z, radius, side in ((0.0, self.radius, -1.0), (self.base, self.inner, 1.0)):
            disc = _disc(radius, z, step)
            faces.append((disc, np.tile([0.0, 0.0, side], (len(disc), 1))))
        rim = _ring(self.radius - 0.5 * self.wall, self.height, step)
        faces.append((rim, np.tile([0.0, 0.0, 1.0], (len(rim), 1))))
        return np.concatenate([p for p, _ in faces]), np.concatenate([n for _, n in faces])


def level_error(run: Engine, glass: Tumbler) -> float:
    """How far the water's level is from where it was poured, relative [-]."""
    snapshot = run.snapshot().position
    water = snapshot[-len(glass.posed().bodies[1].position) :]
    return float(2 * (water[:, 2].mean() - glass.base) / glass.level - 1)


def outside(run: Engine, glass: Tumbler) -> float:
    """Share of the water that went through the wall or the bottom [-]."""
    water = run.snapshot().position[-len(glass.posed().bodies[1].position) :]
    through = (np.hypot(water[:, 0], water[:, 1]) > glass.radius) | (water[:, 2] < 0)
    return float(through.mean())


def _between(low: float, high: float, step: float) -> np.ndarray:
    count = max(1, round((high - low) / step))
    return low + (np.arange(count) + 0.5) * (high - low) / count


def _ring(radius: float, z: float, step: float) -> np.ndarray:
    angle = np.arange(0, 2 * pi, step / radius)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle + z], axis=1)


def _disc(radius: float, z: float, step: float) -> np.ndarray:
    x, y = np.meshgrid(*[_between(-radius, radius, step)] * 2)
    inside = np.hypot(x, y) < radius
    return np.stack([x[inside], y[inside], 0 * x[inside] + z], axis=1)
