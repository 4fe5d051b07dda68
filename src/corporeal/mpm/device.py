"""The engine for CUDA cards: all steps of a frame in one graph, no word to the host inside.

The same method as ``reference``, in plain Warp: particles in float32 with their places relative
to the grid, rigid bodies and impulses in double precision. ``device="cpu"`` runs the very same
graph on the processor, one thread, which is how it is tested where there is no card.
"""

from collections.abc import Collection
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from corporeal.errors import SimulationError, UserError
from corporeal.mpm import device_extras as extras
from corporeal.mpm import device_hands as hands
from corporeal.mpm import device_layout as layout
from corporeal.mpm.device_layout import wp
from corporeal.mpm.device_measure import measured, shown
from corporeal.mpm.device_memory import Memory, slowing, split
from corporeal.mpm.device_program import MODULES, PARTICLE_STATE, Arrays, Program
from corporeal.mpm.grip import Grip
from corporeal.mpm.matter import Matter
from corporeal.mpm.problem import Body, Measure, Problem, Snapshot, Steps
from corporeal.types import Vector

KNOWN = {
    Body: "name position velocity volume density law young poisson yield_stress hardening "
    "friction_angle cohesion viscosity rigid surface push wind faces tether",
    Problem: "bodies cell friction restitution planes gravity gravity_ramp contact transfer "
    "courant bonds joints apart",
}
"""What this engine knows of a problem; anything else must be at its default."""
CONTACT_ROOM = 4096
RIGID_STATE = "centre turn speed moment inertia spin cell place"
SHEET_STATE = (
    "clock fast loss external plane_impulse pair_impulse first_contact last_contact contact_point"
)


class DeviceEngine:
    """Steps one problem on a CUDA card."""

    def __init__(self, problem: Problem, device: str = "cuda") -> None:
        """Lay out memory.

        Args:
            problem: What to simulate.
            device: A Warp device: "cuda", "cuda:1", …; "cpu" for tests.

        Raises:
            UserError: There is no such card, or the problem asks for what only other engines do.

        """
        self.device = present(device)
        _refuse_unknown(problem)
        self.problem = problem
        self.steps = Steps()
        self.matter = Matter.of(problem)
        memory = self.memory = Memory(self.device)
        apart = self.matter.rigid & (problem.contact == "multi")
        particles = memory.particles(problem, self.matter, np.flatnonzero(~apart))
        self.arrays = Arrays(
            sheet=memory.sheet(problem, self.matter),
            particles=particles,
            rigid=memory.rigid(problem, self.matter),
            grid=memory.grid(problem, self._blocks_needed()),
            contacts=memory.contacts(problem, CONTACT_ROOM),
            loads=extras.loads(memory, problem, self.matter),
            bonds=extras.bonds(memory, problem),
        )
        self.program = Program(problem, self.arrays, self.device)
        self.kept = self._kept()
        self.spare = {name: wp.empty_like(array) for name, array in self.kept.items()}
        self.lost = np.zeros(len(self.matter.mass), bool)
        self.grips: dict[int, Grip] = {}
        for module in MODULES:
            wp.load_module(module, device=self.device)
        self._start()

    def _blocks_needed(self) -> int:
        """Blocks that particles reach now, and half as many again."""
        position = np.concatenate([b.position for b in self.problem.bodies]) / self.problem.cell
        if not np.isfinite(position).all():
            raise SimulationError(
                "There are positions that are not finite. Look at the mesh that was filled."
            )
        low = split(position)[0] >> 2
        single = self.problem.contact == "single"
        field = self.matter.body * (not single)
        homes = np.unique(np.column_stack([field, low]), axis=0)
        around = homes[:, None, :] + np.pad(np.array(list(np.ndindex(2, 2, 2))), ((0, 0), (1, 0)))
        return 64 + len(np.unique(around.reshape(-1, 4), axis=0)) * 3 // 2

    def _kept(self) -> dict[str, Any]:
        """Everything that the next step depends on, and the books."""
        groups = (
            ("particle", self.arrays.particles, PARTICLE_STATE),
            ("rigid", self.arrays.rigid, RIGID_STATE),
            ("sheet", self.arrays.sheet, SHEET_STATE),
        )
        return {
            f"{group}.{name}": getattr(struct, name)
            for group, struct, names in groups
            for name in names.split()
        }

    def _start(self) -> None:
        """Say how fast things are at the start, and find their blocks."""
        m = self.matter
        soft = self.arrays.particles.number.numpy()[: self.arrays.particles.count]
        speed = wave = 0.0
        if len(soft):
            velocity = np.concatenate([b.velocity for b in self.problem.bodies])[soft]
            speed = float(np.linalg.norm(velocity, axis=1).max())
            wave = float((m.wave_speed * slowing(m, self.problem.cell))[soft].max())
        self.arrays.sheet.fast.assign(np.array([0, 0, speed, wave], np.float32))
        self._arrange()

    # ------------------------------------------------------------ time

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        return float(self.arrays.sheet.clock.numpy()[layout.TIME])

    def stable_step(self) -> float:
        """Largest stable step now [s]."""
        self._set(layout.UNTIL, self.time)
        self.program.look_ahead()
        return float(self.arrays.sheet.clock.numpy()[layout.STABLE])

    def advance(self, until: float) -> None:
        """Step until exactly ``until`` [s], choosing steps by stability."""
        self._set(layout.FORCED, 0.0)
        self._go(until)

    def step(self, dt: float) -> None:
        """Take one step of dt [s]."""
        self._set(layout.FORCED, 1.0)
        self._go(self.time + dt)

    def _set(self, what: Any, value: float) -> None:
        self.arrays.sheet.clock[int(what) : int(what) + 1].fill_(value)

    def _go(self, until: float) -> None:
        for name, array in self.kept.items():
            wp.copy(self.spare[name], array)
        self._set(layout.UNTIL, until)
        self._arrange()
        while True:
            self.program.run()
            flag = self.arrays.sheet.flag.numpy()
            if flag[layout.LOST]:
                self._give_up()
            if not flag[layout.FULL]:
                break
            self._enlarge(int(flag[layout.FULL]))
            self._arrange()
        self._read_steps()

    def _read_steps(self) -> None:
        clock = self.arrays.sheet.clock.numpy()
        self.steps.count = int(clock[layout.COUNT])
        self.steps.smallest = float(clock[layout.SMALLEST])
        self.steps.largest = float(clock[layout.LARGEST])

    def _enlarge(self, what: int) -> None:
        """Double what was too small; the program is recorded anew."""
        self.program.forget()
        if what == 1:
            self.arrays.grid = self.memory.grid(self.problem, 2 * self.arrays.grid.room)
        else:
            self.arrays.contacts = self.memory.contacts(self.problem, 2 * self.arrays.contacts.room)

    def _arrange(self) -> None:
        """Sort particles, and give every block that they reach a slot."""
        self.program.arrange()
        while self.arrays.sheet.flag.numpy()[layout.FULL]:
            self._enlarge(1)
            self.program.arrange()

    def _give_up(self) -> None:
        """Go back to where this began, and say what was lost."""
        count, time = self.arrays.particles.count, self.time
        lost = self.arrays.particles.lost.numpy()[:count] > 0
        self.lost[:] = False
        self.lost[self.arrays.particles.number.numpy()[:count][lost]] = True
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

    # ------------------------------------------------------------ from outside

    def poke(self, body: int, point: Vector, impulse: Vector) -> None:
        """Give a body an impulse [N s] at a point [m] at once: see ``problem.Interactive``."""
        hands.poke(self, body, point, impulse)

    def drag(self, body: int, point: Vector | None, target: Vector, stiffness: float) -> None:
        """Pull on a body by a spring until told otherwise: see ``problem.Interactive``."""
        hands.drag(self, body, point, target, stiffness)

    # ------------------------------------------------------------ reading and keeping

    def snapshot(self) -> Snapshot:
        """Copy every particle's state."""
        return shown(self)

    def measure(self) -> Measure:
        """Add up the ledger."""
        return measured(self)

    def save(self) -> dict[str, np.ndarray]:
        """Everything needed to go on later exactly as if nothing had happened."""
        return {name: array.numpy().copy() for name, array in self.kept.items()}

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Go on from what ``save`` returned, on an engine built from the same problem."""
        for name, array in self.kept.items():
            array.assign(saved[name])
        self.lost[:] = False
        self.arrays.sheet.flag.zero_()
        self._arrange()
        self._read_steps()

    def halt(self, bodies: Collection[int]) -> None:
        """Take all motion out of some bodies; nothing of it is booked."""
        hands.halt(self, bodies)

    def begin(self, saved: dict[str, np.ndarray], bodies: Collection[int]) -> None:
        """Put some bodies where they were in another's ``save``: see ``problem.Engine``."""
        hands.begin(self, saved, bodies)
        self._arrange()


def present(device: str) -> str:
    """Name of a device that is there.

    Raises:
        UserError: It is not, or its driver is too old for a whole frame in one graph.

    """
    known = [found.alias for found in wp.get_devices()]
    cards = [found.alias for found in wp.get_cuda_devices()]
    chosen = cards[0] if device == "cuda" and cards else device
    if chosen not in known:
        raise UserError(
            f"The engine 'cuda' needs a CUDA card, and Warp finds no {device!r} here "
            f"(found: {', '.join(known)}). Install NVIDIA's driver (CUDA 12.4 or later), or "
            "simulate on the processor: --engine warp."
        )
    if chosen in cards and not wp.is_conditional_graph_supported():
        raise UserError(
            f"The driver of {chosen!r} is too old for the engine 'cuda'. Install one for CUDA 12.4 "
            "or later, or simulate on the processor: --engine warp."
        )
    return chosen


def _refuse_unknown(problem: Problem) -> None:
    """Raise when a problem asks for something that this engine would leave out."""
    if problem.contact == "single" and any(b.rigid for b in problem.bodies):
        raise UserError(_cannot("rigid bodies in one shared field (contact='single')"))
    for thing in (problem, *problem.bodies):
        known = KNOWN[Problem if thing is problem else Body].split()
        for f in fields(thing):
            if f.name not in known and not _default(getattr(thing, f.name), f):
                raise UserError(_cannot(f"{f.name} (of {getattr(thing, 'name', 'the problem')!r})"))


def _cannot(what: str) -> str:
    return f"The engine 'cuda' does not simulate {what} yet. Use --engine warp."


def _default(value: Any, declared: Any) -> bool:
    """Whether a field says nothing."""
    usual = declared.default
    if usual is MISSING and declared.default_factory is not MISSING:
        usual = declared.default_factory()
    if isinstance(value, np.ndarray):
        return np.array_equal(value, np.asarray(usual))
    return bool(value == usual)
