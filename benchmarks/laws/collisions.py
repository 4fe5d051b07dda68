"""Bodies that meet: cases 1, 2, 4 and 6."""

from dataclasses import dataclass, replace

import numpy as np

from corporeal.mpm.constants import SWEEPS
from corporeal.mpm.physics import contact, contact_impulses
from corporeal.mpm.problem import Problem
from corporeal.mpm.reference.engine import ReferenceEngine
from laws.bodies import RUBBER, Stuff, ball, body, disc, problem, walls
from laws.outcome import Outcome, absolute, at_least, relative
from laws.watching import bodies_of, follow, half_width, rise, started, watch

OFF_GRID = np.array([0.13, 0.31, 0.22])
"""Where bodies lie within a cell [dx]: nothing may depend on being centred."""


# ---------------------------------------------------------------- cases 1 and 2


@dataclass(frozen=True)
class Books:
    """How well an oblique collision of two soft balls, with friction, kept its books."""

    momentum: float
    """Largest change, relative to Σ m|v| [-]."""
    angular_momentum: float
    """Relative to Σ m|v| R [-]."""
    energy: float
    """Largest, relative to the start [-]."""


def oblique_collision(build, transfer: str = "apic", stuff: Stuff = RUBBER) -> Books:
    """Let two balls meet obliquely, without gravity, at R/dx = 3."""
    radius, speed = 0.1, 0.3
    cell = radius / 3
    start = OFF_GRID * cell
    apart = np.array([0.9 * 2 * radius, 0.0, 0.5 * radius]) + np.array([0.4 * cell, 0, 0])
    balls = [
        ball(tuple(start + shift), radius, cell / 2, stuff=stuff, velocity=(v, 0.0, 0.0))
        for shift, v in ((np.zeros(3), speed / 2), (apart, -speed / 2))
    ]
    run = build(problem(*balls, cell=cell, friction=0.3, transfer=transfer))
    history = watch(run, 0.2, 10)
    scale = np.abs(history.all("momentum")[0]).sum()
    total = history.all("momentum").sum(axis=1)
    turn = history.all("angular_momentum").sum(axis=1)
    return Books(
        float(np.abs(total - total[0]).max() / scale),
        float(np.abs(turn - turn[0]).max() / (scale * radius)),
        float(history.energy.max() / history.energy[0]),
    )


def any_collision(quick: bool = False) -> Outcome:
    """Case 1: P and L are conserved and energy never grows."""
    exact, fast = oblique_collision(ReferenceEngine), oblique_collision(started)
    usual = oblique_collision(started, "flip")
    stiff_in_bulk = oblique_collision(started, "flip", replace(RUBBER, poisson=0.49))
    margin = {"f64 twin": (exact, 1e-12), "production engine": (fast, 1e-5)}
    checks = []
    for name, (found, most) in margin.items():
        checks.append(absolute(f"momentum change, {name}", found.momentum, 0.0, most))
        checks.append(absolute(f"angular momentum change, {name}", found.angular_momentum, 0.0, most))
    checks.append(absolute("momentum change, production with FLIP", usual.momentum, 0.0, 1e-5))
    grown = max(0.0, *(books.energy - 1 for books in (exact, fast, usual, stiff_in_bulk)))
    checks.append(absolute("growth of energy", grown, 0.0, 1e-3))
    words = (
        "two soft balls, oblique, with friction, R/dx 3; APIC, and FLIP where said; energy also with FLIP at ν = .49"
    )
    return Outcome("1", "A collision conserves momentum and never gains energy", words, tuple(checks))


@dataclass(frozen=True)
class NodeSolve:
    """Random bodies that meet in one node."""

    momentum: float
    """Largest error, relative to √(2 K M) [-]."""
    energy: float
    """Largest kinetic energy after, relative to before [-]."""
    residual: float
    """Largest approach left of a node, relative to the fastest body; mean over nodes [-]."""


def crowded_node(bodies: int, trials: int, sweeps: int = SWEEPS) -> NodeSolve:
    """Let random bodies with random outward normals meet in a node, with friction."""
    rng = np.random.default_rng(1)
    found = []
    for _ in range(trials):
        mass = 10 ** rng.uniform(-2, 2, bodies)
        before = rng.standard_normal((bodies, 3))
        still = np.zeros((bodies, 3))
        movers = contact_impulses.Movers(1 / mass, np.zeros((bodies, 3, 3)), still, before.copy(), still.copy())
        contacts = _all_pairs(bodies, rng)
        contact_impulses.solve(contacts, movers, np.zeros(len(contacts.a)), sweeps)
        after, energy = movers.velocity, mass @ np.sum(before**2, axis=1)
        left = np.sum(contacts.approach(movers) * contacts.normal, axis=1).max()
        found.append(
            (
                np.linalg.norm(mass @ (after - before)) / np.sqrt(energy * mass.sum()),
                mass @ np.sum(after**2, axis=1) / energy,
                max(left, 0.0) / np.abs(after).max(),
            )
        )
    momentum, kinetic, residual = np.array(found).T
    return NodeSolve(float(momentum.max()), float(kinetic.max()), float(residual.mean()))


def _all_pairs(bodies: int, rng: np.random.Generator) -> contact_impulses.ContactList:
    a, c = np.triu_indices(bodies, 1)
    n = len(a)
    own = contact.unit(rng.standard_normal((bodies, 3)))
    normal = contact.unit(own[a] - own[c])
    return contact_impulses.ContactList(a, c, np.zeros((n, 3)), normal, np.zeros(n), np.full(n, 0.3))


def node_of_many_bodies(quick: bool = False) -> Outcome:
    """Case 2: momentum is conserved, kinetic energy never grows, and contacts are resolved."""
    found = [crowded_node(n, 100 if quick else 1000) for n in (3, 4, 5)]
    checks = (
        absolute("momentum error", max(f.momentum for f in found), 0.0, 1e-15),
        absolute("growth of kinetic energy", max(0.0, *(f.energy - 1 for f in found)), 0.0, 1e-12),
        absolute("approach left [%]", 100 * max(f.residual for f in found), 0.0, 1.0, "%"),
    )
    words = f"3, 4 and 5 random bodies, masses over two decades, {SWEEPS} sweeps"
    return Outcome("2", "Many bodies in a node conserve momentum", words, checks)


# ---------------------------------------------------------------- case 4


@dataclass(frozen=True)
class Collision:
    """Two equal round bodies that met."""

    restitution: float
    """Along the line of centres [-]."""
    duration: float
    """While the approach speed is between 98 % of its first and last value [s]."""
    gap: float
    """Between the surfaces when the force reaches 2 % of its peak [dx]."""
    tangential: float
    """Change of velocity across the line of centres, relative to that along it [-]."""
    depth: float
    """Largest approach of the centres of mass beyond touching [m]."""
    pole_depth: float
    """Largest approach of the far ends beyond touching [m]."""
    force: float
    """Largest [N]."""
    pressed: float
    """How long the force is above 2 % of its peak [s]."""
    half_width: float
    """Of the force at half its peak [s]."""


def discs(cells: int, angle: float = 0.0, contact: str = "multi", transfer: str = "flip") -> Collision:
    """Let Sulsky's two discs meet: r = .2 m, E = 1 kPa, in plane strain between smooth walls.

    Args:
        cells: r/dx.
        angle: Of the line of centres on the grid [degrees].
        contact: "single" glues.
        transfer: "flip" or "apic".

    """
    radius, cell = 0.2, 0.2 / cells
    stuff = Stuff(young_pa=1e3, poisson=0.3, density=1000.0)
    axis = np.array([np.cos(np.radians(angle)), 0.0, np.sin(np.radians(angle))])
    centre = OFF_GRID * cell * (1, 0, 1) + (0, cell, 0)
    sides = [
        disc(
            tuple(centre + 0.25 * s * axis),
            radius,
            2 * cell,
            cell / 2,
            stuff=stuff,
            velocity=tuple(-0.1 * np.sqrt(2) * s * axis),
        )
        for s in (-1, 1)
    ]
    given = problem(*sides, cell=cell, planes=walls(1, 0.0, 2 * cell), contact=contact, transfer=transfer)
    return collision(given, 2.2, 2 * radius, 2 * 0.1 * np.sqrt(2), looks=240)


def collision(given: Problem, until: float, touching: float, speed: float, looks: int = 100) -> Collision:
    """Watch two bodies meet whose centres are ``touching`` [m] apart when they touch."""
    run = started(given)
    bodies = bodies_of(given)
    start = given.bodies[0].position.mean(axis=0)
    line = given.bodies[1].position.mean(axis=0) - start
    behind = [g[far_from(b.position @ line * side)] for g, b, side in zip(bodies, given.bodies, (-1, 1), strict=True)]
    path = follow(run, until, looks, bodies + behind)
    apart = path.place[:, 1] - path.place[:, 0]
    distance = np.linalg.norm(apart, axis=1)
    axis = apart[np.argmin(distance)] / distance.min()
    u = path.velocity[:, 1] - path.velocity[:, 0]
    along, change = u @ axis, u[-1] - u[0]
    across = change - (change @ axis) * axis
    impulse = float(given.bodies[0].volume @ given.bodies[0].density) / 2 * (along - along[0])
    force = np.diff(impulse) / np.diff(path.time)
    pressed = np.flatnonzero(force > 0.02 * force.max())
    poles = (path.place[:, 3] - path.place[:, 2]) @ axis
    return Collision(
        restitution=float(along[-1] / speed),
        duration=rise(path.time, along, -0.98 * speed, 0.98 * along[-1]),
        gap=float((distance[pressed[0]] - touching) / given.cell),
        tangential=float(np.linalg.norm(across) / abs(change @ axis)),
        depth=float(touching - distance.min()),
        pole_depth=float(poles[0] - distance[0] + touching - poles.min()),
        force=float(force.max()),
        pressed=float(path.time[pressed[-1] + 1] - path.time[pressed[0]]),
        half_width=half_width(path.time, impulse),
    )


def far_from(height: np.ndarray) -> np.ndarray:
    """Return the twentieth of the particles that lies highest."""
    return np.flatnonzero(height > np.quantile(height, 0.95))


def two_discs(quick: bool = False) -> Outcome:
    """Case 4: two independent codes agree on e ≈ .905 and a contact of .95 s."""
    found, tilted = discs(8), discs(8, angle=30.0)
    glued = discs(8, contact="single")
    checks = []
    for name, f, control in (("along the grid", found, glued), ("at 30°", tilted, None)):
        checks += [
            absolute(f"restitution, {name}", f.restitution, 0.90, 0.02, "", control and control.restitution),
            absolute(f"contact time, {name} [s]", f.duration, 0.95, 0.03, "s", control and control.duration),
            absolute(f"gap at first contact, {name} [dx]", f.gap, 0.0, 0.4, "dx"),
            absolute(f"spurious tangential, {name} [%]", 100 * f.tangential, 0.0, 3.0, "%"),
        ]
    if not quick:
        checks.append(absolute("restitution at r/dx 16", discs(16).restitution, 0.90, 0.02))
    return Outcome(
        "4",
        "Two elastic discs rebound as other codes say",
        "plane strain between smooth walls, r/dx 8; FLIP",
        tuple(checks),
    )


# ---------------------------------------------------------------- case 6


@dataclass(frozen=True)
class Hertz:
    """Contact of two equal spheres."""

    depth: float
    """Largest approach of the centres δ [m]."""
    time: float
    """[s]"""
    force: float
    """Largest [N]."""
    half_width: float
    """Of the force [s]."""

    @classmethod
    def of(cls, radius: float, stuff: Stuff, speed: float) -> "Hertz":
        """Two equal spheres that approach at ``speed`` [m/s]; K. L. Johnson 1985, section 11.4.

        δ = (15 m* v² / (16 E* √R*))^(2/5), t = 2.943 δ/v, F = 4/3 E* √R* δ^(3/2). The width of the
        force at half its peak is integrated.
        """
        mass = stuff.density * 4 / 3 * np.pi * radius**3 / 2
        modulus, curved = stuff.young_pa / (1 - stuff.poisson**2) / 2, radius / 2
        depth = (15 * mass * speed**2 / (16 * modulus * np.sqrt(curved))) ** 0.4
        stiff = 4 / 3 * modulus * np.sqrt(curved)
        x = np.linspace(0.5 ** (2 / 3), 1, 200_001) * depth
        slow = np.sqrt(np.maximum(speed**2 - 0.8 * stiff * x**2.5 / mass, 0))
        middle = 0.5 * (slow[1:] + slow[:-1])
        width = 2 * np.sum(np.diff(x) / middle)
        return cls(float(depth), float(2.943 * depth / speed), float(stiff * depth**1.5), float(width))


SPHERE, SPEED, RADIUS = Stuff(young_pa=1e5, poisson=0.3, density=1000.0), 0.2, 0.2


def spheres(cells: int, fill: str = "blue", transfer: str = "flip") -> Collision:
    """Let two spheres of .2 m radius meet head on at .2 m/s, off the grid's symmetry.

    Args:
        cells: R/dx.
        fill: "blue" or "lattice"; a lattice makes the poles flat.
        transfer: "flip" or "apic".

    """
    cell = RADIUS / cells
    one = ball((0.0, 0.0, 0.0), RADIUS, cell / 2, fill)
    near = OFF_GRID * cell
    far = near + np.array([2 * RADIUS + cell, 0.0, 0.0])
    volume = float(one.volume.sum())
    pair = [
        body(one.position + place, volume, SPHERE, (v, 0.0, 0.0)) for place, v in ((near, SPEED / 2), (far, -SPEED / 2))
    ]
    hertz = Hertz.of(RADIUS, SPHERE, SPEED)
    given = problem(*pair, cell=cell, transfer=transfer)
    return collision(given, cell / SPEED + 1.35 * hertz.time, 2 * RADIUS, SPEED)


def hertz_spheres(quick: bool = False) -> Outcome:
    """Case 6: two spheres meet as Hertz says."""
    cells = 10
    found, ideal = spheres(cells), Hertz.of(RADIUS, SPHERE, SPEED)
    faint = 2 * 0.02 ** (2 / 3) * ideal.depth / SPEED
    checks = [
        relative("largest approach of the centres [m]", found.depth, ideal.depth, 10.0),
        relative("contact time [s]", found.pressed, ideal.time - faint, 10.0),
        relative("largest force [N]", found.force, ideal.force, 10.0),
        at_least("restitution", found.restitution, 1.0, 0.95),
        absolute("spurious tangential [%]", 100 * found.tangential, 0.0, 3.0, "%"),
    ]
    words = "R/dx 10, blue-noise fill, off the grid's symmetry; time: force above 2 % of its peak"
    return Outcome("6", "Two spheres meet as Hertz says", words, tuple(checks))
