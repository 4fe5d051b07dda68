"""Memory of the device engine: initialization of the structs of ``layout``."""

from typing import Any

import numpy as np

from corporeal.mpm import laws
from corporeal.mpm.constants import FACET_ROW, FIELDS_AT_NODE, KEY_ROW, MAX_STEP_S, VAST_DOUBLE
from corporeal.mpm.cuda import layout
from corporeal.mpm.cuda.layout import BlockGrid, StepGlobals, wp
from corporeal.mpm.cuda.layout_bodies import DeviceRigidBodies
from corporeal.mpm.cuda.layout_contact import DeviceContacts
from corporeal.mpm.formulas.one_lane_contact import SUPPORT_LEAST_GAP, SUPPORT_ROW
from corporeal.mpm.physics import prescribed_motion
from corporeal.mpm.physics.contact import face_table, full_cell_mass
from corporeal.mpm.physics.springs import longest_step
from corporeal.mpm.physics.wall_stress import flow_curve
from corporeal.mpm.problem import Problem
from corporeal.mpm.state import ParticleConstants, State

NORMAL_CACHE_COLUMNS = ("at", "fa", "fc", "pick")
"""Of what ``layout.Contacts`` keeps of choices."""
WarpStruct = Any
"""A Warp struct: pyright cannot read them."""


class DeviceMemory:
    """Arrays on one device."""

    def __init__(self, device: str) -> None:
        self.device = device

    def put(self, values: np.ndarray, kind: Any) -> wp.array:
        """Copy values to the device; never an empty array."""
        values = np.asarray(values)
        if len(values) == 0:
            values = np.zeros((1, *values.shape[1:]), values.dtype)
        return wp.array(values, dtype=kind, device=self.device)

    def zeros(self, count: int | tuple[int, ...], kind: Any) -> wp.array:
        """Make an array of zeros; never an empty one."""
        shape = tuple(max(1, n) for n in (count if isinstance(count, tuple) else (count,)))
        return wp.zeros(shape, dtype=kind, device=self.device)

    def grid(self, problem: Problem, room: int) -> WarpStruct:
        """Make room for some node blocks."""
        g = BlockGrid()
        size = 1 << int(np.ceil(np.log2(4 * room)))
        g.keys = wp.full(size, -1, dtype=wp.int64, device=self.device)
        g.slots = self.zeros(size, wp.int32)
        g.mask, g.room = size - 1, room
        g.fields = 1 if problem.contact == "single" else len(problem.bodies)
        g.where, g.field = self.zeros(room, wp.vec3i), self.zeros(room, wp.int32)
        g.near = self.zeros(8 * room, wp.int32)
        g.partner = self.zeros(FIELDS_AT_NODE * room, wp.int32)
        g.seen = self.zeros(room, wp.int32)
        for name in ("held_by", "first"):
            setattr(g, name, self.zeros(room, wp.int32))
        particles = sum(len(b.position) for b in problem.bodies)
        for name in ("task_home", "task_first", "task_last"):
            setattr(g, name, self.zeros(room + particles // int(layout.TASK), wp.int32))
        sums, lists = int(layout.ARENA_SUMS) * layout.ARENA_NODES, layout.NODES_OF_BLOCK
        g.arena = self.zeros(sums + lists + int(layout.TASK), wp.float32)
        g.sum = self.zeros(int(layout.ARENA_SUMS) * layout.NODES_OF_BLOCK * room, wp.float32)
        g.node, g.old = self.zeros(64 * room, wp.vec4), self.zeros(64 * room, wp.vec4)
        g.pool = self.zeros((3, 8 * room), wp.float32)
        for name in ("meet", "held", "was"):
            setattr(g, name, self.zeros(64 * room, wp.int32))
        return g

    def rigid(self, problem: Problem, matter: ParticleConstants) -> WarpStruct:
        """Lay out rigid bodies that have a grid of their own."""
        start = State.start(problem, matter)
        apart = problem.contact == "multi"
        stiff = np.array([b.rigid and apart for b in problem.bodies])
        inverse = np.linalg.inv(matter.inertia)
        r = DeviceRigidBodies()
        r.stiff = self.put(stiff, wp.int32)
        prescribed = np.array([b.path is not None for b in problem.bodies])
        surfaces = [len(b.surface) > 0 for b in problem.bodies]
        r.pointed = self.put(stiff & (prescribed | surfaces), wp.int32)
        r.light = self.put(np.where(prescribed, 0.0, 1.0 / matter.total), wp.float64)
        r.centre = self.put(matter.centre, wp.vec3d)
        r.turn = self.put(np.tile(np.eye(3), (len(stiff), 1, 1)), wp.mat33d)
        acting = np.where(prescribed[:, None, None], 0.0, inverse)
        r.rest, r.inertia = self.put(acting, wp.mat33d), self.put(acting, wp.mat33d)
        r.speed = self.put(start.speed, wp.vec3d)
        r.moment = self.put(start.spin_momentum, wp.vec3d)
        r.spin = self.put(start.spin(matter), wp.vec3d)
        r.radius = self.put(matter.radius, wp.float64)
        r.speed_change = self.zeros(len(stiff), wp.vec3d)
        r.moment_change = self.zeros(len(stiff), wp.vec3d)
        r.last_speed = self.zeros(len(stiff), wp.vec3d)
        r.last_moment = self.zeros(len(stiff), wp.vec3d)
        r.busy, r.lost = self.zeros(len(stiff), wp.int32), self.zeros(len(stiff), wp.int32)
        self._rigid_particles(r, problem, matter, np.flatnonzero(stiff[matter.body]))
        self._surfaces(r, matter, np.flatnonzero(stiff), problem.cell)
        self._facets(r, matter, np.flatnonzero(stiff))
        self._wetted_points(r, problem, matter, stiff)
        self._paths(r, problem, matter)
        return r

    def _paths(self, r: WarpStruct, problem: Problem, matter: ParticleConstants) -> None:
        """Lay out prescribed motion."""
        bodies, paths = len(problem.bodies), prescribed_motion.path_followers(problem)
        count, arm = np.zeros(bodies, int), np.zeros((bodies, 3))
        for b, guide in paths.items():
            count[b], arm[b] = len(guide.rows), guide.arm
        rows = [np.zeros((1, KEY_ROW)), *(guide.rows for guide in paths.values())]
        r.path = self.put(np.concatenate(rows), wp.float64)
        r.path_first = self.put(1 + np.cumsum(count) - count, wp.int32)
        r.path_count, r.path_arm = self.put(count, wp.int32), self.put(arm, wp.vec3d)
        r.heavy = self.put(matter.inertia, wp.mat33d)
        r.heading = self.put(np.tile(np.eye(3), (bodies, 1, 1)), wp.mat33d)

    def _rigid_particles(self, r: WarpStruct, problem: Problem, matter: ParticleConstants, chosen: np.ndarray) -> None:
        position = np.concatenate([b.position for b in problem.bodies])[chosen]
        cell, place = split_position(position / problem.cell)
        order = np.lexsort((*(cell >> 2).T, matter.body[chosen]))
        chosen = chosen[order]
        r.count = len(chosen)
        r.body = self.put(matter.body[chosen], wp.int32)
        r.arm = self.put(matter.arm[chosen], wp.vec3d)
        r.mass = self.put(matter.mass[chosen], wp.float32)
        r.volume = self.put(matter.volume[chosen], wp.float32)
        r.cell, r.place = self.put(cell[order], wp.vec3i), self.put(place[order], wp.vec3)
        r.home = self.zeros(r.count, wp.int32)

    def _surfaces(self, r: WarpStruct, matter: ParticleConstants, stiff: np.ndarray, cell: float) -> None:
        body = [np.full(len(matter.surface[b]), b) for b in stiff]
        points = [matter.surface[b] for b in stiff]
        r.surfaces = sum(len(p) for p in points)
        r.surface_body = self.put(np.concatenate([np.zeros(0, int), *body]), wp.int32)
        r.surface = self.put(np.concatenate([np.zeros((0, 3)), *points]), wp.vec3d)
        rows = [matter.curvature[b].reshape(-1) for b in stiff]
        r.curvature = self.put(np.concatenate([np.zeros(0), *rows]), wp.float64)
        r.bends = self.put(np.array([np.any(m[:, 10:] != 0.0) for m in matter.curvature]), wp.int32)
        count, thin, flat = np.zeros((3, len(matter.surface)), int)
        count[stiff] = [len(p) for p in points]
        thin[stiff] = [matter.thinness(cell)[b] for b in stiff]
        flat[stiff] = [matter.flat[b] for b in stiff]
        places = matter.thin_places(cell)
        slim = [matter.surface[b][places[b]] for b in stiff]
        slims = np.zeros(len(matter.surface), int)
        slims[stiff] = [len(p) for p in slim]
        r.slim = self.put(np.concatenate([np.zeros((0, 3)), *slim]), wp.vec3d)
        r.slim_first = self.put(np.cumsum(slims) - slims, wp.int32)
        r.slim_count = self.put(slims, wp.int32)
        r.spacing, r.flat = self.put(matter.spacing, wp.float64), self.put(flat, wp.int32)
        r.edged = self.put(np.array(matter.edged, dtype=int), wp.int32)
        r.first = self.put(np.cumsum(count) - count, wp.int32)
        r.points, r.thin = self.put(count, wp.int32), self.put(thin, wp.int32)

    def _facets(self, r: WarpStruct, matter: ParticleConstants, stiff: np.ndarray) -> None:
        rows, points, body, count = [np.zeros((0, FACET_ROW))], [np.zeros((0, 3))], [], 0
        for b in stiff:
            facets = matter.facets[b]
            row = facets.row.copy()
            row[:, -2:] += count
            rows.append(row)
            points.append(facets.point)
            body += [b] * len(row)
            count += len(facets.point)
        r.facets = len(body)
        r.facet = self.put(np.concatenate(rows).reshape(-1), wp.float64)
        r.facet_point = self.put(np.concatenate(points), wp.vec3d)
        r.facet_body = self.put(np.array(body, dtype=int), wp.int32)
        faces = np.bincount(np.array(body, dtype=int), minlength=len(matter.facets))
        r.facet_first = self.put(np.cumsum(faces) - faces, wp.int32)
        r.facet_count = self.put(faces, wp.int32)

    def _wetted_points(self, r: WarpStruct, problem: Problem, matter: ParticleConstants, stiff: np.ndarray) -> None:
        rows, count = [np.zeros((0, 3))], np.zeros(len(stiff), int)
        for b in np.flatnonzero(stiff):
            wetted = problem.bodies[b].wetted_surface
            if wetted is not None:
                both = np.stack([wetted.point - matter.centre[b], wetted.normal], axis=1)
                rows.append(both.reshape(-1, 3))
                count[b] = len(both)
        r.wetted_points = self.put(np.concatenate(rows), wp.vec3d)
        r.wetted_first = self.put(np.cumsum(count) - count, wp.int32)
        r.wetted_count = self.put(count, wp.int32)
        liquid = matter.body[np.isin(matter.law, laws.LIQUID_LAWS)] * (problem.contact == "multi")
        pours = np.isin(np.arange(len(stiff)), liquid) & ~stiff
        r.pours = self.put(pours, wp.int32)
        full = [full_cell_mass(body, problem.cell) for body in problem.bodies]
        r.full = self.put(np.array(full), wp.float32)
        curves = [flow_curve(body, problem.cell) for body in problem.bodies]
        r.flows_by = self.put(np.array(curves), wp.vec3d)

    def contacts(self, problem: Problem, room: int) -> WarpStruct:
        """Make room for some nodes where fields meet, and twice as many touches."""
        c = DeviceContacts()
        c.room = room
        c.at = self.zeros(room, wp.vec3i)
        for name in ("number", "first", "last", "stiff"):
            setattr(c, name, self.zeros(room, wp.int32))
        entries, touches = FIELDS_AT_NODE * room, 2 * room
        c.field, c.slot = self.zeros(entries, wp.int32), self.zeros(entries, wp.int32)
        c.mean, c.outward = self.zeros(entries, wp.vec3), self.zeros(entries, wp.vec3)
        c.velocity, c.light = self.zeros(entries, wp.vec3d), self.zeros(entries, wp.float64)
        for name in ("meet", "a", "c", "fa", "fc", "active", "facet", "slips", "pick", "rolls"):
            setattr(c, name, self.zeros(touches, wp.int32))
        c.instead, c.inward = self.zeros(touches, wp.float64), self.zeros(touches, wp.float64)
        c.kept_at = self.zeros(touches, wp.vec3i)
        for name in ("kept_fa", "kept_fc", "kept_pick"):
            setattr(c, name, self.zeros(touches, wp.int32))
        c.candidate = self.zeros(touches, wp.mat33)
        c.far_a, c.far_c = self.zeros(3 * touches, wp.float32), self.zeros(3 * touches, wp.float32)
        c.normal = self.zeros(touches, wp.vec3)
        c.gap = self.zeros(touches, wp.float32)
        c.target, c.span = self.zeros(touches, wp.float64), self.zeros(touches, wp.float64)
        c.last_velocity, c.turn = self.zeros(entries, wp.vec3d), self.zeros(touches, wp.float64)
        for name in ("point", "before", "impulse", "last_impulse", "struck"):
            setattr(c, name, self.zeros(touches, wp.vec3d))
        self._pairs(c, problem)
        c.face = self.put(face_table(), wp.float32)
        return c

    def _pairs(self, c: WarpStruct, problem: Problem) -> None:
        """Tables of all pairs of bodies and planes."""
        friction, restitution = _pair_tables(problem)
        c.friction, c.restitution = (self.put(friction, wp.float64), self.put(restitution, wp.float64))
        c.restitution_law = self.put(problem.restitution_law_of_pair.reshape(-1, 5), wp.float64)
        lengths = 0.0 * friction if problem.rolling_resistance is None else problem.rolling_resistance
        c.rolling_resistance = self.put(lengths, wp.float64)
        rows = np.zeros((friction.size, SUPPORT_ROW))
        rows[:, SUPPORT_LEAST_GAP] = VAST_DOUBLE
        c.rounds = self.put(rows, wp.float64)
        c.lightness = self.zeros(len(friction), wp.float64)
        apart = np.zeros((len(problem.bodies), len(problem.bodies)), int)
        for a, b in problem.all_excluded_pairs:
            apart[a, b] = apart[b, a] = 1
        c.apart = self.put(apart, wp.int32)

    def choices(self, contacts: WarpStruct, count: int) -> np.ndarray:
        """Copy the first choices of candidate normals, (N, 6): node, two fields, candidate."""
        columns = [getattr(contacts, f"kept_{name}").numpy()[:count] for name in NORMAL_CACHE_COLUMNS]
        return np.column_stack(columns).astype(np.int32)

    def put_choices(self, contacts: WarpStruct, rows: np.ndarray) -> None:
        """Write choices that ``choices`` gave; there must be room."""
        at, fa, fc, pick = np.split(rows, [3, 4, 5], axis=1)
        for name, values in zip(NORMAL_CACHE_COLUMNS, (at, fa[:, 0], fc[:, 0], pick[:, 0]), strict=True):
            if len(values):
                overwrite_rows(getattr(contacts, f"kept_{name}"), np.arange(len(values)), values)

    def sheet(self, problem: Problem, matter: ParticleConstants) -> WarpStruct:
        """Clock, flags, forces and books at time 0."""
        bodies, planes = len(problem.bodies), len(problem.planes)
        everything = bodies + planes
        s = StepGlobals()
        s.clock, s.flag = (self.zeros(layout.CLOCK_LENGTH, wp.float64), self.zeros(layout.FLAG_COUNT, wp.int32))
        s.clock[int(layout.CLOCK_SMALLEST) : int(layout.CLOCK_SMALLEST) + 1].fill_(np.inf)
        s.fast, s.change = self.zeros(4, wp.float32), self.zeros(1, wp.float32)
        s.pace = self.zeros(4, wp.float64)
        s.loss = self.zeros((5, int(layout.LOSS_LANES)), wp.float64)
        s.gravity, s.ramp = wp.vec3d(*problem.gravity), problem.gravity_ramp
        s.courant, s.dx, s.cell = problem.courant, problem.cell, problem.cell
        s.longest = min(MAX_STEP_S, longest_step(problem), prescribed_motion.longest_step(problem))
        self._forces(s, problem)
        s.mass = self.put(matter.total, wp.float64)
        soft = ~matter.rigid | (problem.contact == "single")
        s.particles, s.bodies, s.planes = int(soft.sum()), bodies, planes
        normals = np.array([p.normal for p in problem.planes], float).reshape(-1, 3)
        s.plane = self.put(normals, wp.vec3d)
        s.offset = self.put(np.array([p.offset for p in problem.planes], float), wp.float64)
        s.external = self.zeros(bodies, wp.vec3d)
        s.plane_impulse = self.zeros((planes, bodies), wp.vec3d)
        s.pair_impulse = self.zeros((bodies, bodies), wp.float64)
        s.impact_of_pair = self.zeros((everything, everything), wp.float64)
        never = np.full((everything, everything), np.nan)
        s.first_contact, s.last_contact = self.put(never, wp.float64), self.put(never, wp.float64)
        s.contact_point = self.put(np.stack([never] * 3, axis=2), wp.vec3d)
        s.marked = self.zeros((everything, everything), wp.int32)
        s.met = self.zeros(everything * everything, wp.int32)
        s.step_impulse = self.zeros((everything, everything), wp.float64)
        s.step_place = self.zeros((everything, everything), wp.vec3d)
        return s

    def _forces(self, s: WarpStruct, problem: Problem) -> None:
        push, start, end = [], [], []
        for body in problem.bodies:
            given = body.push
            push.append(given.acceleration if given else (0.0, 0.0, 0.0))
            start.append(given.start if given else 0.0)
            end.append(given.end if given else 0.0)
        s.push = self.put(np.array(push, float), wp.vec3d)
        s.start = self.put(np.array(start, float), wp.float64)
        s.end = self.put(np.array(end, float), wp.float64)
        s.kick = self.zeros(len(push), wp.vec3d)
        s.pushed = self.zeros(len(push), wp.vec3d)
        s.pull = max(float(np.linalg.norm(a)) for a in [problem.gravity, *push])


def add_to_row(array: wp.array, at: int | tuple[int, int], values: np.ndarray | float) -> None:
    """Add to one row, or one number, on the device."""
    there = array.numpy()
    there[at] += values
    array.assign(there)


def overwrite_rows(array: wp.array, rows: np.ndarray, values: np.ndarray | float) -> None:
    """Overwrite some rows on the device."""
    there = array.numpy()
    there[rows] = values
    array.assign(there)


def split_position(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest of each particle's 27 nodes, and its offset from it [cells]."""
    low = np.floor(place - 0.5)
    return low.astype(np.int64), place - low


def _pair_tables(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Friction and restitution; one shared field, which goes by the name 0, has the mean."""
    friction = np.array(problem.friction, float)
    restitution = np.array(problem.restitution, float)
    if problem.contact == "single":
        bodies = len(problem.bodies)
        friction[0, bodies:] = friction[:bodies, bodies:].mean(axis=0)
        restitution[:] = 0.0
    return friction, restitution
