"""Memory of the native contact solver, and its parameters."""

import numpy as np

from corporeal.mpm import laws
from corporeal.mpm.constants import (
    LIQUID_WALL_REACH_DX,
    POINT_RUN_WIDTH_RATIO,
    SURFACE_SEARCH_RADIUS_DX,
    VAST,
    WALL_REACH,
    WETTED_REACH_DX,
)
from corporeal.mpm.cpu import layout
from corporeal.mpm.cpu.layout import CENTRE, LANES, LOCAL_BOX, PAIR_COLUMNS, RADIUS
from corporeal.mpm.ledger import EngineLedger
from corporeal.mpm.physics import rigid
from corporeal.mpm.physics.contact import face_table, spread_table
from corporeal.mpm.physics.flat_facets import facets_of, has_edges, is_bounded_by_facets
from corporeal.mpm.problem import Body, Problem
from corporeal.mpm.shells.assemble import vertex_half_wall
from corporeal.mpm.state import surface_curvature

CONTACT_LISTS = {
    "junction": layout.JUNCTION_RECORD,
    "meet": layout.MEET_RECORD,
    "side": layout.SIDE_RECORD,
    "spread": layout.SPREAD_RECORD,
    "touch": layout.TOUCH_RECORD,
    "aim": layout.AIM_RECORD,
    "lean": layout.LEAN_RECORD,
    "choice": layout.CHOICE_RECORD,
    "kept": layout.CHOICE_RECORD,
    "entry": layout.ENTRY_RECORD,
    "line": layout.LINE_RECORD,
    "past": layout.PAST_RECORD,
}
"""What the native pieces list."""
RECORD_BYTES = {name: record.dtype.itemsize for name, record in CONTACT_LISTS.items()}
BONDED_FRICTION = -1
"""Friction of a pair that is never in contact, to the native piece."""
LEDGER_ARRAYS = (
    "plane_impulse pair_impulse friction_loss first_contact last_contact contact_point impact_loss impact_of_pair"
)


def write_pointers(record: np.ndarray, **arrays: np.ndarray) -> None:
    """Write the addresses of arrays, which must stay alive, into a native struct."""
    for name, array in arrays.items():
        record[name] = array.ctypes.data


def rigid_grid(
    record: np.ndarray, body: Body, state: np.ndarray, points: np.ndarray, cell: float
) -> dict[str, np.ndarray]:
    """Give a rigid body a grid that holds it however it turns; memory is used where it is touched.

    Args:
        record: The native struct to fill.
        body: The body.
        state: Its rigid state, see ``layout``.
        points: Its particles in its own frame, see ``tables``.
        cell: dx [m].
    """
    across = int(np.ceil((2.0 * state[RADIUS] / cell + 4.0) / 4.0)) + 3
    surface, curvature = body.surface - state[CENTRE : CENTRE + 3], surface_curvature(body)
    facets = facets_of(surface, curvature)
    points, clumps = _sort_into_cubes(points, 4.0 * cell)
    wetted_points, patches = _wetted_points(body, state[CENTRE : CENTRE + 3], cell)
    places = np.full((3, len(wetted_points) + LANES), VAST, np.float32)
    places[:, : len(wetted_points)] = wetted_points[:, :3].T
    normals = curvature[:, :3]
    thin = rigid.thinness(body.surface, normals, cell)
    spacing = rigid.surface_point_spacing(body.surface)
    # Many nodes ask where a body's surface begins: runs of points that are near each other.
    width = max(SURFACE_SEARCH_RADIUS_DX * cell, POINT_RUN_WIDTH_RATIO * spacing)
    shown, shows = _sort_into_cubes(surface, width)
    slim = surface[rigid.thin_places(body.surface, normals, cell)]
    state[LOCAL_BOX : LOCAL_BOX + 3], state[LOCAL_BOX + 3 : LOCAL_BOX + 6] = (
        points[:, :3].min(0),
        points[:, :3].max(0),
    )
    arrays = {
        "node": np.zeros((across**3, 64, 8), np.float32),
        "table": np.full(across**3, -1, np.int32),
        "where": np.zeros((across**3, 4), np.int32),
        "block": np.zeros(len(points), np.int32),
        "point": points,
        "clump": clumps,
        "surface": np.ascontiguousarray(surface),
        "curvature": np.ascontiguousarray(curvature),
        "facet": facets.row,
        "facet_point": np.ascontiguousarray(facets.point),
        "wetted_points": wetted_points,
        "patch": patches,
        "places": places,
        "shown": shown,
        "show": shows,
        "slim": np.ascontiguousarray(slim),
        "rigid": state,
    }
    write_pointers(record, **arrays)
    record["dim"], record["rigids"], record["floor"] = across, 1, -1
    record["points"], record["surfaces"] = len(points), len(surface)
    record["pointed"] = len(surface) > 0 or body.path is not None
    record["clumps"], record["patches"], record["shows"] = len(clumps), len(patches), len(shows)
    record["wets"], record["facets"] = places.shape[1], len(facets.row)
    record["rolls"] = bool((curvature[:, 6:8] > 0.0).any())
    record["bends"] = bool(np.any(curvature[:, 10:] != 0.0))
    record["spacing"] = spacing
    record["thin"], record["slims"] = thin, len(slim)
    record["flat"] = is_bounded_by_facets(facets, body.surface)
    record["edged"] = has_edges(curvature)
    return arrays


def _wetted_points(body: Body, centre: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points that liquids touch and their normals, in the body's frame, and patches of them.

    Patches are two cells wide: a liquid looks no farther.
    """
    if body.wetted_surface is None:
        return np.zeros((0, 6)), np.zeros((0, 6))
    rows = np.concatenate([body.wetted_surface.point - centre, body.wetted_surface.normal], axis=1)
    return _sort_into_cubes(rows, WETTED_REACH_DX * cell)


def _sort_into_cubes(points: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Sort a rigid body's points into cubes, which are passed over where all is far.

    Args:
        points: Places first, in the body's frame [m].
        width: Of a cube [m].

    Returns:
        The points, and for each cube the first and last of them, its middle and its radius [m].
    """
    cube = np.floor(points[:, :3] / width).astype(np.int64)
    order = np.lexsort(cube.T)
    points, cube = np.ascontiguousarray(points[order]), cube[order]
    starts = np.flatnonzero(np.any(np.diff(cube, axis=0, prepend=cube[:1] - 1) != 0, axis=1))
    clumps = np.zeros((len(starts), 6))
    clumps[:, 0], clumps[:, 1] = starts, np.append(starts[1:], len(points))
    for clump in clumps:
        mine = points[int(clump[0]) : int(clump[1]), :3]
        clump[2:5] = 0.5 * (mine.min(axis=0) + mine.max(axis=0))
        clump[5] = np.linalg.norm(mine - clump[2:5], axis=1).max()
    return points, clumps


class ContactMemory:
    """Lists of nodes, contacts and particles near them, and tables that never change."""

    def __init__(self, world: np.ndarray, problem: Problem, ledger: EngineLedger) -> None:
        self.world, self.cell = world, problem.cell
        poured = any(np.isin(body.law, laws.LIQUID_LAWS).any() for body in problem.bodies)
        self.reach = LIQUID_WALL_REACH_DX if poured else WALL_REACH
        walls = [[*plane.normal, plane.offset] for plane in problem.planes]
        self.plane = np.array(walls, float).reshape(-1, 4)
        self.friction, self.restitution = _pair_tables(problem)
        self.restitution_law = np.ascontiguousarray(problem.restitution_law_of_pair)
        self.face, self.spread_face = face_table(), spread_table()
        self.stage = np.zeros(1, layout.CONTACT_STAGE_RECORD.dtype)
        self.pair = np.zeros(self.friction.size * PAIR_COLUMNS)
        self.light = np.zeros(len(self.friction))
        write_pointers(self.stage, pair=self.pair, light=self.light)
        write_pointers(
            world,
            plane=self.plane,
            friction=self.friction,
            restitution=self.restitution,
            restitution_law=self.restitution_law,
            contact_memory=self.stage,
            face=self.face,
            spread_face=self.spread_face,
        )
        self._measure_walls(problem)
        if problem.has_rolling_resistance:
            self.rolling_resistance = np.array(problem.rolling_resistance, float)
            write_pointers(world, rolling_resistance=self.rolling_resistance)
        write_pointers(world, **{name: getattr(ledger, name) for name in LEDGER_ARRAYS.split()})
        world["planes"], world["names"] = len(walls), len(problem.bodies) + len(walls)
        moves = problem.contact == "multi" and any(body.rigid for body in problem.bodies)
        self.lines = 8 if moves else 0
        nothing = np.zeros(0, np.uint8)
        self.room = 256
        self.lists = {"past": nothing, "choice": nothing, "kept": nothing}
        self.lengthen()

    def _measure_walls(self, problem: Problem) -> None:
        """Find the vertices of shells, and which bodies are shells for the most part."""
        walls = [_half_wall(body) / problem.cell for body in problem.bodies]
        apart = problem.contact == "multi"
        self.widest_wall = [float(wall.max(initial=0.0)) if apart else 0.0 for wall in walls]
        self.is_shell = [apart and bool(np.count_nonzero(wall) > 0.5 * len(wall)) for wall in walls]
        self.half_wall = np.concatenate(walls).astype(np.float32)

    def note_walls(self, record: np.ndarray, field: int) -> None:
        """Write down how thick the walls of a field's shells are; one that is a shell stands on no plane by itself."""
        record["is_shell"], record["widest_wall"] = self.is_shell[field], self.widest_wall[field]
        if self.widest_wall[field] > 0.0:
            write_pointers(record, half_wall=self.half_wall)
        if self.is_shell[field]:
            record["floor"], record["level"] = -1, 0.0

    def watched(self, origin: np.ndarray, dim: np.ndarray) -> tuple[int, np.ndarray]:
        """Return the plane that a window reaches, and its normal; -1 and 0 if none or several.

        Args:
            origin: The window's first block.
            dim: How many blocks it has along each axis.
        """
        ends = 4.0 * self.cell * np.stack([origin, origin + dim])
        normal = self.plane[:, :3]
        lowest = np.where(normal > 0.0, normal * ends[0], normal * ends[1]).sum(axis=1)
        near = np.flatnonzero(lowest - self.plane[:, 3] <= self.reach * self.cell)
        if len(near) != 1:
            return -1, np.zeros(3)
        return int(near[0]), normal[near[0]]

    def stand(self, floor: np.ndarray, tasks: int) -> int:
        """Make room for the books of tasks on nodes; how many of them there are, if any stands."""
        self.stands = np.zeros(tasks * RECORD_BYTES["entry"], np.uint8)
        write_pointers(self.stage, stand=self.stands)
        return tasks if (floor >= 0).any() else 0

    @property
    def past(self) -> np.ndarray:
        """Forces of the contacts in the last step, as bytes: where the next one begins to look."""
        return self.lists["past"][: int(self.stage["pasts"][0]) * RECORD_BYTES["past"]].copy()

    @past.setter
    def past(self, bytes_: np.ndarray) -> None:
        while len(bytes_) > len(self.lists["past"]):
            self.lengthen()
        self.lists["past"][: len(bytes_)] = bytes_
        self.stage["pasts"] = len(bytes_) // RECORD_BYTES["past"]

    @property
    def kept(self) -> np.ndarray:
        """Choices of candidate normals in the last step, as bytes: what the next one keeps."""
        which = self._list_of_kept()
        return self.lists[which][: int(self.stage["kepts"][0]) * RECORD_BYTES["kept"]].copy()

    @kept.setter
    def kept(self, bytes_: np.ndarray) -> None:
        while len(bytes_) > len(self.lists["kept"]):
            self.lengthen()
        self.lists[self._list_of_kept()][: len(bytes_)] = bytes_
        self.stage["kepts"] = len(bytes_) // RECORD_BYTES["kept"]

    def _list_of_kept(self) -> str:
        """Name the list of the last step: it takes turns with that of this step."""
        turned = self.stage["kept"][0] == self.lists["choice"].ctypes.data
        return "choice" if turned else "kept"

    def lengthen(self) -> None:
        """Make every list half as long again."""
        self.room += self.room // 2
        room = {
            "junction": self.room // 2,
            "meet": 4 * self.room,
            "side": 8 * self.room,
            "touch": 8 * self.room,
            "aim": 8 * self.room,
            "lean": 8 * self.room,
            "choice": 8 * self.room,
            "kept": 8 * self.room,
            "entry": 8 * self.room,
            "line": self.lines * self.room,
            "past": self.lines * self.room,
        }
        if any(self.is_shell):
            room["spread"] = room["side"]
        past, kept = self.past, self.kept
        self.lists = {name: np.zeros(n * RECORD_BYTES[name], np.uint8) for name, n in room.items()}
        self.order = np.zeros(room["line"] + 3 * self.friction.size + 1, np.int32)
        self.slot = np.zeros(1 << (4 * room["past"]).bit_length(), np.int32)
        self.kept_slot = np.zeros(1 << (2 * room["kept"]).bit_length(), np.int32)
        self.stage["slots"] = len(self.slot)
        write_pointers(self.stage, order=self.order, slot=self.slot, kept_slot=self.kept_slot, **self.lists)
        self.past, self.kept = past, kept
        self.stage["most_junctions"], self.stage["most_meets"] = room["junction"], room["meet"]
        self.stage["most_sides"], self.stage["most_touches"] = room["side"], room["touch"]


def _half_wall(body: Body) -> np.ndarray:
    """Half the wall at a body's particles that are vertices of its shell [m]."""
    if body.shell is None or body.rigid:
        return np.zeros(len(body.position))
    return vertex_half_wall(body.shell.triangle, body.shell.thickness, len(body.position))


def _pair_tables(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Friction and restitution of fields and planes; one shared field has its bodies' mean."""
    friction = np.array(problem.friction, float)
    restitution = np.array(problem.restitution, float)
    if problem.contact == "multi":
        for frame, soft in problem.all_excluded_pairs:
            friction[frame, soft] = friction[soft, frame] = BONDED_FRICTION
        return friction, restitution
    bodies, walls = len(problem.bodies), len(problem.planes)
    shared = np.zeros((1 + walls, 1 + walls))
    shared[0, 1:] = shared[1:, 0] = friction[:bodies, bodies:].mean(axis=0)
    return shared, np.zeros_like(shared)
