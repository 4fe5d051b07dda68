"""Memory that the native contact piece works in, and what it is told of the problem."""

import numpy as np

from corporeal.mpm import tables
from corporeal.mpm.contact import half_space_face
from corporeal.mpm.kernels import CLOSE, MEET, TOUCH
from corporeal.mpm.ledger import Ledger
from corporeal.mpm.problem import Body, Problem

BONDED = -1.0
"""Friction of a pair that is never in contact, to the native piece."""
BOOKS = "plane_impulse pair_impulse friction_loss first_contact last_contact contact_point"


def point(record: np.ndarray, **arrays: np.ndarray) -> None:
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
        state: Its rigid state, see ``tables``.
        points: Its particles in its own frame, see ``tables``.
        cell: dx [m].

    """
    across = int(np.ceil((2.0 * state[tables.RADIUS] / cell + 4.0) / 4.0)) + 3
    surface = body.surface - state[tables.CENTRE : tables.CENTRE + 3]
    arrays = {
        "node": np.zeros((across**3, 64, 8), np.float32),
        "table": np.full(across**3, -1, np.int32),
        "where": np.zeros((across**3, 4), np.int32),
        "near": np.zeros(2 * across**3, np.uint64),
        "block": np.zeros(len(points), np.int32),
        "point": np.ascontiguousarray(points),
        "surface": np.ascontiguousarray(surface),
        "rigid": state,
    }
    point(record, **arrays)
    record["dim"], record["rigids"] = across, 1
    record["points"], record["surfaces"] = len(points), len(surface)
    return arrays


class ContactMemory:
    """Lists of nodes, contacts and particles near them, and tables that never change."""

    def __init__(self, world: np.ndarray, problem: Problem, ledger: Ledger) -> None:
        self.world = world
        walls = [[*plane.normal, plane.offset] for plane in problem.planes]
        self.plane = np.array(walls, float).reshape(-1, 4)
        self.friction, self.restitution = _pair_tables(problem)
        self.scratch = np.zeros(self.friction.size * 8)
        self.face = half_space_face(np.linspace(-1.5, 0.0, 4097))
        point(
            world,
            plane=self.plane,
            friction=self.friction,
            restitution=self.restitution,
            ledger=self.scratch,
            face=self.face,
        )
        point(world, **{name: getattr(ledger, name) for name in BOOKS.split()})
        world["planes"], world["names"] = len(walls), len(problem.bodies) + len(walls)
        self.room = 1024
        self.lengthen()

    def lengthen(self) -> None:
        """Make every list twice as long."""
        self.room *= 2
        room, world = self.room, self.world
        self.meets = np.zeros(room * MEET, np.uint8)
        self.touches = np.zeros(2 * room * TOUCH, np.uint8)
        self.closes = np.zeros(4 * room * CLOSE, np.uint8)
        self.order = np.zeros(2 * room, np.int32)
        point(
            world,
            contact_memory=self.meets,
            pair_memory=self.touches,
            near_memory=self.closes,
            order=self.order,
        )
        world["most_contacts"], world["most_pairs"], world["most_nears"] = room, 2 * room, 4 * room


def _pair_tables(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Friction and restitution of fields and planes; one shared field has its bodies' mean."""
    friction = np.array(problem.friction, float)
    restitution = np.array(problem.restitution, float)
    if problem.contact == "multi":
        for frame, soft in problem.bonds:
            friction[frame, soft] = friction[soft, frame] = BONDED
        return friction, restitution
    bodies, walls = len(problem.bodies), len(problem.planes)
    shared = np.zeros((1 + walls, 1 + walls))
    shared[0, 1:] = shared[1:, 0] = friction[:bodies, bodies:].mean(axis=0)
    return shared, np.zeros_like(shared)
