"""Particles of a problem: constant properties and state."""

from collections.abc import Collection
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.core.types import CURVATURE_COLUMNS
from corporeal.mpm import laws
from corporeal.mpm.constants import MIN_VOLUME_RATIO
from corporeal.mpm.laws.kinematics import determinant
from corporeal.mpm.material_table import MaterialTable
from corporeal.mpm.physics import maxwell_branches, rigid
from corporeal.mpm.physics.flat_facets import BodyFacets, facets_of, has_edges, is_bounded_by_facets
from corporeal.mpm.physics.maxwell_branches import BranchMemory, MaxwellBranches
from corporeal.mpm.problem import Body, Problem
from corporeal.mpm.shells.assemble import Shells, vertex_half_wall
from corporeal.mpm.shells.forces import ShellState


def surface_curvature(body: Body) -> Float[np.ndarray, "S 12"]:
    """How a body's surface curves at its points; zeros where it is unknown."""
    rows = np.zeros((len(body.surface), CURVATURE_COLUMNS))
    if len(body.curvature) == len(body.surface):
        rows[:, : body.curvature.shape[1]] = body.curvature
    return rows


@dataclass(frozen=True)
class ParticleConstants:
    """What never changes; all bodies' particles in one list."""

    body: Int[np.ndarray, " P"]
    mass: Float[np.ndarray, " P"]
    volume: Float[np.ndarray, " P"]
    substances: MaterialTable
    """What they are made of, and …"""
    kind: Int[np.ndarray, " P"]
    """… the row of each in it."""
    total: Float[np.ndarray, " B"]
    """Mass of each body [kg]."""
    centre: Float[np.ndarray, "B 3"]
    """Where each body's centre of mass starts [m]."""
    inertia: Float[np.ndarray, "B 3 3"]
    """Of each body at the start, about its centre [kg m²]; used where rigid."""
    arm: Float[np.ndarray, "P 3"]
    """Position at the start, from the body's centre [m]."""
    surface: tuple[Float[np.ndarray, "S 3"], ...]
    """Surface points of each body at the start, from its centre [m]."""
    curvature: tuple[Float[np.ndarray, "S 12"], ...]
    """How the surface curves there at the start: see ``types.CURVATURE_COLUMNS``; zero where it does not."""
    shells: Shells
    """Thin parts of all bodies."""

    @classmethod
    def of(cls, problem: Problem) -> "ParticleConstants":
        """Gather what the bodies say of their particles."""
        bodies = problem.bodies
        substances, kind = MaterialTable.of(problem)
        volume = np.concatenate([np.asarray(b.volume, np.float64) for b in bodies])
        masses = [rigid.mass_and_inertia(b.position, b.volume * b.density, b.volume) for b in bodies]
        centre = np.stack([m.centre for m in masses])
        return cls(
            body=substances.body[kind],
            mass=volume * substances.density[kind],
            volume=volume,
            substances=substances,
            kind=kind,
            total=np.array([m.total for m in masses]),
            centre=centre,
            inertia=np.stack([m.inertia for m in masses]),
            arm=np.concatenate([b.position - m.centre for b, m in zip(bodies, masses, strict=True)]),
            surface=tuple(b.surface - m.centre for b, m in zip(bodies, masses, strict=True)),
            curvature=tuple(surface_curvature(b) for b in bodies),
            shells=Shells.of(problem),
        )

    @cached_property
    def radius(self) -> Float[np.ndarray, " B"]:
        """How far each body reaches from its centre of mass [m]."""
        points = [(self.arm[self.body == b], s) for b, s in enumerate(self.surface)]
        return np.array([np.linalg.norm(np.concatenate(p), axis=1).max() for p in points])

    @cached_property
    def facets(self) -> tuple[BodyFacets, ...]:
        """Flat faces of each body at the start, from its centre."""
        both = zip(self.surface, self.curvature, strict=True)
        return tuple(facets_of(points, rows) for points, rows in both)

    @cached_property
    def flat(self) -> tuple[bool, ...]:
        """Whether each body is bounded by flat faces for the most part."""
        return tuple(map(is_bounded_by_facets, self.facets, self.surface))

    @cached_property
    def edged(self) -> tuple[bool, ...]:
        """Whether each body is known to have edges."""
        return tuple(map(has_edges, self.curvature))

    @cached_property
    def spacing(self) -> Float[np.ndarray, " B"]:
        """Distance of each body's surface points [m]; 0 without any."""
        return np.array([rigid.surface_point_spacing(points) for points in self.surface])

    def thinness(self, cell: float) -> tuple[int, ...]:
        """How thin each body is against a cell [m], were it rigid: see ``rigid.thinness``."""
        if cell not in self._thin:
            both = zip(self.surface, self.curvature, strict=True)
            self._thin[cell] = tuple(rigid.thinness(p, rows[:, :3], cell) for p, rows in both)
        return self._thin[cell]

    def thin_places(self, cell: float) -> tuple[Bool[np.ndarray, " S"], ...]:
        """Surface points of each body where it is thin and not as a whole, were it rigid."""
        if cell not in self._places:
            both = zip(self.surface, self.curvature, strict=True)
            self._places[cell] = tuple(rigid.thin_places(p, r[:, :3], cell) for p, r in both)
        return self._places[cell]

    @cached_property
    def _places(self) -> dict[float, tuple[Bool[np.ndarray, " S"], ...]]:
        return {}

    @cached_property
    def _thin(self) -> dict[float, tuple[int, ...]]:
        return {}

    @cached_property
    def law(self) -> Int[np.ndarray, " P"]:
        """``types.Law`` values; 0 where rigid."""
        return self.substances.law[self.kind]

    @cached_property
    def mu(self) -> Float[np.ndarray, " P"]:
        """μ [Pa]; 0 where rigid."""
        return self.substances.mu[self.kind]

    @cached_property
    def lam(self) -> Float[np.ndarray, " P"]:
        """λ [Pa]; 0 where rigid."""
        return self.substances.lam[self.kind]

    @cached_property
    def relaxing(self) -> Int[np.ndarray, " K"]:
        """Numbers of the particles with Maxwell branches."""
        return np.flatnonzero(self.substances.relaxes[self.kind])

    @cached_property
    def branches(self) -> MaxwellBranches:
        """Branches of those particles."""
        table, rows = self.substances.branches, self.kind[self.relaxing]
        return MaxwellBranches(table.shear[rows], table.bulk[rows], table.time[rows])

    @cached_property
    def density(self) -> Float[np.ndarray, " P"]:
        """ρ [kg/m³]."""
        return self.substances.density[self.kind]

    @cached_property
    def rigid(self) -> Bool[np.ndarray, " P"]:
        """Whether the particle's body is."""
        return self.substances.rigid[self.kind]

    @cached_property
    def shell(self) -> Bool[np.ndarray, " P"]:
        """Whether the particle is a vertex of a shell."""
        return self.substances.shell[self.kind]

    @cached_property
    def is_shell_body(self) -> Bool[np.ndarray, " B"]:
        """Whether most particles of each body are vertices of shells."""
        return np.bincount(self.body, self.shell, len(self.total)) > 0.5 * np.bincount(self.body)

    @cached_property
    def half_wall(self) -> Float[np.ndarray, " P"]:
        """Half the thickness of the wall at vertices of shells [m]; 0 elsewhere."""
        shells = self.shells
        return vertex_half_wall(shells.mesh.triangle, shells.material.thickness, len(self.mass))

    @cached_property
    def wave_speed(self) -> Float[np.ndarray, " P"]:
        """Longitudinal wave speed at rest [m/s]; 0 where rigid."""
        return self.substances.wave_speed[self.kind]

    @cached_property
    def flip_damping_rate(self) -> Float[np.ndarray, " P"]:
        """Rate at which what the grid cannot see is forgotten [1/s]: see ``MaterialTable``."""
        return self.substances.flip_damping_rate[self.kind]

    @cached_property
    def uses_mean_dilatation(self) -> Bool[np.ndarray, " P"]:
        """Whether pressure comes from a mean dilatation."""
        return self.substances.uses_mean_dilatation[self.kind]

    @cached_property
    def mean_bulk(self) -> Float[np.ndarray, " P"]:
        """Part of λ that acts on the mean dilatation [Pa]; 0 where none does."""
        return self.substances.mean_bulk[self.kind]

    @cached_property
    def own_lam(self) -> Float[np.ndarray, " P"]:
        """The rest of λ, which acts on a particle's own volume [Pa]."""
        return self.lam - self.mean_bulk

    @cached_property
    def flows(self) -> Bool[np.ndarray, " P"]:
        """Whether a return map acts: shape is then not only elastic deformation."""
        return self.substances.flows[self.kind]

    @cached_property
    def pours(self) -> Bool[np.ndarray, " B"]:
        """Whether each body holds a liquid."""
        poured = self.body[np.isin(self.law, laws.LIQUID_LAWS)]
        return np.bincount(poured, minlength=len(self.total)) > 0

    @cached_property
    def inverse_inertia(self) -> Float[np.ndarray, "B 3 3"]:
        """I⁻¹ of each body at the start [1/(kg m²)]; used where rigid."""
        return np.linalg.inv(self.inertia)

    @cached_property
    def half_spacing(self) -> Float[np.ndarray, " P"]:
        """r0: half the distance between particles at rest, or half the wall of a shell [m]."""
        return np.where(self.shell, self.half_wall, 0.5 * np.cbrt(self.volume))

    def fit(
        self, body: int, position: Float[np.ndarray, "P 3"], velocity: Float[np.ndarray, "P 3"]
    ) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """Rigid motion of one body closest to its particles': velocity, angular momentum."""
        mine = self.body == body
        whole = rigid.mass_and_inertia(position[mine], self.mass[mine], self.volume[mine])
        return rigid.fit_motion(whole, position[mine], self.mass[mine], velocity[mine])


@dataclass(frozen=True)
class Velocities:
    """How particles and rigid bodies move; P particles, B bodies."""

    velocity: Float[np.ndarray, "P 3"]
    """[m/s]"""
    speed: Float[np.ndarray, "B 3"]
    """Velocity of rigid bodies' centres [m/s]; 0 for others."""
    spin_momentum: Float[np.ndarray, "B 3"]
    """Their angular momentum about it [kg m²/s]."""

    @classmethod
    def none(cls, problem: Problem) -> "Velocities":
        """Rest: nothing moves."""
        particles = sum(len(body.position) for body in problem.bodies)
        bodies = len(problem.bodies)
        return cls(np.zeros((particles, 3)), np.zeros((bodies, 3)), np.zeros((bodies, 3)))

    @classmethod
    def at_start(cls, problem: Problem) -> "Velocities":
        """Move as the problem says."""
        motion = cls.none(problem)
        motion.velocity[:] = np.concatenate([body.velocity for body in problem.bodies])
        for b, body in enumerate(problem.bodies):
            if body.rigid:
                mass = body.volume * body.density
                whole = rigid.mass_and_inertia(body.position, mass, body.volume)
                fitted = rigid.fit_motion(whole, body.position, mass, body.velocity)
                motion.speed[b], motion.spin_momentum[b] = fitted
        return motion


_SHELL_ARRAYS = tuple(f"shell_{f.name}" for f in fields(ShellState))


def _named_shell_arrays(shell: ShellState) -> dict[str, np.ndarray]:
    return dict(zip(_SHELL_ARRAYS, vars(shell).values(), strict=True))


@dataclass(frozen=True)
class State:
    """What changes. Arrays are replaced, never written to, so an old state stays good."""

    time: Float[np.ndarray, ""]
    position: Float[np.ndarray, "P 3"]
    velocity: Float[np.ndarray, "P 3"]
    affine: Float[np.ndarray, "P 3 3"]
    """C: velocity gradient a particle carries [1/s]."""
    F: Float[np.ndarray, "P 3 3"]
    """Elastic deformation gradient."""
    motion: Float[np.ndarray, "P 3 3"]
    plastic: Float[np.ndarray, " P"]
    volume: Float[np.ndarray, " P"]
    """v_c of granular material."""
    log_volume_ratio: Float[np.ndarray, " P"]
    """ln of the mean volume J̄ that a particle's pressure follows over its own J; see
    ``Matter.uses_mean_dilatation``."""
    branch_strain: Float[np.ndarray, "K 2 3 3"]
    """What Maxwell branches remember, of the particles that have any (``Matter.relaxing``) …"""
    branch_volume: Float[np.ndarray, "K 2"]
    """… see ``physics.branches.Memory``."""
    shell_inverse_rest: Float[np.ndarray, "T 2 2"]
    """History of the triangles of shells, see ``shells.forces.ShellState`` …"""
    shell_plastic_strain: Float[np.ndarray, " T"]
    shell_plastic_curvature: Float[np.ndarray, "T 3"]
    shell_green: Float[np.ndarray, "T 3"]
    shell_bend: Float[np.ndarray, "T 3"]
    shell_branch_strain: Float[np.ndarray, "T 2 3"]
    shell_branch_bend: Float[np.ndarray, "T 2 3"]
    """… to here."""
    centre: Float[np.ndarray, "B 3"]
    """The rest is used for rigid bodies: centre of mass [m] …"""
    speed: Float[np.ndarray, "B 3"]
    """… its velocity [m/s] …"""
    spin_momentum: Float[np.ndarray, "B 3"]
    """… angular momentum about it [kg m²/s] …"""
    rotation: Float[np.ndarray, "B 3 3"]
    """… and how far the body has turned."""

    @classmethod
    def start(cls, problem: Problem, matter: ParticleConstants) -> "State":
        """Bodies as the problem has them: undeformed, with their particles' velocities."""
        position = np.concatenate([np.asarray(b.position, np.float64) for b in problem.bodies])
        velocity = np.concatenate([np.asarray(b.velocity, np.float64) for b in problem.bodies])
        count, bodies = len(position), len(problem.bodies)
        identity = np.broadcast_to(np.eye(3), (count, 3, 3))
        fits = [matter.fit(b, position, velocity) for b in range(bodies)]
        state = cls(
            time=np.zeros(()),
            position=position,
            velocity=velocity,
            affine=np.zeros((count, 3, 3)),
            F=identity,
            motion=identity,
            plastic=np.zeros(count),
            volume=np.zeros(count),
            log_volume_ratio=np.zeros(count),
            branch_strain=np.zeros((len(matter.relaxing), 2, 3, 3)),
            branch_volume=np.zeros((len(matter.relaxing), 2)),
            **_named_shell_arrays(ShellState.start(matter.shells.mesh)),
            centre=matter.centre,
            speed=np.stack([linear for linear, _ in fits]),
            spin_momentum=np.stack([angular for _, angular in fits]),
            rotation=np.tile(np.eye(3), (bodies, 1, 1)),
        )
        return state.follow_rigid(matter)

    @property
    def memory(self) -> BranchMemory:
        """What Maxwell branches remember."""
        return BranchMemory(self.branch_strain, self.branch_volume)

    @property
    def shell(self) -> ShellState:
        """History of the triangles of shells."""
        return ShellState(*(getattr(self, name) for name in _SHELL_ARRAYS))

    def with_shell(self, shell: ShellState) -> "State":
        """Return the state with another history of triangles."""
        return replace(self, **_named_shell_arrays(shell))

    def spin(self, matter: ParticleConstants) -> Float[np.ndarray, "B 3"]:
        """ω of every body [rad/s]; meaningful where rigid."""
        return np.einsum("bij,bj->bi", self.inverse_inertia(matter), self.spin_momentum)

    def inverse_inertia(self, matter: ParticleConstants) -> Float[np.ndarray, "B 3 3"]:
        """I⁻¹ of every body in the world frame [1/(kg m²)]; meaningful where rigid."""
        return self.rotation @ matter.inverse_inertia @ np.swapaxes(self.rotation, 1, 2)

    def follow_rigid(self, matter: ParticleConstants) -> "State":
        """Put the particles of rigid bodies where the bodies are: x = X + R r₀, v = V + ω × r."""
        if not matter.rigid.any():
            return self
        body, stiff = matter.body, matter.rigid[:, None]
        spin = self.spin(matter)[body]
        arm = np.einsum("pij,pj->pi", self.rotation[body], matter.arm)
        affine = np.stack([rigid.cross_matrix(w) for w in self.spin(matter)])[body]
        still = np.eye(3)
        return replace(
            self,
            position=np.where(stiff, self.centre[body] + arm, self.position),
            velocity=np.where(stiff, self.speed[body] + np.cross(spin, arm), self.velocity),
            affine=np.where(stiff[:, None], affine, self.affine),
            F=np.where(stiff[:, None], still, self.F),
            motion=np.where(stiff[:, None], still, self.motion),
        )

    def moving(self, motion: Velocities, matter: ParticleConstants, bodies: Collection[int]) -> "State":
        """Return the same place with other motion of some bodies."""
        mine, body = self._of(matter, bodies)
        return replace(
            self,
            velocity=np.where(mine[:, None], motion.velocity, self.velocity),
            affine=np.where(mine[:, None, None], 0.0, self.affine),
            speed=np.where(body[:, None], motion.speed, self.speed),
            spin_momentum=np.where(body[:, None], motion.spin_momentum, self.spin_momentum),
        ).follow_rigid(matter)

    def placed_as(self, there: "State", matter: ParticleConstants, bodies: Collection[int]) -> "State":
        """Return the same motion with some bodies where, and as strained as, they are there.

        Whatever they were strained by there was long ago: their branches have forgotten it.
        """
        mine, body = self._of(matter, bodies)
        taken = {name: mine for name in ("position", "F", "motion", "plastic", "volume", "log_volume_ratio")}
        taken |= {name: body for name in ("centre", "rotation")}
        taken |= {name: body[matter.shells.body] for name in _SHELL_ARRAYS}
        found = {}
        for name, chosen in taken.items():
            here = getattr(self, name)
            which = chosen.reshape(-1, *(1,) * (here.ndim - 1))
            found[name] = np.where(which, getattr(there, name), here)
        fresh = mine[matter.relaxing]
        found["branch_strain"] = np.where(fresh[:, None, None, None], 0.0, self.branch_strain)
        found["branch_volume"] = np.where(fresh[:, None], 0.0, self.branch_volume)
        return replace(self, **found).follow_rigid(matter)

    def continuing(
        self, there: "State", then: ParticleConstants, matter: ParticleConstants, whole: Collection[int]
    ) -> "State":
        """Return this state with whole bodies, and the time, as they were in another problem.

        Args:
            there: State of the other problem.
            then: Particle constants of the other problem, in which these bodies have their numbers.
            matter: Of this one.
            whole: Bodies that are the same in both.
        """
        mine, body = self._of(matter, whole)
        theirs, their_body = there._of(then, whole)
        found = {"time": there.time}
        for name in vars(self).keys() - found.keys():
            here, chosen, taken = np.array(getattr(self, name)), mine, theirs
            if name in ("centre", "speed", "spin_momentum", "rotation"):
                chosen, taken = body, their_body
            elif name in ("branch_strain", "branch_volume"):
                chosen, taken = mine[matter.relaxing], theirs[then.relaxing]
            elif name in _SHELL_ARRAYS:
                chosen, taken = body[matter.shells.body], their_body[then.shells.body]
            here[chosen] = getattr(there, name)[taken]
            found[name] = here
        return replace(self, **found)

    def _of(self, matter: ParticleConstants, bodies: Collection[int]) -> tuple[np.ndarray, np.ndarray]:
        """Which particles and which bodies are meant."""
        body = np.isin(np.arange(len(self.centre)), list(bodies))
        return body[matter.body], body

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Copy everything into a dict."""
        return {f.name: np.array(getattr(self, f.name)) for f in fields(self)}


def elastic_stress(matter: ParticleConstants, state: State) -> Float[np.ndarray, "P 3 3"]:
    """Kirchhoff stress τ of each particle's own strain [Pa]; none in rigid bodies.

    Without what ``mean_pressure`` adds where material is nearly incompressible.
    """
    m, s = matter, state
    out = np.zeros_like(s.F)
    soft = ~m.rigid
    out[soft] = laws.tau(m.law[soft], s.F[soft], m.mu[soft], m.own_lam[soft])
    return out


def branch_stress(matter: ParticleConstants, memory: BranchMemory) -> Float[np.ndarray, "P 3 3"]:
    """Kirchhoff stress of the Maxwell branches [Pa]."""
    out = np.zeros((len(matter.mass), 3, 3))
    out[matter.relaxing] = maxwell_branches.maxwell_stress(matter.branches, memory)
    return out


def branch_energy(matter: ParticleConstants, memory: BranchMemory) -> Float[np.ndarray, " P"]:
    """Energy that the branches of each particle hold [J]."""
    out, k = np.zeros(len(matter.mass)), matter.relaxing
    out[k] = matter.volume[k] * maxwell_branches.branch_free_energy(matter.branches, memory)
    return out


def mean_pressure(matter: ParticleConstants, state: State) -> Float[np.ndarray, " P"]:
    """Kirchhoff pressure of the mean dilatation [Pa]; 0 where pressure is one's own."""
    m, k, out = matter, matter.uses_mean_dilatation, np.zeros(len(state.F))
    mean = np.maximum(mean_volume(state.F[k], state.log_volume_ratio[k]), MIN_VOLUME_RATIO)
    out[k] = laws.mean_pressure(m.law[k], mean, m.mean_bulk[k])
    return out


def mean_volume(F: Float[np.ndarray, "P 3 3"], log_volume_ratio: Float[np.ndarray, " P"]) -> Float[np.ndarray, " P"]:
    """J̄ = J exp(log_volume_ratio) [-]."""
    return determinant(F) * np.exp(log_volume_ratio)


def strain_energy(
    matter: ParticleConstants, F: Float[np.ndarray, "P 3 3"], log_volume_ratio: Float[np.ndarray, " P"]
) -> Float[np.ndarray, " P"]:
    """Elastic energy of each particle [J] at F and the log_volume_ratio of its mean dilatation."""
    m, out = matter, np.zeros(len(F))
    soft, k = ~m.rigid, m.uses_mean_dilatation
    out[soft] = laws.psi(m.law[soft], F[soft], m.mu[soft], m.own_lam[soft])
    out[k] += laws.psi_mean(m.law[k], mean_volume(F[k], log_volume_ratio[k]), m.mean_bulk[k])
    return m.volume * out


def return_to_yield_surface(matter: ParticleConstants, state: State, dt: float) -> tuple[State, float]:
    """Bring what flows back to what it can bear after a step of dt [s]; give the energy lost [J].

    What takes any shape keeps no other motion than its elastic one.
    """
    k = np.flatnonzero(matter.flows)
    F, plastic, volume = state.F.copy(), state.plastic.copy(), state.volume.copy()
    numbers = matter.substances.numbers(matter.kind[k], dt)
    flow = laws.flow(matter.law[k], F[k], numbers, plastic[k], volume[k])
    F[k], volume[k] = flow.F, flow.volume
    plastic[k] += flow.plastic_strain
    loss = float(np.sum(matter.volume[k] * flow.loss))
    pours = np.isin(matter.law, laws.LIQUID_LAWS)[:, None, None] & ~matter.rigid[:, None, None]
    motion = np.where(pours, F, state.motion)
    return replace(state, F=F, motion=motion, plastic=plastic, volume=volume), loss
