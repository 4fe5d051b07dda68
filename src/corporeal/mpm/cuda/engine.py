"""The engine for CUDA GPUs: all steps of a frame in one graph, without host synchronisation.

The same method as ``reference``, in plain Warp: particles in float32 with their places relative
to the grid, rigid bodies and impulses in double precision. ``device="cpu"`` runs the very same
graph on the processor, one thread, which is how it is tested where there is no GPU.
"""

from collections.abc import Collection
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from corporeal.core.errors import SimulationError, UserError
from corporeal.mpm.cuda import device_memory, layout, particle_memory
from corporeal.mpm.cuda import load_memory as extras
from corporeal.mpm.cuda.device_memory import DeviceMemory, split_position
from corporeal.mpm.cuda.layout import wp
from corporeal.mpm.cuda.program import CudaProgram, DeviceArrays
from corporeal.mpm.diagnostics import BodySums, ParticleEnergy
from corporeal.mpm.engine_interaction import EngineInteraction
from corporeal.mpm.ledger import EngineLedger
from corporeal.mpm.physics import maxwell_branches
from corporeal.mpm.physics.rigid import RigidBody, world_inverse_inertia
from corporeal.mpm.physics.spring_grips import Grip
from corporeal.mpm.problem import Body, Problem, Snapshot, StepStatistics
from corporeal.mpm.shells.assemble import Shells
from corporeal.mpm.state import ParticleConstants, Velocities, branch_energy, strain_energy

KNOWN_FIELDS = {
    Body: "name position velocity volume density law young_pa poisson yield_stress hardening "
    "friction_angle cohesion loss vibration consistency flow_index "
    "rigid surface curvature wetted_surface push wind faces tether path pivot",
    Problem: "bodies cell friction restitution planes gravity gravity_ramp contact transfer "
    "courant bonds joints excluded_pairs rolling_resistance restitution_law",
}
"""What this engine knows of a problem; anything else must be at its default."""
INITIAL_CONTACT_ROOM = 4096
WARM_START_ARRAYS = tuple("cell place strain motion stress plastic opened log_volume_ratio pressure".split())
"""What a warm start takes over of particles."""
RIGID_STATE_ARRAYS = "centre turn speed moment inertia spin cell place"
STEP_STATE_ARRAYS = (
    "clock fast loss external plane_impulse pair_impulse impact_of_pair first_contact last_contact contact_point"
)


class CudaEngine(EngineInteraction):
    """Steps one problem on a CUDA GPU."""

    name = "cuda"

    def __init__(self, problem: Problem, device: str = "cuda", threads: int | None = None) -> None:
        """Lay out memory.

        Args:
            problem: What to simulate.
            device: A Warp device: "cuda", "cuda:1", …; "cpu" for tests.
            threads: As every engine takes them; the host uses one.

        Raises:
            UserError: There is no such GPU, or the problem asks for what only other engines do.
        """
        self.device = require_device(device)
        _refuse_unknown(problem)
        self.problem = problem
        self.steps = StepStatistics()
        self.matter = ParticleConstants.of(problem)
        room = self.memory = DeviceMemory(self.device)
        apart = self.matter.rigid & (problem.contact == "multi")
        soft = np.flatnonzero(~apart)
        self.arrays = DeviceArrays(
            sheet=room.sheet(problem, self.matter),
            particles=particle_memory.lay_out_particles(room, problem, self.matter, soft),
            rigid=room.rigid(problem, self.matter),
            grid=room.grid(problem, self._blocks_needed()),
            contacts=room.contacts(problem, INITIAL_CONTACT_ROOM),
            loads=extras.lay_out_loads(room, problem, self.matter),
            bonds=extras.lay_out_bonds(room, problem),
        )
        self.program = CudaProgram(problem, self.arrays, self.device)
        self.kept = self._kept()
        self.spare = {name: wp.empty_like(array) for name, array in self.kept.items()}
        self.lost = np.zeros(len(self.matter.mass), bool)
        self.grips: dict[int, Grip] = {}
        self.program.load()
        self._start()

    def _blocks_needed(self) -> int:
        """Blocks that particles reach now, and half as many again."""
        position = np.concatenate([b.position for b in self.problem.bodies]) / self.problem.cell
        if not np.isfinite(position).all():
            raise SimulationError("There are positions that are not finite. Look at the mesh that was filled.")
        low = split_position(position)[0] >> 2
        single = self.problem.contact == "single"
        field = self.matter.body * (not single)
        homes = np.unique(np.column_stack([field, low]), axis=0)
        around = homes[:, None, :] + np.pad(np.array(list(np.ndindex(2, 2, 2))), ((0, 0), (1, 0)))
        return 64 + len(np.unique(around.reshape(-1, 4), axis=0)) * 3 // 2

    def _kept(self) -> dict[str, Any]:
        """Everything that the next step depends on, and the books."""
        groups = (
            ("particle", self.arrays.particles, " ".join(particle_memory.PARTICLE_STATE)),
            ("rigid", self.arrays.rigid, RIGID_STATE_ARRAYS),
            ("sheet", self.arrays.sheet, STEP_STATE_ARRAYS),
        )
        return {f"{group}.{name}": getattr(struct, name) for group, struct, names in groups for name in names.split()}

    def _start(self) -> None:
        """Return how fast objects are at the start, and find their blocks."""
        m = self.matter
        soft = self._rows("number")
        speed = wave = 0.0
        if len(soft):
            velocity = np.concatenate([b.velocity for b in self.problem.bodies])[soft]
            speed = float(np.linalg.norm(velocity, axis=1).max())
            kinds, s = np.unique(m.kind[soft]), m.substances
            wave = float(s.wave_speed[kinds].max())
        self.arrays.sheet.fast.assign(np.array([0, 0, speed, wave], np.float32))
        self._arrange()

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        return float(self.arrays.sheet.clock.numpy()[layout.CLOCK_TIME])

    def stable_step(self) -> float:
        """Largest stable step now [s]."""
        self._set(layout.CLOCK_UNTIL, self.time)
        self.program.look_ahead()
        return float(self.arrays.sheet.clock.numpy()[layout.CLOCK_STABLE])

    def advance(self, until: float) -> None:
        """Step until exactly ``until`` [s], choosing steps by stability."""
        self._set(layout.CLOCK_FORCED, 0.0)
        self._go(until)

    def step(self, dt: float) -> None:
        """Take one step of dt [s]."""
        self._set(layout.CLOCK_FORCED, 1.0)
        self._go(self.time + dt)

    def _set(self, what: Any, value: float) -> None:
        self.arrays.sheet.clock[int(what) : int(what) + 1].fill_(value)

    def _go(self, until: float) -> None:
        for name, array in self.kept.items():
            wp.copy(self.spare[name], array)
        self._set(layout.CLOCK_UNTIL, until)
        self._arrange()
        while True:
            self.program.run()
            flag = self.arrays.sheet.flag.numpy()
            if flag[layout.FLAG_LOST]:
                self._give_up()
            if not flag[layout.FLAG_FULL]:
                break
            self._enlarge(int(flag[layout.FLAG_FULL]))
            self._arrange()
        self._read_steps()

    def _read_steps(self) -> None:
        clock = self.arrays.sheet.clock.numpy()
        self.steps.count = int(clock[layout.CLOCK_COUNT])
        self.steps.smallest = float(clock[layout.CLOCK_SMALLEST])
        self.steps.largest = float(clock[layout.CLOCK_LARGEST])

    def _enlarge(self, what: int) -> None:
        """Double what was too small; the program is recorded anew."""
        self.program.forget()
        if what == 1:
            self.arrays.grid = self.memory.grid(self.problem, 2 * self.arrays.grid.room)
        else:
            self._make_room_for_contacts(2 * self.arrays.contacts.room)

    def _make_room_for_contacts(self, room: int) -> None:
        kept = self._choices()
        self.arrays.contacts = self.memory.contacts(self.problem, room)
        self.memory.put_choices(self.arrays.contacts, kept)

    def _choices(self) -> np.ndarray:
        """Candidate normals that contacts took in the last step."""
        count = int(self.arrays.sheet.flag.numpy()[layout.FLAG_NORMALS_KEPT])
        return self.memory.choices(self.arrays.contacts, count)

    def _arrange(self) -> None:
        """Sort particles, and give every block that they reach a slot."""
        self.program.arrange()
        while self.arrays.sheet.flag.numpy()[layout.FLAG_FULL]:
            self._enlarge(1)
            self.program.arrange()

    def _give_up(self) -> None:
        """Go back to where this began, and say what was lost."""
        count, time = self.arrays.particles.count, self.time
        lost = self.arrays.particles.lost.numpy()[:count] > 0
        self.lost[:] = False
        self.lost[self._rows("number")[lost]] = True
        for b in np.flatnonzero(self.arrays.rigid.lost.numpy()):
            self.lost |= self.matter.body == b
        for name, array in self.kept.items():
            wp.copy(array, self.spare[name])
        self.arrays.particles.lost.zero_()
        self.arrays.rigid.lost.zero_()
        self.arrays.sheet.flag.zero_()
        self._arrange()
        body = self.problem.bodies[int(self.matter.body[np.argmax(self.lost)])].name
        raise SimulationError(
            f"At t = {time:.4g} s {int(self.lost.sum())} particles of {body!r} were lost: they "
            "are not finite or left the domain. What was computed before is kept. Use more "
            "detail, or look for parts that overlap at the start."
        )

    def save(self) -> dict[str, np.ndarray]:
        """Everything needed to go on later exactly as if nothing had happened."""
        saved = {name: self._read(name) for name in self.kept}
        return saved | {"choices": self._choices()}

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Go on from what ``save`` returned, on an engine built from the same problem."""
        for name in self.kept:
            self._write(name, saved[name])
        self.lost[:] = False
        self.arrays.sheet.flag.zero_()
        choices, room = saved["choices"], self.arrays.contacts.room
        if len(choices) > 2 * room:
            self.program.forget()
            self._make_room_for_contacts(len(choices))
        self.memory.put_choices(self.arrays.contacts, choices)
        device_memory.overwrite_rows(self.arrays.sheet.flag, np.array([layout.FLAG_NORMALS_KEPT]), len(choices))
        self._arrange()
        self._read_steps()

    def _particles(self) -> Snapshot:
        m, cell = self.matter, self.problem.cell
        F, motion = self._placed("strain") + np.eye(3), self._placed("motion") + np.eye(3)
        place = self._rows("cell") + self._rows("place").astype(np.float64)
        return Snapshot(
            time=self.time,
            position=self._in_order(place) * cell,
            velocity=self._placed("velocity"),
            deformation=F,
            motion=np.where(m.flows[:, None, None], motion, F),
            plastic_strain=self._placed("plastic"),
        )

    def _sums(self) -> BodySums:
        now, cell = self._particles(), self.problem.cell
        affine = self._placed("affine") / cell
        log_volume_ratio = self._placed("log_volume_ratio")
        elastic = strain_energy(self.matter, now.deformation, log_volume_ratio)
        energy = ParticleEnergy(elastic, branch_energy(self.matter, self._memory()))
        return BodySums.of(self.matter, now, affine, energy, cell)

    def _memory(self) -> maxwell_branches.BranchMemory:
        """Read what the Maxwell branches of the particles that have any remember."""
        rows = self._placed("branch")[self.matter.relaxing]
        rows = rows.reshape(-1, int(layout.BRANCHES), int(layout.BRANCH_CHANNELS))
        return maxwell_branches.BranchMemory(_full_tensors(rows[..., :6]), rows[..., 6])

    def _rows(self, name: str) -> np.ndarray:
        """Copy what is kept of particles to the host, in the engine's order."""
        return particle_memory.read_rows(self.arrays.particles, name)

    def _placed(self, name: str) -> np.ndarray:
        """Copy what is kept of particles to the host, in the problem's order; 0 where rigid."""
        return self._in_order(self._rows(name))

    def _in_order(self, values: np.ndarray) -> np.ndarray:
        out = np.zeros((len(self.matter.mass), *values.shape[1:]))
        out[self._rows("number")] = values
        return out

    def _read(self, name: str) -> np.ndarray:
        """Copy what is kept by a name of ``kept``; of particles in rows."""
        group, _, own = name.partition(".")
        return self._rows(own) if group == "particle" else self.kept[name].numpy().copy()

    def _write(self, name: str, values: np.ndarray) -> None:
        """Write what ``_read`` gave."""
        group, _, own = name.partition(".")
        if group == "particle":
            particle_memory.write_rows(self.arrays.particles, own, values)
        else:
            self.kept[name].assign(values)

    def _rigid_bodies(self) -> dict[int, RigidBody]:
        r, m = self.arrays.rigid, self.matter
        centre, turn = r.centre.numpy(), r.turn.numpy()
        speed, moment = r.speed.numpy(), r.moment.numpy()
        return {
            int(b): RigidBody(
                mass=float(m.total[b]),
                centre=centre[b],
                rotation=turn[b],
                velocity=speed[b],
                angular_momentum=moment[b],
                spin=world_inverse_inertia(turn[b], m.inertia[b]) @ moment[b],
                start=m.centre[b],
                arm=m.arm[m.body == b],
            )
            for b in np.flatnonzero(r.stiff.numpy())
        }

    def _shells(self) -> Shells:
        return self.matter.shells

    def _booked(self) -> EngineLedger:
        s = self.arrays.sheet
        loss = s.loss.numpy().sum(axis=1)
        return EngineLedger(
            external_impulse=s.external.numpy(),
            plane_impulse=s.plane_impulse.numpy()[: len(self.problem.planes)],
            pair_impulse=s.pair_impulse.numpy(),
            push_work=np.array(loss[layout.LOSS_PUSH_WORK]),
            friction_loss=np.array(loss[layout.LOSS_FRICTION]),
            impact_loss=np.array(loss[layout.LOSS_IMPACT]),
            impact_of_pair=s.impact_of_pair.numpy(),
            plastic_loss=np.array(loss[layout.LOSS_PLASTIC]),
            viscous_loss=np.array(loss[layout.LOSS_VISCOUS]),
            first_contact=s.first_contact.numpy(),
            last_contact=s.last_contact.numpy(),
            contact_point=s.contact_point.numpy(),
        )

    def _enter(self, body: int, impulse: np.ndarray, work: float) -> None:
        s = self.arrays.sheet
        device_memory.add_to_row(s.external, body, impulse)
        device_memory.add_to_row(s.loss, (int(layout.LOSS_PUSH_WORK), 0), work)

    def _add_velocity(self, body: int, particle: np.ndarray, gained: np.ndarray) -> None:
        p, m = self.arrays.particles, self.matter
        every = np.zeros((len(m.mass), 3))
        every[np.flatnonzero(m.body == body)[particle]] = gained
        velocity = self._rows("velocity") + every[self._rows("number")].astype(np.float32)
        particle_memory.write_rows(p, "velocity", velocity)
        self._note_fast(2, np.linalg.norm(velocity, axis=1).max())

    def _note_fast(self, what: int, speed: float) -> None:
        """Raise the largest speed (2) or wave speed (3) of the last step [m/s]."""
        fast = self.arrays.sheet.fast.numpy()
        fast[what] = max(fast[what], speed)
        self.arrays.sheet.fast.assign(fast)

    def _add_momentum(self, body: int, momentum: np.ndarray, angular: np.ndarray) -> None:
        r = self.arrays.rigid
        device_memory.add_to_row(r.speed, body, momentum / self.matter.total[body])
        device_memory.add_to_row(r.moment, body, angular)
        device_memory.add_to_row(r.spin, body, r.inertia.numpy()[body] @ angular)

    def _take_grips(self) -> None:
        extras.write_grips(self.arrays.loads, self.problem, self.matter, self.grips)
        self.program.hold(bool(self.grips))

    def _set_motion(self, bodies: Collection[int], motion: Velocities) -> None:
        p, r = self.arrays.particles, self.arrays.rigid
        number, which = self._rows("number"), np.array(list(bodies), int)
        mine = np.flatnonzero(np.isin(self.matter.body[number], which))
        particle_memory.overwrite_particles(p, "velocity", mine, motion.velocity[number[mine]])
        particle_memory.overwrite_particles(p, "affine", mine, 0.0)
        moment = motion.spin_momentum[which]
        device_memory.overwrite_rows(r.speed, which, motion.speed[which])
        device_memory.overwrite_rows(r.moment, which, moment)
        spin = np.einsum("bij,bj->bi", r.inertia.numpy()[which], moment)
        device_memory.overwrite_rows(r.spin, which, spin)

    def _place_as(self, saved: dict[str, np.ndarray], bodies: Collection[int]) -> None:
        p, r, owner = self.arrays.particles, self.arrays.rigid, self.matter.body
        which = np.array(list(bodies), int)
        there = np.empty(len(owner), int)
        there[saved["particle.number"][: p.count]] = np.arange(p.count)
        number = self._rows("number")
        mine = np.flatnonzero(np.isin(owner[number], which))
        for name in WARM_START_ARRAYS:
            then = saved[f"particle.{name}"][there[number[mine]]]
            particle_memory.overwrite_particles(p, name, mine, then)
        # Whatever it was strained by there was long ago: branches have forgotten it.
        particle_memory.overwrite_particles(p, "branch", mine, 0.0)
        for name in ("centre", "turn", "inertia"):
            device_memory.overwrite_rows(getattr(r, name), which, saved[f"rigid.{name}"][which])
        riding = np.flatnonzero(np.isin(r.body.numpy(), which))
        for name in ("cell", "place"):
            device_memory.overwrite_rows(getattr(r, name), riding, saved[f"rigid.{name}"][riding])
        self._note_fast(3, saved["sheet.fast"][3])
        device_memory.overwrite_rows(self.arrays.sheet.flag, np.array([layout.FLAG_NORMALS_KEPT]), 0)
        self._arrange()


def _full_tensors(rows: np.ndarray) -> np.ndarray:
    """Symmetric tensors of their six numbers 00 01 02 11 12 22, which stand in the last axis."""
    return rows[..., [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(*rows.shape[:-1], 3, 3)


def require_device(device: str) -> str:
    """Name of a device that is there.

    Raises:
        UserError: It is not, or its driver is too old for a whole frame in one graph.
    """
    known = [found.alias for found in wp.get_devices()]
    cards = [found.alias for found in wp.get_cuda_devices()]
    chosen = cards[0] if device == "cuda" and cards else device
    if chosen not in known:
        raise UserError(
            f"The engine 'cuda' needs a CUDA GPU, and Warp finds no {device!r} here "
            f"(found: {', '.join(known)}). Install NVIDIA's driver (CUDA 12.4 or later), or "
            "simulate on the processor: --engine cpu."
        )
    if chosen in cards and not wp.is_conditional_graph_supported():
        raise UserError(
            f"The driver of {chosen!r} is too old for the engine 'cuda'. Install one for CUDA 12.4 "
            "or later, or simulate on the processor: --engine cpu."
        )
    return chosen


def _refuse_unknown(problem: Problem) -> None:
    """Raise when a problem asks for something that this engine would leave out."""
    if problem.contact == "single" and any(b.rigid for b in problem.bodies):
        raise UserError(_unsupported_error("rigid bodies in one shared field (contact='single')"))
    for thing in (problem, *problem.bodies):
        known = KNOWN_FIELDS[Problem if thing is problem else Body].split()
        for f in fields(thing):
            if f.name not in known and not _is_default(getattr(thing, f.name), f):
                raise UserError(_unsupported_error(f"{f.name} (of {getattr(thing, 'name', 'the problem')!r})"))


def _unsupported_error(what: str) -> str:
    return f"The engine 'cuda' does not simulate {what} yet. Use --engine cpu."


def _is_default(value: Any, declared: Any) -> bool:
    """Whether a field says nothing."""
    usual = declared.default
    if usual is MISSING and declared.default_factory is not MISSING:
        usual = declared.default_factory()
    if isinstance(value, np.ndarray):
        return np.array_equal(value, np.asarray(usual))
    return bool(value == usual)
