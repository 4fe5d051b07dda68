"""Granular beds of objects of which only the surface is drawn."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Int

from corporeal.core.types import MaterialField, Parts, Scene
from corporeal.discretization.granular_bed import GranularBed, find_granular_bed
from corporeal.discretization.mesh_kind import MeshKind
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart, measure_assembled
from corporeal.discretization.oriented_extent import oriented_box_size
from corporeal.geometry.mesh import Mesh, join_meshes, open_edge_ratio
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

BED_PROBE_SEED = 9
"""Of the probes of an object with a bed."""


def loose_matter_parts(field: MaterialField) -> set[int]:
    """Parts of grains or of a liquid, which lie over no air."""
    return {k for k, m in enumerate(field.materials) if CONSTITUTIVE_LAWS[m.law].loose}


def fill_all_beds(
    anatomies: Sequence[MeasuredObject], field: MaterialField
) -> list[MeasuredObject]:
    """Let the granular material of every object fill what holds it.

    Args:
        anatomies: One per object.
        field: What all is made of, with walls as thick as in the scene.

    """
    loose = loose_matter_parts(field)
    return [with_beds(a, find_beds(a, field, loose)) for a in anatomies]


def find_beds(
    anatomy: MeasuredObject, field: MaterialField, loose: Collection[int]
) -> dict[int, GranularBed]:
    """Find the bed of each part of granular material that has one."""
    found = {
        m.part: find_granular_bed(anatomy, m, field) for m in anatomy.members if m.part in loose
    }
    return {part: bed for part, bed in found.items() if bed is not None}


def with_beds(anatomy: MeasuredObject, beds: Mapping[int, GranularBed]) -> MeasuredObject:
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
    faces, of_face = _without_parts(anatomy, body)
    triangles = np.concatenate([faces, *(m.triangles for m in body.values())])
    shape = QueryMesh(Mesh(vertices, triangles))
    added = [np.full(len(m.triangles), part) for part, m in body.items()]
    alone = [
        _part_as_bed(m, beds[m.part].holder, body[m.part], shape) if m.part in body else m
        for m in anatomy.members
    ]
    of_triangle = np.concatenate([of_face, *added])
    return measure_assembled(
        vertices, shape, of_triangle, alone, np.random.default_rng(BED_PROBE_SEED)
    )


def _without_parts(
    anatomy: MeasuredObject, parts: Collection[int]
) -> tuple[Int[np.ndarray, "T 3"], Int[np.ndarray, " T"]]:
    """Return the faces of an object, and whose they are, less those of parts that close nothing."""
    if anatomy.shape is None:
        return np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64)
    mesh, of_face = anatomy.shape.mesh, anatomy.part_of_triangle
    for part in parts:
        rest = mesh.only(of_face != part)
        if not len(rest.triangles) or open_edge_ratio(rest) <= open_edge_ratio(mesh):
            mesh, of_face = rest, of_face[of_face != part]
    return mesh.triangles, of_face


def _part_as_bed(member: MeasuredPart, holder: int, body: Mesh, shape: QueryMesh) -> MeasuredPart:
    return replace(
        member,
        body=body,
        sheet=body.only(np.zeros(len(body.triangles), dtype=bool)),
        closed=True,
        build=MeshKind.BODY,
        volume=0.0,
        size=oriented_box_size(body.corners.reshape(-1, 3)),
        whole=shape,
        drawn=join_meshes([member.body, member.sheet]),
        holder=holder,
    )


def describe_beds(member: MeasuredPart, parts: Parts) -> str:
    """Describe in words what granular material fills; "" where it is as it is drawn."""
    if member.drawn is None:
        return ""
    return f": it fills {parts.catalogue[member.holder].name} below its surface"


def warn_of_loose_sheets(
    scene: Scene, parts: Parts, anatomies: Sequence[MeasuredObject], field: MaterialField
) -> tuple[str, ...]:
    """Warn of granular material of which only a surface is drawn, and that nothing holds."""
    loose = loose_matter_parts(field)
    found = [m for a in anatomies for m in a.members if m.part in loose and m.volume == 0]
    return tuple(
        f"{scene.objects[parts.catalogue[m.part].object].name}: {parts.catalogue[m.part].name} of "
        f"{field.materials[m.part].name} is drawn as an open sheet, and nothing of the same object "
        "holds it: its depth and mass are a guess. Model its volume or its container."
        for m in found
    )
