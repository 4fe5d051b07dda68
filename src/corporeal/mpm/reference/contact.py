"""Contact of the reference engine: detection and solution in one step.

Order: list the nodes; look at the surfaces there; choose normals; measure gaps; solve all
impulses together, rigid bodies and walls included.
"""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm.constants import (
    FLAT_BODY_GAP_DX,
    IMPACT_SWEEPS,
    LIQUID_WALL_REACH_DX,
    MAX_LAYER_DEVIATION_DX,
    NODE_SIGHT_DX,
    SHELL_WALL_REACH_DX,
    SURFACE_SEARCH_RADIUS_DX,
    SWEEPS,
    TINY_DOUBLE,
    VAST,
    WALL_REACH,
)
from corporeal.mpm.laws.kinematics import determinant
from corporeal.mpm.physics import contact, contact_impulses, impact_support
from corporeal.mpm.physics.flat_facets import facet_normals
from corporeal.mpm.physics.grid_spline import Stencil
from corporeal.mpm.reference.contact_scene import ContactScene, NormalCache, PossibleContacts, friction_table
from corporeal.mpm.reference.curved_contacts import list_curved_contacts
from corporeal.mpm.reference.rolling_contacts import brake_rolling
from corporeal.mpm.reference.surface_point_contacts import (
    drop_replaced_nodes,
    list_facet_contacts,
    list_plane_contacts,
    sort_by_pair,
)


@dataclass(frozen=True)
class ContactOutcome:
    """What came of it."""

    velocity: Float[np.ndarray, "A 3"]
    """Of every slot after contact [m/s]."""
    speed: Float[np.ndarray, "B 3"]
    """Of rigid bodies [m/s]."""
    spin: Float[np.ndarray, "B 3"]
    """Of rigid bodies [rad/s]."""
    pair: Int[np.ndarray, "E 2"]
    contacts: contact_impulses.ContactList
    impulse: Float[np.ndarray, "E 3"]
    """-J on the first and +J on the second of each pair [N s]."""
    friction_loss: float
    """[J]"""
    impact_loss: Float[np.ndarray, " E"]
    """Of each contact [J]."""
    kept: NormalCache
    """For the next step."""
    moment: Float[np.ndarray, "B 3"]
    """Angular impulse of rolling friction on each body [N m s]."""


def resolve_contacts(scene: ContactScene, velocity: Float[np.ndarray, "A 3"], dt: float) -> ContactOutcome:
    """Let everything that touches exchange impulses."""
    possible = find_contacts(scene)
    touches = [_drop_impossible(touch) for touch in possible]
    problem = scene.problem
    pair = np.array([t.pair for t in touches for _ in range(len(t.gap))], dtype=np.int64)
    pair = pair.reshape(-1, 2)
    contacts = contact_impulses.ContactList(
        *(_joined([getattr(t, name) for t in touches], shape) for name, shape in _CONTACT_COLUMNS),
        friction=friction_table(problem)[pair[:, 0], pair[:, 1]]
        * _joined([t.grips for t in touches], (0,)).astype(np.float64),
        group=_contact_groups(touches),
        guided=_touches_prescribed_body(scene, pair),
        layer=_joined([t.layers for t in touches], (0, 4)),
    )
    movers = scene.movers(velocity)
    # Impacts of rigid bodies first, one after the other; then all that touches, together.
    rolls = np.repeat([t.rolls for t in touches], [len(t.gap) for t in touches]).astype(np.int64)
    rebound = _rebound(scene, movers, pair, contacts, rolls)
    struck = contact_impulses.solve_impacts(contacts, movers, rebound, problem.cell, dt)
    target = np.maximum(contacts.gap, 0.0) / dt - _joined([t.inwards for t in touches], (0,)).astype(np.float64)
    sweeps = IMPACT_SWEEPS if _is_pressed(scene, pair) else _sweeps(scene, contacts, bool(struck.any()))
    impulse = struck + contact_impulses.solve(contacts, movers, target, sweeps)
    rounds = np.concatenate([t.rounds for t in touches]) if touches else np.zeros(0, dtype=bool)
    braked = brake_rolling(problem, movers, contacts, pair, impulse, rounds)
    impulse = impulse + braked.impulse
    before, after = contacts.approach(scene.movers_before_forces()), contacts.approach(movers)
    bodies = len(problem.bodies)
    return ContactOutcome(
        velocity=movers.velocity[bodies : scene.wall_mover],
        speed=movers.velocity[:bodies],
        spin=movers.spin[:bodies],
        pair=pair,
        contacts=contacts,
        impulse=impulse,
        friction_loss=contact_impulses.friction_loss(impulse, contacts.normal, before, after) + braked.energy,
        impact_loss=contact_impulses.impact_loss(impulse, contacts.normal, before, after),
        kept=NormalCache.of_all(touch.kept for touch in possible),
        moment=braked.moment,
    )


def _touches_prescribed_body(scene: ContactScene, pair: Int[np.ndarray, "E 2"]) -> Bool[np.ndarray, " E"]:
    """Return which contacts are of a rigid body with one that follows a prescribed path."""
    bodies, walls = scene.problem.bodies, len(scene.problem.planes)
    rigid = np.array([scene.is_rigid(b) for b in range(len(bodies))] + [False] * walls)
    prescribed = np.array([body.path is not None for body in bodies] + [False] * walls)
    one, other = pair.T
    return rigid[one] & rigid[other] & (prescribed[one] | prescribed[other])


def _contact_groups(touches: list[PossibleContacts]) -> Int[np.ndarray, " E"]:
    """Give contacts of one pair one number, on nodes and on surface points another."""
    number: dict[tuple[tuple[int, int], bool], int] = {}
    found = [number.setdefault((t.pair, t.rolls >= 0), len(number)) for t in touches]
    return np.repeat(np.array(found, dtype=np.int64), [len(t.gap) for t in touches])


def _sweeps(scene: ContactScene, contacts: contact_impulses.ContactList, hit: bool) -> int:
    """One sweep is exact where nothing that can move has more than one contact.

    Rigid bodies on one another have only each other to yield: with few sweeps stacks creep.
    """
    movers = np.concatenate([contacts.a, contacts.c])
    shared = np.bincount(movers[movers < scene.wall_mover], minlength=1).max() > 1
    bodies = len(scene.problem.bodies)
    stacked = bool(np.any((contacts.a < bodies) & (contacts.c < bodies)))
    if hit or stacked:
        return IMPACT_SWEEPS
    return SWEEPS if shared else 1


def _is_pressed(scene: ContactScene, pair: Int[np.ndarray, "E 2"]) -> bool:
    """Whether a rigid body is on a shell, whose nodes are light: few sweeps hand on only part of what it bears."""
    shell, rigid = (
        np.array([is_so(b) for b in range(len(scene.problem.bodies))] + [False] * len(scene.problem.planes))
        for is_so in (scene.is_shell, scene.is_rigid)
    )
    one, other = pair.T
    return bool(np.any((shell[one] & rigid[other]) | (rigid[one] & shell[other])))


def _drop_impossible(touch: PossibleContacts) -> PossibleContacts:
    """Leave out what is no contact at all; what only drags never pushes."""
    drags = touch.layers[:, 0] > 0.0
    real = np.isfinite(touch.gap) | drags
    columns = {name: getattr(touch, name)[real] for name, _ in _CONTACT_COLUMNS}
    columns["gap"] = np.minimum(columns["gap"], VAST)
    slips = None if touch.slips is None else touch.slips[real]
    corner = None if touch.corner is None else touch.corner[real]
    return replace(touch, **columns, slips=slips, layer=touch.layers[real], corner=corner)


_CONTACT_COLUMNS = (("a", (0,)), ("c", (0,)), ("point", (0, 3)), ("normal", (0, 3)), ("gap", (0,)))


def _joined(columns: list[np.ndarray], empty: tuple[int, ...]) -> np.ndarray:
    if not columns:
        return np.zeros(empty, dtype=np.int64 if empty == (0,) else np.float64)
    return np.concatenate(columns)


def _rebound(
    scene: ContactScene,
    movers: contact_impulses.Movers,
    pair: Int[np.ndarray, "E 2"],
    contacts: contact_impulses.ContactList,
    rolls: Int[np.ndarray, " E"],
) -> contact_impulses.ReboundRules:
    problem = scene.problem
    bodies, planes = len(problem.bodies), len(problem.planes)
    stiff = np.array([scene.is_rigid(b) for b in range(bodies)] + [True] * planes)
    kick = np.concatenate([scene.kick, np.zeros((planes, 3))])
    light = movers.inverse_mass[:bodies]
    first, second = pair.T
    both = stiff[first] & stiff[second]
    return contact_impulses.ReboundRules(
        pair=first * (bodies + planes) + second,
        restitution=np.where(both, np.asarray(problem.restitution)[first, second], 0.0),
        kick=np.sum((kick[first] - kick[second]) * contacts.normal, axis=1),
        feigned=np.where(rolls >= 0, scene.feigned[rolls], 0.0),
        bodies=impact_support.ImpactBodies(
            np.concatenate([np.where(stiff[:bodies], light, -1.0), np.zeros(planes)]),
            np.asarray(problem.restitution, dtype=float),
            problem.restitution_law_of_pair,
        ),
    )


def find_contacts(scene: ContactScene) -> list[PossibleContacts]:
    """List everything that touches or may touch in this step."""
    fields = np.unique(scene.grid.field).tolist()
    rows = {f: np.flatnonzero((scene.grid.field == f) & (scene.mass > 0.0)) for f in fields}
    bonded = {tuple(sorted(bond)) for bond in scene.problem.all_excluded_pairs}
    apart = [p for p in combinations(fields, 2) if p not in bonded]
    pairs = {p: _common_slots(scene.grid, rows, p) for p in apart}
    shared = [np.zeros(0, np.int64), *(slot for both in pairs.values() for slot in both)]
    alone = np.setdiff1d(np.arange(scene.grid.count), np.concatenate(shared))
    walls = {(f, w): _slots_near_wall(scene, rows[f], alone, (f, w)) for f in fields for w in _walls_on_nodes(scene, f)}
    shown = [*shared, *walls.values()]
    look = NodeSamples.at(scene, np.concatenate(shown))
    touches = [_field_contacts(scene, look, p, slots) for p, slots in pairs.items() if len(slots[0])]
    touches += [_wall_contacts(scene, look, p, slot) for p, slot in walls.items() if len(slot)]
    faces = list_facet_contacts(scene) + list_curved_contacts(scene)
    nodes = [touch.placed for touch in drop_replaced_nodes(scene, touches, faces)]
    return nodes + sort_by_pair(faces + list_plane_contacts(scene))


def _common_slots(grid: Stencil, rows: dict[int, np.ndarray], pair: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Slots of two fields at the nodes where both have mass."""
    a, c = rows[pair[0]], rows[pair[1]]
    _, in_a, in_c = np.intersect1d(grid.key[a], grid.key[c], assume_unique=True, return_indices=True)
    return a[in_a], c[in_c]


def _walls_on_nodes(scene: ContactScene, field: int) -> range:
    """Planes that a field meets on nodes: none with surface points or prescribed motion."""
    body = scene.problem.bodies[field]
    spared = scene.is_rigid(field) and (len(body.surface) > 0 or body.path is not None)
    return range(0 if spared else len(scene.problem.planes))


def _slots_near_wall(
    scene: ContactScene, slot: np.ndarray, alone: np.ndarray, pair: tuple[int, int]
) -> Int[np.ndarray, " E"]:
    """Slots of a field that a plane may touch.

    Pressure of a liquid that slides along it pushes all nodes whose splines reach it, and a plane drags on all such
    nodes of one that sticks. Where fields meet, there may be a body between, and only the nodes near the plane count.
    """
    height = _height(scene, slot, pair[1]) / scene.problem.cell
    near = height <= WALL_REACH
    if scene.is_shell(pair[0]):
        near |= height <= SHELL_WALL_REACH_DX
    if scene.pours(pair[0]):
        near |= (height <= LIQUID_WALL_REACH_DX) & np.isin(slot, alone)
    return slot[near]


def _height(scene: ContactScene, slot: np.ndarray, wall: int) -> np.ndarray:
    plane = scene.problem.planes[wall]
    return scene.grid.index[slot] @ np.array(plane.normal) * scene.problem.cell - plane.offset


@dataclass(frozen=True)
class NodeSamples:
    """How fields look from some slots. M links, each one particle seen from one slot."""

    mean: Float[np.ndarray, "A 3"]
    """X̄: mean offset of the field's material from the node [m]; 0 where unused."""
    outward: Float[np.ndarray, "A 3"]
    """g = Σ J V₀ ∇N [m²]."""
    slot: Int[np.ndarray, " M"]
    particle: Int[np.ndarray, " M"]
    offset: Float[np.ndarray, "M 3"]
    """x_p - x_i [m]."""

    @classmethod
    def at(cls, scene: ContactScene, slots: Int[np.ndarray, " S"]) -> "NodeSamples":
        """Visit once more the particles around the slots, and only them."""
        grid, matter = scene.grid, scene.matter
        wanted = np.zeros(grid.count, dtype=bool)
        wanted[slots] = True
        particle, near = np.nonzero(wanted[grid.slot])
        slot, offset = grid.slot[particle, near], -grid.arm[particle, near]
        weight = grid.weight[particle, near] * matter.mass[particle]
        volume = matter.volume * determinant(scene.state.F)
        gradient = volume[particle][:, None] * grid.gradient(particle, near)

        def total(values: np.ndarray) -> np.ndarray:
            return np.stack([np.bincount(slot, v, grid.count) for v in values.T], axis=1)

        full = np.where(scene.mass > 0.0, scene.mass, 1.0)[:, None]
        mean = total(weight[:, None] * offset) / full
        return cls(mean, total(gradient), slot, particle, offset)

    def reach(
        self, scene: ContactScene, slots: Int[np.ndarray, " E"], normals: Float[np.ndarray, "E 3 3"]
    ) -> Float[np.ndarray, "E 3"]:
        """How far the fields at some slots reach along candidate normals [m]: max x·n + R."""
        order = np.argsort(slots)
        low = np.searchsorted(slots[order], self.slot, "left")
        seen = np.flatnonzero(np.searchsorted(slots[order], self.slot, "right") > low)
        row, particle = order[low[seen]], self.particle[seen]
        n = normals[row]
        along = np.einsum("mqd,md->mq", n, self.offset[seen])
        stretched = np.linalg.norm(n @ scene.state.F[particle], axis=2)
        out = np.full((len(slots), 3), -np.inf)
        extent = scene.matter.half_spacing[particle][:, None] * stretched
        np.maximum.at(out, row, along + extent)
        return out

    def shell_spread(self, scene: ContactScene, slots: Int[np.ndarray, " E"]) -> "ShellSpread":
        """Where the vertices of the shells of some slots lie, weighted by spline and mass."""
        order = np.argsort(slots)
        low = np.searchsorted(slots[order], self.slot, "left")
        seen = np.flatnonzero(np.searchsorted(slots[order], self.slot, "right") > low)
        row, particle, slot = order[low[seen]], self.particle[seen], self.slot[seen]
        near = np.argmax(scene.grid.slot[particle] == slot[:, None], axis=1)
        weight = scene.grid.weight[particle, near] * scene.matter.mass[particle]
        count, offset = len(slots), self.offset[seen]
        full = np.maximum(np.bincount(row, weight, count), TINY_DOUBLE)

        def mean(values: np.ndarray) -> np.ndarray:
            rows = [np.bincount(row, weight * column, count) / full for column in values.reshape(len(values), -1).T]
            return np.stack(rows, axis=1)

        middle = mean(offset)
        apart = offset - middle[row]
        square = mean(apart[:, :, None] * apart[:, None, :]).reshape(-1, 3, 3)
        return ShellSpread(middle, square, mean(scene.matter.half_wall[particle])[:, 0])


@dataclass(frozen=True)
class ShellSpread:
    """Where the vertices of shells lie around some nodes."""

    mean: Float[np.ndarray, "E 3"]
    """Mean offset [m]."""
    covariance: Float[np.ndarray, "E 3 3"]
    """Of the offsets [m²]."""
    half_wall: Float[np.ndarray, " E"]
    """[m]"""

    def face(
        self, normal: Float[np.ndarray, "E 3"], cell: float
    ) -> tuple[Float[np.ndarray, " E"], Float[np.ndarray, " E"]]:
        """Where the shells end along n, seen from the node, and the deviation of what is seen there [m].

        Mean and deviation of the vertices' offsets say where their middle surface ends; half the wall comes on top.
        """
        mean = np.sum(self.mean * normal, axis=1)
        square = np.einsum("ei,eij,ej->e", normal, self.covariance, normal)
        deviation = np.sqrt(np.maximum(square, 0.0))
        return contact.face_of_spread(mean / cell, deviation / cell) * cell + self.half_wall, deviation


def _field_contacts(
    scene: ContactScene, look: NodeSamples, pair: tuple[int, int], slots: tuple[np.ndarray, np.ndarray]
) -> PossibleContacts:
    """Contacts of two fields on their common nodes, with separating-axis normals, smoothed."""
    wet = _liquid_contacts(scene, look, pair, slots)
    if wet is not None:
        return wet
    a, c = slots
    cell, index = scene.problem.cell, scene.grid.index[a]
    thin = [scene.thinness(body) for body in pair]
    candidates = _candidates(look, slots, thin)
    reach_a = look.reach(scene, a, candidates)
    reach_c = -look.reach(scene, c, -candidates)
    which = contact.widest_candidate(candidates, reach_a, reach_c, cell)
    kept = NormalCache.none()
    if not any(scene.is_rigid(body) for body in pair):
        known = scene.kept.of(pair, index)
        which = np.where(known >= 0, known, which)
        kept = NormalCache.of_pair(pair, index, which)
    normal = contact.take_candidate(candidates, which)
    normal = contact.smooth_normals(normal, np.minimum(scene.mass[a], scene.mass[c]), index)
    normal = _layer_normals(scene, look, pair, slots, _facet_normals(scene, look, pair, slots, normal))
    gap = contact.gap_between(look.mean[a], look.mean[c], normal, cell)
    asked = np.full(len(a), max(thin) > 0 or any(map(scene.is_shell, pair)))
    if all(map(scene.flat, pair)):
        asked |= gap <= FLAT_BODY_GAP_DX * cell
    if not asked.all():
        asked |= _thin_there(scene, pair, index * cell)
    if asked.any():
        gap[asked] = _surface_gap(scene, look, pair, (a[asked], c[asked]), normal[asked])
    gap = np.where(np.any(normal != 0.0, axis=1), gap, np.inf)
    movers, acts = (scene.mover_of_slot(a), scene.mover_of_slot(c)), None
    if all(map(scene.is_rigid, pair)):
        acts = index * cell + _edge_distances(scene, look, pair, slots, normal)
    return PossibleContacts(pair, *movers, index * cell, normal, gap, kept=kept, acts=acts)


def _candidates(look: NodeSamples, slots: tuple[np.ndarray, np.ndarray], thin: list[int]) -> Float[np.ndarray, "E 3 3"]:
    """Candidate normals; what is small against the cell has no face of its own."""
    found = contact.candidate_normals(*(look.outward[slot] for slot in slots))
    if (thin[0] == 2) != (thin[1] == 2):
        found[:, [0, 1 if thin[0] == 2 else 2]] = 0.0
    return found


def _facet_normals(
    scene: ContactScene,
    look: NodeSamples,
    pair: tuple[int, int],
    slots: tuple[np.ndarray, np.ndarray],
    normal: Float[np.ndarray, "E 3"],
) -> Float[np.ndarray, "E 3"]:
    """Take the normals of faces where those of nodes feign an approach."""
    if not all(map(scene.flat, pair)):
        return normal
    node = scene.grid.index[slots[0]] * scene.problem.cell
    first, second = (scene.seen_faces(body, node, look.mean[slot]) for body, slot in zip(pair, slots, strict=True))
    slip = scene.speed_at(pair[0], node) - scene.speed_at(pair[1], node)
    known = np.any(normal != 0.0, axis=1)[:, None]
    return np.where(known, facet_normals(normal, slip, first, second), normal)


def _layer_normals(
    scene: ContactScene,
    look: NodeSamples,
    pair: tuple[int, int],
    slots: tuple[np.ndarray, np.ndarray],
    normal: Float[np.ndarray, "E 3"],
) -> Float[np.ndarray, "E 3"]:
    """Take the normals of shells where they are layers there."""
    shells = [slot for body, slot in zip(pair, slots, strict=True) if scene.is_shell(body)]
    seen = [look.shell_spread(scene, slot).covariance / scene.problem.cell**2 for slot in shells]
    return contact.layer_normals(normal, *seen)


def _edge_distances(
    scene: ContactScene,
    look: NodeSamples,
    pair: tuple[int, int],
    slots: tuple[np.ndarray, np.ndarray],
    normal: Float[np.ndarray, "E 3"],
) -> Float[np.ndarray, "E 3"]:
    """How far from nodes two rigid bodies touch [m]; what is round all over has no edges."""
    edged = scene.matter.edged
    first, second = (edged[b] * look.mean[slot] for b, slot in zip(pair, slots, strict=True))
    return contact.touching_offset(first, second, normal, scene.problem.cell)


def _liquid_contacts(
    scene: ContactScene, look: NodeSamples, pair: tuple[int, int], slots: tuple[np.ndarray, np.ndarray]
) -> PossibleContacts | None:
    """Contacts of a liquid with a rigid body that says where liquids touch it; None: another pair.

    Its walls may be thinner than a cell, and its corners concave: its surface says how high a node lies over it, and
    which way it looks.
    """
    for rigid_side, liquid_side in ((0, 1), (1, 0)):
        surface = scene.wetted(pair[rigid_side])
        if surface is not None and scene.pours(pair[liquid_side]):
            break
    else:
        return None
    cell, slot = scene.problem.cell, slots[liquid_side]
    node, mean = scene.grid.index[slot] * cell, look.mean[slot]
    face = contact.wetted_faces(surface, node, node + mean, cell)
    k, out = face.node, face.outward
    liquid, layer = pair[liquid_side], None
    if scene.sticks(liquid, pair[rigid_side]):
        gap = contact.gap_to_surface(mean[k], face.height, -out, cell)
        layer = scene.layer(liquid, slot[k], mean[k], face.height, -out)
    else:
        full = scene.full(liquid, slot)[k]
        gap = contact.gap_of_liquid(mean[k], face.height, -out, full, cell)
    normal = out if rigid_side == 0 else -out
    movers = scene.mover_of_slot(slots[0][k]), scene.mover_of_slot(slots[1][k])
    slips = face.height > WALL_REACH * cell
    return PossibleContacts(pair, *movers, node[k], normal, gap, slips, layer)


def _thin_there(scene: ContactScene, pair: tuple[int, int], node: Float[np.ndarray, "E 3"]) -> Bool[np.ndarray, " E"]:
    """Tell at which nodes rigid bodies meet where one is thin, though not as a whole."""
    there = np.zeros(len(node), dtype=bool)
    if all(scene.is_rigid(body) and len(scene.surface(body)) for body in pair):
        for body in pair:
            places = scene.thin_places(body)
            there |= contact.sees_thin_place(places, node, NODE_SIGHT_DX * scene.problem.cell)
    return there


def _surface_gap(
    scene: ContactScene,
    look: NodeSamples,
    pair: tuple[int, int],
    slots: tuple[np.ndarray, np.ndarray],
    normal: Float[np.ndarray, "E 3"],
) -> Float[np.ndarray, " E"]:
    """Open distance where more is known of a surface than what nodes see of a half space [m].

    Of a shell it is the spread of its vertices. Of a rigid body it is its surface points where it is thin: as a whole,
    or between two rigid bodies there, and between two that are bounded by flat faces.
    """
    cell, node = scene.problem.cell, scene.grid.index[slots[0]] * scene.problem.cell
    found: list[np.ndarray | None] = []
    for body, slot, way in zip(pair, slots, (-normal, normal), strict=True):
        if scene.is_shell(body):
            found.append(-look.shell_spread(scene, slot).face(-way, cell)[0])
            continue
        points = scene.surface(body) if scene.is_rigid(body) else np.zeros((0, 3))
        limits = SURFACE_SEARCH_RADIUS_DX * cell, NODE_SIGHT_DX * cell
        shown = len(points) > 0
        found.append(contact.surface_begins(points, node, way, *limits) if shown else None)
    first, second = found
    if first is None and second is not None:
        return contact.gap_to_thin(look.mean[slots[0]], second, normal, cell)
    if first is not None and second is None:
        return contact.gap_to_thin(look.mean[slots[1]], first, -normal, cell)
    return np.asarray(first) + np.asarray(second)


def _wall_contacts(scene: ContactScene, look: NodeSamples, pair: tuple[int, int], slot: np.ndarray) -> PossibleContacts:
    """Contacts of a field with a plane, on nodes."""
    field, wall = pair
    cell, bodies = scene.problem.cell, len(scene.problem.bodies)
    normal = np.tile(-np.array(scene.problem.planes[wall].normal), (len(slot), 1))
    height, layer = _height(scene, slot, wall), None
    if scene.sticks(field, bodies + wall):
        layer = scene.layer(field, slot, look.mean[slot], height, normal)
    if scene.slides(field, wall):
        full = scene.full(field, slot)
        gap = contact.gap_of_liquid(look.mean[slot], height, normal, full, cell)
    elif scene.is_shell(field):
        face, deviation = look.shell_spread(scene, slot).face(normal, cell)
        above = (height > WALL_REACH * cell) & (deviation > MAX_LAYER_DEVIATION_DX * cell)
        gap = np.where(above, np.inf, height - face)
    else:
        gap = contact.gap_to_wall(look.mean[slot], height, normal, cell)
    point = scene.grid.index[slot] * cell
    there = np.full(len(slot), scene.wall_mover + wall)
    movers = scene.mover_of_slot(slot)
    slips = (height > WALL_REACH * cell) & (not scene.is_shell(field))
    return PossibleContacts((field, bodies + wall), movers, there, point, normal, gap, slips, layer)
