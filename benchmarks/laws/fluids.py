"""Liquids and pastes in plane strain, against theory and a published experiment.

A slab two cells thick between walls without friction; what is rough holds what touches it.
"""

from dataclasses import dataclass, replace
from math import cos, pi, sin, sqrt

import numpy as np
from scipy.optimize import brentq

from corporeal.core.types import Law
from corporeal.mpm.constants import COURANT
from corporeal.mpm.physics.liquid_stiffness import bulk_modulus, elastic_moduli
from corporeal.mpm.problem import Engine, Plane, Problem
from laws.bodies import G, Stuff, body, floor, problem, walls
from laws.watching import started

ROUGH = 50.0
"""Friction of what holds whatever touches it [-]."""
PER_CELL = 2
"""Particles per cell and axis."""
MARTIN_MOYCE = np.array(
    [[0.832, 1.217], [1.219, 1.474], [1.997, 2.292], [2.547, 2.995], [3.345, 4.134], [4.034, 4.944]]
)
"""Front of a collapsing column twice as high as wide: t √(2g/a), z/a (Martin and Moyce 1952,
n² = 2, as digitised in pysph's examples/db_exp_data.py)."""


@dataclass(frozen=True)
class Liquid:
    """A liquid or paste; SI."""

    density: float
    consistency: float
    """K_c [Pa sⁿ]; the viscosity [Pa s] where n is 1."""
    yield_shear: float = 0.0
    """τ_y [Pa]"""
    flow_index: float = 1.0


WATER = Liquid(1000.0, 1e-3)


@dataclass(frozen=True)
class Tank:
    """A block of liquid at the left wall of a tank, in plane strain."""

    liquid: Liquid
    width: float
    """Of the block [m]."""
    height: float
    """[m]"""
    cells: int
    """Across the height."""
    speed: float
    """Largest that is expected [m/s]."""
    room: float | None = None
    """Width of the tank [m]; None: the block's."""
    rough: bool = False
    """Whether the floor holds what touches it."""
    gravity: tuple[float, float, float] = (0.0, 0.0, -G)
    ramp: float = 0.0
    """[s]"""

    @property
    def cell(self) -> float:
        """Grid spacing dx [m]."""
        return self.height / self.cells

    @property
    def thick(self) -> float:
        """Of the slab [m]."""
        return 2.0 * self.cell

    def posed(self) -> Problem:
        """Give the problem; the block's corner is the origin."""
        h = self.cell / PER_CELL
        size = np.array([self.width, self.thick, self.height])
        axes = [(np.arange(round(s / h)) + 0.5) * s / round(s / h) for s in size]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        given = self.liquid
        young_pa, poisson = elastic_moduli(bulk_modulus(given.density, self.speed))
        stuff = Stuff(
            law=Law.FLUID,
            young_pa=young_pa,
            poisson=poisson,
            density=given.density,
            yield_stress=sqrt(3.0) * given.yield_shear,
            consistency=given.consistency,
            flow_index=given.flow_index,
        )
        planes: list[Plane] = [floor(), *walls(1, 0.0, self.thick)]
        planes += walls(0, 0.0, self.width if self.room is None else self.room)
        friction = np.zeros((1 + len(planes), 1 + len(planes)))
        friction[0, 1] = friction[1, 0] = ROUGH if self.rough else 0.0
        poured = body(points, float(np.prod(size)), stuff)
        return problem(
            poured, cell=self.cell, friction=friction, planes=planes, gravity=self.gravity, gravity_ramp=self.ramp
        )

    def started(self) -> Engine:
        """Build an engine with it."""
        return started(self.posed())


def moved(given: Problem, shift: np.ndarray) -> Problem:
    """Give a problem with all bodies and planes elsewhere on the grid, by ``shift`` [m]."""
    bodies = tuple(replace(b, position=b.position + shift) for b in given.bodies)
    planes = (Plane(p.normal, p.offset + float(shift @ np.array(p.normal))) for p in given.planes)
    return replace(given, bodies=bodies, planes=tuple(planes))


def front(run: Engine, tank: Tank) -> float:
    """How far a liquid reaches [m]: its third particles from the front, and half a spacing."""
    across = np.sort(run.snapshot().position[:, 0])
    layers = 2 * PER_CELL
    return float(across[-3 * layers : -2 * layers].mean()) + 0.5 * tank.cell / PER_CELL


def level(run: Engine, tank: Tank) -> float:
    """How high a liquid stands at rest [m]: the topmost layer and the half spacing above it."""
    height = np.sort(run.snapshot().position[:, 2])
    top = round(len(height) / (PER_CELL * tank.cells))
    return float(height[-top:].mean()) + 0.5 * tank.cell / PER_CELL


# ---------------------------------------------------------------- the cases


def resting_level(cells: int, seconds: float = 1.0) -> float:
    """Level of water at rest in a tank of .2 x .1 m, relative error [-]."""
    tank = Tank(WATER, 0.2, 0.1, cells, sqrt(G * 0.1), ramp=0.5)
    run = tank.started()
    run.advance(seconds)
    return level(run, tank) / tank.height - 1.0


@dataclass(frozen=True)
class Film:
    """A film of honey that flows down a wall which it sticks to; gravity is tilted."""

    viscosity: float
    """η [Pa s]"""
    cells: int
    """Across its thickness."""
    place: float = 0.0
    """Of the wall above a node [cells]."""
    courant: float = COURANT
    seconds: float = 0.3
    thick: float = 0.02
    """h [m]"""
    density: float = 1400.0
    pull: float = G * sin(0.5)
    """g sin α [m/s²]"""

    def flowing(self) -> tuple[np.ndarray, np.ndarray]:
        """Give heights over the wall [m] and speeds [m/s], far from the film's ends."""
        honey = Liquid(self.density, self.viscosity)
        gravity = (self.pull, 0.0, -G * cos(0.5))
        tank = Tank(honey, 0.3, self.thick, self.cells, 0.5, room=0.6, rough=True, gravity=gravity)
        up = self.place * tank.cell
        posed = moved(tank.posed(), np.array([0.0, 0.0, up]))
        run = started(replace(posed, courant=self.courant))
        run.advance(self.seconds)
        now = run.snapshot()
        middle = np.abs(now.position[:, 0] - 0.18) < 0.03
        return now.position[middle, 2] - up, now.velocity[middle, 0]

    def exact(self, height: np.ndarray) -> np.ndarray:
        """U = ρ g sin α (h y - y²/2)/η [m/s]."""
        shear = self.density * self.pull / self.viscosity
        return shear * (self.thick * height - height**2 / 2)


def film_on_a_slope(viscosity: float, cells: int) -> float:
    """Let a film of honey flow down a wall: rms error over the greatest speed [-]."""
    film = Film(viscosity, cells)
    height, speed = film.flowing()
    exact = film.exact(height)
    return float(np.sqrt(np.mean((speed - exact) ** 2)) / exact.max())


def film_flow(film: Film) -> float:
    """Let a film flow down a wall: error of its flow, ρ g sin α h³/3η [-]."""
    _, speed = film.flowing()
    exact = film.density * film.pull * film.thick**2 / (3.0 * film.viscosity)
    return float(speed.mean() / exact - 1.0)


def spreading_column(viscosity: float, cells: int, times: tuple[float, ...]) -> list[float]:
    """Let a column of honey spread on a rough floor: error of its front [-] (Huppert 1982).

    x_N = 1.411 (g q³ t/3ν)^⅕ with q the half section.
    """
    side, density = 0.05, 1400.0
    tank = Tank(Liquid(density, viscosity), side, side, cells, 1.0, room=0.4, rough=True)
    run, found = tank.started(), []
    for t in times:
        run.advance(t)
        exact = 1.411 * (G * side**6 * t / (3.0 * viscosity / density)) ** 0.2
        found.append(front(run, tank) / exact - 1.0)
    return found


def stopped_length(area: float, depth: float) -> float:
    """Length of a paste that has stopped on a rough floor, in plane strain [m].

    The floor bears τ_y, and where the layer is stretched it pulls back by its own yield stress:
    over its height ∫ (σ_xx - σ_zz) dz = π/2 τ_y h, as between rough plates (Nye 1967; Dubash et al.
    2009). So d/dx (h²/2 - π/2 b h) = -b with b = τ_y/ρ g, and

        h = π b/2 + √((π b/2)² + 2 b (L - x)).

    Without that term L = (9 q²/8 b)^⅓, which is 10 to 34 % longer for what is compared here.

    Args:
        area: q [m²].
        depth: b [m].

    """
    k = 0.5 * pi * depth

    def excess(length: float) -> float:
        return k * length + ((k**2 + 2 * depth * length) ** 1.5 - k**3) / (3 * depth) - area

    return float(brentq(excess, 0.0, (9 * area**2 / 8 / depth) ** (1 / 3)))


def stopped_paste(yield_shear: float, cells: int, seconds: float = 3.0) -> tuple[float, float]:
    """Let a paste slump until it stops: error of its length [-], and its speed then [m/s].

    5 Pa s are enough for it to creep to where it stops, as the theory has it: of 1 Pa s it would
    come down so fast that it slides on by a tenth.
    """
    side, density = 0.05, 1100.0
    paste = Liquid(density, 5.0, yield_shear)
    tank = Tank(paste, side, side, cells, 1.0, room=0.3, rough=True)
    run = tank.started()
    run.advance(seconds)
    exact = stopped_length(side**2, yield_shear / density / G)
    speed = float(np.sqrt(np.mean(np.sum(run.snapshot().velocity ** 2, axis=1))))
    return front(run, tank) / exact - 1.0, speed


def dam_break(cells: int) -> list[float]:
    """Water that was held: errors of its front [-] against Martin and Moyce (1952)."""
    a = 0.05715
    tank = Tank(WATER, a, 2 * a, 2 * cells, sqrt(2 * G * 2 * a), room=6 * a)
    run, found = tank.started(), []
    for t, z in MARTIN_MOYCE:
        run.advance(t / sqrt(2 * G / a))
        found.append(front(run, tank) / a / z - 1.0)
    return found
