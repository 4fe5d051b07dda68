"""Support of a rigid body during an impact: twin of formulas/impact_support.h.

A body between what strikes it and what it rests on is squeezed at once where it is light, or where the contact behind
is the wider one: its own vibration between the two contacts is then much quicker than the impact, so that both contacts
are springs in series (decision restitution-soft-and-layered).
"""

from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from corporeal.mpm.constants import (
    IMPACT_PATCH_DX,
    LAYER_STIFFNESS_FACTOR,
    MAX_RESTING_SPEED,
    SUPPORT_FREQUENCY_RATIO2,
    SUPPORT_MASS_RATIO,
    SUPPORT_NORMAL_COSINE,
    TINY_DOUBLE,
)
from corporeal.mpm.physics.contact import Indices, Scalars, Vectors

ROLE_WAITS, ROLE_REBOUNDS, ROLE_HELD = 0, 1, 2
"""The part of a pair in a round of impacts."""


@dataclass(frozen=True)
class ImpactBodies:
    """What a round of impacts knows of the N bodies and planes."""

    light: Float[np.ndarray, " N"]
    """Inverse masses [1/kg]; 0 of planes and prescribed motion, -1 of what is not rigid."""
    restitution: Float[np.ndarray, "N N"]
    """Newton's e of every pair …"""
    restitution_law: Float[np.ndarray, "N N 5"]
    """… and how it changes with the speed of an impact: see ``restitution_at_speed``."""


class ImpactContacts(NamedTuple):
    """E contacts at the begin of a round."""

    number: Indices
    """Of each contact's pair, as in ``Rebound``."""
    point: Vectors
    """[m]"""
    normal: Vectors
    """Unit, from the first body of the pair to the second."""
    gap: Scalars
    """[m]"""
    speed: Scalars
    """At which it closes [m/s]."""
    struck: Bool[np.ndarray, " E"]
    """Whether its pair is."""
    approach: Scalars
    """Speed of approach of those that begin an impact, without this step's forces [m/s]; else 0."""


@dataclass
class ImpactPair:
    """One pair's near contacts in a round."""

    role: int
    bounce: float
    """Restitution in this round [-]."""
    radius: float
    """Of the disc over which they spread [m]."""
    normal: Float[np.ndarray, "3"]
    """Their mean, unit, from the first to the second."""
    place: Float[np.ndarray, "3"]
    """Their mean [m]."""


def restitution_at_speed(restitution: float, law: Float[np.ndarray, "5"], speed: float) -> float:
    """Restitution at the speed of an impact [-]: twin of ``Impact::bounce`` in contact.h.

    e = e_r (v/v_r)^(-q) - s (v - v_r), within bounds: q = 1/4 where a metal yields, a slope s where a rubber ball was
    rated at two speeds (decision restitution-pairs).

    Args:
        restitution: e_r: at the law's speed [-].
        law: v_r [m/s], s [s/m], q [-], least and most e.
        speed: v [m/s].
    """
    rated, slope, power, least, most = law
    now = restitution * (max(speed, TINY_DOUBLE) / rated) ** -power - slope * (speed - rated)
    return float(min(max(now, least), most))


def contact_disc_radius(points: Vectors, normal: Float[np.ndarray, "3"], cell: float) -> float:
    """Radius of the disc over which contacts spread across their normal [m], of a cell at least.

    A contact of radius a is as stiff as 2 E* a (Johnson, Contact Mechanics, 1985, §3.4, §4.2).
    """
    arms = points - points.mean(axis=0)
    spread = np.mean(np.sum(arms**2, axis=1) - (arms @ normal) ** 2)
    return sqrt(2.0 * max(float(spread), 0.0) + cell**2)


def equivalent_punch_radius(radius: float, thickness: float, cell: float) -> float:
    """How stiff a contact behind is, as the radius of a punch on a half-space that is as stiff [m].

    What is thin and lies on its face is pressed as a layer: E π a²/h, which is more than 2 E* a from a = 2h/π on.

    Args:
        radius: Of the disc over which it spreads, with its cell [m].
        thickness: h: of what is pressed, from the contact before it [m].
        cell: dx [m].
    """
    spread = max(radius**2 - cell**2, 0.0)
    return max(radius, LAYER_STIFFNESS_FACTOR * spread / max(thickness, TINY_DOUBLE))


def responds_within_impact(stiffness: float, mass: float, strikes: float, behind: float) -> bool:
    """Whether what lies between swings much quicker than the impact lasts.

    ω² = k (1/m + 1/m_behind) + 1/m between both springs, against 1/m_strikes + 1/(m + m_behind) of the impact, over the
    stiffness of the contact that is struck.

    Args:
        stiffness: k: of the contact behind over that of the one that is struck [-].
        mass: m [kg].
        strikes: Inverse mass of what strikes [1/kg].
        behind: Inverse mass of what is behind [1/kg].
    """
    between = stiffness * (1.0 / mass + behind) + 1.0 / mass
    return between > SUPPORT_FREQUENCY_RATIO2 * (strikes + behind / (1.0 + mass * behind))


@dataclass
class ImpactRound:
    """Who takes part in one round of impacts; E contacts."""

    bodies: ImpactBodies
    number: Indices
    """Of each contact's pair, as in ``Rebound``."""
    pairs: dict[int, ImpactPair]
    cell: float
    """dx [m]"""

    @classmethod
    def of(cls, bodies: ImpactBodies, seen: ImpactContacts, cell: float) -> "ImpactRound":
        """Look at near contacts, and hold what is struck; cell: dx [m]."""
        number, found = seen.number, {}
        rigid = (bodies.light[np.stack(np.divmod(number, len(bodies.light)))] >= 0.0).all(axis=0)
        for pair in np.unique(number[rigid]):
            mine = number == pair
            struck = bool(seen.struck[mine].any())
            least = max(float(seen.gap[mine].min()), 0.0) if struck else 0.0
            near = mine & (seen.speed > -MAX_RESTING_SPEED) & (seen.gap < least + IMPACT_PATCH_DX * cell)
            if not near.any():
                continue
            normal = seen.normal[near].sum(axis=0)
            normal = normal / max(float(np.linalg.norm(normal)), TINY_DOUBLE)
            both = np.divmod(pair, len(bodies.light))
            approach = float(seen.approach[mine].max())
            e = restitution_at_speed(float(bodies.restitution[both]), bodies.restitution_law[both], approach)
            width = contact_disc_radius(seen.point[near], normal, cell)
            place = seen.point[near].mean(axis=0)
            found[int(pair)] = ImpactPair(ROLE_REBOUNDS if struck else ROLE_WAITS, e, width, normal, place)
        now = cls(bodies, number, found, cell)
        for pair, struck in found.items():
            if struck.role == ROLE_REBOUNDS:
                now._hold(pair, struck)
        return now

    def _hold(self, pair: int, struck: ImpactPair) -> None:
        a, c = divmod(pair, len(self.bodies.light))
        soft, kept = 1.0, struck.bounce**2
        for strikes, first, along in ((a, c, struck.normal), (c, a, -struck.normal)):
            for stiffness, e in self._behind(strikes, first, along, struck):
                soft, kept = soft + 1.0 / stiffness, kept + e**2 / stiffness
        struck.bounce = sqrt(kept / soft) if soft > 1.0 else struck.bounce

    def _behind(
        self, strikes: int, first: int, along: Float[np.ndarray, "3"], struck: ImpactPair
    ) -> list[tuple[float, float]]:
        """Hold what a struck body rests on, and what that rests on; stiffness and e of each."""
        found: list[tuple[float, float]] = []
        light, before, body, mass = self.bodies.light, strikes, first, 0.0
        front = struck
        while light[body] > 0.0 and len(found) < len(light):
            mass += 1.0 / light[body]
            stiffest, following, rests = 0.0, -1, front
            for other in range(len(light)):
                pair = self._between(body, other)
                if other == before or pair is None or not self._backs(pair, body, other, along):
                    continue
                thickness = abs(float((pair.place - front.place) @ along))
                stiffness = equivalent_punch_radius(pair.radius, thickness, self.cell) / struck.radius
                if not responds_within_impact(stiffness, mass, light[strikes], light[other]):
                    continue
                pair.role = ROLE_HELD
                if stiffness > stiffest:
                    stiffest, following, rests = stiffness, other, pair
            if following < 0:
                break
            found.append((stiffest, float(self.bodies.restitution[body, following])))
            before, body, front = body, following, rests
        return found

    def _between(self, one: int, other: int) -> ImpactPair | None:
        return self.pairs.get(min(one, other) * len(self.bodies.light) + max(one, other))

    def _backs(self, pair: ImpactPair, body: int, other: int, along: Float[np.ndarray, "3"]) -> bool:
        """Whether another body lies behind a struck one, and is not much lighter."""
        light = self.bodies.light
        if pair.role == ROLE_REBOUNDS or light[other] < 0.0 or SUPPORT_MASS_RATIO * light[other] > light[body]:
            return False
        cosine = float(pair.normal @ along)
        return (cosine if body < other else -cosine) >= SUPPORT_NORMAL_COSINE

    @property
    def held(self) -> Bool[np.ndarray, " E"]:
        """Which contacts hold what is struck."""
        held = [pair for pair, found in self.pairs.items() if found.role == ROLE_HELD]
        return np.isin(self.number, np.array(held, dtype=np.int64))

    def bounce(self, restitution: Scalars) -> Scalars:
        """Restitution in this round [-]; of pairs that are not struck as it was."""
        out = np.array(restitution)
        for pair, found in self.pairs.items():
            if found.role == ROLE_REBOUNDS:
                out[(self.number == pair) & (restitution > 0.0)] = found.bounce
        return out
