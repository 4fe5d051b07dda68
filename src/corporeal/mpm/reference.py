"""The reference engine: NumPy, double precision, one idea per function. Slow and to be trusted.

Moving-least-squares MPM (Hu et al. 2018) with one field per body and explicit contact between
fields. Every other engine is compared with this one.
"""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from corporeal.errors import SimulationError
from corporeal.mpm import elasticity, rigid
from corporeal.mpm.bond import Bonds, without
from corporeal.mpm.driving import Drive
from corporeal.mpm.encounter import Meeting, Scene, resolve
from corporeal.mpm.grip import Grip, Hold, check, regripped, take_hold, take_hold_of_rigid
from corporeal.mpm.ledger import Ledger
from corporeal.mpm.matter import Matter, State, elastic_stress, flowed
from corporeal.mpm.problem import Measure, Problem, Snapshot, Steps
from corporeal.mpm.reckoning import measured, shown
from corporeal.mpm.springs import longest_step, struck
from corporeal.mpm.stencil import Stencil, stencil
from corporeal.mpm.swelling import relief
from corporeal.types import Vector

RIGID_COURANT = 0.05
"""Largest fraction of a cell that a rigid body may cross in one step."""
FALL = 0.1
"""Largest step as a fraction of the time √(dx/g) in which a body at rest falls half a cell."""
SUNK = 8.0
"""A particle deeper than this in a wall [cells] has left the domain."""
FARTHEST = 1e5
"""A particle farther than this from the origin [cells] has left the domain."""


class ReferenceEngine:
    """Steps one problem with NumPy in double precision."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.steps = Steps()
        self.matter = Matter.of(problem)
        self.state = State.start(problem, self.matter)
        self.bonds = Bonds(problem)
        self.grips: dict[int, Grip] = {}
        self.ledger = Ledger.blank(len(problem.bodies), len(problem.planes))
        self.lost = np.zeros(len(self.matter.mass), dtype=bool)

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        return float(self.state.time)

    def advance(self, until: float) -> None:
        """Step until exactly ``until`` [s], choosing steps by stability."""
        while self.time < until:
            left = until - self.time
            count = max(1, int(np.ceil(left / self.stable_step() - 1e-9)))
            self.step(left / count)
            if count == 1:
                self.state = replace(self.state, time=np.array(until))

    def step(self, dt: float) -> None:
        """Take one step of dt [s]."""
        matter, cell = self.matter, self.problem.cell
        grid = stencil(self.state.position, self._field, cell)
        kick, push = self._kicks(dt)
        mass, old, new = self._to_grid(grid, kick, dt)
        drive = Drive(self.problem, matter, self.state, grid, self.grips)
        loaded, damped = drive.act((mass, new), (kick, push), dt)
        state, new = loaded.state, loaded.velocity
        held = tuple(self.bonds.compose(matter, state, grid, mass, new))
        stage = Scene(self.problem, matter, state, grid, without(mass, held), kick, old, held)
        meeting = resolve(stage, new, dt)
        for composite in held:
            meeting = composite.split(meeting)
        moved, viscous_loss = self._from_grid(grid, old, meeting.velocity, dt)
        settled, plastic_loss = flowed(matter, moved)
        turned = self._move_rigid(settled, meeting, dt)
        self._check(turned)
        self.ledger.plastic_loss += plastic_loss
        self.ledger.viscous_loss += viscous_loss + damped
        self._enter(meeting, grid, kick, push)
        self.ledger.external_impulse += loaded.impulse
        self.ledger.push_work += loaded.work
        self.state = replace(turned, time=np.array(self.time + dt))
        self.steps.count += 1
        self.steps.smallest = min(self.steps.smallest, dt)
        self.steps.largest = max(self.steps.largest, dt)

    # ------------------------------------------------------------ time step

    def stable_step(self) -> float:
        """Largest stable step now [s].

        dt = s dx/(c_p + |v|) over deformable particles, with c_p grown by their stretch and
        shortened by viscosity as an explicit oscillator demands; rigid bodies cross at most
        .05 dx; nothing falls more than a fraction of a cell from rest.
        """
        m, cell = self.matter, self.problem.cell
        speed = np.linalg.norm(self.state.velocity, axis=1)
        limits = [np.inf]
        soft = ~m.rigid
        if soft.any():
            stretch = np.linalg.norm(self.state.F[soft], axis=(1, 2)) / np.sqrt(3.0)
            wave = m.wave_speed[soft] * np.maximum(1.0, stretch)
            modulus = np.maximum((m.lam + 2.0 * m.mu)[soft], 1e-30)
            damping = m.viscosity[soft] / modulus * wave / cell
            slower = np.sqrt(1.0 + damping**2) - damping
            crossing = self.problem.courant * cell / max(wave.max() + speed[soft].max(), 1e-30)
            limits.append(crossing * slower.min())
        if m.rigid.any():
            limits.append(RIGID_COURANT * cell / max(speed[m.rigid].max(), 1e-30))
        pulls = [body.push.acceleration for body in self.problem.bodies if body.push is not None]
        strongest = max(float(np.linalg.norm(p)) for p in [self.problem.gravity, *pulls])
        limits += [FALL * np.sqrt(cell / max(strongest, 1e-30)), longest_step(self.problem)]
        return float(min(min(limits), 1.0))

    # ------------------------------------------------------------ forces

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
        return gravity + push, push

    # ------------------------------------------------------------ particles to grid and back

    def _to_grid(
        self, grid: Stencil, kick: np.ndarray, dt: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Scatter mass and momentum; give mass, velocity before forces and velocity after.

        m_i = Σ w m_p;  p_i = Σ w m_p (v_p + C_p (x_i - x_p));
        force on i: -Σ V₀ (4/dx²) w τ (x_i - x_p), the gradient that F is updated with.
        """
        m, s = self.matter, self.state
        mass, p = grid.scatter(m.mass), m.mass[:, None]
        pull = -dt * 4.0 / self.problem.cell**2 * m.volume[:, None, None] * self._stress()
        plain = grid.scatter(np.hstack([p * s.velocity, p * kick[m.body]]))
        moment = grid.scatter_moment(np.hstack([p[:, :, None] * s.affine, pull]))
        old, gained = np.split(plain + moment, 2, axis=1)
        full = np.maximum(mass, 1e-300)[:, None]
        return mass, old / full, (old + gained) / full

    def _stress(self) -> Float[np.ndarray, "P 3 3"]:
        """Kirchhoff stress τ, elastic and viscous [Pa]; none in rigid bodies."""
        return elastic_stress(self.matter, self.state) + self._viscous_stress()

    def _viscous_stress(self) -> Float[np.ndarray, "P 3 3"]:
        """Kelvin–Voigt part τ_v = J η (C + Cᵀ) [Pa]."""
        m, s = self.matter, self.state
        if not m.viscosity.any():
            return np.zeros_like(s.affine)
        viscous = np.where(m.rigid, 0.0, m.viscosity) * elasticity.determinant(s.F)
        return viscous[:, None, None] * (s.affine + elasticity.transpose(s.affine))

    def _from_grid(
        self, grid: Stencil, old: np.ndarray, new: np.ndarray, dt: float
    ) -> tuple[State, float]:
        """Gather what the particle's own field says, and remember what the grid cannot see.

        v_p = S v_new + a (v_p - S v_old);  C_p = ∇v_new + a (C_p - ∇v_old);
        x_p += dt S v_new;  F ← (1 + dt ∇v_new) F;  a = 1 - min(1, rate dt), 0 for APIC.

        Returns:
            The state after it, and the energy that viscosity took [J].

        """
        m, state = self.matter, self.state
        forget = np.minimum(1.0, m.forgetting * dt)
        keep = 1.0 - forget
        both = np.hstack([new, old])
        v, v_old = np.split(grid.gather(both), 2, axis=1)
        gradient, gradient_old = np.split(grid.gather_gradient(both), 2, axis=1)
        lost_v, lost_c = state.velocity - v_old, state.affine - gradient_old
        step = np.eye(3) + dt * gradient
        viscous = np.sum(self._viscous_stress() * gradient, axis=(1, 2))
        after = replace(
            state,
            position=state.position + dt * v,
            velocity=v + keep[:, None] * lost_v,
            affine=gradient + keep[:, None, None] * lost_c,
            F=step @ state.F,
            motion=step @ state.motion,
            relief=relief(m, state.F, grid),
        )
        return after, dt * float(np.sum(m.volume * viscous))

    def _move_rigid(self, state: State, meeting: Meeting, dt: float) -> State:
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
            turned[b] = rigid.turned(R, matter.inertia[b], momentum[b], dt)
        moved = replace(state, centre=centre, speed=speed, spin_momentum=momentum, rotation=turned)
        return moved.follow_rigid(matter)

    # ------------------------------------------------------------ safety and ledger

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
        cell = self.problem.cell
        finite = np.isfinite(state.position).all(axis=1) & np.isfinite(state.F).all(axis=(1, 2))
        with np.errstate(invalid="ignore"):
            inside = finite & (np.abs(state.position) < FARTHEST * cell).all(axis=1)
            for plane in self.problem.planes:
                height = state.position @ np.array(plane.normal) - plane.offset
                inside &= height > -SUNK * cell
        return np.logical_not(inside)

    def _enter(self, meeting: Meeting, grid: Stencil, kick: np.ndarray, push: np.ndarray) -> None:
        """Book the step: impulses, work and losses."""
        m, s, book = self.matter, self.state, self.ledger
        book.external_impulse += m.total[:, None] * kick
        book.friction_loss += meeting.friction_loss
        for b in np.flatnonzero(np.any(push != 0.0, axis=1)):
            mine = m.body == b
            mean = m.mass[mine] @ s.velocity[mine] / m.total[b] + 0.5 * kick[b]
            book.push_work += m.total[b] * push[b] @ mean
        if self.problem.contact == "single":
            meeting = self._shared(meeting, grid)
        book.enter(meeting.pair, meeting.impulse, meeting.contacts, self.time)

    def _shared(self, meeting: Meeting, grid: Stencil) -> Meeting:
        """Give each body its part, by mass, of the impulses on the field that all share."""
        m, bodies = self.matter, len(self.problem.bodies)
        slot = meeting.contacts.a - bodies
        parts = []
        for b in range(bodies):
            parts.append(grid.scatter(np.where(m.body == b, m.mass, 0.0))[slot])
        share = np.stack(parts) / np.maximum(np.sum(parts, axis=0), 1e-300)
        pair = np.tile(meeting.pair, (bodies, 1))
        pair[:, 0] = np.repeat(np.arange(bodies), len(slot))
        return replace(
            meeting,
            pair=pair,
            contacts=meeting.contacts.repeated(bodies),
            impulse=(share[:, :, None] * meeting.impulse).reshape(-1, 3),
        )

    # ------------------------------------------------------------ from outside

    def poke(self, body: int, point: Vector, impulse: Vector) -> None:
        """Give a body an impulse [N s] at a point [m] at once: see ``problem.Interactive``."""
        check(self.problem, body, point, impulse)
        hold, given, m, s = self._hold(body, point), np.array(impulse), self.matter, self.state
        before = self.measure().kinetic[body]
        if self.problem.bodies[body].rigid:
            arm = s.rotation[body] @ hold.arm
            self.state = struck(s, m, body, given, np.cross(arm, given)).follow_rigid(m)
        else:
            own = np.flatnonzero(m.body == body)[hold.particle]
            velocity = s.velocity.copy()
            velocity[own] += hold.share[:, None] * given / m.mass[own][:, None]
            self.state = replace(s, velocity=velocity)
        self.ledger.external_impulse[body] += given
        self.ledger.push_work += self.measure().kinetic[body] - before

    def drag(self, body: int, point: Vector | None, target: Vector, stiffness: float) -> None:
        """Pull on a body by a spring until told otherwise: see ``problem.Interactive``."""
        check(self.problem, body, point, target)
        hold = None if point is None else self._hold(body, point)
        pull, total = (target, stiffness), float(self.matter.total[body])
        self.grips = regripped(self.grips, body, hold, pull, total)

    def _hold(self, body: int, point: Vector) -> Hold:
        s, m = self.state, self.matter
        if self.problem.bodies[body].rigid:
            return take_hold_of_rigid(m.total[body], s.centre[body], s.rotation[body], point)
        place = s.position[m.body == body]
        return take_hold(self.problem.bodies[body], place, point, self.problem.cell)

    # ------------------------------------------------------------ reading and keeping

    def snapshot(self) -> Snapshot:
        """Copy every particle's state."""
        return shown(self.matter, self.state)

    def measure(self) -> Measure:
        """Add up the ledger."""
        return measured(self.problem, self.matter, self.state, self.ledger, self.lost)

    def save(self) -> dict[str, np.ndarray]:
        """Everything needed to go on later exactly as if nothing had happened."""
        steps = np.array([self.steps.count, self.steps.smallest, self.steps.largest])
        state = {f"state.{k}": v for k, v in self.state.as_arrays().items()}
        return (
            state
            | {f"ledger.{k}": v for k, v in self.ledger.as_arrays().items()}
            | {"steps": steps}
        )

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Go on from what ``save`` returned, on an engine built from the same problem."""
        self.state = State(**_of("state.", saved))
        self.ledger = Ledger(**_of("ledger.", saved))
        count, smallest, largest = saved["steps"].tolist()
        self.steps = Steps(int(count), smallest, largest)
        self.lost = self._lost(self.state)

    def halt(self, bodies: Collection[int]) -> None:
        """Take all motion out of some bodies; nothing of it is booked."""
        self.state = self.state.halted(self.matter, bodies)

    def begin(self, saved: dict[str, np.ndarray], bodies: Collection[int]) -> None:
        """Put some bodies where they were in another's ``save``: see ``problem.Engine``."""
        there = State(**_of("state.", saved))
        self.state = self.state.placed_as(there, self.matter, bodies)


def _of(kind: str, saved: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {k.removeprefix(kind): np.array(v) for k, v in saved.items() if k.startswith(kind)}


def _ramped(time: float, ramp: float) -> float:
    """∫ min(1, t/ramp) dt from 0 to ``time`` [s]."""
    if time >= ramp:
        return time - 0.5 * ramp
    return 0.5 * time**2 / ramp
