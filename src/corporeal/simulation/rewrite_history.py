"""Frames and ledger before a fracture, with fragments as objects that move together."""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from jaxtyping import Float

from corporeal.core.types import FractureEvent, Frame, Ledger
from corporeal.mpm.physics import rigid
from corporeal.mpm.split_body import ParentMap
from corporeal.scene.fractured_scene import piece_mass_fractions
from corporeal.simulation.fracture_state import FractureState
from corporeal.simulation.trajectory_files import FrameLayout, read_frame, read_ledger, write_frame, write_layout


def rewrite_history(folder: Path, count: int, before: FractureState, after: FractureState, one: FractureEvent) -> None:
    """Write the first ``count`` frames again, with the fragments as objects that move together."""
    old, new = FrameLayout.of(before.posed), FrameLayout.of(after.posed)
    for number in range(count):
        frame, row = read_frame(folder, number, old), read_ledger(folder, number)
        write_frame(folder, number, frame, new, _ledger_shares(row, frame, before, one))
    write_layout(folder, new)


def _ledger_shares(row: Ledger, frame: Frame, before: FractureState, one: FractureEvent) -> Ledger:
    """Distribute the ledger of the object to its fragments."""
    share, objects, k = piece_mass_fractions(one, before.particles), len(row.mass), one.object
    numbers = np.array([k, *range(objects, objects + len(share) - 1)])
    heirs = ParentMap(
        np.append(np.arange(objects), np.full(len(share) - 1, k)),
        np.concatenate([np.where(np.arange(objects) == k, share[0], 1.0), share[1:]]),
    )
    book = {f.name: np.asarray(getattr(row, f.name)) for f in fields(Ledger)}
    found = book | heirs.inherited(book)
    # Sums go by mass; places and distances are those of the whole, and pieces touch one another.
    for name in ("mass", "kinetic", "elastic", "potential", "flow"):
        found[name] = book[name][heirs.parent] * heirs.share
    for name in ("momentum", "angular_momentum"):
        found[name] = book[name][heirs.parent] * heirs.share[:, None]
    for name in ("centre", "rms_speed"):
        found[name] = book[name][heirs.parent]
    found["plane_depth"] = book["plane_depth"][:, heirs.parent]
    square = np.ix_(heirs.parent, heirs.parent)
    found["gap"], found["overlap"] = book["gap"][square], book["overlap"][square]
    apart = np.where(np.eye(len(numbers), dtype=bool), np.inf, 0.0)
    found["gap"][np.ix_(numbers, numbers)] = apart
    # Every piece moves about the common centre: what that adds to each adds up to nothing.
    moves = _piece_motions(row, frame, before, one)
    for name in ("momentum", "angular_momentum", "kinetic"):
        each = np.array([getattr(m, name) for m in moves])
        left = book[name][k] - each.sum(axis=0)
        found[name][numbers] = each + np.multiply.outer(share, left)
    found["centre"][numbers] = [m.centre for m in moves]
    height = (found["centre"][numbers] - book["centre"][k]) @ np.array(before.scene.gravity)
    found["potential"][numbers] -= found["mass"][numbers] * height
    return Ledger(**found)


def _piece_motions(row: Ledger, frame: Frame, before: FractureState, one: FractureEvent) -> list["_PieceMotion"]:
    """Return the motion of each fragment while the object is whole."""
    particles, k = before.particles, one.object
    mine = np.flatnonzero(particles.object == k)
    weight, volume = particles.mass[mine], particles.volume[mine]
    place = frame.position[mine].astype(float)
    whole = rigid.mass_and_inertia(place, weight, volume)
    speed = row.momentum[k] / row.mass[k]
    about = row.angular_momentum[k] - row.mass[k] * np.cross(row.centre[k], speed)
    spin = np.linalg.lstsq(whole.inertia, about, rcond=None)[0]
    moves = []
    for n in range(len(one.surfaces)):
        own = one.piece == n
        mass = rigid.mass_and_inertia(place[own], weight[own], volume[own])
        moves.append(_PieceMotion.of(mass, speed + np.cross(spin, mass.centre - whole.centre), spin))
    return moves


@dataclass(frozen=True)
class _PieceMotion:
    """Motion of one fragment."""

    centre: Float[np.ndarray, "3"]
    momentum: Float[np.ndarray, "3"]
    angular_momentum: Float[np.ndarray, "3"]
    """About the origin [kg m²/s]."""
    kinetic: float

    @classmethod
    def of(cls, mass: rigid.BodyInertia, speed: np.ndarray, spin: np.ndarray) -> "_PieceMotion":
        momentum, own = mass.total * speed, mass.inertia @ spin
        return cls(
            mass.centre, momentum, np.cross(mass.centre, momentum) + own, 0.5 * float(momentum @ speed + own @ spin)
        )
