"""Rigid bodies in a shared velocity field: the control without contact.

Their particles move with the field like all others; then each body takes the rigid motion that
fits what they gathered, and puts them back where its shape says.
"""

import numpy as np

from corporeal.mpm.cpu import layout
from corporeal.mpm.cpu.field_window import FieldWindow
from corporeal.mpm.cpu.layout import AF, HALF_CELL_UNITS, PLACE, VE, XI
from corporeal.mpm.physics import rigid
from corporeal.mpm.problem import Body


class CarriedRigidBody:
    """One rigid body's particles within a shared window."""

    def __init__(self, body: Body, state: np.ndarray, first: int, cell: float) -> None:
        self.state, self.first, self.cell = state, first, cell
        self.mass = body.volume * body.density
        self.volume = body.volume
        whole = rigid.mass_and_inertia(body.position, self.mass, self.volume)
        self.inertia = whole.inertia
        self.arm = body.position - whole.centre

    def find(self, window: FieldWindow) -> None:
        """Find the body's particles after a sort."""
        count = len(self.mass)
        at = np.empty(window.count, np.int64)
        at[window.number] = window.slot
        slot = at[self.first : self.first + count]
        self.batch, self.lane = slot // 8, slot % 8
        run = np.searchsorted(window.block[:, 0], slot, side="right") - 1
        self.home = window.block[run, 2:5]

    def carry(self, window: FieldWindow, dt: float) -> bool:
        """Fit, move and turn the body; True when a particle strayed from its block."""
        state, cell = self.state, self.cell
        place = self._read(window, XI).view(np.int32) / float(1 << PLACE) + 4.0 * window.origin
        position = place * cell
        velocity = self._read(window, VE).astype(np.float64)
        whole = rigid.mass_and_inertia(position, self.mass, self.volume)
        speed, moment = rigid.fit_motion(whole, position, self.mass, velocity)
        turn = state[layout.TURN : layout.TURN + 9].reshape(3, 3)
        turn = rigid.integrate_rotation(turn, self.inertia, moment, dt)
        state[layout.CENTRE : layout.CENTRE + 3] += dt * speed
        state[layout.TURN : layout.TURN + 9] = turn.ravel()
        state[layout.SPEED : layout.SPEED + 3] = speed
        state[layout.MOMENT : layout.MOMENT + 3] = moment
        inverse = rigid.world_inverse_inertia(turn, self.inertia)
        spin = inverse @ moment
        state[layout.INERTIA : layout.INERTIA + 9] = inverse.ravel()
        state[layout.SPIN : layout.SPIN + 3] = spin
        return self._write(window, turn, spin)

    def _write(self, window: FieldWindow, turn: np.ndarray, spin: np.ndarray) -> bool:
        state, cell = self.state, self.cell
        arm = self.arm @ turn.T
        place = (state[layout.CENTRE : layout.CENTRE + 3] + arm) / cell - 4.0 * window.origin
        fixed = np.rint(place * (1 << PLACE)).astype(np.int32)
        velocity = state[layout.SPEED : layout.SPEED + 3] + np.cross(spin, arm)
        gradient = (rigid.cross_matrix(spin) * cell).ravel()
        for k in range(3):
            window.part[self.batch, XI + k, self.lane] = fixed[:, k].view(np.float32)
            window.part[self.batch, VE + k, self.lane] = velocity[:, k]
        for k in range(9):
            window.part[self.batch, AF + k, self.lane] = gradient[k]
        inside = ((fixed - HALF_CELL_UNITS) >> PLACE) - 4 * self.home
        return bool(((inside < -1) | (inside > 4)).any())

    def _read(self, window: FieldWindow, first: int) -> np.ndarray:
        columns = [window.part[self.batch, first + k, self.lane] for k in range(3)]
        return np.ascontiguousarray(np.stack(columns, axis=1))
