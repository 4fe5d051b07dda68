"""The production engine: float32 particles in sorted batches, one sparse grid per body.

Moving-least-squares MPM (Hu et al. 2018) with quadratic B-splines and affine FLIP; the loops over
particles, nodes and contacts are the native pieces of ``kernels``, launched by Warp.
"""

from collections.abc import Collection

import numpy as np

from corporeal.errors import SimulationError
from corporeal.machine import cores
from corporeal.mpm import beginning, pacing, tables, touching
from corporeal.mpm.blow import Blows
from corporeal.mpm.carried import Carried
from corporeal.mpm.grip import Grip
from corporeal.mpm.kernels import (
    ASTRAY,
    CLOCK,
    FIELD,
    INFINITE,
    PLASTIC,
    REPORT,
    STRAYED,
    VISCOUS,
    WORK,
    WORLD,
    Program,
)
from corporeal.mpm.kernels_read import Reader
from corporeal.mpm.kernels_sort import Sorter
from corporeal.mpm.ledger import Ledger
from corporeal.mpm.measuring import measured, shown
from corporeal.mpm.memory import ContactMemory, point, rigid_grid
from corporeal.mpm.problem import Measure, Problem, Snapshot, Steps
from corporeal.mpm.spring_records import Springs
from corporeal.mpm.springs import longest_step
from corporeal.mpm.window import POINTED, Window, node_tasks, particle_tasks, too_wide
from corporeal.types import Vector

RIGID_COURANT = 0.05
"""Largest fraction of a cell that a rigid body may cross in one step."""
FALL = 0.1
"""Largest step as a fraction of √(dx/g)."""
SUNK = 8.0
"""A particle deeper than this in a wall [cells] has left the domain."""
FARTHEST = 1e5
"""A particle farther than this from the origin [cells] has left the domain."""
LARGEST = 1e9
"""A particle with a larger velocity [m/s], velocity gradient or strain is as good as infinite."""
MOST_THREADS = 4
STRANGERS = 0.1
"""Share of a field's particles outside of their blocks from which it is sorted with others."""
BREATH = 0.2
"""Seconds of computing after which Python looks whether somebody wants to stop."""
KEPT = ("count", "smallest", "largest", "speed", "wave")
"""What the clock remembers from step to step."""


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
        self.threads = threads or min(MOST_THREADS, cores())
        self.steps = Steps()
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
        self.program = Program(self.world, self.threads)
        self.field = np.zeros(len(self.members), FIELD)
        self.window: dict[int, Window] = {}
        walls = [[*plane.normal, plane.offset / problem.cell] for plane in problem.planes]
        sorter = Sorter(np.reshape(walls, (-1, 4)), (SUNK, FARTHEST), self.program)
        self.reader = Reader(problem.cell, self.program)
        self.material: dict[int, np.ndarray] = {}
        self.body_of_material: dict[int, np.ndarray] = {}
        for f, bodies in enumerate(self.members):
            if self._is_rigid(f):
                continue
            self.material[f], kind, self.body_of_material[f] = tables.materials(problem, bodies)
            rows = tables.particle_rows(problem, bodies, self.first, kind)
            place = np.concatenate([problem.bodies[b].position for b in bodies]) / problem.cell
            self._refuse_far(place, bodies)
            flows = any(np.isin(problem.bodies[b].law, tables.PLASTIC_LAWS).any() for b in bodies)
            self.window[f] = Window(place, rows, flows, sorter)
            if not self.window[f].fits:
                raise SimulationError(too_wide(problem, bodies, 0.0))
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
        self.springs = Springs(problem, self.first, self.ledger.external_impulse, self.rigid)
        self.grips: dict[int, Grip] = {}
        self.bond, self.bonded = tables.bonds(problem)
        self._wind_clock()
        self.connect()

    def _wind_clock(self) -> None:
        problem, clock = self.problem, np.zeros(1, CLOCK)
        self.clock = clock
        self.things = pacing.things(problem, self.rigid, self.body_of_material)
        clock["gravity"], clock["ramp"] = problem.gravity, problem.gravity_ramp
        clock["courant"], clock["rigid_courant"] = problem.courant, RIGID_COURANT
        pull = max(
            float(np.linalg.norm(a)) for a in (problem.gravity, *self.things["push"].tolist())
        )
        fall = FALL * np.sqrt(problem.cell / max(pull, 1e-30))
        clock["fall"] = min(fall, longest_step(problem))
        clock["speed"] = max(np.linalg.norm(b.velocity, axis=1).max() for b in problem.bodies)
        clock["wave"] = max([self._rest_speed(f) for f in self.window] + [0.0])
        clock["smallest"] = np.inf
        clock["things"] = len(self.things)
        # Carried bodies are moved between steps.
        clock["fuse"] = not self.carried
        point(
            clock,
            thing=self.things,
            external_impulse=self.ledger.external_impulse,
            push_work=self.ledger.push_work,
        )
        point(self.world, clock=clock)

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
        slowing = float((np.sqrt(1.0 + damping**2) + damping).max())
        self.field["slowing"][field] = slowing
        return float(wave.max()) * slowing

    def connect(self) -> None:
        """List the tasks and point the native structs to where everything is."""
        self.task, counts = particle_tasks(self.window)
        self.node_task = node_tasks(self.window)
        self.report = np.zeros((len(self.task), REPORT))
        for f, window in self.window.items():
            self._connect_field(f, window)
        for body in self.carried:
            body.find(self.window[0])
        world = self.world
        point(
            world,
            field=self.field,
            task=self.task,
            list=self.node_task,
            report=self.report,
            blow=self.blows.record,
            bond=self.bond,
        )
        self._connect_bonds()
        self.springs.connect(world)
        world["blows"] = len(self.blows.record)
        world["blown"] = len(self.field) if len(self.blows.record) else 0
        world["fields"], world["dx"] = len(self.field), self.problem.cell
        world["tasks"], world["nodes"] = len(self.task), len(self.node_task)
        world["colour"] = counts
        world["stands"] = self.contact.stand(self.field["floor"], len(self.node_task))
        world["rigids"] = len(self.field) if self.field["rigids"].any() else 0
        self.clock["laid"] = 0
        particles = sum(window.count for window in self.window.values())
        self.program.divide((np.cumsum(counts) - counts).tolist(), len(self.task), particles)

    def _connect_bonds(self) -> None:
        """Make room for every node that a frame could hold."""
        self.held = []
        for row in self.bond:
            room = 64 * len(self.window[int(row["soft"])].where)
            held = np.zeros(room, np.int32), np.zeros(room, np.float32), np.zeros(room, np.float32)
            self.held += held
            row["slot"], row["mass"], row["volume"] = (array.ctypes.data for array in held)
        self.world["bonds"] = len(self.bond)

    def _connect_field(self, f: int, window: Window) -> None:
        record = self.field[f : f + 1]
        for name in POINTED:
            record[name] = getattr(window, name).ctypes.data
        record["material"] = self.material[f].ctypes.data
        record["origin"], record["dim"] = window.origin, window.dim
        record["blocks"], record["pool"] = len(window.block), len(window.where)
        record["flows"] = len(window.history) > 0
        record["swells"] = tables.swells(self.material[f])
        # One lane of a node says how high mass lies over a floor, or how it swells.
        watched = self.contact.watched(window.origin, window.dim)
        record["floor"], record["level"] = (-1, 0.0) if record["swells"] else watched

    # ------------------------------------------------------------ time

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        return float(self.world["time"][0])

    def advance(self, until: float) -> None:
        """Step until exactly ``until`` [s], choosing steps by stability."""
        good = self.save()
        try:
            self.clock["until"], self.clock["given"] = until, 0.0
            breath = pacing.Breath(BREATH)
            while self.time < until:
                with breath:
                    self.clock["budget"] = 1 if self.carried else breath.steps
                    self._run()
        except SimulationError:
            lost = self.lost.copy()
            self.restore(good)
            self.lost = lost
            raise

    def stable_step(self) -> float:
        """Largest stable step now [s]: dt = s dx/(c + |v|), and the falls of what is rigid."""
        self.clock["budget"] = 0
        self.program.run()
        return float(self.clock["stable"][0])

    def step(self, dt: float) -> None:
        """Take one step of dt [s]."""
        self.clock["given"], self.clock["budget"] = dt, 1
        self._run()

    def _run(self) -> None:
        """Step until something is up; where a list was too short, lengthen it and go on."""
        world = self.world
        self.program.run()
        while world["full"][0]:
            self.contact.lengthen()
            world["again"] = 1
            self.program.run(resume=True)
        self._note_steps()
        strayed = [body.carry(self.window[0], float(world["dt"][0])) for body in self.carried]
        if world["stop"][0] == INFINITE:
            self._find_lost()
        if world["stop"][0] == STRAYED or any(strayed):
            astray = (self.report[:, ASTRAY] > 0) | any(strayed)
            self._sort({int(f) for f in self.task[astray, 0]})

    def _note_steps(self) -> None:
        clock = self.clock[0]
        self.steps = Steps(int(clock["count"]), float(clock["smallest"]), float(clock["largest"]))

    @property
    def mass(self) -> list[float]:
        """Mass of every body [kg]."""
        return self.things["mass"].tolist()

    def book(self) -> None:
        """Move what the tasks added up into the ledger."""
        total = self.report[:, [PLASTIC, VISCOUS, WORK]].sum(axis=0)
        self.ledger.plastic_loss += total[0]
        self.ledger.viscous_loss += total[1] + self.springs.take_loss()
        self.ledger.push_work += total[2] + self.blows.take_work() + self.springs.take_work()
        self.report[:, [PLASTIC, VISCOUS, WORK]] = 0.0

    def _sort(self, fields: set[int]) -> None:
        self.book()
        lost = [window.survey() for window in self.window.values()]
        if any(lost):
            self._find_lost()
        # Who would be next soon is sorted now: all particles must lie down again after every sort.
        fields |= {f for f, window in self.window.items() if window.strangers > STRANGERS}
        wide = [f for f in sorted(fields) if not self.window[f].sort()]
        self.connect()
        if wide:
            raise SimulationError(too_wide(self.problem, self.members[wide[0]], self.time))

    def _find_lost(self) -> None:
        """Raise when a particle is not finite or left the domain."""
        cell = self.problem.cell
        self.lost[:] = False
        for window in self.window.values():
            place = window.position()
            rows = window.channel(3, 21)
            good = (np.abs(rows) < LARGEST).all(axis=1) & (np.abs(place) < FARTHEST).all(axis=1)
            for plane in self.problem.planes:
                height = place @ np.array(plane.normal) - plane.offset / cell
                good &= height > -SUNK
            self.lost[window.number[~good]] = True
        if self.lost.any():
            first = int(np.argmax(self.lost))
            body = int(np.searchsorted(self.first, first, side="right")) - 1
            raise SimulationError(
                f"At t = {self.time:.4g} s {int(self.lost.sum())} particles of "
                f"{self.problem.bodies[body].name!r} were lost: they are not finite or left the "
                "domain. What was computed before is kept. Use more detail, or look for parts "
                "that overlap at the start."
            )

    # ------------------------------------------------------------ from outside

    def poke(self, body: int, point: Vector, impulse: Vector) -> None:
        """Give a body an impulse [N s] at a point [m] at once: see ``problem.Interactive``."""
        touching.poke(self, body, point, impulse)

    def drag(self, body: int, point: Vector | None, target: Vector, stiffness: float) -> None:
        """Pull on a body by a spring until told otherwise: see ``problem.Interactive``."""
        touching.drag(self, body, point, (target, stiffness))

    # ------------------------------------------------------------ reading and keeping

    def snapshot(self) -> Snapshot:
        """Copy every particle's state."""
        return shown(self)

    def measure(self) -> Measure:
        """Add up the ledger."""
        self.book()
        return measured(self)

    def save(self) -> dict[str, np.ndarray]:
        """Everything needed to go on later exactly as if nothing had happened."""
        self.book()
        saved = {f"ledger.{k}": v for k, v in self.ledger.as_arrays().items()}
        for f, window in self.window.items():
            saved |= {f"field{f}.{k}": v for k, v in window.saved().items()}
        saved |= {f"rigid{b}": state.copy() for b, state in self.rigid.items()}
        saved["contact"] = self.contact.past
        saved["clock"] = np.array([self.time, *(float(self.clock[k][0]) for k in KEPT)])
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
        self.contact.past = saved["contact"]
        time, *kept = saved["clock"].tolist()
        self.world["time"] = time
        for name, value in zip(KEPT, kept, strict=True):
            self.clock[name] = value
        self._note_steps()
        self.lost[:] = False
        self.connect()

    def halt(self, bodies: Collection[int]) -> None:
        """Take all motion out of some bodies; nothing of it is booked."""
        beginning.halt(self, bodies)

    def begin(self, saved: dict[str, np.ndarray], bodies: Collection[int]) -> None:
        """Put some bodies where they were in another's ``save``: see ``problem.Engine``."""
        beginning.begin(self, saved, bodies)
