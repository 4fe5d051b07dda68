"""The engine for CUDA cards: all steps of a frame in one graph, no word to the host inside.

The same method as ``reference``, in plain Warp: particles in float32 with their places relative
to the grid, rigid bodies and impulses in double precision. ``device="cpu"`` runs the very same
graph on the processor, one thread, which is how it is tested where there is no card.
"""

from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from corporeal.errors import SimulationError, UserError
from corporeal.mpm import device_contact as contact
from corporeal.mpm import device_grid as grids
from corporeal.mpm import device_impulses as impulses
from corporeal.mpm import device_kernels as kernels
from corporeal.mpm import device_layout as layout
from corporeal.mpm import device_meets as meets
from corporeal.mpm import device_rigid as rigid
from corporeal.mpm.device_layout import wp
from corporeal.mpm.device_measure import measured, shown
from corporeal.mpm.device_memory import Memory, split
from corporeal.mpm.matter import Matter
from corporeal.mpm.problem import Body, Measure, Problem, Snapshot, Steps

MODULES = (grids, kernels, meets, contact, impulses, rigid)
"""Modules whose kernels a step launches."""
KNOWN = {
    Body: "name position velocity volume density law young poisson yield_stress hardening "
    "friction_angle cohesion viscosity rigid surface push faces",
    Problem: "bodies cell friction restitution planes gravity gravity_ramp contact transfer "
    "courant",
}
"""What this engine knows of a problem; anything else must be at its default."""
THREADS_PER_PROCESSOR = 1024
CONTACT_ROOM = 4096
PARTICLE_STATE = (
    "cell place velocity affine strain motion stress mass volume plastic opened kind field number"
)
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
        self.device = _present(device)
        _refuse_unknown(problem)
        self.problem = problem
        self.steps = Steps()
        self.matter = Matter.of(problem)
        memory = self.memory = Memory(self.device)
        apart = self.matter.rigid & (problem.contact == "multi")
        self.sheet = memory.sheet(problem, self.matter)
        self.particles = memory.particles(problem, self.matter, np.flatnonzero(~apart))
        self.rigid = memory.rigid(problem, self.matter)
        self.grid = memory.grid(problem, self._blocks_needed())
        self.contacts = memory.contacts(problem, CONTACT_ROOM)
        self.kept = self._kept()
        self.spare = {name: wp.empty_like(array) for name, array in self.kept.items()}
        self.lost = np.zeros(len(self.matter.mass), bool)
        self.stride = self._threads()
        self.graph = None
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
            ("particle", self.particles, PARTICLE_STATE),
            ("rigid", self.rigid, RIGID_STATE),
            ("sheet", self.sheet, SHEET_STATE),
        )
        return {
            f"{group}.{name}": getattr(struct, name)
            for group, struct, names in groups
            for name in names.split()
        }

    def _threads(self) -> int:
        """Threads of one launch: as many as keep the device busy."""
        found = wp.get_device(self.device)
        return THREADS_PER_PROCESSOR * found.sm_count if found.is_cuda else 1

    def _start(self) -> None:
        """Say how fast things are at the start, and find their blocks."""
        m = self.matter
        soft = self.particles.number.numpy()[: self.particles.count]
        speed = wave = 0.0
        if len(soft):
            velocity = np.concatenate([b.velocity for b in self.problem.bodies])[soft]
            speed = float(np.linalg.norm(velocity, axis=1).max())
            damping = (m.viscosity / (m.lam + 2.0 * m.mu) * m.wave_speed / self.problem.cell)[soft]
            wave = float((m.wave_speed[soft] * (np.sqrt(1.0 + damping**2) + damping)).max())
        self.sheet.fast.assign(np.array([0, 0, speed, wave], np.float32))
        self._arrange()

    # ------------------------------------------------------------ time

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        return float(self.sheet.clock.numpy()[layout.TIME])

    def stable_step(self) -> float:
        """Largest stable step now [s]."""
        self._set(layout.UNTIL, self.time)
        self._run(kernels.begin, 1, self.sheet, self.rigid, stride=False)
        return float(self.sheet.clock.numpy()[layout.STABLE])

    def advance(self, until: float) -> None:
        """Step until exactly ``until`` [s], choosing steps by stability."""
        self._set(layout.FORCED, 0.0)
        self._go(until)

    def step(self, dt: float) -> None:
        """Take one step of dt [s]."""
        self._set(layout.FORCED, 1.0)
        self._go(self.time + dt)

    def _set(self, what: Any, value: float) -> None:
        self.sheet.clock[int(what) : int(what) + 1].fill_(value)

    def _go(self, until: float) -> None:
        for name, array in self.kept.items():
            wp.copy(self.spare[name], array)
        self._set(layout.UNTIL, until)
        self._arrange()
        while True:
            if self.graph is None:
                self.graph = self._record()
            wp.capture_launch(self.graph)
            flag = self.sheet.flag.numpy()
            if flag[layout.LOST]:
                self._give_up()
            if not flag[layout.FULL]:
                break
            self._enlarge(int(flag[layout.FULL]))
            self._arrange()
        self._read_steps()

    def _read_steps(self) -> None:
        clock = self.sheet.clock.numpy()
        self.steps.count = int(clock[layout.COUNT])
        self.steps.smallest = float(clock[layout.SMALLEST])
        self.steps.largest = float(clock[layout.LARGEST])

    def _enlarge(self, what: int) -> None:
        """Double what was too small; the graph is recorded anew."""
        self.graph = None
        if what == 1:
            self.grid = self.memory.grid(self.problem, 2 * self.grid.room)
        else:
            self.contacts = self.memory.contacts(self.problem, 2 * self.contacts.room)

    def _give_up(self) -> None:
        """Go back to where this began, and say what was lost."""
        count, time = self.particles.count, self.time
        lost = self.particles.lost.numpy()[:count] > 0
        self.lost[:] = False
        self.lost[self.particles.number.numpy()[:count][lost]] = True
        for b in np.flatnonzero(self.rigid.lost.numpy()):
            self.lost |= self.matter.body == b
        for name, array in self.kept.items():
            wp.copy(array, self.spare[name])
        self.particles.lost.zero_()
        self.rigid.lost.zero_()
        self.sheet.flag.zero_()
        self._arrange()
        body = self.problem.bodies[int(self.matter.body[np.argmax(self.lost)])].name
        raise SimulationError(
            f"At t = {time:.4g} s {int(self.lost.sum())} particles of {body!r} were lost: they "
            "are not finite or left the domain. What was computed before is kept. Use more "
            "detail, or look for parts that overlap at the start."
        )

    # ------------------------------------------------------------ launches

    def _run(self, kernel: Any, threads: int, *inputs: Any, stride: bool = True) -> None:
        given = [*inputs, threads] if stride else list(inputs)
        wp.launch(kernel, dim=threads, inputs=given, device=self.device)

    def _each(self, kernel: Any, *inputs: Any) -> None:
        """Launch a kernel that loops over its items."""
        self._run(kernel, self.stride, *inputs)

    def _arrange(self) -> None:
        """Sort particles by block, and give every block that they reach a slot."""
        p, r, s = self.particles, self.rigid, self.sheet
        if p.count:
            self._sort()
        while True:
            self._each(grids.forget, self.grid, s)
            self._each(grids.settle, p, r, self.grid, s)
            if not s.flag.numpy()[layout.FULL]:
                return
            self._enlarge(1)

    def _sort(self) -> None:
        p, count = self.particles, self.particles.count
        keys = self.memory.zeros(2 * count, wp.int64)
        order = self.memory.zeros(2 * count, wp.int32)
        self._each(grids.key_particles, p, keys, order)
        wp.utils.radix_sort_pairs(keys, order, count)
        for name in PARTICLE_STATE.split():
            array = getattr(p, name)
            words = _words(array)
            sorted_words = wp.empty_like(words)
            self._each(grids.reorder, count, words.size // count, order, words, sorted_words)
            wp.copy(words, sorted_words)

    def _record(self) -> Any:
        """Capture a whole frame: steps until the clock says stop."""
        going = self.sheet.flag[int(layout.GOING) : int(layout.GOING) + 1]
        with wp.ScopedCapture(device=self.device) as capture:
            self._run(kernels.begin, 1, self.sheet, self.rigid, stride=False)
            wp.capture_while(going, self._step)
        return capture.graph

    def _step(self) -> None:
        p, r, g, s = self.particles, self.rigid, self.grid, self.sheet
        self._each(grids.link, g, s)
        self._each(grids.clear, g, s)
        self._each(kernels.scatter, p, g, s)
        self._each(kernels.scatter_rigid, r, g, s)
        self._each(grids.divide, g, s)
        self._look()
        self._run(rigid.force, len(self.problem.bodies), r, s, stride=False)
        self._touch()
        self._each(kernels.gather, p, g, s)
        self._run(rigid.advance, len(self.problem.bodies), r, s, stride=False)
        self._each(rigid.follow, r, g, s)
        self._run(kernels.tick, 1, s, r, stride=False)

    def _look(self) -> None:
        """List nodes where fields meet, choose normals, and measure gaps."""
        p, r, g, s, c = self.particles, self.rigid, self.grid, self.sheet, self.contacts
        self._each(meets.list_meets, g, c, r, s)
        self._each(meets.look_around, g, s)
        self._each(contact.show_particles, p, g, c, s)
        self._each(contact.show_rigid, r, g, c, s)
        self._each(contact.propose, c, s)
        self._each(contact.reach_particles, p, g, c, s)
        self._each(contact.reach_rigid, r, g, c, s)
        self._each(contact.choose, c, s)
        self._each(contact.measure_gaps, g, c, s)
        self._each(meets.list_points, r, c, s)

    def _touch(self) -> None:
        """Solve all impulses, and enter them."""
        r, g, s, c = self.rigid, self.grid, self.sheet, self.contacts
        self._each(impulses.prepare, c, r, g, s)
        self._each(impulses.rebound, c, s)
        self._each(impulses.solve_nodes, c, r, s)
        sweeping = s.flag[int(layout.SWEEPING) : int(layout.SWEEPING) + 1]
        wp.capture_while(sweeping, self._sweep)
        self._each(impulses.hand_back, g, c, r, s)
        self._each(impulses.note, c, r, s)
        everything = len(self.problem.bodies) + len(self.problem.planes)
        wp.launch(impulses.enter_books, (everything, everything), [c, s], device=self.device)

    def _sweep(self) -> None:
        r, s, c = self.rigid, self.sheet, self.contacts
        self._each(impulses.count_busy, c, r, s)
        self._each(impulses.sweep, c, r, s)
        self._run(impulses.apply, 1, r, s, stride=False)

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
        self.sheet.flag.zero_()
        self._arrange()
        self._read_steps()


def _words(array: Any) -> Any:
    """Look at the same memory as 32-bit words."""
    size = array.capacity // 4
    return wp.array(ptr=array.ptr, dtype=wp.int32, shape=(size,), device=array.device)


def _present(device: str) -> str:
    """Name of a device that is there.

    Raises:
        UserError: It is not.

    """
    known = [found.alias for found in wp.get_devices()]
    cards = [found.alias for found in wp.get_cuda_devices()]
    if device == "cuda" and cards:
        return cards[0]
    if device in known:
        return device
    raise UserError(
        f"The engine 'cuda' needs a CUDA card, and Warp finds no {device!r} here "
        f"(found: {', '.join(known)}). Install NVIDIA's driver (CUDA 12.4 or later), or simulate "
        "on the processor: --engine warp."
    )


def _refuse_unknown(problem: Problem) -> None:
    """Raise when a problem asks for something that this engine would leave out."""
    if problem.contact == "single" and any(b.rigid for b in problem.bodies):
        raise UserError(_cannot("rigid bodies in one shared field (contact='single')"))
    for thing in (problem, *problem.bodies):
        known = KNOWN[type(thing)].split()
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
