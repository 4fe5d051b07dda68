"""Merging of two filled scenes."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from corporeal.core.types import MaterialField, Particles, Parts, PlantRoot, Scene
from corporeal.scene.fractured_scene import FilledScene
from corporeal.scene.vessel_contents import SceneWithMaterials


def merge_filled_scenes(
    here: FilledScene, there: FilledScene, friction: Float[np.ndarray, "K1 K1"], restitution: Float[np.ndarray, "K1 K1"]
) -> FilledScene:
    """Return one filled scene of two, at the first one's grid spacing and under its forces.

    Args:
        here: What is simulated.
        there: What joins it, filled with the same grid spacing; its names are not taken.
        friction: Of the parts of both, in this order, and the floor; see ``MaterialField``.
        restitution: The same.
    """
    a, b = here.whole, there.whole
    whole = SceneWithMaterials(
        _merged_scene(a.scene, b.scene), _merged_parts(a, b), _merged_field(a.field, b.field, friction, restitution)
    )
    return FilledScene(whole, _merged_particles(here, there.particles))


def shift_filled_scene(filled: FilledScene, shift: Float[np.ndarray, "3"]) -> FilledScene:
    """Return a filled scene that begins elsewhere [m]."""
    whole, particles = filled.whole, filled.particles
    surfaces = tuple(replace(s, vertices=s.vertices + shift) for s in whole.scene.surfaces)
    scene = replace(whole.scene, surfaces=surfaces)
    moved = replace(
        particles,
        position=particles.position + shift,
        surface=particles.surface + shift,
        wetted_point=particles.wetted_point + shift,
        roots=tuple(_shifted_root(root, shift) for root in particles.roots),
    )
    return FilledScene(SceneWithMaterials(scene, whole.parts, whole.field), moved)


def _shifted_root(root: PlantRoot, shift: Float[np.ndarray, "3"]) -> PlantRoot:
    x, y, z = (np.array(root.point) + shift).tolist()
    return replace(root, point=(x, y, z))


def _merged_scene(a: Scene, b: Scene) -> Scene:
    objects, finishes = len(a.objects), len(a.finishes)
    more = (replace(s, object=s.object + objects, finish=s.finish + finishes) for s in b.surfaces)
    return replace(
        a, objects=(*a.objects, *b.objects), surfaces=(*a.surfaces, *more), finishes=(*a.finishes, *b.finishes)
    )


def _merged_parts(a: SceneWithMaterials, b: SceneWithMaterials) -> Parts:
    objects, parts = len(a.scene.objects), len(a.parts.catalogue)
    own, more = a.parts, b.parts
    part = np.where(more.part_of_point >= 0, more.part_of_point + parts, -1)
    return replace(
        own,
        object_of_point=np.append(own.object_of_point, more.object_of_point + objects),
        part_of_point=np.append(own.part_of_point, part),
        confidence=np.append(own.confidence, more.confidence),
        catalogue=(*own.catalogue, *(replace(entry, object=entry.object + objects) for entry in more.catalogue)),
    )


def _merged_field(a: MaterialField, b: MaterialField, friction: np.ndarray, restitution: np.ndarray) -> MaterialField:
    """Existing pairs keep their coefficients, which may be annotated."""
    friction, restitution = friction.copy(), restitution.copy()
    old = [*range(len(a.materials)), len(friction) - 1]
    friction[np.ix_(old, old)], restitution[np.ix_(old, old)] = a.friction, a.restitution
    none = ((),)
    return replace(
        a,
        materials=a.materials + b.materials,
        structures=a.structures + b.structures,
        words=a.words + b.words,
        friction=friction,
        restitution=restitution,
        pieces=(a.pieces or none * len(a.materials)) + (b.pieces or none * len(b.materials)),
    )


def _merged_particles(here: FilledScene, b: Particles) -> Particles:
    a, whole = here.particles, here.whole
    objects, parts, count = len(whole.scene.objects), len(whole.parts.catalogue), a.count
    rows = ("position", "velocity", "volume", "density", "surface", "curvature", "face")
    rows += ("wetted_point", "wetted_normal")
    both = {name: np.concatenate([getattr(a, name), getattr(b, name)]) for name in rows}
    for name in ("object", "object_of_surface", "object_of_wetted"):
        both[name] = np.append(getattr(a, name), getattr(b, name) + objects)
    both["part"] = np.append(a.part, b.part + parts)
    both["particle_of_face"] = np.append(a.particle_of_face, b.particle_of_face + count)
    if len(a.rate) or len(b.rate):
        both["rate"] = np.append(_particle_rates(a), _particle_rates(b))
    roots = (replace(r, object=r.object + objects, part=r.part + parts) for r in b.roots)
    lists = ("treatments", "mass_real", "fills", "walls")
    return replace(a, roots=(*a.roots, *roots), **both, **{name: getattr(a, name) + getattr(b, name) for name in lists})


def _particle_rates(particles: Particles) -> Float[np.ndarray, " P"]:
    return particles.rate if len(particles.rate) else np.zeros(particles.count)
