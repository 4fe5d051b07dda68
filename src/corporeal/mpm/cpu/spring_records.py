"""Records of tethers, joints and grips for native code."""

import numpy as np

from corporeal.mpm.cpu import layout, native_tables
from corporeal.mpm.cpu.contact_memory import write_pointers
from corporeal.mpm.cpu.layout import GRIP_RECORD, JOINT_RECORD, TETHER_RECORD
from corporeal.mpm.physics.spring_grips import Grip
from corporeal.mpm.problem import Body, Joint, Problem


class SpringRecords:
    """Records of a problem's springs, and the arrays that they point to."""

    def __init__(
        self, problem: Problem, first: list[int], impulse: np.ndarray, rigid: dict[int, np.ndarray]
    ) -> None:
        """Lay out memory.

        Args:
            problem: What to simulate; in a field that all share no springs act.
            first: Number of each body's first particle.
            impulse: The ledger's external impulses, which grips add to.
            rigid: States of the rigid bodies.

        """
        self.problem, self.first, self.impulse, self.rigid = problem, first, impulse, rigid
        self.start = {b: native_tables.rigid_state(problem.bodies[b]) for b in rigid}
        self.kept: list[np.ndarray] = []
        apart = problem.contact == "multi"
        tied = [(b, body) for b, body in enumerate(problem.bodies) if body.tether and apart]
        joints = problem.joints if apart else ()
        self.tether, self.joint = (
            np.zeros(len(tied), TETHER_RECORD.dtype),
            np.zeros(len(joints), JOINT_RECORD.dtype),
        )
        self.grip = np.zeros(0, GRIP_RECORD.dtype)
        for row, (b, body) in enumerate(tied):
            self._tie(self.tether[row : row + 1], b, body)
        for row, joint in enumerate(joints):
            self._join(self.joint[row], joint)

    def _tie(self, record: np.ndarray, b: int, body: Body) -> None:
        assert body.tether is not None
        holder = body.tether.holder
        centre = self.start[holder][layout.CENTRE : layout.CENTRE + 3]
        anchor = np.ascontiguousarray(body.position - centre, np.float64)
        rate = np.ascontiguousarray(body.tether.rate, np.float64)
        self.kept += [anchor, rate]
        write_pointers(record, anchor=anchor, rate=rate, holder=self.rigid[holder])
        record["damping"], record["field"] = body.tether.damping, b
        record["first"], record["count"] = self.first[b], len(rate)

    def _join(self, record: np.ndarray, joint: Joint) -> None:
        for name, b in (("first", joint.first), ("second", joint.second)):
            record[name] = self.rigid[b].ctypes.data
            centre = self.start[b][layout.CENTRE : layout.CENTRE + 3]
            record[f"arm_{name}"] = np.array(joint.point) - centre
        record["stiffness"], record["damping"] = joint.stiffness, joint.damping

    def grasp(self, grips: dict[int, Grip]) -> None:
        """Take these grips in place of all earlier ones; by body."""
        self.grip = np.zeros(len(grips), GRIP_RECORD.dtype)
        single = self.problem.contact == "single"
        self.held: list[np.ndarray] = []
        for row, (b, grip) in enumerate(grips.items()):
            record = self.grip[row : row + 1]
            share = np.zeros(len(self.problem.bodies[b].position))
            write_pointers(record, impulse=self.impulse[b])
            if b in self.rigid and not single:
                write_pointers(record, rigid=self.rigid[b])
            else:
                share[grip.hold.particle] = grip.hold.share
            self.held.append(share)
            write_pointers(record, share=share)
            record["arm"], record["target"] = grip.hold.arm, grip.target
            record["stiffness"], record["damping"] = grip.stiffness, grip.damping
            record["mass"], record["field"] = grip.hold.mass, 0 if single else b
            record["first"], record["count"] = self.first[b], len(share)

    def connect(self, world: np.ndarray) -> None:
        """Point the world to the records."""
        write_pointers(world, tether=self.tether, joint=self.joint, grip=self.grip)
        counts = len(self.tether), len(self.joint), len(self.grip)
        world["tethers"], world["joints"], world["grips"] = counts
        world["sprung"] = int(any(counts))

    def take_loss(self) -> float:
        """Return what dampers took since last asked [J]."""
        total = float(self.tether["lost"].sum() + self.joint["lost"].sum())
        self.tether["lost"] = self.joint["lost"] = 0.0
        return total

    def take_work(self) -> float:
        """Return the work that grips did since last asked [J]."""
        total = float(self.grip["work"].sum())
        self.grip["work"] = 0.0
        return total
