"""Fill every part with material points: solids, walls and sheets, with their true masses."""

import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import (
    CURVATURE_COLUMNS,
    Discretization,
    Material,
    MaterialField,
    Particles,
    Parts,
    Scene,
    with_text,
)
from corporeal.discretization.choose_resolution import MeasuredScene, SimulationAccuracy, choose_resolution
from corporeal.discretization.contact_points import sample_contact_points
from corporeal.discretization.discretization_plan import DiscretizationPlan, QualityPreset
from corporeal.discretization.exposed_surface import exposed_faces
from corporeal.discretization.foliage import weigh_bulk_foliage, with_plant_springs
from corporeal.discretization.granular_bed_objects import describe_beds, fill_all_beds, warn_of_loose_sheets
from corporeal.discretization.mesh_measures import (
    MeasuredObject,
    measure_objects,
    refuse_buried_objects,
    refuse_flat_scene,
)
from corporeal.discretization.missing_walls import close_all_missing_walls, describe_missing_wall
from corporeal.discretization.mobile_contents import add_wetted_points, pour_loose_contents, vessels_with_contents
from corporeal.discretization.object_filling import FillRecipe, ObjectFilling, fill_object
from corporeal.discretization.object_masses import (
    scale_to_stated_masses,
    warn_of_implausible_masses,
    warn_of_masses_not_as_named,
    warn_of_thick_walls,
)
from corporeal.discretization.object_scaling import field_in_scene_scale, is_not_life_size, part_scales
from corporeal.discretization.part_model import PartModel, describe_fill, fill_recipe, infer_part_model
from corporeal.discretization.plant_roots import extend_plants_into_ground
from corporeal.discretization.point_masses import remove_mixed_points, warn_of_unmeshed_walls, weigh_points
from corporeal.discretization.rods import Rod, find_rod
from corporeal.discretization.vessel_shell import hollow_all_vessels
from corporeal.geometry.scene_transforms import underside_centre
from corporeal.materials import find_material
from corporeal.mpm.physics.prescribed_motion import start_velocity
from corporeal.pipeline.settings import FillConfig
from corporeal.scene.vessel_contents import add_vessel_contents, vessels_of_contents

DEFAULT_CONFIG = FillConfig()
OBJECT_NUMBER_PATTERN = re.compile(r"Object (\d+) of the scene")
"""Placeholder for an object's name in messages of the discretization."""


def fill(
    scene: Scene,
    parts: Parts,
    field: MaterialField,
    config: FillConfig = DEFAULT_CONFIG,
    quality: QualityPreset | None = None,
) -> Particles:
    """Turn meshes into material points, choosing resolution and discretization.

    A wall is as thick as in reality times the scale of its object.

    Args:
        scene: Scene.
        parts: Which triangles belong to which part.
        field: What every part is made of.
        config: Resolution.
        quality: Resolution instead of that of ``config.detail``.
    """
    # Movable contents become objects.
    contents = pour_loose_contents(scene, parts, field, config.seed)
    scene, parts, field = add_vessel_contents(scene, parts, field, contents).all
    field = field_in_scene_scale(field, part_scales(scene, parts))
    scene, drawn = extend_plants_into_ground(scene, parts, field)
    # Granular material fills its container; hollow parts are closed below soft ones.
    bedded = fill_all_beds(hollow_all_vessels(measure_objects(scene, parts, config.seed), field), field)
    anatomies = close_all_missing_walls(bedded, field)
    # Construction of every part; masses stated in files are kept.
    leaf = find_material("leaf_tissue")
    tissue = leaf.pick(leaf.typical())
    makes = part_models(scene, anatomies, field, tissue, config.seed)
    makes, heavy = scale_to_stated_masses(scene, anatomies, makes)
    refuse_flat_scene(scene, anatomies)
    rods = solid_rods(anatomies, makes, config.seed)
    bodies = MeasuredScene(scene, field, anatomies, makes, rods, vessels_of_contents(scene, contents))
    # Grid spacing and treatments follow from all of it.
    asked = SimulationAccuracy(quality or config.detail, config.stiffness, config.seed, config.walls == "shells")
    bodies, chosen = choose_resolution(bodies, asked)
    refuse_buried_objects(scene, anatomies, chosen.cell)
    # Remove overlaps; volumes and densities add up to the masses.
    together = vessels_with_contents(parts, field)
    packings = remove_mixed_points(pack_objects(bodies, chosen, config.seed), chosen.cell, together)
    particles = add_wetted_points(gather_particles(parts, bodies, chosen, packings), bodies, config.seed)
    doubted = warn_of_implausible_masses(scene, anatomies, particles.mass_real)
    unlike = warn_of_masses_not_as_named(scene, anatomies, particles.mass_real)
    thick = warn_of_thick_walls(scene, anatomies, makes, field)
    notes = (*name_objects(particles.warnings, scene), *drawn, *heavy, *thick, *doubted, *unlike)
    notes += warn_of_loose_sheets(scene, parts, anatomies, field)
    particles = replace(particles, warnings=notes, contents=contents)
    return with_plant_springs(scene, particles, anatomies, field, tissue)


def name_objects(warnings: Iterable[str], scene: Scene) -> tuple[str, ...]:
    """Return sentences with the names of objects in place of their numbers."""
    return tuple(
        with_text(w, OBJECT_NUMBER_PATTERN.sub(lambda found: scene.objects[int(found[1]) - 1].name, w))
        for w in warnings
    )


def part_models(
    scene: Scene, anatomies: list[MeasuredObject], field: MaterialField, tissue: Material, seed: int
) -> dict[int, PartModel]:
    """How each part is made; crowns of leaves from ``tissue``."""
    return {
        m.part: weigh_bulk_foliage(
            infer_part_model(a, m, field, np.random.default_rng([seed, m.part, 5])), a, m, field, tissue, obj.scale
        )
        for obj, a in zip(scene.objects, anatomies, strict=True)
        for m in a.members
    }


def solid_rods(anatomies: list[MeasuredObject], makes: dict[int, PartModel], seed: int) -> dict[int, Rod]:
    """Find solid rods, which are represented by rings of points where they bend."""
    return {
        m.part: rod
        for a in anatomies
        for m in a.members
        if makes[m.part].thickness == 0 and (rod := find_rod(m, np.random.default_rng(seed)))
    }


def pack_objects(bodies: MeasuredScene, chosen: DiscretizationPlan, seed: int) -> list[ObjectFilling]:
    """Place points in every object."""
    packings = []
    for number, anatomy in enumerate(bodies.anatomies):
        recipes = {
            m.part: ring_points(
                fill_recipe(m, bodies.makes[m.part], chosen.treatments[m.part], chosen.cell),
                bodies.rods.get(m.part),
                chosen.treatments[m.part],
                chosen.cell,
            )
            for m in anatomy.members
        }
        rng = np.random.default_rng([seed, number, 1])
        coarse = is_rigid(anatomy, chosen)
        packings.append(fill_object(anatomy, recipes, chosen.cell / 2, rng, coarse=coarse))
    return packings


def ring_points(recipe: FillRecipe, rod: Rod | None, treatment: Discretization, cell: float) -> FillRecipe:
    """Represent a bending rod that is thinner than two cells by rings of points."""
    if rod is None or treatment.kind != "deformable" or rod.diameter >= 2 * cell:
        return recipe
    return replace(recipe, depth=0.0, rod=rod, thick=2 * cell)


def is_rigid(anatomy: MeasuredObject, chosen: DiscretizationPlan) -> bool:
    """Whether the object moves as one rigid body."""
    return all(chosen.treatments[m.part].kind == "rigid" for m in anatomy.members)


def gather_particles(
    parts: Parts, bodies: MeasuredScene, chosen: DiscretizationPlan, packings: list[ObjectFilling]
) -> Particles:
    """Set volumes and densities of points, and contact points of rigid bodies."""
    scene, anatomies, makes = bodies.scene, bodies.anatomies, bodies.makes
    pairs = list(zip(anatomies, packings, strict=True))
    weighed = [weigh_points(a, p, makes, chosen.treatments, chosen.cell) for a, p in pairs]
    surfaces = [contact_surface(a, chosen, number) for number, a in enumerate(anatomies)]
    windward = [wind_faces(scene, k, *pair, chosen.cell) for k, pair in enumerate(pairs)]
    counts = [len(p.points) for p in packings]
    firsts = np.cumsum([0, *counts[:-1]])
    part = np.concatenate([p.part for p in packings])
    return Particles(
        position=np.concatenate([p.points for p in packings]),
        velocity=np.concatenate([initial_velocities(scene, k, p.points) for k, p in enumerate(packings)]),
        volume=np.concatenate([volume for volume, _ in weighed]),
        density=np.concatenate([density for _, density in weighed]),
        object=np.repeat(np.arange(len(packings)), counts),
        part=part,
        cell=chosen.cell,
        treatments=chosen.treatments,
        surface=np.concatenate([points for points, _ in surfaces]),
        object_of_surface=np.repeat(np.arange(len(surfaces)), [len(s) for s, _ in surfaces]),
        curvature=np.concatenate([curvature for _, curvature in surfaces]),
        face=np.concatenate([face for face, _ in windward]),
        particle_of_face=np.concatenate([first + bearer for first, (_, bearer) in zip(firsts, windward, strict=True)]),
        shell_triangle=np.concatenate([first + p.triangle for first, p in zip(firsts, packings, strict=True)]),
        shell_thickness=np.concatenate([p.wall for p in packings]),
        mass_real=tuple(makes[k].mass for k in range(len(parts.catalogue))),
        fills=fill_sentences(parts, bodies, chosen, part),
        walls=tuple((makes[k].thickness, makes[k].sheet) for k in range(len(parts.catalogue))),
        warnings=(*chosen.warnings, *warn_of_unmeshed_walls(packings, makes, chosen.treatments)),
    )


def contact_surface(
    anatomy: MeasuredObject, chosen: DiscretizationPlan, number: int
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 12"]]:
    """Points on the rigid surface of object ``number`` [m], and its curvature."""
    stiff = [m.part for m in anatomy.members if chosen.treatments[m.part].kind == "rigid"]
    if not stiff:
        return np.zeros((0, 3)), np.zeros((0, CURVATURE_COLUMNS))
    outside = anatomy if is_rigid(anatomy, chosen) else anatomy.only(stiff)
    return sample_contact_points(outside, chosen.cell / 3, np.random.default_rng([number, 3]))


def wind_faces(
    scene: Scene, number: int, anatomy: MeasuredObject, packing: ObjectFilling, cell: float
) -> tuple[Float[np.ndarray, "F 3"], Int[np.ndarray, " F"]]:
    """Area vectors of the faces on which wind acts [m²], and the point of the object at each."""
    if scene.objects[number].wind is None:
        return np.zeros((0, 3)), np.zeros(0, np.int64)
    return exposed_faces(anatomy, packing.points, cell / 4)


def initial_velocities(scene: Scene, number: int, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    """Velocity at the start of each point of object ``number`` [m/s]."""
    obj = scene.objects[number]
    if obj.path is not None:
        return start_velocity(obj.path, underside_centre(scene, number), points)
    return np.broadcast_to(np.array(obj.velocity, dtype=np.float64), points.shape)


def fill_sentences(
    parts: Parts, bodies: MeasuredScene, chosen: DiscretizationPlan, part_of_particle: Int[np.ndarray, " P"]
) -> tuple[str, ...]:
    """One sentence per part; a second one where its object is not life-size."""
    members = {m.part: m for a in bodies.anatomies for m in a.members}
    sentences = []
    for k, entry in enumerate(parts.catalogue):
        make, count = bodies.makes[k], int((part_of_particle == k).sum())
        what = describe_fill(members[k], make, chosen.treatments[k], chosen.cell)
        what += describe_beds(members[k], parts) + describe_missing_wall(members[k])
        shared = f" It weighs what its pieces weigh: {'; '.join(make.pieces)}."
        sentences.append(
            f"{entry.name}: {what}; {count:,} particles, {make.mass:.3g} kg."
            + (shared if make.pieces else "")
            + real_size_sentence(make, bodies.scene.objects[entry.object].scale)
        )
    return tuple(sentences)


def real_size_sentence(make: PartModel, scale: float) -> str:
    """Describe what a part weighs at its real size, and how thick its wall is; "" where it has it."""
    if not is_not_life_size(scale):
        return ""
    wall = make.thickness or make.sheet
    thick = f", with a wall {wall / scale * 1e3:.3g} mm thick" if wall else ""
    weighs = f"it weighs {make.mass / scale**3:.3g} kg{thick}"
    return f" At real size, {1 / scale:.3g} times as large, {weighs}."
