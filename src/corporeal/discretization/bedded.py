"""Objects whose loose matter fills what holds it, although only its surface is drawn."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Int

from corporeal.core.types import MaterialField, Parts, Scene
from corporeal.discretization.anatomy import Build
from corporeal.discretization.bed import Bed, bed_of
from corporeal.discretization.extent import oriented_size
from corporeal.discretization.survey import Anatomy, Member, assembled
from corporeal.geometry.mesh import Mesh, joined, openness
from corporeal.geometry.shape import Shape
from corporeal.mpm.laws import MENU

SEED = 9
"""Of the probes of an object with a bed."""


def loose_parts(field: MaterialField) -> set[int]:
    """Parts of grains or of a liquid, which lie over no air."""
    return {k for k, m in enumerate(field.materials) if MENU[m.law].loose}


def all_bedded(anatomies: Sequence[Anatomy], field: MaterialField) -> list[Anatomy]:
    """Let the loose matter of every object fill what holds it.

    Args:
        anatomies: One per object.
        field: What all is made of, with walls as thick as in the scene.

    """
    loose = loose_parts(field)
    return [bedded(a, beds_of(a, field, loose)) for a in anatomies]


def beds_of(anatomy: Anatomy, field: MaterialField, loose: Collection[int]) -> dict[int, Bed]:
    """Find the bed of each part of loose matter that has one."""
    found = {m.part: bed_of(anatomy, m, field) for m in anatomy.members if m.part in loose}
    return {part: bed for part, bed in found.items() if bed is not None}


def bedded(anatomy: Anatomy, beds: Mapping[int, Bed]) -> Anatomy:
    """Put beds in place of what is drawn of them.

    What is drawn stays a face of the object where it closes it; all other parts stay as they are: a
    bed takes up air.
    """
    if not beds:
        return anatomy
    starts = len(anatomy.vertices) + np.cumsum([0, *(len(b.mesh.vertices) for b in beds.values())])
    vertices = np.concatenate([anatomy.vertices, *(b.mesh.vertices for b in beds.values())])
    body = {
        part: Mesh(vertices, bed.mesh.triangles + start)
        for (part, bed), start in zip(beds.items(), starts, strict=False)
    }
    faces, of_face = _without(anatomy, body)
    triangles = np.concatenate([faces, *(m.triangles for m in body.values())])
    shape = Shape(Mesh(vertices, triangles))
    added = [np.full(len(m.triangles), part) for part, m in body.items()]
    alone = [
        _as_bed(m, beds[m.part].holder, body[m.part], shape) if m.part in body else m
        for m in anatomy.members
    ]
    of_triangle = np.concatenate([of_face, *added])
    return assembled(vertices, shape, of_triangle, alone, np.random.default_rng(SEED))


def _without(
    anatomy: Anatomy, parts: Collection[int]
) -> tuple[Int[np.ndarray, "T 3"], Int[np.ndarray, " T"]]:
    """Return the faces of an object, and whose they are, less those of parts that close nothing."""
    if anatomy.shape is None:
        return np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
    mesh, of_face = anatomy.shape.mesh, anatomy.part_of_triangle
    for part in parts:
        rest = mesh.only(of_face != part)
        if not len(rest.triangles) or openness(rest) <= openness(mesh):
            mesh, of_face = rest, of_face[of_face != part]
    return mesh.triangles, of_face


def _as_bed(member: Member, holder: int, body: Mesh, shape: Shape) -> Member:
    return replace(
        member,
        body=body,
        sheet=body.only(np.zeros(len(body.triangles), dtype=bool)),
        closed=True,
        build=Build.BODY,
        volume=0.0,
        size=oriented_size(body.corners.reshape(-1, 3)),
        whole=shape,
        drawn=joined([member.body, member.sheet]),
        holder=holder,
    )


def how_bedded(member: Member, parts: Parts) -> str:
    """Say in words what loose matter fills; "" where it is as it is drawn."""
    if member.drawn is None:
        return ""
    return f": it fills {parts.catalogue[member.holder].name} below its surface"


def loose_sheets(
    scene: Scene, parts: Parts, anatomies: Sequence[Anatomy], field: MaterialField
) -> tuple[str, ...]:
    """Warn of loose matter of which only a surface is drawn, and that nothing holds."""
    loose = loose_parts(field)
    found = [m for a in anatomies for m in a.members if m.part in loose and m.volume == 0]
    return tuple(
        f"{scene.objects[parts.catalogue[m.part].object].name}: {parts.catalogue[m.part].name} of "
        f"{field.materials[m.part].name} is drawn as an open sheet, and nothing of the same object "
        "holds it: how deep it is, and so its mass, is a guess. Model its body, or what it lies in."
        for m in found
    )
