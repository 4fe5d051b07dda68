"""The launches of a step on the device, and the graph that repeats them until a frame is done."""

from dataclasses import dataclass
from typing import Any

from corporeal.mpm.cuda import contact, dilatation, layout, loads, rigid
from corporeal.mpm.cuda import contact_impulses as impulses
from corporeal.mpm.cuda import contact_nodes as meets
from corporeal.mpm.cuda import contact_rolling as rolling
from corporeal.mpm.cuda import contact_rounds as rounds
from corporeal.mpm.cuda import grid as grids
from corporeal.mpm.cuda import inclusions as bonds
from corporeal.mpm.cuda import step as kernels
from corporeal.mpm.cuda.layout import wp
from corporeal.mpm.problem import Problem

MODULES = (
    *(grids, kernels, dilatation, meets, contact),
    *(impulses, rounds, rolling, rigid, loads, bonds),
)
"""Modules whose kernels a step launches."""
THREADS_PER_PROCESSOR = 1024


@dataclass
class Arrays:
    """Everything on the device: the structs of ``layout``."""

    sheet: Any
    particles: Any
    rigid: Any
    grid: Any
    contacts: Any
    loads: Any
    bonds: Any


class Program:
    """One frame's launches, recorded as a graph when they are first needed."""

    def __init__(self, problem: Problem, arrays: Arrays, device: str) -> None:
        self.bodies, self.planes = len(problem.bodies), len(problem.planes)
        self.arrays, self.device = arrays, device
        self.graph = None
        self.held = False
        self.touching = self.planes > 0 or (self.bodies > 1 and problem.contact == "multi")
        self.rolls = bool(arrays.rigid.bends.numpy().any()) if arrays.rigid.surfaces else False
        table = arrays.particles.table.numpy()
        self.swelling = bool(table[:, int(layout.SWELLS)].any())
        self.brakes = problem.brakes and bool(arrays.rigid.surfaces)
        self.stride = self._threads()

    def _threads(self) -> int:
        """Threads of one launch: as many as keep the device busy."""
        found = wp.get_device(self.device)
        return THREADS_PER_PROCESSOR * found.sm_count if found.is_cuda else 1

    def run(self) -> None:
        """Take all steps of a frame."""
        if self.graph is None:
            self.graph = self._record()
        wp.capture_launch(self.graph)

    def hold(self, held: bool) -> None:
        """Say whether anything is held from outside."""
        if held != self.held:
            self.held = held
            self.forget()

    def forget(self) -> None:
        """Record anew before the next run: arrays were replaced."""
        self.graph = None

    def look_ahead(self) -> None:
        """Work out the largest stable step."""
        self._run(kernels.begin, 1, self.arrays.sheet, self.arrays.rigid, stride=False)

    def _run(self, kernel: Any, threads: int, *inputs: Any, stride: bool = True) -> None:
        given = [*inputs, threads] if stride else list(inputs)
        wp.launch(kernel, dim=threads, inputs=given, device=self.device)

    def _each(self, kernel: Any, *inputs: Any) -> None:
        """Launch a kernel that loops over its items."""
        self._run(kernel, self.stride, *inputs)

    def _per_body(self, kernel: Any, *inputs: Any) -> None:
        """Launch a kernel with one thread for each body."""
        self._run(kernel, self.bodies, *inputs, stride=False)

    def arrange(self) -> None:
        """Sort particles by block, and give every block that they reach a slot: FULL if too few."""
        a = self.arrays
        if a.particles.count:
            self._sort()
        self._each(grids.forget, a.grid, a.sheet)
        self._each(grids.claim_blocks, a.particles, a.rigid, a.grid, a.sheet)

    def _sort(self) -> None:
        p, count = self.arrays.particles, self.arrays.particles.count
        keys = wp.zeros(2 * count, dtype=wp.int64, device=self.device)
        order = wp.zeros(2 * count, dtype=wp.int32, device=self.device)
        self._each(grids.key_particles, p, keys, order)
        wp.utils.radix_sort_pairs(keys, order, count)
        in_order = wp.empty_like(p.words)
        self._each(grids.reorder, count, order, p.words, in_order)
        wp.copy(p.words, in_order)

    def _record(self) -> Any:
        """Capture a whole frame: steps until the clock says stop."""
        with wp.ScopedCapture(device=self.device) as capture:
            self._run(kernels.begin, 1, self.arrays.sheet, self.arrays.rigid, stride=False)
            wp.capture_while(self._flag(layout.GOING), self._step)
        return capture.graph

    def _step(self) -> None:
        a = self.arrays
        self._each(grids.link, a.grid, a.sheet)
        self._each(grids.clear, a.grid, a.sheet)
        if self.touching:
            self._each(contact.recall, a.grid, a.contacts, a.sheet)
        self._load()
        if self.swelling:
            self._each(dilatation.empty, a.grid, a.sheet)
            self._each(dilatation.pool, a.particles, a.grid)
        self._each(kernels.scatter, a.particles, a.grid, a.loads, a.sheet)
        if a.rigid.count:
            self._each(kernels.scatter_rigid, a.rigid, a.grid, a.sheet)
        self._each(grids.divide, a.grid, a.sheet)
        self._hold()
        if self.touching:
            self._look()
        self._force()
        if self.touching:
            self._touch()
        self._release()
        self._each(kernels.gather, a.particles, a.grid, a.loads, a.sheet)
        if self.swelling:
            self._each(dilatation.press, a.particles, a.grid, a.sheet)
        if a.rigid.count:
            self._per_body(rigid.advance, a.rigid, a.sheet)
            self._each(rigid.follow, a.rigid, a.grid, a.sheet)
        self._run(kernels.tick, 1, a.sheet, a.rigid, a.loads, stride=False)

    def _load(self) -> None:
        """Let wind and tethers act on particles."""
        a = self.arrays
        if not (a.loads.faces or a.loads.tethers or a.loads.joints or self.held):
            return
        self._each(loads.calm, a.particles, a.loads, a.sheet)
        if a.loads.faces:
            self._each(loads.blow, a.particles, a.rigid, a.loads, a.sheet)
        if a.loads.tethers:
            self._each(loads.tether, a.particles, a.rigid, a.loads, a.sheet)
        if self.held:
            self._each(loads.feel, a.particles, a.loads, a.sheet)
            self._each(loads.grasp, a.particles, a.loads, a.sheet)

    def _hold(self) -> None:
        """Find what rigid frames hold."""
        a = self.arrays
        if a.bonds.count:
            self._per_body(bonds.let_go, a.bonds, a.sheet)
            self._each(bonds.hold, a.grid, a.rigid, a.bonds, a.sheet)

    def _force(self) -> None:
        """Let forces act on rigid bodies; frames then stand for all that they hold."""
        a = self.arrays
        if not a.rigid.count:
            return
        if a.loads.faces or a.loads.tethers:
            self._per_body(loads.load_rigid, a.rigid, a.loads, a.sheet)
        self._per_body(rigid.force, a.rigid, a.sheet)
        if a.loads.joints:
            self._run(loads.join, 1, a.rigid, a.loads, a.sheet, stride=False)
        if self.held:
            self._per_body(loads.grasp_rigid, a.rigid, a.loads, a.sheet)
        if a.bonds.count:
            self._per_body(bonds.compose, a.rigid, a.bonds, a.sheet)

    def _release(self) -> None:
        """Give frames and what they hold their parts of the motion."""
        a = self.arrays
        if a.bonds.count:
            self._each(bonds.split_nodes, a.grid, a.rigid, a.bonds, a.sheet)
            self._per_body(bonds.split_frames, a.rigid, a.bonds, a.sheet)

    def _look(self) -> None:
        """List nodes where fields meet, choose normals, and measure gaps."""
        a = self.arrays
        self._each(meets.list_meets, a.grid, a.contacts, a.rigid, a.sheet)
        self._each(meets.look_around, a.grid, a.sheet)
        self._each(contact.show_particles, a.particles, a.grid, a.contacts, a.sheet)
        if a.rigid.count:
            self._each(contact.show_rigid, a.rigid, a.grid, a.contacts, a.sheet)
        self._each(contact.propose, a.grid, a.contacts, a.rigid, a.sheet)
        self._each(contact.reach_particles, a.particles, a.grid, a.contacts, a.sheet)
        if a.rigid.count:
            self._each(contact.reach_rigid, a.rigid, a.grid, a.contacts, a.sheet)
        self._each(contact.choose, a.contacts, a.rigid, a.sheet)
        self._each(contact.measure_gaps, a.grid, a.contacts, a.rigid, a.sheet)
        if a.rigid.surfaces:
            self._run(meets.count_nodes, 1, a.sheet, stride=False)
            if a.rigid.facets:
                self._each(meets.list_facets, a.rigid, a.contacts, a.sheet)
            if self.rolls:
                self._each(meets.list_curves, a.rigid, a.contacts, a.sheet)
            if a.rigid.facets or self.rolls:
                self._each(meets.instead_of_nodes, a.rigid, a.contacts, a.sheet)
            self._each(meets.list_points, a.rigid, a.contacts, a.sheet)

    def _touch(self) -> None:
        """Solve all impulses, and enter them."""
        a = self.arrays
        self._each(impulses.prepare, a.contacts, a.rigid, a.grid, a.sheet)
        self._each(impulses.solve_nodes, a.contacts, a.rigid, a.sheet)
        if a.rigid.count:
            wp.capture_while(self._flag(layout.IMPACTING), self._impact)
        if self.brakes:
            self._each(rolling.count_rolling, a.contacts, a.rigid, a.sheet)
            self._each(rolling.brake_rolling, a.contacts, a.rigid, a.sheet)
            self._per_body(rolling.slow_down, a.rigid, a.sheet)
        self._each(impulses.hand_back, a.grid, a.contacts, a.rigid, a.sheet)
        self._each(impulses.note, a.contacts, a.rigid, a.sheet)
        everything = self.bodies + self.planes
        wp.launch(
            impulses.enter_books,
            (everything, everything),
            [a.contacts, a.sheet],
            device=self.device,
        )

    def _impact(self) -> None:
        """Solve one round of impacts, or all contacts together."""
        a = self.arrays
        self._each(rounds.strike, a.contacts, a.rigid, a.sheet)
        self._each(rounds.find_least, a.contacts, a.rigid, a.sheet)
        self._each(rounds.look_behind, a.contacts, a.rigid, a.sheet)
        self._run(rounds.begin_round, 1, a.contacts, a.rigid, a.sheet, stride=False)
        self._each(rounds.aim, a.contacts, a.rigid, a.sheet)
        wp.capture_while(self._flag(layout.SWEEPING), self._sweep)
        self._each(rounds.bank, a.contacts, a.sheet)
        self._run(rounds.end_round, 1, a.contacts, a.sheet, stride=False)

    def _flag(self, which: Any) -> Any:
        """One flag, as something that repeats while it is 1."""
        return self.arrays.sheet.flag[int(which) : int(which) + 1]

    def _sweep(self) -> None:
        a = self.arrays
        self._each(impulses.count_busy, a.contacts, a.rigid, a.sheet)
        self._each(impulses.sweep, a.contacts, a.rigid, a.sheet)
        self._run(impulses.apply, 1, a.rigid, a.sheet, stride=False)
