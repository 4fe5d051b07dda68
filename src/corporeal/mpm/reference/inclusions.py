"""Rigid inclusions in the reference engine, acting on its grid."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm.constants import MIN_FRAME_VOLUME_FRACTION
from corporeal.mpm.physics import rigid
from corporeal.mpm.physics.contact_impulses import Movers
from corporeal.mpm.physics.grid_spline import Stencil
from corporeal.mpm.physics.inclusions import inclusion_and_soft_density
from corporeal.mpm.problem import Problem
from corporeal.mpm.reference.contact import ContactOutcome
from corporeal.mpm.state import ParticleConstants, State


@dataclass(frozen=True)
class FrameComposite:
    """A frame and what it holds, as one rigid body; R nodes."""

    frame: int
    """Body."""
    own: rigid.BodyInertia
    """Of the frame alone, in the world's axes now."""
    whole: rigid.BodyInertia
    """Of both."""
    speed: Float[np.ndarray, "3"]
    """Of the common centre [m/s]."""
    moment: Float[np.ndarray, "3"]
    """Angular momentum about it [kg m²/s]."""
    slot: Int[np.ndarray, " R"]
    """The soft field's nodes that are held."""
    place: Float[np.ndarray, "R 3"]
    """[m]"""

    def act(self, movers: Movers) -> None:
        """Stand in for the frame among what contact can move."""
        inverse = np.linalg.inv(self.whole.inertia)
        movers.inverse_mass[self.frame] = 1.0 / self.whole.total
        movers.inverse_inertia[self.frame] = inverse
        movers.centre[self.frame] = self.whole.centre
        movers.velocity[self.frame] = self.speed
        movers.spin[self.frame] = inverse @ self.moment

    def split(self, meeting: ContactOutcome) -> ContactOutcome:
        """Give the nodes and the frame their parts of the motion: v = V + ω × r."""
        velocity, speed = meeting.velocity.copy(), meeting.speed.copy()
        spin = meeting.spin[self.frame]
        common = speed[self.frame].copy()
        velocity[self.slot] = common + np.cross(spin, self.place - self.whole.centre)
        speed[self.frame] = common + np.cross(spin, self.own.centre - self.whole.centre)
        return replace(meeting, velocity=velocity, speed=speed)


def join_bodies(
    own: rigid.BodyInertia,
    motion: tuple[np.ndarray, np.ndarray],
    mass: Float[np.ndarray, " R"],
    place: Float[np.ndarray, "R 3"],
    velocity: Float[np.ndarray, "R 3"],
) -> tuple[rigid.BodyInertia, Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """One rigid body of a frame and moving points: mass, velocity of its centre, L about it.

    Args:
        own: The frame's.
        motion: The frame's velocity [m/s] and angular momentum about its centre [kg m²/s].
        mass: Of the points [kg].
        place: [m]
        velocity: [m/s]
    """
    speed, moment = motion
    total = own.total + float(mass.sum())
    centre = (own.total * own.centre + mass @ place) / total
    common = (own.total * speed + mass @ velocity) / total
    d, r = own.centre - centre, place - centre
    spread = own.total * np.outer(d, d) + (r * mass[:, None]).T @ r
    inertia = own.inertia + np.trace(spread) * np.eye(3) - spread
    about = np.cross(r, mass[:, None] * velocity).sum(axis=0)
    moment = moment + own.total * np.cross(d, speed) + about
    return rigid.BodyInertia(total, centre, inertia), common, moment


class FrameBonds:
    """All bonds of a problem."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        bodies = problem.bodies
        self.density = [inclusion_and_soft_density(bodies[f], bodies[s], problem.cell) for f, s in problem.bonds]
        self.pairs = problem.bonds if problem.contact == "multi" else ()

    def compose(
        self,
        matter: ParticleConstants,
        state: State,
        grid: Stencil,
        mass: Float[np.ndarray, " A"],
        velocity: Float[np.ndarray, "A 3"],
    ) -> list[FrameComposite]:
        """Make one rigid body of every frame and what it holds now.

        Args:
            matter: What never changes.
            state: With the velocities of rigid bodies after forces.
            grid: Where everything is.
            mass: Of every slot [kg].
            velocity: Of every slot, after forces [m/s].
        """
        made: list[FrameComposite] = []
        taken = np.zeros(grid.count, bool)
        for frame in sorted({f for f, _ in self.pairs}):
            R = state.rotation[frame]
            inertia = R @ matter.inertia[frame] @ R.T
            own = rigid.BodyInertia(float(matter.total[frame]), state.centre[frame], inertia)
            slot = self._held(frame, grid, mass)
            slot = slot[~taken[slot]]
            taken[slot] = True
            place = grid.index[slot] * self.problem.cell
            motion = state.speed[frame], state.spin_momentum[frame]
            joined = join_bodies(own, motion, mass[slot], place, velocity[slot])
            made.append(FrameComposite(frame, own, *joined, slot, place))
        return made

    def _held(self, frame: int, grid: Stencil, mass: np.ndarray) -> Int[np.ndarray, " R"]:
        """Slots of soft fields where the frame has its share of the volume."""
        slots = [np.zeros(0, np.int64)]
        mine = np.flatnonzero((grid.field == frame) & (mass > 0.0))
        for (f, soft), (density, held) in zip(self.pairs, self.density, strict=True):
            if f != frame:
                continue
            other = np.flatnonzero((grid.field == soft) & (mass > 0.0))
            _, a, c = np.intersect1d(grid.key[mine], grid.key[other], assume_unique=True, return_indices=True)
            stiff, yielding = mass[mine[a]] / density, mass[other[c]] / held
            slots.append(other[c[stiff >= MIN_FRAME_VOLUME_FRACTION * (stiff + yielding)]])
        return np.concatenate(slots)


def without_held_nodes(mass: Float[np.ndarray, " A"], made: tuple[FrameComposite, ...]) -> Float[np.ndarray, " A"]:
    """Leave held nodes out of contact: there the frame's surface is felt."""
    free: Bool[np.ndarray, " A"] = np.ones(len(mass), bool)
    for composite in made:
        free[composite.slot] = False
    return np.where(free, mass, 0.0)
