"""Movable contents of vessels, as objects of their own (decision liquids-walls-and-vessels)."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from corporeal.core.types import (
    MaterialField,
    PartDescription,
    Particles,
    Parts,
    Scene,
    SceneObject,
    Structure,
    Surface,
    VesselContents,
)
from corporeal.discretization.cavity import is_vessel
from corporeal.discretization.choose_resolution import MeasuredScene
from corporeal.discretization.fill_level import PouredBody, fill_to_volume
from corporeal.discretization.filled_shells import NEARLY_FULL_FRACTION
from corporeal.discretization.granular_bed_objects import fill_all_beds
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart, measure_objects
from corporeal.discretization.object_scaling import field_in_scene_scale, part_scales
from corporeal.discretization.part_model import PartModel, infer_part_model
from corporeal.discretization.vessel_shell import hollow_all_vessels
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.point_sampling import poisson_disk_subset, sample_surface
from corporeal.materials.contact_pairs import combine_friction
from corporeal.materials.default_appearance import default_finish
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

WETTED_SPACING_CELLS = 0.4
"""Distance of neighbours [cells]: a face that is nearly flat within a cell is known to a
hundredth of it."""
DARTS_PER_POINT = 8
"""Samples thrown for each point that is kept, about."""
MAX_SAMPLED_WETTED_POINTS = 60_000


def sample_wetted_points(
    anatomy: MeasuredObject, makes: Mapping[int, PartModel], cell: float, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
    """Cover all faces of an object's material, the inside of a wall that is drawn by its outside too.

    Args:
        anatomy: The object.
        makes: How each part is made.
        cell: dx [m].
        rng: Source of the samples.

    Returns:
        Points [m] and unit normals out of the material.
    """
    faces = [f for m in anatomy.members for f in part_wetted_faces(m, makes[m.part])]
    area = sum(float(mesh.areas.sum()) for mesh, _, _ in faces)
    distance = max(WETTED_SPACING_CELLS * cell, float(np.sqrt(0.69 * area / MAX_SAMPLED_WETTED_POINTS)))
    points, normals = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for mesh, depth, side in faces:
        count = int(
            np.clip(DARTS_PER_POINT * mesh.areas.sum() / distance**2, 50, DARTS_PER_POINT * MAX_SAMPLED_WETTED_POINTS)
        )
        found, triangle = sample_surface(mesh, count, rng)
        normal = mesh.normals[triangle]
        order = rng.permutation(len(found))
        found, normal = found[order] - depth * normal[order], side * normal[order]
        kept = poisson_disk_subset(found, distance)
        points.append(found[kept])
        normals.append(normal[kept])
    return np.concatenate(points), np.concatenate(normals)


def part_wetted_faces(member: MeasuredPart, made: PartModel) -> list[tuple[Mesh, float, float]]:
    """Faces of a part: a mesh, how deep below it each lies [m], and 1 or -1: which way it looks."""
    found: list[tuple[Mesh, float, float]] = []
    if len(member.body.triangles):
        found.append((member.body, 0.0, 1.0))
        if made.thickness > 0 and not made.modelled and not is_vessel(member):
            found.append((member.body, made.thickness, -1.0))
    if len(member.sheet.triangles):
        half = 0.5 * made.sheet
        found += [(member.sheet, -half, 1.0), (member.sheet, half, -1.0)]
    return found


def contents_move(structure: Structure) -> bool:
    """Whether what is behind a wall flows and has the room to."""
    inner = structure.contents
    if inner is None or structure.inflated or not structure.loose:
        return False
    return CONSTITUTIVE_LAWS[inner.law].loose and 0.0 < structure.fill < NEARLY_FULL_FRACTION


def mobile_content_parts(field: MaterialField) -> list[int]:
    """Parts whose contents move; where several objects share a mesh none do."""
    shared = [bool(p) for p in field.pieces] or [False] * len(field.structures)
    return [k for k, s in enumerate(field.structures) if contents_move(s) and not shared[k]]


def pour_contents(
    scene: Scene, parts: Parts, field: MaterialField, anatomies: Sequence[MeasuredObject], seed: int
) -> tuple[VesselContents, ...]:
    """Return what moves in vessels, each as an object of its own.

    The vessel's push acts on all that it was to move: its wall is pushed as much harder. A mass that its file states is
    shared out.

    Args:
        scene: Without them.
        parts: Which part is whose.
        field: What all is made of, with walls as thick as in the scene.
        anatomies: One per object.
        seed: Of all random numbers.
    """
    found: list[VesselContents] = []
    things, own = list(scene.objects), [m.friction for m in field.materials]
    for k in mobile_content_parts(field):
        number = parts.catalogue[k].object
        anatomy = anatomies[number]
        makes = {
            m.part: infer_part_model(anatomy, m, field, np.random.default_rng([seed, m.part, 5]))
            for m in anatomy.members
        }
        member = next(m for m in anatomy.members if m.part == k)
        load, inner = makes[k].held, field.structures[k].contents
        if load is None or inner is None:
            continue
        volume = load.room * field.structures[k].fill
        lies = fill_to_volume(anatomy, member, makes[k].thickness, volume)
        if lies is None:
            continue
        mass = inner.density * volume
        rest = sum(m.mass for m in makes.values()) - load.mass
        things[number] = holder = _emptied_vessel(things[number], mass, rest)
        friction = [combine_friction(inner.friction, mu) for mu in (*own, field.friction[-1, -1])]
        own.append(inner.friction)
        found.append(
            VesselContents(
                vessel=number,
                wall=k,
                holder=holder,
                thing=_contents_object(scene.objects[number], inner.name, lies, mass, rest),
                surface=_contents_surface(inner.name, lies),
                finish=default_finish(inner.name),
                material=inner,
                words=_contents_words(inner.name, field.words[k]),
                friction=np.array(friction),
            )
        )
    return tuple(found)


def _emptied_vessel(vessel: SceneObject, mass: float, rest: float) -> SceneObject:
    """Return a vessel without its contents, of which ``rest`` [kg] is left."""
    push = vessel.push
    if push is not None and rest > 0:
        x, y, z = (a * (1.0 + mass / rest) for a in push.acceleration)
        push = replace(push, acceleration=(x, y, z))
    stated = None if vessel.mass is None else vessel.mass * rest / (rest + mass)
    return replace(vessel, push=push, mass=stated)


def _contents_object(vessel: SceneObject, name: str, lies: PouredBody, mass: float, rest: float) -> SceneObject:
    extent = float(np.ptp(lies.mesh.vertices, axis=0).max())
    return SceneObject(
        name=f"{vessel.name}_{name}",
        class_name=name.replace("_", " "),
        real_extent=extent / vessel.scale,
        scale=vessel.scale,
        velocity=vessel.velocity,
        source=vessel.source,
        sized_by=vessel.sized_by,
        mass=None if vessel.mass is None else vessel.mass * mass / (rest + mass),
    )


def _contents_surface(name: str, lies: PouredBody) -> Surface:
    return Surface(name, 0, 0, lies.mesh.vertices, lies.mesh.triangles)


def _contents_words(name: str, wall: PartDescription) -> PartDescription:
    return PartDescription(
        name=name,
        material=name,
        structure="solid",
        answered_by=wall.built_by,
        margin=wall.margin,
        reason=f"Contents of {wall.name}: {wall.reason}" if wall.reason else "",
    )


def pour_loose_contents(scene: Scene, parts: Parts, field: MaterialField, seed: int) -> tuple[VesselContents, ...]:
    """Return what moves in vessels that it does not fill; the field's lengths are real ones."""
    if not mobile_content_parts(field):
        return ()
    life = field_in_scene_scale(field, part_scales(scene, parts))
    anatomies = fill_all_beds(hollow_all_vessels(measure_objects(scene, parts, seed), life), life)
    return pour_contents(scene, parts, life, anatomies, seed)


def vessels_with_contents(parts: Parts, field: MaterialField) -> set[tuple[int, int]]:
    """Objects that hold something, each with every object that may be that."""
    owners = [part.object for part in parts.catalogue]
    held = [owners[k] for k, s in enumerate(field.structures) if s.holds]
    loose = [owners[k] for k, m in enumerate(field.materials) if CONSTITUTIVE_LAWS[m.law].loose]
    return {(min(a, b), max(a, b)) for a in held for b in loose}


def add_wetted_points(particles: Particles, bodies: MeasuredScene, seed: int) -> Particles:
    """Cover rigid objects with points where liquids touch them, if there is a liquid."""
    if not any(CONSTITUTIVE_LAWS[m.law].liquid for m in bodies.field.materials):
        return particles
    points, normals = [np.zeros((0, 3))], [np.zeros((0, 3))]
    owner = [np.zeros(0, np.int64)]
    for number, anatomy in enumerate(bodies.anatomies):
        if any(particles.treatments[m.part].kind != "rigid" for m in anatomy.members):
            continue
        rng = np.random.default_rng([seed, number, 7])
        found, normal = sample_wetted_points(anatomy, bodies.makes, particles.cell, rng)
        points.append(found)
        normals.append(normal)
        owner.append(np.full(len(found), number))
    return replace(
        particles,
        wetted_point=np.concatenate(points),
        wetted_normal=np.concatenate(normals),
        object_of_wetted=np.concatenate(owner),
    )
