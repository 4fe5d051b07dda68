"""Records of the shells of a problem: triangles and hinges in batches of eight, and what their history is.

Batches of triangles belong to one body each. What fills the last one repeats a triangle, without area.
"""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm import laws
from corporeal.mpm.constants import BRANCHES, VAST
from corporeal.mpm.cpu.contact_memory import write_pointers
from corporeal.mpm.cpu.layout import (
    LANES,
    SHELL_BATCHES_PER_TASK,
    SHELL_BRANCH_STRAIN,
    SHELL_PLASTIC,
    SHELL_RECORD,
    SHELL_REPORT_COLUMNS,
    SHELL_STATE_CHANNELS,
    SHELL_VERTICES_PER_TASK,
    SHELL_VISCOUS,
    TRIANGLE_AREA,
    TRIANGLE_CHANNELS,
    TRIANGLE_REST,
    TRIANGLE_WALL,
    WALL_COLUMNS,
    WALL_DECAY,
    WALL_STRENGTH,
)
from corporeal.mpm.cpu.program import aligned_zeros
from corporeal.mpm.laws.constitutive_law import lame_parameters
from corporeal.mpm.problem import Problem
from corporeal.mpm.shells.assemble import Shells, longest_bending_step
from corporeal.mpm.shells.forces import ShellState, shell_energy
from corporeal.mpm.shells.mesh import ShellMesh

STATE_WIDTHS = {
    "inverse_rest": (2, 2),
    "plastic_strain": (),
    "plastic_curvature": (3,),
    "green": (3,),
    "bend": (3,),
    "branch_strain": (BRANCHES, 3),
    "branch_bend": (BRANCHES, 3),
}
"""Shape of each array of ``ShellState``, in the order of the channels."""


class ShellRecords:
    """The record of all shells, and the arrays that it points to."""

    def __init__(self, problem: Problem) -> None:
        """Lay out memory.

        Args:
            problem: What to simulate.
        """
        self.shells = Shells.of(problem)
        self.record = np.zeros(1, SHELL_RECORD.dtype)
        self.bodies = np.unique(self.shells.body).tolist()
        self.lane, self.live = _fill_lanes(self.shells.body)
        """Triangle of every lane, and which lanes fill no batch."""
        self.lane_of = np.flatnonzero(self.live)
        """Lane of every triangle."""
        self.state = np.zeros((0, SHELL_STATE_CHANNELS, LANES), np.float32)
        self.report = np.zeros((0, SHELL_REPORT_COLUMNS))
        self.kept: list[np.ndarray] = []
        if not self.shells:
            return
        self._number_vertices()
        self._fill_triangles()
        self._fill_hinges()
        self._list_corners()
        record = self.record
        record["triangles"], record["hinges"] = len(self.state), len(self.hinge)
        record["wave"] = self.shells.wave_speed.max()
        record["bending_step"] = longest_bending_step(self.shells, problem.courant, problem.cell)

    def _number_vertices(self) -> None:
        chosen = np.flatnonzero(self.shells.is_vertex)
        self.vertex = np.full(len(self.shells.is_vertex), -1, np.int32)
        self.vertex[chosen] = np.arange(len(chosen))
        self.place = aligned_zeros((len(chosen), 4), np.int32)
        self._point(vertex=self.vertex, place=self.place)

    def _fill_triangles(self) -> None:
        mesh = self.shells.mesh
        time, decay = np.unique(self.shells.material.branch_time, axis=0, return_inverse=True)
        wall, row = np.unique(_wall_rows(self.shells, decay.reshape(-1)), axis=0, return_inverse=True)
        rest = np.zeros((len(self.lane), TRIANGLE_CHANNELS), np.float32)
        rest[:, TRIANGLE_WALL] = row.reshape(-1)[self.lane].astype(np.int32).view(np.float32)
        rest[:, TRIANGLE_AREA] = np.where(self.live, mesh.area[self.lane], 0.0)
        rest[:, TRIANGLE_REST : TRIANGLE_REST + 4] = mesh.inverse_rest.reshape(-1, 4)[self.lane]
        self.state = _batches(self._columns(ShellState.start(mesh)))
        batches = len(self.state)
        self.report = np.zeros((-(-batches // SHELL_BATCHES_PER_TASK), SHELL_REPORT_COLUMNS))
        self.record["decays"] = len(time)
        self._point(
            triangle=_batches(self.vertex[mesh.triangle][self.lane]),
            wall=np.ascontiguousarray(wall),
            rest=_batches(rest),
            state=self.state,
            pull=aligned_zeros((batches, 12, LANES), np.float32),
            corner=aligned_zeros((LANES * batches, 3, 4), np.float32),
            branch_time=np.ascontiguousarray(time),
            decay=np.zeros((len(time), 2 * BRANCHES), np.float32),
            report=self.report,
        )

    def _fill_hinges(self) -> None:
        mesh, batches = self.shells.mesh, len(self.state)
        count = len(mesh.hinge)
        fill = np.minimum(np.arange(-(-count // LANES) * LANES), count - 1)
        self.hinge = _batches(self.vertex[mesh.hinge][fill])
        first, slot, curvature = _hinge_slots(mesh, self.lane_of, batches, len(fill))
        room = int(slot.max(initial=0) // 4) + 1
        self._point(
            hinge=self.hinge,
            rest_angle=mesh.rest_angle[fill].astype(np.float32),
            turn=aligned_zeros((room,), np.float32),
            half=aligned_zeros((room, 2), np.float32),
            first_slot=first,
            slot=slot,
            curvature=curvature,
        )

    def _list_corners(self) -> None:
        """List the corners at every vertex, in order."""
        vertex = self.vertex[self.shells.mesh.triangle]
        number = 3 * self.lane_of[:, None] + np.arange(3)
        order = np.argsort(vertex.ravel(), kind="stable")
        first = np.concatenate([[0], np.cumsum(np.bincount(vertex.ravel(), minlength=len(self.place)))])
        force = aligned_zeros((len(self.place) + 1, 4), np.float32)  # eight lanes are read
        self.record["vertices"] = len(self.place)
        self._point(force=force, first_corner=first.astype(np.int32), corners=number.ravel()[order].astype(np.int32))

    def _point(self, **arrays: np.ndarray) -> None:
        self.kept += arrays.values()
        write_pointers(self.record, **arrays)

    def _columns(self, state: ShellState) -> Float[np.ndarray, "L C"]:
        """Write a history as channels of lanes."""
        arrays = [np.asarray(getattr(state, name)) for name in STATE_WIDTHS]
        return np.concatenate([a.reshape(len(a), -1) for a in arrays], axis=1)[self.lane].astype(np.float32)

    # ------------------------------------------------------------ use

    def connect(self, world: np.ndarray, fields: np.ndarray, shared: bool) -> None:
        """Point the world to the record, and say how many tasks there are.

        Args:
            world: Whose tasks on particles are known.
            fields: Of the world.
            shared: Whether all bodies share one field.
        """
        fields["shells"] = 0
        fields["shells"][[0] if shared and self.bodies else self.bodies] = 1
        write_pointers(world, shell=self.record)
        world["shelled"] = world["chores"] if self.shells else 0
        world["shell_triangles"] = len(self.report)
        world["shell_vertices"] = -(-int(self.record["vertices"][0]) // SHELL_VERTICES_PER_TASK)
        world["shell_hinges"] = -(-int(self.record["hinges"][0]) // SHELL_BATCHES_PER_TASK)

    def history(self) -> ShellState:
        """Return the history of all triangles."""
        rows = self._rows().astype(np.float64)
        parts = np.split(rows, np.cumsum([int(np.prod(shape)) for shape in STATE_WIDTHS.values()])[:-1], axis=1)
        shapes = STATE_WIDTHS.values()
        return ShellState(*(part.reshape(-1, *shape) for part, shape in zip(parts, shapes, strict=True)))

    def _rows(self) -> Float[np.ndarray, "T C"]:
        return self.state.transpose(0, 2, 1).reshape(-1, SHELL_STATE_CHANNELS)[self.lane_of]

    def saved(self) -> dict[str, np.ndarray]:
        """Copy the history of every body's triangles."""
        rows = self._rows()
        return {f"shell{b}": rows[self.shells.body == b] for b in self.bodies}

    def restore(self, saved: dict[str, np.ndarray], bodies: Iterable[int]) -> None:
        """Take the history of some bodies back."""
        rows = self.state.transpose(0, 2, 1).reshape(-1, SHELL_STATE_CHANNELS)
        body = self.shells.body[self.lane]
        for b in set(bodies) & set(self.bodies):
            mine = body == b
            rows[mine] = saved[f"shell{b}"][np.minimum(np.arange(mine.sum()), len(saved[f"shell{b}"]) - 1)]
        self.state[:] = rows.reshape(-1, LANES, SHELL_STATE_CHANNELS).transpose(0, 2, 1)

    def relax(self, bodies: Iterable[int]) -> None:
        """Let Maxwell branches of some bodies remember nothing."""
        for b in set(bodies) & set(self.bodies):
            batch = np.unique(np.flatnonzero(self.shells.body[self.lane] == b) // LANES)
            self.state[batch, SHELL_BRANCH_STRAIN:] = 0.0

    def energy_of_bodies(self, position: Float[np.ndarray, "P 3"], bodies: int) -> Float[np.ndarray, "B 2"]:
        """Return what the triangles of each body hold, elastically and in Maxwell branches [J].

        Args:
            position: Of all particles [m].
            bodies: Number of all.
        """
        shells = self.shells
        if not shells:
            return np.zeros((bodies, 2))
        held = shell_energy(shells.mesh, shells.material, self.history(), position)
        return np.stack([np.bincount(shells.body, of, bodies) for of in (held.elastic, held.relaxing)], axis=1)

    def take_losses(self) -> Float[np.ndarray, " 2"]:
        """Return the plastic work and the work on branches since last asked [J]."""
        total = self.report[:, [SHELL_PLASTIC, SHELL_VISCOUS]].sum(axis=0)
        self.report[:] = 0.0
        return total


def _fill_lanes(body: Int[np.ndarray, " T"]) -> tuple[Int[np.ndarray, " L"], Bool[np.ndarray, " L"]]:
    """Choose which triangle stands in each lane, and which lanes fill no batch."""
    lanes, live = [np.zeros(0, np.int64)], [np.zeros(0, bool)]
    for first, count in zip(*np.unique(body, return_index=True, return_counts=True)[1:], strict=True):
        padded = np.arange(-(-count // LANES) * LANES)
        lanes.append(first + np.minimum(padded, count - 1))
        live.append(padded < count)
    return np.concatenate(lanes), np.concatenate(live)


def _batches(rows: np.ndarray) -> np.ndarray:
    """Lay rows of lanes into batches, (batches, channels, 8)."""
    out = aligned_zeros((len(rows) // LANES, rows.shape[1], LANES), rows.dtype)
    out[:] = rows.reshape(-1, LANES, rows.shape[1]).transpose(0, 2, 1)
    return out


def _wall_rows(shells: Shells, decay: Int[np.ndarray, " T"]) -> Float[np.ndarray, "T C"]:
    """Write the wall of each triangle.

    Args:
        shells: All.
        decay: Number of its relaxation times.
    """
    m = shells.material
    mu, lam = lame_parameters(m.membrane_young_pa, m.poisson)
    yields = np.isin(m.law, laws.PLASTIC_LAWS) & np.isfinite(m.yield_stress)
    yield_stress = np.where(yields, np.minimum(m.yield_stress, VAST), VAST)
    hinge_moment = np.where(yields, 0.25 * yield_stress * m.thickness**2, VAST)
    rows = np.zeros((len(m.law), WALL_COLUMNS), np.float32)
    first = (m.law, mu, lam, m.poisson, yield_stress, np.where(yields, m.hardening, 0.0), m.membrane_stiffness)
    rows[:, :WALL_STRENGTH] = np.column_stack([*first, m.bending_stiffness, hinge_moment, m.thickness])
    rows[:, WALL_STRENGTH : WALL_STRENGTH + BRANCHES] = m.branch_strength
    rows[:, WALL_DECAY] = decay
    return rows


def _hinge_slots(
    mesh: ShellMesh, lane_of: Int[np.ndarray, " T"], batches: int, hinges: int
) -> tuple[Int[np.ndarray, " B1"], Int[np.ndarray, "S 8"], Float[np.ndarray, "S 3 8"]]:
    """List the hinges of every triangle by batch, in rounds of one for each side.

    Args:
        mesh: Of the triangles.
        lane_of: Lane of every triangle.
        batches: Of triangles.
        hinges: Lanes of hinges.

    Returns:
        Where each batch's slots begin, what stands in them (numbers after all hinges stand for none), and the curvature
        for each radian.
    """
    t, half = mesh.hinge_triangle, 2 * np.arange(len(mesh.hinge))[:, None] + [0, 1]
    corner = mesh.triangle[t]
    side = np.argmax(corner == mesh.hinge[:, 2:, None], axis=2)
    along = np.take_along_axis(corner, (side[..., None] + 1) % 3, axis=2)[..., 0] == mesh.hinge[:, :1]
    sign = np.where(along == [True, False], 1.0, -1.0)
    key = (3 * t + side).ravel()
    order = np.argsort(key, kind="stable")
    again = np.arange(len(key)) - np.searchsorted(key[order], key[order])
    lane = lane_of[t.ravel()[order]]
    rounds = np.zeros(batches, np.int64)
    np.maximum.at(rounds, lane // LANES, again + 1)
    first = np.concatenate([[0], 3 * np.cumsum(rounds)])
    slot = np.full((int(first[-1]), LANES), -1, np.int64)
    curvature = aligned_zeros((len(slot), 3, LANES), np.float32)
    at = first[lane // LANES] + 3 * again + side.ravel()[order], lane % LANES
    slot[at] = (2 * half + (sign < 0)).ravel()[order]
    unused = slot < 0
    slot[unused] = 4 * (hinges + np.arange(unused.sum()))
    for k in range(3):
        curvature[at[0], k, at[1]] = mesh.curvature_of_angle.reshape(-1, 3)[order, k]
    return first.astype(np.int32), slot.astype(np.int32), curvature
