"""Vessels with something loose in them: what it becomes, and where liquids touch what is rigid."""

from dataclasses import replace

import numpy as np

from corporeal.core.types import Contents, MaterialField, Particles, Parts, Scene
from corporeal.discretization.bedded import all_bedded
from corporeal.discretization.hollowed import all_hollowed
from corporeal.discretization.poured import moving, pour
from corporeal.discretization.resolution import Bodies
from corporeal.discretization.scene_survey import examine
from corporeal.discretization.sizes import in_scene, scale_of_part
from corporeal.discretization.wetted import wetted_points
from corporeal.mpm.laws import MENU


def pour_out(scene: Scene, parts: Parts, field: MaterialField, seed: int) -> tuple[Contents, ...]:
    """Return what moves in vessels that it does not fill; the field's lengths are real ones."""
    if not moving(field):
        return ()
    life = in_scene(field, scale_of_part(scene, parts))
    anatomies = all_bedded(all_hollowed(examine(scene, parts, seed), life), life)
    return pour(scene, parts, life, anatomies, seed)


def in_vessels(parts: Parts, field: MaterialField) -> set[tuple[int, int]]:
    """Objects that hold something, each with every object that may be that."""
    owners = [part.object for part in parts.catalogue]
    held = [owners[k] for k, s in enumerate(field.structures) if s.holds]
    loose = [owners[k] for k, m in enumerate(field.materials) if MENU[m.law].loose]
    return {(min(a, b), max(a, b)) for a in held for b in loose}


def wetted(particles: Particles, bodies: Bodies, seed: int) -> Particles:
    """Cover rigid objects with points where liquids touch them, if there is a liquid."""
    if not any(MENU[m.law].liquid for m in bodies.field.materials):
        return particles
    points, normals = [np.zeros((0, 3))], [np.zeros((0, 3))]
    owner = [np.zeros(0, np.int64)]
    for number, anatomy in enumerate(bodies.anatomies):
        if any(particles.treatments[m.part].kind != "rigid" for m in anatomy.members):
            continue
        rng = np.random.default_rng([seed, number, 7])
        found, normal = wetted_points(anatomy, bodies.makes, particles.cell, rng)
        points.append(found)
        normals.append(normal)
        owner.append(np.full(len(found), number))
    return replace(
        particles,
        wetted=np.concatenate(points),
        wetted_normal=np.concatenate(normals),
        object_of_wetted=np.concatenate(owner),
    )
