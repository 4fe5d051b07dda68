"""The launches of a step on the device, and the graph that repeats them until a frame is done."""

from dataclasses import dataclass
from typing import Any

from corporeal.mpm.cuda import block_grid as grids
from corporeal.mpm.cuda import block_sort, contact, layout, loads, mean_dilatation, rigid, scatter, timestep
from corporeal.mpm.cuda import contact_impact_rounds as rounds
from corporeal.mpm.cuda import contact_impulses as impulses
from corporeal.mpm.cuda import contact_nodes as meets
from corporeal.mpm.cuda import contact_rolling as rolling
from corporeal.mpm.cuda import contact_surface as surface
from corporeal.mpm.cuda import gather as kernels
from corporeal.mpm.cuda import inclusions as bonds
from corporeal.mpm.cuda.layout import wp
from corporeal.mpm.problem import Problem

KERNEL_MODULES = (
    *(block_sort, grids, timestep, scatter, kernels, mean_dilatation, meets, contact),
    *(surface, impulses, rounds, rolling, rigid, loads, bonds),
)
"""Modules whose kernels a step launches."""
THREADS_PER_PROCESSOR = 1024
MIN_PARTICLES_PER_TASK = 32
"""Particles of a task where blocks are part-filled: small scenes have a group for so many."""


@dataclass
class DeviceArrays:
    """Everything on the device: the structs of ``layout``."""

    sheet: Any
    particles: Any
    rigid: Any
    grid: Any
    contacts: Any
    loads: Any
    bonds: Any


class CudaProgram:
    """One frame's launches, recorded as a graph when they are first needed."""

    def __init__(self, problem: Problem, arrays: DeviceArrays, device: str) -> None:
        self.bodies, self.planes = len(problem.bodies), len(problem.planes)
        self.arrays, self.device = arrays, device
        self.graph = None
        self.held = False
        self.touching = self.planes > 0 or (self.bodies > 1 and problem.contact == "multi")
        self.rolls = bool(arrays.rigid.bends.numpy().any()) if arrays.rigid.surfaces else False
        table = arrays.particles.table.numpy()
        self.swelling = bool(table[:, int(layout.USES_MEAN_DILATATION)].any())
        self.brakes = problem.has_rolling_resistance and bool(arrays.rigid.surfaces)
        self.stride = self._threads()
        self.lanes = layout.THREADS_PER_GROUP if wp.get_device(self.device).is_cuda else 1

    def _threads(self) -> int:
        """Threads of one launch, in whole groups: as many as keep the device busy, or have work."""
        found = wp.get_device(self.device)
        if not found.is_cuda:
            return 1
        tasks = self.arrays.particles.count // MIN_PARTICLES_PER_TASK + 1
        groups = max(tasks, self.arrays.rigid.count // layout.THREADS_PER_GROUP)
        return min(THREADS_PER_PROCESSOR * found.sm_count, groups * layout.THREADS_PER_GROUP)

    def load(self) -> None:
        """Compile what a step launches, or find it compiled."""
        for module in KERNEL_MODULES:
            wp.load_module(module, device=self.device, block_dim=self.lanes)

    def run(self) -> None:
        """Take all steps of a frame."""
        if self.graph is None:
            self.graph = self._record()
        wp.capture_launch(self.graph)

    def hold(self, held: bool) -> None:
        """Return whether anything is held from outside."""
        if held != self.held:
            self.held = held
            self.forget()

    def forget(self) -> None:
        """Record anew before the next run: arrays were replaced."""
        self.graph = None

    def look_ahead(self) -> None:
        """Work out the largest stable step."""
        self._one_group(timestep.begin_frame, self.arrays.sheet, self.arrays.rigid)

    def _run(self, kernel: Any, threads: int, *inputs: Any) -> None:
        """Launch a kernel with so many threads."""
        wp.launch(kernel, threads, inputs, device=self.device, block_dim=self.lanes)

    def _each(self, kernel: Any, *inputs: Any) -> None:
        """Launch a kernel that loops over its items."""
        self._run(kernel, self.stride, *inputs, self.stride)

    def _groups(self, kernel: Any, *inputs: Any) -> None:
        """Launch a kernel whose threads work in groups."""
        self._run(kernel, self.stride, *inputs, self.stride, self.lanes)

    def _one_group(self, kernel: Any, *inputs: Any) -> None:
        """Launch a kernel of one group of threads."""
        self._run(kernel, self.lanes, *inputs, self.lanes)

    def _per_body(self, kernel: Any, *inputs: Any) -> None:
        """Launch a kernel with one thread for each body."""
        self._run(kernel, self.bodies, *inputs)

    def arrange(self) -> None:
        """Sort particles by block, and give every block that they reach a slot: FULL if too few."""
        a = self.arrays
        self._each(block_sort.clear_hash, a.grid, a.sheet)
        self._each(block_sort.claim_homes, a.particles, a.grid, a.sheet)
        self._each(block_sort.count_homes, a.particles, a.grid, a.sheet)
        self._each(block_sort.claim_reached, a.rigid, a.grid, a.sheet)
        channels, together = a.particles.words.shape[0], a.particles.spare.shape[0]
        for first in range(0, channels if a.particles.count else 0, together):
            self._each(block_sort.write_sorted, a.particles, a.grid, a.sheet, first)
            self._each(block_sort.keep_sorted, a.particles, a.sheet, first)
        self._each(grids.link_all_blocks, a.grid, a.sheet)

    def _record(self) -> Any:
        """Capture a whole frame: steps until the clock says stop."""
        with wp.ScopedCapture(device=self.device) as capture:
            self._one_group(timestep.begin_frame, self.arrays.sheet, self.arrays.rigid)
            wp.capture_while(self._flag(layout.FLAG_GOING), self._steps)
        return capture.graph

    def _steps(self) -> None:
        """Step until too many particles have strayed; then sort them, unless the frame is over."""
        wp.capture_while(self._flag(layout.FLAG_STEPPING), self._step)
        wp.capture_if(self._flag(layout.FLAG_GOING), self.arrange)

    def _step(self) -> None:
        a = self.arrays
        self._load()
        if self.swelling:
            self._each(mean_dilatation.sum_clusters, a.particles, a.grid)
        self._groups(scatter.scatter, a.particles, a.grid, a.rigid, a.loads, a.sheet)
        self._each(grids.momentum_to_velocity, a.grid, a.sheet)
        self._hold()
        if self.touching:
            self._look()
        self._force()
        if self.touching:
            self._touch()
        self._release()
        self._groups(kernels.gather, a.particles, a.grid, a.loads, a.sheet)
        if self.swelling:
            self._each(mean_dilatation.apply_mean_pressure, a.particles, a.grid, a.sheet)
        if a.rigid.count:
            self._per_body(rigid.advance_rigid, a.rigid, a.sheet)
            self._each(rigid.place_rigid_particles, a.rigid, a.grid, a.sheet)
        self._groups(timestep.finish_step, a.grid, a.rigid, a.loads, a.sheet)

    def _load(self) -> None:
        """Let wind and tethers act on particles."""
        a = self.arrays
        a.loads.acts = int(bool(a.loads.faces or a.loads.tethers or self.held))
        if not (a.loads.acts or a.loads.joints):
            return
        self._each(loads.clear_loads, a.particles, a.loads, a.sheet)
        if a.loads.faces:
            self._each(loads.apply_wind, a.particles, a.rigid, a.loads, a.sheet)
        if a.loads.tethers:
            self._each(loads.pull_tethered, a.particles, a.rigid, a.loads, a.sheet)
        if self.held:
            self._each(loads.measure_grips, a.particles, a.loads, a.sheet)
            self._each(loads.apply_grips, a.particles, a.loads, a.sheet)

    def _hold(self) -> None:
        """Find what rigid frames hold."""
        a = self.arrays
        if a.bonds.count:
            self._per_body(bonds.clear_bonds, a.bonds, a.sheet)
            self._each(bonds.hold_nodes, a.grid, a.rigid, a.bonds, a.sheet)

    def _force(self) -> None:
        """Let forces act on rigid bodies; frames then stand for all that they hold."""
        a = self.arrays
        if not a.rigid.count:
            return
        self._per_body(loads.force_rigid, a.rigid, a.loads, a.sheet)
        if a.loads.joints:
            self._run(loads.hold_joints, 1, a.rigid, a.loads, a.sheet)
        if self.held:
            self._per_body(loads.apply_rigid_grips, a.rigid, a.loads, a.sheet)
        if a.bonds.count:
            self._per_body(bonds.compose_bodies, a.rigid, a.bonds, a.sheet)

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
        self._each(contact.sample_fields, a.particles, a.rigid, a.grid, a.contacts, a.sheet)
        self._each(contact.propose_normals, a.grid, a.contacts, a.rigid, a.sheet)
        self._each(contact.push_all_supports, a.particles, a.rigid, a.grid, a.contacts, a.sheet)
        self._each(contact.measure_gaps, a.grid, a.contacts, a.rigid, a.sheet)
        if a.rigid.surfaces:
            self._each(surface.list_surface, a.rigid, a.contacts, a.sheet, int(self.rolls))

    def _touch(self) -> None:
        """Solve all impulses, and enter them."""
        a = self.arrays
        self._each(impulses.begin_contact, a.contacts, a.rigid, a.grid, a.sheet)
        if a.rigid.count:
            wp.capture_while(self._flag(layout.FLAG_IMPACTING), self._impact)
        if self.brakes:
            self._each(rolling.count_rolling, a.contacts, a.rigid, a.sheet)
            self._each(rolling.brake_rolling, a.contacts, a.rigid, a.sheet)
            self._per_body(rolling.apply_brakes, a.rigid, a.sheet)
        self._each(impulses.end_contact, a.grid, a.contacts, a.rigid, a.sheet)

    def _impact(self) -> None:
        """Solve one round of impacts, or all contacts together."""
        a = self.arrays
        self._each(rounds.find_struck_pairs, a.contacts, a.rigid, a.sheet)
        self._each(rounds.find_least_gaps, a.contacts, a.rigid, a.sheet)
        self._each(rounds.sum_near_contacts, a.contacts, a.rigid, a.sheet)
        self._one_group(rounds.begin_round, a.contacts, a.rigid, a.sheet)
        self._each(rounds.set_targets, a.contacts, a.rigid, a.sheet)
        wp.capture_while(self._flag(layout.FLAG_SWEEPING), self._sweep)
        self._each(rounds.end_round, a.contacts, a.rigid, a.sheet)

    def _flag(self, which: Any) -> Any:
        """One flag, as something that repeats while it is 1."""
        return self.arrays.sheet.flag[int(which) : int(which) + 1]

    def _sweep(self) -> None:
        a = self.arrays
        self._each(impulses.count_busy, a.contacts, a.rigid, a.sheet)
        self._each(impulses.sweep_contacts, a.contacts, a.rigid, a.sheet)
        self._one_group(impulses.apply_rigid_impulses, a.rigid, a.sheet)
