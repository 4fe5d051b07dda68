"""Contacts of rigid bodies on their surface points: with planes, and round ones with flat faces."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations

import numpy as np
from jaxtyping import Bool, Float

from corporeal.mpm.constants import (
    CURVED_GAP_ERROR_DX2,
    CURVED_NORMAL_COSINE,
    FACET_NORMAL_COSINE,
    FACET_REPLACES_NODES_DX,
    SURFACE_POINT_REACH_DX,
    VALLEY_ITERATIONS,
)
from corporeal.mpm.physics.flat_facets import lies_over_facet
from corporeal.mpm.reference.contact_scene import ContactScene, PossibleContacts


def list_plane_contacts(scene: ContactScene) -> list[PossibleContacts]:
    """List contacts of rigid bodies with planes."""
    problem, bodies = scene.problem, len(scene.problem.bodies)
    touches = []
    for b in filter(scene.is_rigid, range(bodies)):
        if problem.bodies[b].path is not None:
            continue
        for w, plane in enumerate(problem.planes):
            point, own = scene.touching(b, -np.array(plane.normal))
            height = point @ np.array(plane.normal) - plane.offset
            near = np.flatnonzero(own & (height < SURFACE_POINT_REACH_DX * problem.cell))
            if len(near) == 0:
                continue
            normal = np.tile(-np.array(plane.normal), (len(near), 1))
            mover, wall = np.full(len(near), b), np.full(len(near), scene.wall_mover + w)
            at = point[near], normal, height[near]
            corner = scene.matter.curvature[b][near, 6:8].sum(axis=1) <= 0.0
            touches.append(PossibleContacts((b, bodies + w), mover, wall, *at, rolls=b, corner=corner))
    return touches


def list_facet_contacts(scene: ContactScene) -> list[PossibleContacts]:
    """List contacts of rounded surface points with the flat faces of other rigid bodies.

    Each face is a plane that ends: exact, where nodes of the grid would be a road with bumps.
    """
    bodies = scene.problem.bodies
    bonded = {tuple(sorted(bond)) for bond in scene.problem.all_excluded_pairs}
    found = []
    for round_one, flat_one in permutations(filter(scene.is_rigid, range(len(bodies))), 2):
        pair = min(round_one, flat_one), max(round_one, flat_one)
        if pair in bonded or bodies[round_one].path is not None:
            continue
        for at, normal, gap in _with_facets(scene, round_one, flat_one):
            if len(gap):
                a, c = (np.full(len(gap), b) for b in pair)
                out = normal if flat_one == pair[0] else -normal
                found.append(PossibleContacts(pair, a, c, at, out, gap, rolls=round_one))
    return _join_contacts(found)


def _with_facets(
    scene: ContactScene, round_one: int, flat_one: int
) -> Iterator[tuple[Float[np.ndarray, "E 3"], Float[np.ndarray, "E 3"], Float[np.ndarray, " E"]]]:
    """Give places, normals out of the face and gaps for each face of a body."""
    state, matter = scene.state, scene.matter
    turn, centre = state.rotation[flat_one], state.centre[flat_one]
    reach = SURFACE_POINT_REACH_DX * scene.problem.cell
    # What is round lies with its middle on this side of the face, or it is another one's.
    deepest = np.minimum(reach, matter.curvature[round_one][:, 6:8].sum(axis=1))
    facets = matter.facets[flat_one]
    for row in facets.row if deepest.any() else ():
        normal = turn @ row[:3]
        place, own = scene.touching(round_one, -normal)
        gap = (place - centre) @ normal - row[3]
        near = np.flatnonzero(own & (gap < reach) & (gap > -deepest) & (deepest > 0.0))
        held = facets.point[int(row[9]) : int(row[10])]
        near = near[lies_over_facet(held, row[:3], row[8], (place[near] - centre) @ turn)]
        yield place[near], np.tile(normal, (len(near), 1)), gap[near]


def drop_replaced_nodes(
    scene: ContactScene, nodes: list[PossibleContacts], faces: list[PossibleContacts]
) -> list[PossibleContacts]:
    """Leave out contacts on nodes that are those on faces, less well known."""
    cell, kept = scene.problem.cell, []
    for touch in nodes:
        left = np.ones(len(touch.gap), dtype=bool)
        met = [(np.zeros((len(left), 0), dtype=bool), np.zeros((0, 3)))]
        for face in (f for f in faces if f.pair == touch.pair):
            reach, alike = face.instead, CURVED_NORMAL_COSINE
            if reach is None:
                wide = scene.matter.radius[face.rolls]
                reach = FACET_REPLACES_NODES_DX * cell + np.sqrt((0.5 * wide + CURVED_GAP_ERROR_DX2 * cell) * cell)
                thin = scene.thinness(sum(face.pair) - face.rolls)
                alike = CURVED_NORMAL_COSINE if thin else FACET_NORMAL_COSINE
            apart = np.linalg.norm(touch.point[:, None] - face.point, axis=2)
            same = (touch.normal @ face.normal.T > alike) & (apart < reach)
            left &= ~same.any(axis=1)
            met.append((apart < reach, face.normal))
        near, normals = np.concatenate([n for n, _ in met], axis=1), [m for _, m in met]
        left &= ~in_valley(touch.normal, np.concatenate(normals), near)
        kept.append(touch if left.all() else _select_contacts(touch, left))
    return kept


def in_valley(
    normal: Float[np.ndarray, "E 3"], faces: Float[np.ndarray, "F 3"], near: Bool[np.ndarray, "E F"]
) -> Bool[np.ndarray, " E"]:
    """Return which normals on nodes are sums of those of faces near them, as far as they are known.

    What is round and touches two faces of a body touches nothing between them, but nodes there see both, and look
    halfway. The face that a normal looks at most is taken off it, again and again.
    """
    rest = normal.copy()
    for _ in range(VALLEY_ITERATIONS if near.any() else 0):
        cosine = np.where(near, rest @ faces.T, 0.0)
        best = np.argmax(cosine, axis=1)
        most = np.take_along_axis(cosine, best[:, None], axis=1)
        rest -= np.maximum(most, 0.0) * faces[best]
    return near.any(axis=1) & (np.sum(rest**2, axis=1) < 1.0 - FACET_NORMAL_COSINE**2)


def sort_by_pair(touches: list[PossibleContacts]) -> list[PossibleContacts]:
    """Sort by pair, as they are swept."""
    return sorted(touches, key=lambda touch: touch.pair)


def _join_contacts(touches: list[PossibleContacts]) -> list[PossibleContacts]:
    """Make one of all contacts of one body's points with another body's faces."""
    joined: dict[tuple[tuple[int, int], int], list[PossibleContacts]] = {}
    for touch in touches:
        joined.setdefault((touch.pair, touch.rolls), []).append(touch)
    return [replace(some[0], **_contact_columns(some)) for some in joined.values()]


def _contact_columns(some: list[PossibleContacts]) -> dict[str, np.ndarray]:
    return {name: np.concatenate([getattr(t, name) for t in some]) for name in _CONTACT_FIELDS}


_CONTACT_FIELDS = ("a", "c", "point", "normal", "gap")


def _select_contacts(touch: PossibleContacts, chosen: np.ndarray) -> PossibleContacts:
    columns = {name: getattr(touch, name)[chosen] for name in _CONTACT_FIELDS}
    slips = None if touch.slips is None else touch.slips[chosen]
    layer = None if touch.layer is None else touch.layer[chosen]
    acts = None if touch.acts is None else touch.acts[chosen]
    return replace(touch, **columns, slips=slips, layer=layer, acts=acts)
