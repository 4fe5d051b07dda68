"""The reference engine: NumPy in double precision, slow, for verification.

Moving-least-squares MPM (Hu et al. 2018) with one field per body and explicit contact between fields. Every other
engine is compared with this one.
"""

from collections.abc import Collection
from dataclasses import replace
from typing import Self

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.errors import SimulationError
from corporeal.mpm import laws
from corporeal.mpm.body_changes import BodyChange, EngineBodyChanges
from corporeal.mpm.constants import (
    FREE_FALL_STEP_FRACTION,
    MAX_DISTANCE_FROM_ORIGIN_DX,
    MAX_STEP_S,
    MAX_WALL_DEPTH_DX,
    RIGID_COURANT,
    STEP_ROUNDING,
    TINY,
    TINY_DOUBLE,
)
from corporeal.mpm.diagnostics import BodySums, particle_energy
from corporeal.mpm.engine_interaction import EngineLoadChanges
from corporeal.mpm.ledger import EngineLedger
from corporeal.mpm.physics import contact, rigid
from corporeal.mpm.physics.grid_spline import Stencil, stencil
from corporeal.mpm.physics.maxwell_branches import advance_branches
from corporeal.mpm.physics.spring_grips import Grip
from corporeal.mpm.physics.springs import longest_step
from corporeal.mpm.problem import Problem, Snapshot, StepStatistics
from corporeal.mpm.reference.contact import ContactOutcome, resolve_contacts
from corporeal.mpm.reference.contact_scene import ContactScene, NormalCache
from corporeal.mpm.reference.inclusions import FrameBonds, without_held_nodes
from corporeal.mpm.reference.mean_dilatation import DilatationClusters, group_clusters
from corporeal.mpm.reference.prescribed_bodies import PrescribedBodies
from corporeal.mpm.reference.springs import add_impulse
from corporeal.mpm.reference.step_forces import StepForces
from corporeal.mpm.shells.assemble import Shells, longest_shell_step
from corporeal.mpm.shells.forces import shell_step
from corporeal.mpm.state import (
    ParticleConstants,
    State,
    Velocities,
    branch_stress,
    elastic_stress,
    mean_pressure,
    mean_volume,
    return_to_yield_surface,
)


class ReferenceEngine(EngineBodyChanges, EngineLoadChanges):
    """Steps one problem with NumPy in double precision."""

    name = "reference"

    def __init__(self, problem: Problem, threads: int | None = None) -> None:
        """Put all particles into one list."""
        self.problem = problem
        self.steps = StepStatistics()
        self.matter = ParticleConstants.of(problem)
        self.state = State.start(problem, self.matter)
        self.bonds = FrameBonds(problem)
        self.guides = PrescribedBodies(problem)
        self.grips: dict[int, Grip] = {}
        self.kept = NormalCache.none()
        self.ledger = EngineLedger.blank(len(problem.bodies), len(problem.planes))
        self.lost = np.zeros(len(self.matter.mass), dtype=bool)

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        return float(self.state.time)

    def advance(self, until: float) -> None:
        """Step until exactly ``until`` [s], choosing steps by stability."""
        while self.time < until:
            left = until - self.time
            count = max(1, int(np.ceil(left / self.stable_step() - STEP_ROUNDING)))
            self.step(left / count)
            if count == 1:
                self.state = replace(self.state, time=np.array(until))

    def step(self, dt: float) -> None:
        """Take one step of dt [s]."""
        matter, cell, before = self.matter, self.problem.cell, self.state
        self.state, guided = self.guides.steer(before, matter, dt)
        grid = stencil(self.state.position, self._field, cell)
        kick, push = self._kicks(dt)
        groups = group_clusters(matter, self.state, self._field, cell)
        mass, old, new = self._to_grid(grid, groups, kick, dt)
        new = new + self._shell_kick(grid, mass, dt)
        drive = StepForces(self.problem, matter, self.state, grid, self.grips)
        loaded, damped = drive.act((mass, new), (kick, push), dt)
        state, new = loaded.state, loaded.velocity
        held = tuple(self.bonds.compose(matter, state, grid, mass, new))
        scene = ContactScene(
            self.problem,
            matter,
            state,
            grid,
            without_held_nodes(mass, held),
            kick,
            old,
            dt,
            self._kept_choices(dt),
            held,
        )
        meeting = resolve_contacts(scene, new, dt)
        for composite in held:
            meeting = composite.split(meeting)
        moved, viscous_work = self._from_grid(grid, groups, old, meeting.velocity, dt)
        settled, plastic_loss = return_to_yield_surface(matter, moved, dt)
        turned = self.guides.place(self._move_rigid(settled, meeting, dt), matter, guided)
        self._check(turned)
        self.kept = meeting.kept
        self.ledger.plastic_loss += plastic_loss
        self.ledger.viscous_loss += viscous_work + damped
        self._book_step(meeting, grid, kick, push)
        self.ledger.external_impulse += loaded.impulse
        self.ledger.push_work += loaded.work
        self.guides.book(self.ledger, matter, before, turned, meeting)
        self.state = replace(turned, time=np.array(self.time + dt))
        self.steps.count += 1
        self.steps.smallest = min(self.steps.smallest, dt)
        self.steps.largest = max(self.steps.largest, dt)

    def stable_step(self) -> float:
        """Largest stable step now [s].

        dt = s dx/(c + |v|) over deformable particles, with the law's bound on c at their strain,
        grown by what branches resist at once; rigid bodies cross at most .05 dx; nothing falls
        more than a fraction of a cell from rest.
        """
        m, cell = self.matter, self.problem.cell
        speed = np.linalg.norm(self.state.velocity, axis=1)
        limits = [np.inf]
        soft = ~m.rigid
        if soft.any():
            law, F = m.law[soft], self.state.F[soft]
            mean = mean_volume(F, self.state.log_volume_ratio[soft])
            modulus = laws.wave_modulus(law, F, m.mu[soft], m.own_lam[soft])
            modulus += laws.mean_modulus(law, mean, m.mean_bulk[soft])
            wave = np.sqrt(modulus / m.density[soft])
            stiffening = m.substances.stiffening[m.kind[soft]]
            fastest = (wave * stiffening).max() + speed[soft].max()
            limits.append(self.problem.courant * cell / max(fastest, TINY))
        if m.rigid.any():
            limits.append(RIGID_COURANT * cell / max(speed[m.rigid].max(), TINY))
        pulls = [body.push.acceleration for body in self.problem.bodies if body.push is not None]
        strongest = max(float(np.linalg.norm(p)) for p in [self.problem.gravity, *pulls])
        limits += [FREE_FALL_STEP_FRACTION * np.sqrt(cell / max(strongest, TINY)), longest_step(self.problem)]
        limits.append(self.guides.longest_step)
        limits.append(longest_shell_step(m.shells, self.problem.courant, cell, float(speed.max(initial=0.0))))
        return float(min(min(limits), MAX_STEP_S))

    def _kept_choices(self, dt: float) -> NormalCache:
        """Candidate normals of the last step; none where all are looked at anew."""
        soft = ~self.matter.rigid
        speed = np.linalg.norm(self.state.velocity[soft], axis=1).max(initial=0.0)
        anew = self.steps.count % contact.normal_cache_steps(speed * dt / self.problem.cell) == 0
        return NormalCache.none() if anew else self.kept

    @property
    def _field(self) -> Int[np.ndarray, " P"]:
        single = self.problem.contact == "single"
        return np.zeros_like(self.matter.body) if single else self.matter.body

    def _kicks(self, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Velocity [m/s] that gravity and push give each body in this step; the push's alone."""
        start, end, ramp = self.time, self.time + dt, self.problem.gravity_ramp
        gravity = np.array(self.problem.gravity) * (_ramped(end, ramp) - _ramped(start, ramp))
        push = np.zeros((len(self.problem.bodies), 3))
        for b, body in enumerate(self.problem.bodies):
            if body.push is not None:
                span = max(0.0, min(end, body.push.end) - max(start, body.push.start))
                push[b] = np.array(body.push.acceleration) * span
        kick = gravity + push
        kick[list(self.guides.guide)] = 0.0
        return kick, push

    def _to_grid(
        self, grid: Stencil, groups: DilatationClusters, kick: np.ndarray, dt: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Scatter mass and momentum; give mass, velocity before forces and velocity after.

        m_i = Σ w m_p;  p_i = Σ w m_p (v_p + C_p (x_i - x_p));
        force on i: -Σ V₀ (4/dx²) w τ (x_i - x_p), the gradient that F is updated with.
        """
        m, s = self.matter, self.state
        mass, p = grid.scatter(m.mass), m.mass[:, None]
        pull = -dt * 4.0 / self.problem.cell**2 * m.volume[:, None, None] * self._stress(groups)
        plain = grid.scatter(np.hstack([p * s.velocity, p * kick[m.body]]))
        moment = grid.scatter_moment(np.hstack([p[:, :, None] * s.affine, pull]))
        old, gained = np.split(plain + moment, 2, axis=1)
        full = np.maximum(mass, TINY_DOUBLE)[:, None]
        return mass, old / full, (old + gained) / full

    def _shell_kick(self, grid: Stencil, mass: np.ndarray, dt: float) -> np.ndarray:
        """Velocity that the forces of shells give the slots [m/s]; their triangles yield and relax first."""
        shells = self.matter.shells
        if not shells:
            return np.zeros((grid.count, 3))
        done = shell_step(shells.mesh, shells.material, self.state.shell, self.state.position, dt)
        self.state = self.state.with_shell(done.state)
        self.ledger.plastic_loss += done.plastic_loss
        self.ledger.viscous_loss += done.branch_work
        return grid.scatter(dt * done.force) / np.maximum(mass, TINY_DOUBLE)[:, None]

    def _stress(self, groups: DilatationClusters) -> Float[np.ndarray, "P 3 3"]:
        """Kirchhoff stress τ, of the laws and of branches [Pa]; none in rigid bodies."""
        shared = groups.mean(mean_pressure(self.matter, self.state))[:, None, None] * np.eye(3)
        stress = elastic_stress(self.matter, self.state) + shared
        return stress + branch_stress(self.matter, self.state.memory)

    def _from_grid(
        self, grid: Stencil, groups: DilatationClusters, old: np.ndarray, new: np.ndarray, dt: float
    ) -> tuple[State, float]:
        """Gather what the particle's own field says, and remember what the grid cannot see.

        v_p = S v_new + a (v_p - S v_old);  C_p = ∇v_new + a (C_p - ∇v_old);
        x_p += dt S v_new;  F ← (1 + dt ∇v_new) F;  a = 1 - min(1, rate dt), 0 for APIC;
        ln J̄/J += dt (A - 1) tr ∇v_new, with A the mean over a group of ``mean_dilatation``.

        Returns:
            The state after it, and the work done on Maxwell branches [J].
        """
        m, state = self.matter, self.state
        forget = np.minimum(1.0, m.flip_damping_rate * dt)
        keep = 1.0 - forget
        both = np.hstack([new, old])
        v, v_old = np.split(grid.gather(both), 2, axis=1)
        gradient, gradient_old = np.split(grid.gather_gradient(both), 2, axis=1)
        lost_v, lost_c = state.velocity - v_old, state.affine - gradient_old
        step = np.eye(3) + dt * np.where(m.shell[:, None, None], 0.0, gradient)
        k, branches = m.relaxing, m.branches
        memory = advance_branches(state.memory, dt * gradient[k], branches.time, dt)
        grown = np.where(m.uses_mean_dilatation, dt * np.trace(gradient, axis1=1, axis2=2), 0.0)
        after = replace(
            state,
            position=state.position + dt * v,
            velocity=v + keep[:, None] * lost_v,
            affine=gradient + keep[:, None, None] * lost_c,
            F=step @ state.F,
            motion=step @ state.motion,
            log_volume_ratio=state.log_volume_ratio + groups.mean(grown) - grown,
            branch_strain=memory.strain,
            branch_volume=memory.volume,
        )
        work = dt * np.sum(branch_stress(m, state.memory) * gradient, axis=(1, 2)) * m.volume
        return after, float(np.sum(work))

    def _move_rigid(self, state: State, meeting: ContactOutcome, dt: float) -> State:
        """Move and turn rigid bodies: X += dt V, R ← exp(ω dt) R; their particles follow.

        In the single field they have no velocity of their own: V and ω fit what they gathered.
        """
        matter = self.matter
        speed, momentum = state.speed.copy(), state.spin_momentum.copy()
        centre, turned = state.centre.copy(), state.rotation.copy()
        for b in [b for b, body in enumerate(self.problem.bodies) if body.rigid]:
            R = state.rotation[b]
            if self.problem.contact == "single":
                speed[b], momentum[b] = matter.fit(b, self.state.position, state.velocity)
            else:
                speed[b] = meeting.speed[b]
                momentum[b] = R @ matter.inertia[b] @ R.T @ meeting.spin[b]
            centre[b] = centre[b] + dt * speed[b]
            turned[b] = rigid.integrate_rotation(R, matter.inertia[b], momentum[b], dt)
        moved = replace(state, centre=centre, speed=speed, spin_momentum=momentum, rotation=turned)
        return moved.follow_rigid(matter)

    def _check(self, state: State) -> None:
        """Raise when a particle is not finite or left the domain; the old state stays."""
        self.lost = self._lost(state)
        if not self.lost.any():
            return
        body = self.problem.bodies[int(self.matter.body[np.argmax(self.lost)])].name
        raise SimulationError(
            f"At t = {self.time:.4g} s {int(self.lost.sum())} particles of {body!r} were lost: "
            "they left the domain or were torn or turned inside out. What was computed before is "
            "kept. Ask for more detail, or look for objects that overlap at the start."
        )

    def _lost(self, state: State) -> np.ndarray:
        """Mark particles that are not finite, far away or deep inside a wall."""
        cell, prescribed = self.problem.cell, np.isin(self.matter.body, list(self.guides.guide))
        finite = np.isfinite(state.position).all(axis=1) & np.isfinite(state.F).all(axis=(1, 2))
        with np.errstate(invalid="ignore"):
            inside = finite & (np.abs(state.position) < MAX_DISTANCE_FROM_ORIGIN_DX * cell).all(axis=1)
            for plane in self.problem.planes:
                height = state.position @ np.array(plane.normal) - plane.offset
                inside &= (height > -MAX_WALL_DEPTH_DX * cell) | prescribed
        return np.logical_not(inside)

    def _book_step(self, meeting: ContactOutcome, grid: Stencil, kick: np.ndarray, push: np.ndarray) -> None:
        """Book the step: impulses, work and losses."""
        m, s, book = self.matter, self.state, self.ledger
        book.external_impulse += m.total[:, None] * kick
        book.friction_loss += meeting.friction_loss
        book.strike(meeting.pair, meeting.impact_loss)
        for b in np.flatnonzero(np.any(push != 0.0, axis=1)):
            mine = m.body == b
            mean = m.mass[mine] @ s.velocity[mine] / m.total[b] + 0.5 * kick[b]
            book.push_work += m.total[b] * push[b] @ mean
        if self.problem.contact == "single":
            meeting = self._shared(meeting, grid)
        where = meeting.contacts
        book.enter(meeting.pair, meeting.impulse, where.normal, where.point, self.time)

    def _shared(self, meeting: ContactOutcome, grid: Stencil) -> ContactOutcome:
        """Give each body its part, by mass, of the impulses on the field that all share."""
        m, bodies = self.matter, len(self.problem.bodies)
        slot = meeting.contacts.a - bodies
        parts = []
        for b in range(bodies):
            parts.append(grid.scatter(np.where(m.body == b, m.mass, 0.0))[slot])
        share = np.stack(parts) / np.maximum(np.sum(parts, axis=0), TINY_DOUBLE)
        pair = np.tile(meeting.pair, (bodies, 1))
        pair[:, 0] = np.repeat(np.arange(bodies), len(slot))
        return replace(
            meeting,
            pair=pair,
            contacts=meeting.contacts.repeated(bodies),
            impulse=(share[:, :, None] * meeting.impulse).reshape(-1, 3),
        )

    def save(self) -> dict[str, np.ndarray]:
        """Everything needed to go on later exactly as if nothing had happened."""
        steps = np.array([self.steps.count, self.steps.smallest, self.steps.largest])
        state = {f"state.{k}": v for k, v in self.state.as_arrays().items()}
        return (
            state
            | {f"ledger.{k}": v for k, v in self.ledger.as_arrays().items()}
            | {f"kept.{k}": v for k, v in self.kept.as_arrays().items()}
            | {"steps": steps}
        )

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Go on from what ``save`` returned, on an engine built from the same problem."""
        self.state = State(**_of("state.", saved))
        self.ledger = EngineLedger(**_of("ledger.", saved))
        self.kept = NormalCache(**_of("kept.", saved))
        count, smallest, largest = saved["steps"].tolist()
        self.steps = StepStatistics(int(count), smallest, largest)
        self.lost = self._lost(self.state)

    def _particles(self) -> Snapshot:
        s = self.state
        copies = (s.position, s.velocity, s.F, s.motion, s.plastic)
        return Snapshot(self.time, *(np.array(array) for array in copies))

    def _sums(self) -> BodySums:
        m, s = self.matter, self.state
        return BodySums.of(m, self._particles(), s.affine, particle_energy(m, s), self.problem.cell)

    def _rigid_bodies(self) -> dict[int, rigid.RigidBody]:
        m, s, spin = self.matter, self.state, self.state.spin(self.matter)
        return {
            b: rigid.RigidBody(
                mass=float(m.total[b]),
                centre=s.centre[b],
                rotation=s.rotation[b],
                velocity=s.speed[b],
                angular_momentum=s.spin_momentum[b],
                spin=spin[b],
                start=m.centre[b],
                arm=m.arm[m.body == b],
            )
            for b, body in enumerate(self.problem.bodies)
            if body.rigid
        }

    def _shells(self) -> Shells:
        return self.matter.shells

    def _booked(self) -> EngineLedger:
        return self.ledger

    def _enter(self, body: int, impulse: np.ndarray, work: float) -> None:
        self.ledger.external_impulse[body] += impulse
        self.ledger.push_work += work

    def _add_velocity(self, body: int, particle: np.ndarray, gained: np.ndarray) -> None:
        velocity = self.state.velocity.copy()
        velocity[np.flatnonzero(self.matter.body == body)[particle]] += gained
        self.state = replace(self.state, velocity=velocity)

    def _add_momentum(self, body: int, momentum: np.ndarray, angular: np.ndarray) -> None:
        after = add_impulse(self.state, self.matter, body, momentum, angular)
        self.state = after.follow_rigid(self.matter)

    def _take_grips(self) -> None:
        """Do nothing: a step reads ``grips``."""

    def _take_loads(self) -> None:
        self.guides = PrescribedBodies(self.problem)  # a step reads the rest from ``problem``

    def _set_motion(self, bodies: Collection[int], motion: Velocities) -> None:
        self.state = self.state.moving(motion, self.matter, bodies)

    def _place_as(self, saved: dict[str, np.ndarray], bodies: Collection[int]) -> None:
        there = State(**_of("state.", saved))
        self.state = self.state.placed_as(there, self.matter, bodies)
        self.kept = NormalCache.none()

    def _successor(self, problem: Problem, change: BodyChange) -> Self:
        after = type(self)(problem)
        after.state = after.state.continuing(self.state, self.matter, after.matter, change.whole)
        after.ledger = EngineLedger(**change.inherited(self.ledger.as_arrays()))
        after.steps = replace(self.steps)
        return after


def _of(kind: str, saved: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {k.removeprefix(kind): np.array(v) for k, v in saved.items() if k.startswith(kind)}


def _ramped(time: float, ramp: float) -> float:
    """∫ min(1, t/ramp) dt from 0 to ``time`` [s]."""
    if time >= ramp:
        return time - 0.5 * ramp
    return 0.5 * time**2 / ramp
