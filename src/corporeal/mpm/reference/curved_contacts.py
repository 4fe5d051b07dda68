"""Contacts of round bodies with curved faces of other rigid bodies: a marble in a bowl."""

from dataclasses import dataclass
from itertools import permutations

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm.constants import (
    CURVED_CONTACT_ITERATIONS,
    CURVED_PATCH_RATIO,
    FACING_POINTS_COSINE,
    NEAREST_POINT_FACTOR,
    SURFACE_POINT_REACH_DX,
)
from corporeal.mpm.physics import curved_surface
from corporeal.mpm.reference.contact_scene import ContactScene, PossibleContacts


def list_curved_contacts(scene: ContactScene) -> list[PossibleContacts]:
    """List contacts of round surface points with curved faces of other rigid bodies.

    The ball under a round point lies so far over the face around the curved point that is nearest to its middle. Where
    both are round, points of the first body count.
    """
    bodies = scene.problem.bodies
    bonded = {tuple(sorted(bond)) for bond in scene.problem.all_excluded_pairs}
    found = []
    for round_one, other in permutations(filter(scene.is_rigid, range(len(bodies))), 2):
        pair = min(round_one, other), max(round_one, other)
        if pair in bonded or bodies[round_one].path is not None:
            continue
        touch = RoundOnCurved.of(scene, round_one, other).touch()
        if touch is not None:
            found.append(touch)
    return found


@dataclass(frozen=True)
class RoundOnCurved:
    """Round points of one body and curved points of another one near it; in the world [m]."""

    scene: ContactScene
    body: int
    other: int
    rows: Float[np.ndarray, "S 12"]
    """Of all surface points of the first."""
    points: Float[np.ndarray, "S 3"]
    round_ones: Int[np.ndarray, " P"]
    """Which of them may meet anything."""
    faces: Float[np.ndarray, "Q 12"]
    places: Float[np.ndarray, "Q 3"]

    @classmethod
    def of(cls, scene: ContactScene, body: int, other: int) -> "RoundOnCurved":
        """Find what may meet."""
        rows = _turned_curvature(scene, body)
        faces, places = _turned_curvature(scene, other), scene.surface(other)
        reach = SURFACE_POINT_REACH_DX * scene.problem.cell
        near = curved_surface.is_curved(faces) & ((body < other) | curved_surface.is_hollow(faces))
        apart = np.linalg.norm(places - scene.state.centre[body], axis=1)
        near &= apart <= scene.matter.radius[body] + reach + faces[:, 8]
        faces, places = faces[near], places[near]
        points = scene.surface(body)
        may = curved_surface.ball_radius(rows) > 0.0
        if len(places):
            more = reach + rows[:, 8:9]
            low, high = (places - faces[:, 8:9]).min(axis=0), (places + faces[:, 8:9]).max(axis=0)
            inside = (points >= low - more) & (points <= high + more)
            may &= inside.all(axis=1)
        may &= len(places) > 0
        return cls(scene, body, other, rows, points, np.flatnonzero(may), faces, places)

    def touch(self) -> PossibleContacts | None:
        """Make a contact of each round point that has one; None: none has."""
        p, q = self._nearest()
        rows, faces = self.rows[p], self.faces[q]
        radius = curved_surface.ball_radius(rows)
        middle, over = self._over(p, q, faces[:, :3])
        out, there = over.normal, over.there
        for _ in range(1, CURVED_CONTACT_ITERATIONS):
            middle, over = self._over(p, q, out)
            out, there = over.normal, there & over.there
        gap, place = over.height - radius, middle - radius[:, None] * out
        reach = SURFACE_POINT_REACH_DX * self.scene.problem.cell
        lean = np.arccos(np.clip(-np.sum(out * rows[:, :3], axis=1), -1.0, 1.0))
        there &= (gap < reach) & (gap > -np.minimum(reach, radius))
        there &= over.aside <= (CURVED_PATCH_RATIO * faces[:, 8]) ** 2
        there &= radius * lean <= rows[:, 8]
        chosen = np.flatnonzero(there)
        chosen = chosen[self._owned(p[chosen], place[chosen])]
        if len(chosen) == 0:
            return None
        return self._listed(rows[chosen], faces[chosen], place[chosen], out[chosen], gap[chosen])

    def _over(
        self, p: Int[np.ndarray, " E"], q: Int[np.ndarray, " E"], out: Float[np.ndarray, "E 3"]
    ) -> tuple[Float[np.ndarray, "E 3"], curved_surface.HeightsOverCurve]:
        """Middles of balls under round points that look against a direction, over their faces."""
        middle = self.points[p] + curved_surface.ball_centre(self.rows[p], -out)
        return middle, curved_surface.height_over(self.faces[q], middle - self.places[q])

    def _nearest(self) -> tuple[Int[np.ndarray, " E"], Int[np.ndarray, " E"]]:
        """Round points and for each the curved point that it faces, nearest to its middle."""
        p = self.round_ones
        if len(p) == 0:
            return p, p
        normal = self.rows[p, :3]
        middle = self.points[p] - curved_surface.ball_radius(self.rows[p])[:, None] * normal
        apart = middle[:, None] - self.places
        above = np.einsum("pqi,qi->pq", apart, self.faces[:, :3]) > 0.0
        away = np.where(above, np.einsum("pqi,pqi->pq", apart, apart), np.inf)
        q = np.argmin(away, axis=1)
        faces = np.isfinite(away.min(axis=1))
        faces &= np.sum(self.faces[q, :3] * normal, axis=1) <= -FACING_POINTS_COSINE
        return p[faces], q[faces]

    def _owned(self, p: Int[np.ndarray, " E"], place: Float[np.ndarray, "E 3"]) -> Bool[np.ndarray, " E"]:
        """Whether places of contact belong to their points, and not to those points' neighbours."""
        away = np.sum((place[:, None] - self.points) ** 2, axis=2)
        own = away[np.arange(len(p)), p]
        others = self.rows[p, :3] @ self.rows[:, :3].T > 0.0
        others &= curved_surface.ball_radius(self.rows) > 0.0
        return ~np.any(others & (NEAREST_POINT_FACTOR**2 * away < own[:, None]), axis=1)

    def _listed(
        self, rows: np.ndarray, faces: np.ndarray, place: np.ndarray, out: np.ndarray, gap: np.ndarray
    ) -> PossibleContacts:
        scene, pair = self.scene, (min(self.body, self.other), max(self.body, self.other))
        middle = place + curved_surface.ball_radius(rows)[:, None] * out
        slip = self._velocity(self.body, middle) - self._velocity(self.other, middle)
        square = np.sum(slip**2, axis=1) - np.sum(slip * out, axis=1) ** 2
        a, c = (np.full(len(gap), b) for b in pair)
        return PossibleContacts(
            pair,
            a,
            c,
            place,
            out if self.other == pair[0] else -out,
            gap,
            rolls=self.body,
            instead=curved_surface.node_gap_error_reach(rows, faces, scene.problem.cell),
            inward=curved_surface.speed_into_hollow(rows, faces, np.maximum(square, 0.0), scene.dt),
        )

    def _velocity(self, body: int, place: Float[np.ndarray, "E 3"]) -> Float[np.ndarray, "E 3"]:
        state = self.scene.state
        spin = state.spin(self.scene.matter)[body]
        return state.speed[body] + np.cross(spin, place - state.centre[body])


def _turned_curvature(scene: ContactScene, body: int) -> Float[np.ndarray, "S 12"]:
    """How a body's surface curves at its points, in the world."""
    rows, turn = scene.matter.curvature[body].copy(), scene.state.rotation[body]
    rows[:, :3], rows[:, 3:6] = rows[:, :3] @ turn.T, rows[:, 3:6] @ turn.T
    return rows
