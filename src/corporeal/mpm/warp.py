"""The production engine: float32 particles in sorted batches, one sparse grid per body.

Moving-least-squares MPM (Hu et al. 2018) with quadratic B-splines and affine FLIP; the loops over
particles, nodes and contacts are the native pieces of ``kernels``, launched by Warp.
"""

import os

import numpy as np

from corporeal.errors import SimulationError
from corporeal.mpm import tables
from corporeal.mpm.blow import Blows
from corporeal.mpm.carried import Carried
from corporeal.mpm.kernels import (
    ASTRAY,
    FIELD,
    PLASTIC,
    REPORT,
    SPEED2,
    VISCOUS,
    WAVE2,
    WORK,
    WORLD,
    Program,
)
from corporeal.mpm.ledger import Ledger
from corporeal.mpm.measuring import measured, shown
from corporeal.mpm.memory import ContactMemory, point, rigid_grid
from corporeal.mpm.problem import Measure, Problem, Snapshot, Steps
from corporeal.mpm.window import Window

RIGID_COURANT = 0.05
"""Largest fraction of a cell that a rigid body may cross in one step."""
FALL = 0.1
"""Largest step as a fraction of √(dx/g)."""
SUNK = 8.0
"""A particle deeper than this in a wall [cells] has left the domain."""
FARTHEST = 1e5
"""A particle farther than this from the origin [cells] has left the domain."""
MOST_THREADS = 4
CHUNK = 32
"""Node blocks of one task."""


class WarpEngine:
    """Steps one problem on the CPU."""

    def __init__(self, problem: Problem, threads: int | None = None) -> None:
        """Lay out memory.

        Args:
            problem: What to simulate.
            threads: How many threads share the loops; None: as many as there are cores, up to 4.
                The result does not depend on it.

        """
        self.problem = problem
        self.threads = threads or min(MOST_THREADS, os.cpu_count() or 1)
        self.steps = Steps()
        self.time_now = 0.0
        self.ledger = Ledger.blank(len(problem.bodies), len(problem.planes))
        counts = [len(b.position) for b in problem.bodies]
        self.first = [0, *np.cumsum(counts).tolist()]
        self.lost = np.zeros(self.first[-1], bool)
        everything = list(range(len(problem.bodies)))
        single = problem.contact == "single"
        self.members = [everything] if single else [[b] for b in everything]
        self.rigid = {b: tables.rigid_state(problem.bodies[b]) for b in self._rigid_bodies()}
        self.points = {
            b: tables.rigid_points(problem.bodies[b], state) for b, state in self.rigid.items()
        }
        self._lay_out()

    def _rigid_bodies(self) -> list[int]:
        return [b for b, body in enumerate(self.problem.bodies) if body.rigid]

    def _is_rigid(self, field: int) -> bool:
        return self.problem.contact == "multi" and field in self.rigid

    # ------------------------------------------------------------ memory

    def _lay_out(self) -> None:
        problem = self.problem
        self.world = np.zeros(1, WORLD)
        self.field = np.zeros(len(self.members), FIELD)
        self.window: dict[int, Window] = {}
        self.material: dict[int, np.ndarray] = {}
        self.body_of_material: dict[int, np.ndarray] = {}
        for f, bodies in enumerate(self.members):
            if self._is_rigid(f):
                continue
            self.material[f], kind, self.body_of_material[f] = tables.materials(problem, bodies)
            rows = tables.particle_rows(problem, bodies, self.first, kind)
            place = np.concatenate([problem.bodies[b].position for b in bodies]) / problem.cell
            self._refuse_far(place, bodies)
            self.window[f] = Window(place, rows)
            if not self.window[f].fits:
                raise SimulationError(_too_wide(problem, bodies, 0.0))
        separate = [b for b in self.rigid if self._is_rigid(b)]
        self.grids = [
            rigid_grid(
                self.field[b : b + 1],
                problem.bodies[b],
                self.rigid[b],
                self.points[b],
                problem.cell,
            )
            for b in separate
        ]
        self.carried = [
            Carried(problem.bodies[b], state, self.first[b], problem.cell)
            for b, state in self.rigid.items()
            if b not in separate
        ]
        self.contact = ContactMemory(self.world, problem, self.ledger)
        self.blows = Blows(
            problem, self.first, self.ledger.external_impulse, self.rigid, self.points
        )
        self.bond = tables.bonds(problem)
        self.program = Program(self.world, self.threads)
        self.speed = max(np.linalg.norm(b.velocity, axis=1).max() for b in problem.bodies)
        self.wave = max([self._rest_speed(f) for f in self.window] + [0.0])
        self.connect()

    def _refuse_far(self, place: np.ndarray, bodies: list[int]) -> None:
        if not np.isfinite(place).all():
            raise SimulationError(
                f"{self.problem.bodies[bodies[0]].name!r} starts with positions that are not "
                "finite. Look at the mesh it was filled from."
            )

    def _rest_speed(self, field: int) -> float:
        """Fastest wave of a field at rest [m/s], raised where viscosity asks for shorter steps."""
        table = self.material[field].astype(np.float64)
        wave = np.sqrt((table[:, 2] + 2.0 * table[:, 1]) / table[:, 9])
        damping = table[:, 7] / np.maximum(table[:, 2] + 2.0 * table[:, 1], 1e-30)
        damping = damping * wave / self.problem.cell
        self.slowing = getattr(self, "slowing", {})
        self.slowing[field] = float((np.sqrt(1.0 + damping**2) + damping).max())
        return float(wave.max()) * self.slowing[field]

    def connect(self) -> None:
        """List the tasks and point the native structs to where everything is."""
        even, odd, nodes = [], [], []
        for f, window in self.window.items():
            for x, low, high in window.planes():
                (odd if x % 2 else even).append((f, low, high, 0))
            pool = len(window.where)
            nodes += [(f, low, min(low + CHUNK, pool), 0) for low in range(0, pool, CHUNK)]
        self.task = np.array(even + odd, np.int32).reshape(-1, 4)
        self.node_task = np.array(nodes, np.int32).reshape(-1, 4)
        self.report = np.zeros((len(self.task), REPORT))
        self.slower = np.array([self.slowing[f] for f in self.task[:, 0]])
        for f, window in self.window.items():
            self._connect_field(f, window)
        for body in self.carried:
            body.find(self.window[0])
        point(
            self.world,
            field=self.field,
            task=self.task,
            list=self.node_task,
            report=self.report,
            blow=self.blows.record,
            bond=self.bond,
        )
        self._connect_bonds()
        self.world["blows"] = len(self.blows.record)
        self.world["fields"], self.world["dx"] = len(self.field), self.problem.cell
        self.world["tasks"] = len(self.task)
        work = np.array([self._particles(*task) for task in self.task])
        self.program.divide(
            work[: len(even)],
            work[len(even) :],
            64 * (self.node_task[:, 2] - self.node_task[:, 1]),
            self.blows.load(
                len(self.field), [len(self.problem.bodies[m[0]].position) for m in self.members]
            ),
        )

    def _particles(self, field: int, low: int, high: int, _: int) -> int:
        block = self.window[field].block
        return int(block[high - 1, 1] - block[low, 0])

    def _connect_bonds(self) -> None:
        """Make room for every node that a frame could hold."""
        self.held = []
        for row in self.bond:
            room = 64 * len(self.window[int(row["soft"])].where)
            slot, mass = np.zeros(room, np.int32), np.zeros(room, np.float32)
            self.held += [slot, mass]
            row["slot"], row["mass"] = slot.ctypes.data, mass.ctypes.data
        self.world["bonds"] = len(self.bond)

    def _connect_field(self, f: int, window: Window) -> None:
        record = self.field[f : f + 1]
        for name in ("part", "node", "table", "block", "where", "near"):
            record[name] = getattr(window, name).ctypes.data
        record["material"] = self.material[f].ctypes.data
        record["origin"], record["dim"] = window.origin, window.dim
        record["blocks"], record["pool"] = len(window.block), len(window.where)

    # ------------------------------------------------------------ time

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        return self.time_now

    def advance(self, until: float) -> None:
        """Step until exactly ``until`` [s], choosing steps by stability."""
        good = self.save()
        try:
            while self.time_now < until:
                if not self.speed < np.inf:
                    self._find_lost()
                left = until - self.time_now
                count = max(1, int(np.ceil(left / self.stable_step() - 1e-9)))
                self.step(left / count)
                if count == 1:
                    self.time_now = until
        except SimulationError:
            lost = self.lost.copy()
            self.restore(good)
            self.lost = lost
            raise

    def stable_step(self) -> float:
        """Largest stable step now [s]: dt = s dx/(c + |v|), and the falls of what is rigid."""
        cell = self.problem.cell
        limits = [1.0]
        if self.window:
            limits.append(self.problem.courant * cell / max(self.wave + self.speed, 1e-30))
        for state in self.rigid.values():
            turning = np.linalg.norm(state[37:40]) * state[tables.RADIUS]
            fastest = np.linalg.norm(state[22:25]) + turning
            limits.append(RIGID_COURANT * cell / max(float(fastest), 1e-30))
        pulls = [self.problem.gravity] + [
            b.push.acceleration for b in self.problem.bodies if b.push is not None
        ]
        pull = max(float(np.linalg.norm(p)) for p in pulls)
        limits.append(FALL * np.sqrt(cell / max(pull, 1e-30)))
        return min(limits)

    def step(self, dt: float) -> None:
        """Take one step of dt [s]."""
        world = self.world
        world["dt"], world["time"] = dt, self.time_now
        world["kick"] = self._kick(dt)
        self.program.run(self.program.before)
        self._touch()
        self.program.run(self.program.after)
        strayed = [body.carry(self.window[0], dt) for body in self.carried]
        self.time_now += dt
        self.steps.count += 1
        self.steps.smallest = min(self.steps.smallest, dt)
        self.steps.largest = max(self.steps.largest, dt)
        if len(self.task):
            self._hear(any(strayed))

    def _touch(self) -> None:
        """Solve contact; where a list was too short, lengthen it and begin again."""
        self.world["again"] = 0
        self.program.contact.launch()
        while self.world["full"][0]:
            self.contact.lengthen()
            self.world["again"] = 1
            self.program.contact.launch()

    def _kick(self, dt: float) -> np.ndarray:
        """Velocity [m/s] that gravity gives in this step; enters it and the pushes."""
        problem, start, end = self.problem, self.time_now, self.time_now + dt
        ramp = problem.gravity_ramp
        gravity = np.array(problem.gravity) * (_ramped(end, ramp) - _ramped(start, ramp))
        for b, body in enumerate(problem.bodies):
            push = np.zeros(3)
            if body.push is not None:
                span = max(0.0, min(end, body.push.end) - max(start, body.push.start))
                push = np.array(body.push.acceleration) * span
                self._push(b, push)
            if b in self.rigid:
                state = self.rigid[b]
                state[tables.KICK : tables.KICK + 3] = gravity + push
                mean = state[tables.SPEED : tables.SPEED + 3] + 0.5 * (gravity + push)
                self.ledger.push_work += self.mass[b] * float(push @ mean)
            self.ledger.external_impulse[b] += self.mass[b] * (gravity + push)
        return gravity

    def _push(self, b: int, push: np.ndarray) -> None:
        field = 0 if self.problem.contact == "single" else b
        if field in self.material:
            self.material[field][self.body_of_material[field] == b, 10:13] = push
            self.field["pushed"][field] = 1

    @property
    def mass(self) -> list[float]:
        """Mass of every body [kg]."""
        if not hasattr(self, "_mass"):
            self._mass = [float(b.volume @ b.density) for b in self.problem.bodies]
        return self._mass

    def _hear(self, strayed: bool) -> None:
        """Read what the tasks report; sort where somebody strayed."""
        report = self.report
        speed = np.sqrt(report[:, SPEED2])
        self.speed = float(speed.max())
        self.wave = float((np.sqrt(report[:, WAVE2]) * self.slower).max())
        if strayed or report[:, ASTRAY].any():
            self._sort({int(f) for f in self.task[strayed | (report[:, ASTRAY] > 0), 0]})

    def _book(self) -> None:
        """Move what the tasks added up into the ledger."""
        total = self.report[:, [PLASTIC, VISCOUS, WORK]].sum(axis=0)
        self.ledger.plastic_loss += total[0]
        self.ledger.viscous_loss += total[1]
        self.ledger.push_work += total[2] + self.blows.take_work()
        self.report[:, [PLASTIC, VISCOUS, WORK]] = 0.0

    def _sort(self, fields: set[int]) -> None:
        self._book()
        self._find_lost()
        for f in sorted(fields):
            if not self.window[f].sort():
                raise SimulationError(_too_wide(self.problem, self.members[f], self.time_now))
        self.connect()

    def _find_lost(self) -> None:
        """Raise when a particle is not finite or left the domain."""
        cell = self.problem.cell
        self.lost[:] = False
        for window in self.window.values():
            place = window.position()
            rows = window.channel(3, 21)
            good = np.isfinite(rows).all(axis=1) & (np.abs(place) < FARTHEST).all(axis=1)
            for plane in self.problem.planes:
                height = place @ np.array(plane.normal) - plane.offset / cell
                good &= height > -SUNK
            self.lost[window.number[~good]] = True
        if self.lost.any():
            first = int(np.argmax(self.lost))
            body = int(np.searchsorted(self.first, first, side="right")) - 1
            raise SimulationError(
                f"At t = {self.time_now:.4g} s {int(self.lost.sum())} particles of "
                f"{self.problem.bodies[body].name!r} were lost: they are not finite or left the "
                "domain. What was computed before is kept. Use more detail, or look for parts "
                "that overlap at the start."
            )

    # ------------------------------------------------------------ reading and keeping

    def snapshot(self) -> Snapshot:
        """Copy every particle's state."""
        return shown(self)

    def measure(self) -> Measure:
        """Add up the ledger."""
        self._book()
        return measured(self)

    def save(self) -> dict[str, np.ndarray]:
        """Everything needed to go on later exactly as if nothing had happened."""
        self._book()
        saved = {f"ledger.{k}": v for k, v in self.ledger.as_arrays().items()}
        for f, window in self.window.items():
            saved |= {f"field{f}.{k}": v for k, v in window.saved().items()}
        saved |= {f"rigid{b}": state.copy() for b, state in self.rigid.items()}
        steps = self.steps
        saved["clock"] = np.array(
            [self.time_now, steps.count, steps.smallest, steps.largest, self.speed, self.wave]
        )
        return saved

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Go on from what ``save`` returned, on an engine built from the same problem."""
        for name in self.ledger.as_arrays():
            getattr(self.ledger, name)[...] = saved[f"ledger.{name}"]
        for f, window in self.window.items():
            head = f"field{f}."
            window.restore(
                {k.removeprefix(head): v for k, v in saved.items() if k.startswith(head)}
            )
        for b, state in self.rigid.items():
            state[:] = saved[f"rigid{b}"]
        time, count, smallest, largest, self.speed, self.wave = saved["clock"].tolist()
        self.time_now = time
        self.steps = Steps(int(count), smallest, largest)
        self.lost[:] = False
        self.connect()


def _ramped(time: float, ramp: float) -> float:
    """∫ of gravity's share from 0 to time [s]."""
    if ramp <= 0.0:
        return time
    return 0.5 * time**2 / ramp if time < ramp else time - 0.5 * ramp


def _too_wide(problem: Problem, bodies: list[int], time: float) -> str:
    names = " and ".join(repr(problem.bodies[b].name) for b in bodies)
    return (
        f"At t = {time:.4g} s {names} no longer fits into one grid: it spans more than 500 cells. "
        "Use less detail, a shorter time, or contact='multi'."
    )
