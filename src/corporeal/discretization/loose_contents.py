"""Vessels with loose contents, and wetted surfaces."""

from dataclasses import replace

import numpy as np

from corporeal.core.types import MaterialField, Particles, Parts, Scene, VesselContents
from corporeal.discretization.choose_resolution import MeasuredScene
from corporeal.discretization.granular_bed_objects import fill_all_beds
from corporeal.discretization.mobile_contents import mobile_content_parts, pour_contents
from corporeal.discretization.object_scaling import field_in_scene_scale, part_scales
from corporeal.discretization.scene_measures import measure_objects
from corporeal.discretization.vessel_shell import hollow_all_vessels
from corporeal.discretization.wetted_surface import sample_wetted_points
from corporeal.mpm.laws import CONSTITUTIVE_LAWS


def pour_loose_contents(
    scene: Scene, parts: Parts, field: MaterialField, seed: int
) -> tuple[VesselContents, ...]:
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
