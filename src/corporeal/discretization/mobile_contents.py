"""Movable contents of vessels, as objects of their own (decision 34)."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corporeal.core.types import (
    MaterialField,
    PartDescription,
    Parts,
    Scene,
    SceneObject,
    Structure,
    Surface,
    VesselContents,
)
from corporeal.discretization.fill_level import PouredBody, fill_to_volume
from corporeal.discretization.filled_shells import NEARLY_FULL_FRACTION
from corporeal.discretization.mesh_measures import MeasuredObject
from corporeal.discretization.part_model import infer_part_model
from corporeal.materials.contact_pairs import combine_friction
from corporeal.materials.default_appearance import default_finish
from corporeal.mpm.laws import CONSTITUTIVE_LAWS


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
    scene: Scene,
    parts: Parts,
    field: MaterialField,
    anatomies: Sequence[MeasuredObject],
    seed: int,
) -> tuple[VesselContents, ...]:
    """Return what moves in vessels, each as an object of its own.

    The vessel's push acts on all that it was to move: its wall is pushed as much harder. A mass
    that its file states is shared out.

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


def _contents_object(
    vessel: SceneObject, name: str, lies: PouredBody, mass: float, rest: float
) -> SceneObject:
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
