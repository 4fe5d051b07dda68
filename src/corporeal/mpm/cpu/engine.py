"""The production engine: float32 particles in sorted batches, one sparse grid per body.

Moving-least-squares MPM (Hu et al. 2018) with quadratic B-splines and affine FLIP; the loops over particles, nodes and
contacts are the native pieces of ``cpu.program``, launched by Warp.
"""

from collections.abc import Collection
from typing import Self

import numpy as np

from corporeal.core.errors import SimulationError
from corporeal.core.process_resources import usable_cores
from corporeal.mpm.body_changes import BodyChange, EngineBodyChanges
from corporeal.mpm.constants import (
    FREE_FALL_STEP_FRACTION,
    MAX_DISTANCE_FROM_ORIGIN_DX,
    MAX_FINITE_VALUE,
    MAX_WALL_DEPTH_DX,
    OUT_OF_BLOCK_FRACTION,
    POLL_INTERVAL_S,
    RIGID_COURANT,
    TINY,
)
from corporeal.mpm.cpu import native_tables, task_lists
from corporeal.mpm.cpu import step_clock as pacing
from corporeal.mpm.cpu.contact_memory import ContactMemory, rigid_grid, write_pointers
from corporeal.mpm.cpu.engine_checkpoint import EngineCheckpoint, SavedArrays, continued
from corporeal.mpm.cpu.field_window import NATIVE_ARRAYS, FieldWindow, window_too_wide_error
from corporeal.mpm.cpu.layout import (
    BODY_SUMS,
    CLOCK_RECORD,
    FIELD_RECORD,
    LAMBDA,
    MT,
    MU,
    PLASTIC,
    REPORT_ASTRAY,
    REPORT_COLUMNS,
    REPORT_WORK,
    RHO,
    ST,
    STIFFENING,
    STOP_INFINITE,
    STOP_PARTICLE_STRAYED,
    VE,
    VISCOUS,
    WORLD_RECORD,
)
from corporeal.mpm.cpu.native_tables import SpringRecords, WindRecords
from corporeal.mpm.cpu.particle_reader import ParticleReader
from corporeal.mpm.cpu.particle_sorter import ParticleSorter
from corporeal.mpm.cpu.program import CpuProgram
from corporeal.mpm.cpu.shared_field import CarriedRigidBody
from corporeal.mpm.cpu.shell_records import ShellRecords
from corporeal.mpm.diagnostics import BodySums
from corporeal.mpm.engine_interaction import EngineLoadChanges
from corporeal.mpm.ledger import EngineLedger
from corporeal.mpm.material_table import MaterialTable
from corporeal.mpm.physics import prescribed_motion, wall_stress
from corporeal.mpm.physics.contact import full_cell_mass
from corporeal.mpm.physics.rigid import RigidBody
from corporeal.mpm.physics.spring_grips import Grip
from corporeal.mpm.physics.springs import longest_step
from corporeal.mpm.problem import Problem, Snapshot, StepStatistics
from corporeal.mpm.shells.assemble import Shells
from corporeal.mpm.state import Velocities

DEFAULT_THREADS = 4


class CpuEngine(EngineBodyChanges, EngineLoadChanges):
    """Steps one problem on the CPU."""

    name = "cpu"

    def __init__(self, problem: Problem, threads: int | None = None) -> None:
        """Lay out memory.

        Args:
            problem: What to simulate.
            threads: How many threads share the loops; None: as many as there are cores, up to 4. The result does not
                depend on it.
        """
        self.problem = problem
        self.threads = threads or min(DEFAULT_THREADS, usable_cores())
        self.steps = StepStatistics()
        self.ledger = EngineLedger.blank(len(problem.bodies), len(problem.planes))
        self.first = [0, *np.cumsum([len(b.position) for b in problem.bodies]).tolist()]
        self.lost = np.zeros(self.first[-1], bool)
        everything = list(range(len(problem.bodies)))
        single = problem.contact == "single"
        self.members = [everything] if single else [[b] for b in everything]
        self.rigid = {b: native_tables.rigid_state(body) for b, body in enumerate(problem.bodies) if body.rigid}
        self.paths = prescribed_motion.path_followers(problem)
        self.points = {b: native_tables.rigid_points(problem.bodies[b], state) for b, state in self.rigid.items()}
        self._lay_out()

    def _is_rigid(self, field: int) -> bool:
        return self.problem.contact == "multi" and field in self.rigid

    def _lay_out(self) -> None:
        problem = self.problem
        self.world = np.zeros(1, WORLD_RECORD.dtype)
        self.program = CpuProgram(self.world, self.threads)
        self.field = np.zeros(len(self.members), FIELD_RECORD.dtype)
        self.window: dict[int, FieldWindow] = {}
        walls = [[*plane.normal, plane.offset / problem.cell] for plane in problem.planes]
        sorter = ParticleSorter(
            np.reshape(walls, (-1, 4)), (MAX_WALL_DEPTH_DX, MAX_DISTANCE_FROM_ORIGIN_DX), self.program
        )
        self.reader = ParticleReader(problem.cell, self.program)
        self._fill_fields(sorter)
        separate = [b for b in self.rigid if self._is_rigid(b)]
        self.grids = [
            rigid_grid(self.field[b : b + 1], problem.bodies[b], self.rigid[b], self.points[b], problem.cell)
            for b in separate
        ]
        self.carried = [
            CarriedRigidBody(problem.bodies[b], state, self.first[b], problem.cell)
            for b, state in self.rigid.items()
            if b not in separate
        ]
        self.contact = ContactMemory(self.world, problem, self.ledger)
        self.winds = WindRecords(problem, self.first, self.ledger.external_impulse, self.rigid, self.points)
        self.springs = SpringRecords(problem, self.first, self.ledger.external_impulse, self.rigid)
        self.shells = ShellRecords(problem)
        self.grips: dict[int, Grip] = {}
        self.bond, self.bonded = native_tables.bond_records(problem)
        self._wind_clock()
        self.saving = EngineCheckpoint(
            self.ledger, self.window, self.rigid, self.contact, self.shells, self.clock, self.world
        )
        self.connect()

    def _fill_fields(self, sorter: ParticleSorter) -> None:
        """Give every field that deforms its materials and its particles."""
        problem = self.problem
        substances, row_of_particle = MaterialTable.of(problem)
        self.material: dict[int, native_tables.FieldMaterials] = {}
        for f, bodies in enumerate(self.members):
            if self._is_rigid(f):
                continue
            self.material[f] = native_tables.FieldMaterials.of(substances.of_bodies(bodies))
            kind = row_of_particle[self.first[bodies[0]] : self.first[bodies[-1] + 1]]
            kind = (kind - kind.min()).astype(np.int32)
            rows = native_tables.particle_rows(problem, bodies, self.first, kind)
            place = np.concatenate([problem.bodies[b].position for b in bodies]) / problem.cell
            self._refuse_far(place, bodies)
            self.window[f] = FieldWindow(place, rows, self.material[f], sorter)
            if not self.window[f].fits:
                raise SimulationError(window_too_wide_error(problem, bodies, 0.0))

    def _wind_clock(self) -> None:
        problem, clock = self.problem, np.zeros(1, CLOCK_RECORD.dtype)
        self.clock = clock
        self.body_loads = pacing.body_loads(
            problem, self.rigid, {f: material.body for f, material in self.material.items()}, self.paths
        )
        clock["gravity"], clock["ramp"] = problem.gravity, problem.gravity_ramp
        clock["courant"], clock["rigid_courant"] = problem.courant, RIGID_COURANT
        clock["fall"] = self._longest_fall()
        clock["speed"] = max(np.linalg.norm(b.velocity, axis=1).max() for b in problem.bodies)
        clock["wave"] = max([self._rest_speed(f) for f in self.window] + [0.0])
        clock["smallest"] = np.inf
        clock["body_loads"] = len(self.body_loads)
        # Carried bodies are moved between steps.
        clock["fuse"] = not self.carried
        write_pointers(
            clock,
            body_load=self.body_loads,
            external_impulse=self.ledger.external_impulse,
            push_work=self.ledger.push_work,
        )
        write_pointers(self.world, clock=clock)

    def _longest_fall(self) -> float:
        """Longest step in which nothing falls far from rest, and springs are followed [s]."""
        pulls = (self.problem.gravity, *self.body_loads["push"].tolist())
        pull = max(float(np.linalg.norm(a)) for a in pulls)
        fall = FREE_FALL_STEP_FRACTION * np.sqrt(self.problem.cell / max(pull, TINY))
        return float(min(fall, longest_step(self.problem), prescribed_motion.longest_step(self.problem)))

    def _refuse_far(self, place: np.ndarray, bodies: list[int]) -> None:
        if not np.isfinite(place).all():
            raise SimulationError(
                f"{self.problem.bodies[bodies[0]].name!r} starts with positions that are not "
                "finite. Look at the mesh it was filled from."
            )

    def _rest_speed(self, field: int) -> float:
        """Fastest wave of a field at rest [m/s]."""
        table = self.material[field].table.astype(np.float64)
        modulus = (table[:, LAMBDA] + 2.0 * table[:, MU]) * table[:, STIFFENING]
        return float(np.sqrt(modulus / table[:, RHO]).max())

    def connect(self) -> None:
        """List the tasks and point the native structs to where everything is."""
        hands = self.program.employ(window.count for window in self.window.values())
        self.task = task_lists.list_particle_tasks(self.window, hands)
        self.node_task = task_lists.list_node_tasks(self.window)
        self.report = np.zeros((len(self.task.row), REPORT_COLUMNS))
        for f, window in self.window.items():
            self._connect_field(f, window)
        for body in self.carried:
            body.find(self.window[0])
        world = self.world
        write_pointers(
            world,
            field=self.field,
            task=self.task.row,
            chore=self.task.chore,
            list=self.node_task,
            report=self.report,
            wind_load=self.winds.record,
            bond=self.bond,
        )
        self._connect_bonds()
        self.springs.connect(world)
        world["wind_loads"] = len(self.winds.record)
        world["wind_tasks"] = len(self.field) if len(self.winds.record) else 0
        world["fields"], world["dx"] = len(self.field), self.problem.cell
        world["tasks"], world["nodes"] = len(self.task.row), len(self.node_task)
        world["colour"], world["chores"] = self.task.colours, len(self.task.chore)
        self.shells.connect(world, self.field, self.problem.contact == "single")
        world["stands"] = self.contact.stand(self.field["floor"], len(self.node_task))
        world["rigids"] = len(self.field) if self.field["rigids"].any() else 0
        self.clock["laid"] = 0
        self.program.divide(self.task.first, len(self.task.chore))

    def _connect_bonds(self) -> None:
        """Make room for every node that a frame could hold."""
        self.held = []
        for row in self.bond:
            room = 64 * len(self.window[int(row["soft"])].where)
            held = np.zeros(room, np.int32), np.zeros(room, np.float32), np.zeros(room, np.float32)
            self.held += held
            row["slot"], row["mass"], row["volume"] = (array.ctypes.data for array in held)
        self.world["bonds"] = len(self.bond)

    def _connect_field(self, f: int, window: FieldWindow) -> None:
        record = self.field[f : f + 1]
        window.used[:] = 3  # which set of nodes is which is forgotten: both may hold anything
        for name in NATIVE_ARRAYS:
            record[name] = getattr(window, name).ctypes.data
        record["material"] = self.material[f].table.ctypes.data
        record["origin"], record["dim"] = window.origin, window.dim
        record["blocks"], record["pool"] = len(window.block), len(window.where)
        record["flows"], record["relaxes"] = self.material[f].flows, len(window.branch) > 0
        record["uses_mean_dilatation"], record["pours"] = (
            self.material[f].uses_mean_dilatation,
            self.material[f].pours,
        )
        record["full"] = full_cell_mass(self.problem.bodies[f], self.problem.cell)
        record["flows_by"] = wall_stress.flow_curve(self.problem.bodies[f], self.problem.cell)
        # One lane of a node says how high mass lies over a floor.
        record["floor"], record["level"] = self.contact.watched(window.origin, window.dim)
        self.contact.note_walls(record, f)

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        return float(self.world["time"][0])

    def advance(self, until: float) -> None:
        """Step until exactly ``until`` [s], choosing steps by stability."""
        good = self.save()
        try:
            self.clock["until"], self.clock["given"] = until, 0.0
            batch = pacing.StepBatch(POLL_INTERVAL_S)
            while self.time < until:
                with batch:
                    self.clock["budget"] = 1 if self.carried else batch.steps
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
        if world["stop"][0] == STOP_INFINITE:
            self._find_lost()
        if world["stop"][0] == STOP_PARTICLE_STRAYED or any(strayed):
            astray = (self.report[:, REPORT_ASTRAY] > 0) | any(strayed)
            self._sort({int(f) for f in self.task.field[astray]})

    def _note_steps(self) -> None:
        clock = self.clock[0]
        self.steps = StepStatistics(int(clock["count"]), float(clock["smallest"]), float(clock["largest"]))

    def book(self) -> None:
        """Move what the tasks added up into the ledger."""
        total = self.report[:, [PLASTIC, VISCOUS, REPORT_WORK]].sum(axis=0)
        plastic_loss, branch_work = self.shells.take_losses()
        self.ledger.plastic_loss += total[0] + plastic_loss
        self.ledger.viscous_loss += total[1] + branch_work + self.springs.take_loss()
        self.ledger.push_work += total[2] + self.winds.take_work() + self.springs.take_work()
        self.report[:, [PLASTIC, VISCOUS, REPORT_WORK]] = 0.0

    def _sort(self, fields: set[int]) -> None:
        self.book()
        lost = [window.survey() for window in self.window.values()]
        if any(lost):
            self._find_lost()
        # Who would be next soon is sorted now: all particles must lie down again after every sort.
        out = {f: window.out_of_block for f, window in self.window.items()}
        fields |= {f for f, share in out.items() if share > OUT_OF_BLOCK_FRACTION}
        wide = [f for f in sorted(fields) if not self.window[f].sort()]
        self.connect()
        if wide:
            raise SimulationError(window_too_wide_error(self.problem, self.members[wide[0]], self.time))

    def _find_lost(self) -> None:
        """Raise when a particle is not finite or left the domain."""
        cell = self.problem.cell
        self.lost[:] = False
        for window in self.window.values():
            place = window.position()
            rows = window.channel(VE, ST - VE)
            good = (np.abs(rows) < MAX_FINITE_VALUE).all(axis=1) & (np.abs(place) < MAX_DISTANCE_FROM_ORIGIN_DX).all(
                axis=1
            )
            for plane in self.problem.planes:
                height = place @ np.array(plane.normal) - plane.offset / cell
                good &= height > -MAX_WALL_DEPTH_DX
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

    def save(self) -> SavedArrays:
        """Everything needed to go on later exactly as if nothing had happened."""
        self.book()
        return self.saving.save()

    def restore(self, saved: SavedArrays) -> None:
        """Go on from what ``save`` returned, on an engine built from the same problem."""
        self.saving.restore(saved)
        self._note_steps()
        self.lost[:] = False
        self.connect()

    def _particles(self) -> Snapshot:
        count = self.first[-1]
        now = Snapshot(
            time=self.time,
            position=np.zeros((count, 3)),
            velocity=np.zeros((count, 3)),
            deformation=np.zeros((count, 3, 3)),
            motion=np.zeros((count, 3, 3)),
            plastic_strain=np.zeros(count),
        )
        for f, window in self.window.items():
            self.reader.spread(window, self.material[f], now)
        return now

    def _sums(self) -> BodySums:
        rows = np.zeros((len(self.problem.bodies), BODY_SUMS))
        for f, window in self.window.items():
            rows[self.members[f]] = self.reader.total(window, self.material[f])
        rows[:, 10:12] += self.shells.energy_of_bodies(self._positions(), len(rows))
        return BodySums(
            mass=self.body_loads["mass"].copy(),
            first_moment=rows[:, :3],
            momentum=rows[:, 3:6],
            angular_momentum=rows[:, 6:9],
            kinetic=rows[:, 9],
            elastic=rows[:, 10],
            relaxing=rows[:, 11],
            fastest=rows[:, 12],
        )

    def _positions(self) -> np.ndarray:
        """Positions of the particles of all fields that deform [m]."""
        position = np.zeros((self.first[-1], 3))
        for window in self.window.values():
            position[window.number] = window.position() * self.problem.cell
        return position

    def _rigid_bodies(self) -> dict[int, RigidBody]:
        start = self.springs.start
        return {b: native_tables.rigid_body(state, start[b], self.points[b]) for b, state in self.rigid.items()}

    def _shells(self) -> Shells:
        return self.shells.shells

    def _booked(self) -> EngineLedger:
        self.book()
        return self.ledger

    def _enter(self, body: int, impulse: np.ndarray, work: float) -> None:
        self.ledger.external_impulse[body] += impulse
        self.ledger.push_work += work

    def _add_velocity(self, body: int, particle: np.ndarray, gained: np.ndarray) -> None:
        window = self.window[0 if self.problem.contact == "single" else body]
        every = np.zeros((self.first[-1], 3))
        every[self.first[body] + particle] = gained
        fastest = window.add_velocity(every[window.number])
        self.clock["speed"] = max(float(self.clock["speed"][0]), fastest)
        self._forget_nodes()

    def _add_momentum(self, body: int, momentum: np.ndarray, angular: np.ndarray) -> None:
        state = self.rigid[body]
        moving = native_tables.rigid_body(state, self.springs.start[body], self.points[body])
        speed = moving.velocity + momentum / moving.mass
        native_tables.set_rigid_motion(state, speed, moving.angular_momentum + angular)
        self._forget_nodes()

    def _take_grips(self) -> None:
        self.book()
        self.springs.grasp(self.grips)
        self.springs.connect(self.world)

    def _take_loads(self) -> None:
        self.book()
        self.clock["gravity"], self.clock["ramp"] = self.problem.gravity, self.problem.gravity_ramp
        self.clock["fall"] = self._longest_fall()
        self.winds.set_wind(self.problem)

    def _set_motion(self, bodies: Collection[int], motion: Velocities) -> None:
        for f, window in self.window.items():
            own = np.isin(self.material[f].body, list(bodies))
            chosen = own[window.channel(MT, 1)[:, 0].view(np.int32)]
            window.set_motion(chosen, motion.velocity[window.number[chosen]])
        for b in self.rigid.keys() & set(bodies):
            native_tables.set_rigid_motion(self.rigid[b], motion.speed[b], motion.spin_momentum[b])
        self._forget_nodes()

    def _forget_nodes(self) -> None:
        """Void nodes that were laid with other velocities."""
        self.clock["laid"] = 0

    def _place_as(self, saved: SavedArrays, bodies: Collection[int]) -> None:
        """Take bodies over with their fields: in one that all share, every particle comes along."""
        fields = [f for f in self.window if not set(bodies).isdisjoint(self.members[f])]
        self.saving.place_as(saved, fields, bodies)
        for f in fields:
            # What it was strained by there was long ago: branches have forgotten it.
            self.window[f].relax(self.material[f])
        moved = [b for f in fields for b in self.members[f]]
        self.shells.restore(saved, moved)
        self.shells.relax(moved)
        self.connect()

    def _successor(self, problem: Problem, change: BodyChange) -> Self:
        after = type(self)(problem, self.threads)
        saved, shared = self.save(), problem.contact == "single"
        after.restore(continued(after.save(), saved, change, shared))
        if shared:
            after.window[0].continue_as(self.window[0], after.material[0])
            after.connect()
        return after
