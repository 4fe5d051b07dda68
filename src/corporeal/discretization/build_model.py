"""Build the simulation problem from a scene filled with particles."""

from dataclasses import dataclass
from itertools import combinations
from math import pi, sqrt
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from corporeal.core.types import Discretization, Law, Material, MaterialField, Particles, Scene, Wall
from corporeal.discretization.filled_shells import acting_material
from corporeal.discretization.impact_restitution import restitutions_at_impact
from corporeal.discretization.layered_sheets import part_proportions
from corporeal.discretization.rolling_resistance import rolling_resistance_lengths
from corporeal.geometry.connected_components import connected_components
from corporeal.geometry.scene_transforms import underside_centre
from corporeal.mpm.physics.body_distance import pair_gaps
from corporeal.mpm.problem import (
    FLOOR,
    NO_WIND_FACES,
    Body,
    Joint,
    Plane,
    Problem,
    Shell,
    Tether,
    WettedSurface,
    WindFaces,
)

ZERO_VELOCITY = (0.0, 0.0, 0.0)
GRAVITY_RAMP_S = 0.1
"""Time over which gravity grows where everything starts at rest in contact [s]."""
SAME_INCLUSION_DISTANCE_CELLS = 1.5
"""Rigid material of one object nearer than this [cells] belongs to one frame."""


@dataclass(frozen=True)
class ModelMapping:
    """A problem, and how its particles are ordered."""

    problem: Problem
    order: Int[np.ndarray, " P"]
    """Number in ``Particles`` of each particle of the problem: body after body."""
    rigid: Bool[np.ndarray, " B"]
    object_of_body: Int[np.ndarray, " B"]


def build_model(
    scene: Scene, particles: Particles, field: MaterialField, contact: Literal["multi", "single"] = "multi"
) -> ModelMapping:
    """Build the problem that an engine solves.

    One body per object, in the scene's order; an object with rigid inclusions gives its soft body and then each
    inclusion.
    """
    pieces = divide_into_pieces(particles, len(scene.objects))
    bodies = tuple(build_body(scene, particles, field, piece) for piece in pieces)
    weights = part_surface_weights(particles, pieces)
    footing = footing_weights(particles, pieces, weights)
    bounces = restitutions_at_impact(field, particles.treatments, part_proportions(particles, field))

    def averaged(table: np.ndarray) -> np.ndarray:
        return add_wall_rows(average_pair_table(table, weights, footing), len(scene.walls))

    problem = Problem(
        bodies=bodies,
        cell=particles.cell,
        friction=averaged(field.friction),
        restitution=averaged(bounces.restitution),
        restitution_law=np.stack([averaged(column) for column in np.moveaxis(bounces.laws, -1, 0)], axis=-1),
        planes=(FLOOR, *(plane_of_wall(w) for w in scene.walls)),
        gravity=scene.gravity,
        gravity_ramp=GRAVITY_RAMP_S if starts_settled(scene, particles) else 0.0,
        contact=contact,
        bonds=tuple((k, p.soft) for k, p in enumerate(pieces) if p.soft >= 0),
        joints=plant_joints(particles, pieces),
        excluded_pairs=never_touching_pieces(pieces),
        rolling_resistance=rolling_resistance_lengths(
            bodies, [field.materials[int(share.argmax())] for share in weights], field.floor, 1 + len(scene.walls)
        ),
    )
    return ModelMapping(
        problem,
        np.concatenate([p.members for p in pieces]),
        np.array([p.rigid for p in pieces]),
        np.array([p.object for p in pieces]),
    )


@dataclass(frozen=True)
class BodyPiece:
    """What becomes one body: an object, or of a mixed object what is soft or one rigid inclusion."""

    object: int
    rigid: bool
    members: Int[np.ndarray, " N"]
    """Numbers of its particles."""
    surface: Int[np.ndarray, " S"]
    """Numbers of its surface points."""
    soft: int = -1
    """Piece that a frame holds; -1: no frame."""
    holder: int = -1
    """Piece that foliage hangs on; -1: no foliage."""


def divide_into_pieces(particles: Particles, objects: int) -> list[BodyPiece]:
    """Take mixed objects apart into what is soft and its rigid inclusions."""
    stiff = np.array([t.kind == "rigid" for t in particles.treatments])[particles.part]
    pieces: list[BodyPiece] = []
    leafy = np.array([t.kind == "foliage" for t in particles.treatments])[particles.part]
    for k in range(objects):
        mine = np.flatnonzero(particles.object == k)
        points = np.flatnonzero(particles.object_of_surface == k)
        if leafy[mine].any():
            pieces += divide_plant(particles, k, mine[leafy[mine]], len(pieces))
            continue
        if stiff[mine].all() or not stiff[mine].any():
            pieces.append(BodyPiece(k, bool(stiff[mine[0]]), mine, points))
            continue
        soft, inclusion = len(pieces), mine[stiff[mine]]
        pieces.append(BodyPiece(k, False, mine[~stiff[mine]], points[:0]))
        found = label_rigid_inclusions(
            particles.position[inclusion], particles.surface[points], SAME_INCLUSION_DISTANCE_CELLS * particles.cell
        )
        pieces += [
            BodyPiece(k, True, inclusion[found.of_particle == c], points[found.of_point == c], soft)
            for c in range(found.of_particle.max() + 1)
        ]
    return pieces


@dataclass(frozen=True)
class RigidInclusionLabels:
    """Which rigid inclusion what belongs to."""

    of_particle: Int[np.ndarray, " N"]
    of_point: Int[np.ndarray, " S"]
    """Of the surface."""


def label_rigid_inclusions(
    position: Float[np.ndarray, "N 3"], surface: Float[np.ndarray, "S 3"], reach: float
) -> RigidInclusionLabels:
    """Return which frame each rigid particle and each surface point belongs to.

    Surfaces join too: a wire has few particles, far apart, on a coarse grid.

    Args:
        position: Of the particles [m].
        surface: Of the points [m].
        reach: What is nearer hangs together [m].
    """
    label = label_clusters(np.concatenate([position, surface]), reach)
    filled, joined = np.unique(label[: len(position)], return_inverse=True)
    owner = nearest_label(position, surface, joined) if len(surface) else np.zeros(0, dtype=np.int64)
    known = np.isin(label[len(position) :], filled)
    owner[known] = np.searchsorted(filled, label[len(position) :][known])
    return RigidInclusionLabels(joined, owner)


def divide_plant(particles: Particles, number: int, crown: Int[np.ndarray, " N"], first: int) -> list[BodyPiece]:
    """Take a plant apart: pot and soil, the wood that stands in it where it does, leaves.

    Args:
        particles: All of the scene's.
        number: Which object.
        crown: Numbers of its leaves' particles.
        first: How many pieces there are already.
    """
    mine = np.flatnonzero(particles.object == number)
    points = np.flatnonzero(particles.object_of_surface == number)
    rest = np.setdiff1d(mine, crown)
    wood = [r.part for r in particles.roots if r.object == number]
    swings = np.isin(particles.part[rest], wood).astype(np.int64)
    owner = nearest_label(particles.position[rest], particles.surface[points], swings)
    found = [BodyPiece(number, True, rest[swings == c], points[owner == c]) for c in np.unique(swings)]
    holder = first + len(found) - 1
    return [*found, BodyPiece(number, False, crown, points[:0], holder=holder)]


def label_clusters(points: Float[np.ndarray, "N 3"], reach: float) -> Int[np.ndarray, " N"]:
    """Label the groups of points that hang together over distances below ``reach`` [m]."""
    pairs = KDTree(points).query_pairs(reach, output_type="ndarray")
    return connected_components(pairs[:, 0], pairs[:, 1], len(points))


def nearest_label(
    points: Float[np.ndarray, "N 3"], asked: Float[np.ndarray, "S 3"], label: np.ndarray
) -> Int[np.ndarray, " S"]:
    """Label of the point nearest to each asked one."""
    return label[KDTree(points).query(asked)[1]]


def plant_joints(particles: Particles, pieces: list[BodyPiece]) -> tuple[Joint, ...]:
    """Let the wood of plants rock in its soil."""
    found = []
    for root in particles.roots:
        second = next(k for k, p in enumerate(pieces) if particles.part[p.members[0]] == root.part)
        found.append(Joint(second - 1, second, root.point, root.stiffness, root.damping))
    return tuple(found)


def never_touching_pieces(pieces: list[BodyPiece]) -> tuple[tuple[int, int], ...]:
    """Pieces of one plant, which never touch one another."""
    plants = {p.object for p in pieces if p.holder >= 0}
    pairs = combinations([k for k, p in enumerate(pieces) if p.object in plants], 2)
    return tuple((a, c) for a, c in pairs if pieces[a].object == pieces[c].object)


def build_body(scene: Scene, particles: Particles, field: MaterialField, piece: BodyPiece) -> Body:
    """One body with the simulated numbers of its parts."""
    mine = piece.members
    part = particles.part[mine]
    whole = particles.position[particles.object == piece.object]
    # One particle alone is as wide as the cube that it stands for.
    extent = max(float(np.ptp(whole, axis=0).max()), float(np.cbrt(particles.volume[mine].max())))
    acted = zip(field.materials, field.structures, particles.treatments, strict=True)
    rows = [constitutive_numbers(acting_material(m, s, t), t, extent) for m, s, t in acted]
    column = {name: np.array([row[name] for row in rows])[part] for name in rows[0]}
    obj = scene.objects[piece.object]
    return Body(
        name=obj.name,
        position=particles.position[mine].astype(float),
        velocity=particles.velocity[mine].astype(float),
        volume=particles.volume[mine].astype(float),
        density=particles.density[mine].astype(float),
        law=column["law"].astype(np.int64),
        rigid=piece.rigid,
        surface=particles.surface[piece.surface].astype(float),
        curvature=piece_curvature(particles, piece),
        wetted_surface=piece_wetted_surface(particles, piece),
        push=obj.push,
        wind=obj.wind,
        faces=exposed_piece_faces(particles, mine) if obj.wind is not None else NO_WIND_FACES,
        tether=leaf_tethers(particles, field, piece),
        path=obj.path,
        pivot=ZERO_VELOCITY if obj.path is None else underside_centre(scene, piece.object),
        shell=piece_shell(particles, mine, column) if not piece.rigid else None,
        **{name: values for name, values in column.items() if name != "law"},
    )


def piece_shell(
    particles: Particles, mine: Int[np.ndarray, " N"], column: dict[str, Float[np.ndarray, " N"]]
) -> Shell | None:
    """Return the thin shells among some particles, numbered among them; ``mine`` rises. None: there are none.

    Args:
        particles: All of the scene's.
        mine: Numbers of a body's particles.
        column: Its constitutive numbers, of each of these.
    """
    own = np.isin(particles.shell_triangle, mine).all(axis=1)
    if not own.any():
        return None
    triangle = np.searchsorted(mine, particles.shell_triangle[own])
    first = triangle[:, 0]
    treatment = [particles.treatments[k] for k in particles.part[mine[first]].tolist()]
    shell = {name: column[name][first] for name in ("poisson", "hardening", "loss", "vibration")}
    return Shell(
        triangle=triangle,
        thickness=particles.shell_thickness[own].astype(float),
        law=column["law"][first].astype(np.int64),
        young_pa=np.array([t.bending_young_pa for t in treatment]),
        membrane_young_pa=column["young_pa"][first],
        yield_stress=np.array([t.yield_stress or 0.0 for t in treatment]),
        **shell,
    )


def piece_curvature(particles: Particles, piece: BodyPiece) -> Float[np.ndarray, "S2 Columns"]:
    """Return how its surface curves at a piece's surface points; none: it is not known."""
    known = len(particles.curvature) == len(particles.surface)
    return particles.curvature[piece.surface if known else []].astype(float)


def piece_wetted_surface(particles: Particles, piece: BodyPiece) -> WettedSurface | None:
    """Return where liquids touch an object that is rigid all through; None: there are none."""
    own = particles.object_of_wetted == piece.object
    if not piece.rigid or not own.any():
        return None
    return WettedSurface(particles.wetted_point[own].astype(float), particles.wetted_normal[own].astype(float))


def leaf_tethers(particles: Particles, field: MaterialField, piece: BodyPiece) -> Tether | None:
    """Put leaves on their stalks; ζ is half the loss factor."""
    if piece.holder < 0:
        return None
    loss = field.materials[particles.part[piece.members[0]]].loss
    return Tether(piece.holder, particles.rate[piece.members].astype(float), 0.5 * loss)


def exposed_piece_faces(particles: Particles, mine: Int[np.ndarray, " N"]) -> WindFaces:
    """Faces that some particles show to the air, numbered among them; ``mine`` rises."""
    own = np.isin(particles.particle_of_face, mine)
    bearer = np.searchsorted(mine, particles.particle_of_face[own])
    return WindFaces(area=particles.face[own].astype(float), particle=bearer)


def constitutive_numbers(material: Material, treatment: Discretization, extent: float) -> dict[str, float]:
    """Constitutive numbers of one part; what the treatment scaled, scales its companions.

    The hardening modulus is a stiffness and follows E; cohesion is a strength and follows √(E_sim/E), as the yield
    stress does.
    """
    softer, leafy = treatment.simulated_young_pa / treatment.young_pa, treatment.kind == "foliage"
    return {
        "law": float(Law.COROTATED.value if leafy else material.law.value),
        "young_pa": treatment.simulated_young_pa,
        "poisson": treatment.poisson,
        "yield_stress": treatment.yield_stress or 0.0,
        "hardening": material.hardening * softer,
        "friction_angle": material.friction_angle or 0.0,
        "cohesion": (material.cohesion or 0.0) * sqrt(softer),
        "consistency": material.thickness_of_flow,
        "flow_index": material.flow_index,
        "loss": treatment.loss,
        "vibration": treatment.vibration or slowest_vibration_rad_s(treatment, extent),
    }


def slowest_vibration_rad_s(treatment: Discretization, extent: float) -> float:
    """ω₀ = π √(μ/ρ)/L [rad/s]: the fundamental of a free bar of the object's length in shear."""
    shear = treatment.simulated_young_pa / (2 * (1 + treatment.poisson))
    return pi * sqrt(shear / treatment.density) / extent


def part_surface_weights(particles: Particles, pieces: list[BodyPiece]) -> Float[np.ndarray, "B K"]:
    """Share of each part in its body's surface [-], taken as volume^(2/3)."""
    parts = len(particles.treatments)
    volume = np.stack([np.bincount(particles.part[p.members], particles.volume[p.members], parts) for p in pieces])
    area = volume ** (2 / 3)
    return area / area.sum(axis=1, keepdims=True)


def footing_weights(
    particles: Particles, pieces: list[BodyPiece], weights: Float[np.ndarray, "B K"]
) -> Float[np.ndarray, "B K"]:
    """Share of each part in the lowest cell of its body [-]: what meets the floor."""
    share = np.zeros_like(weights)
    for b, piece in enumerate(pieces):
        mine = piece.members
        height = particles.position[mine, 2]
        low = mine[height <= height.min() + particles.cell]
        np.add.at(share[b], particles.part[low], particles.volume[low])
    return share / share.sum(axis=1, keepdims=True)


def average_pair_table(
    table: Float[np.ndarray, "K+1 K+1"], weights: Float[np.ndarray, "B K"], footing: Float[np.ndarray, "B K"]
) -> Float[np.ndarray, "B+1 B+1"]:
    """Average a table over parts into one over bodies and the floor."""
    between = weights @ table[:-1, :-1] @ weights.T
    floor = footing @ table[:-1, -1]
    corner = np.array([[table[-1, -1]]])
    value = np.block([[between, floor[:, None]], [floor[None, :], corner]])
    return 0.5 * (value + value.T)


def add_wall_rows(table: Float[np.ndarray, "B1 B1"], walls: int) -> Float[np.ndarray, "BW BW"]:
    """Give every wall the floor's row and column, which come last."""
    planes = np.minimum(np.arange(len(table) + walls), len(table) - 1)
    return table[np.ix_(planes, planes)]


def plane_of_wall(wall: Wall) -> Plane:
    """Return a wall as engines know it."""
    return Plane(wall.normal, float(np.dot(wall.normal, wall.point)))


def starts_settled(scene: Scene, particles: Particles) -> bool:
    """Whether nothing moves, is pushed or blown, and every object stands on something.

    Then gravity grows over a tenth of a second: switched on at once it would set off vibrations
    in which bodies hop by less than a grid cell.
    """
    # prescribed paths set the time of motion
    moving = np.abs(particles.velocity).max(initial=0.0) > 0.0
    if moving or any(o.push or o.wind for o in scene.objects):
        return False
    return len(standing_objects(scene, particles)) == len(scene.objects)


def standing_objects(scene: Scene, particles: Particles) -> set[int]:
    """Objects that stand on the floor or follow a path, or on what does: within half a cell."""
    near = 0.5 * particles.cell
    bodies = [particles.position[particles.object == b] for b in range(len(scene.objects))]
    gap, _ = pair_gaps(bodies, particles.cell)
    found = {b for b, x in enumerate(bodies) if x[:, 2].min() < near}
    found |= {b for b, thing in enumerate(scene.objects) if thing.path is not None}
    while True:
        carried = {b for b in range(len(bodies)) for a in found if b not in found and gap[a, b] < near}
        if not carried:
            return found
        found |= carried
