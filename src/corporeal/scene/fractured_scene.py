"""Scenes with fragments as objects."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import FractureEvent, MaterialField, Part, Particles, Parts, Scene
from corporeal.scene.vessel_contents import SceneWithMaterials


@dataclass(frozen=True)
class FilledScene:
    """A scene with its material points."""

    whole: SceneWithMaterials
    particles: Particles


def apply_breaks(whole: SceneWithMaterials, particles: Particles, breaks: Sequence[FractureEvent]) -> FilledScene:
    """Return a scene in which every piece of what broke is an object with one part.

    The first piece keeps the object's number and name; the others come after all there are.
    """
    for one in breaks:
        share, objects = piece_mass_fractions(one, particles), len(whole.scene.objects)
        whole = SceneWithMaterials(
            fractured_scene(whole.scene, one, share), _fractured_parts(whole, one), fractured_field(whole.field, one)
        )
        particles = fractured_particles(particles, one, objects)
    return FilledScene(whole, particles)


def piece_mass_fractions(one: FractureEvent, particles: Particles) -> Float[np.ndarray, " N"]:
    """Share of each piece in the mass of the whole [-]."""
    mass = particles.mass[particles.object == one.object]
    return np.bincount(one.piece, mass) / mass.sum()


def fractured_scene(scene: Scene, one: FractureEvent, share: Float[np.ndarray, " N"]) -> Scene:
    """Replace the broken object's surfaces by those of its pieces."""
    thing, count = scene.objects[one.object], len(scene.objects)
    objects = list(scene.objects)
    for k, part in enumerate(share.tolist()):
        mass = None if thing.mass is None else thing.mass * part
        if k == 0:
            objects[one.object] = replace(thing, mass=mass)
        else:
            objects.append(replace(thing, name=f"{thing.name}_piece_{k}", mass=mass))
    kept = [s for s in scene.surfaces if s.object != one.object]
    numbers = [one.object, *range(count, len(objects))]
    pieces = [replace(s, object=n) for s, n in zip(one.surfaces, numbers, strict=True)]
    return replace(scene, objects=tuple(objects), surfaces=(*kept, *pieces))


def _fractured_parts(whole: SceneWithMaterials, one: FractureEvent) -> Parts:
    """Give every piece a part of its own."""
    parts, scene = whole.parts, whole.scene
    sizes = [len(s.triangles) for s in scene.surfaces]
    kept = np.repeat([s.object != one.object for s in scene.surfaces], sizes)
    new = [len(s.triangles) for s in one.surfaces]
    more = len(one.surfaces) - 1
    objects = [one.object, *range(len(scene.objects), len(scene.objects) + more)]
    numbers = [one.part, *range(len(parts.catalogue), len(parts.catalogue) + more)]
    name = parts.catalogue[one.part].name
    return replace(
        parts,
        object_of_point=np.append(parts.object_of_point[kept], np.repeat(objects, new)),
        part_of_point=np.append(parts.part_of_point[kept], np.repeat(numbers, new)),
        confidence=np.append(parts.confidence[kept], np.ones(sum(new))),
        catalogue=(*parts.catalogue, *(Part(name, n, "a piece") for n in objects[1:])),
    )


def fractured_field(field: MaterialField, one: FractureEvent) -> MaterialField:
    """Every piece is of the same material."""
    more, k = len(one.surfaces) - 1, one.part
    return replace(
        field,
        materials=field.materials + (field.materials[k],) * more,
        structures=field.structures + (field.structures[k],) * more,
        words=field.words + (field.words[k],) * more,
        friction=repeat_table_row(field.friction, k, more),
        restitution=repeat_table_row(field.restitution, k, more),
        pieces=field.pieces + ((),) * more if field.pieces else (),
    )


def repeat_table_row(table: Float[np.ndarray, "K1 K1"], k: int, times: int) -> np.ndarray:
    """Give row and column ``k`` so many doubles, before the last ones, which are the floor's."""
    last = len(table) - 1
    rows = [*range(last), *[k] * times, last]
    return table[np.ix_(rows, rows)]


def fractured_particles(particles: Particles, one: FractureEvent, objects: int) -> Particles:
    """Return particles numbered by pieces, after ``objects`` objects; masses are shared out."""
    share = piece_mass_fractions(one, particles)
    count, more = len(particles.treatments), len(share) - 1
    mine, k = np.flatnonzero(particles.object == one.object), one.part
    number, part = particles.object.copy(), particles.part.copy()
    number[mine] = _piece_numbers(one, one.object, objects)
    part[mine] = _piece_numbers(one, k, count)
    mass = [*particles.mass_real, *[particles.mass_real[k]] * more]
    for n, piece in enumerate((k, *range(count, count + more))):
        mass[piece] = particles.mass_real[k] * float(share[n])
    return replace(
        particles,
        object=number,
        part=part,
        treatments=particles.treatments + (particles.treatments[k],) * more,
        mass_real=tuple(mass),
        fills=particles.fills + (particles.fills[k],) * more if particles.fills else (),
        walls=particles.walls + (particles.walls[k],) * more if particles.walls else (),
    )


def _piece_numbers(one: FractureEvent, first: int, others: int) -> Int[np.ndarray, " P"]:
    return np.where(one.piece == 0, first, others + one.piece - 1)
