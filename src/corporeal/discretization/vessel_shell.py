"""Open ware from pictures as a shell along its outside, with the thickness of its wall.

Unseen hollows are reconstructed as a lump or as a roof over the rim; such ware would hold nothing.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool
from scipy.spatial import KDTree
from skimage.measure import label

from corporeal.core.types import MaterialField
from corporeal.discretization.fill_level import sample_isosurface
from corporeal.discretization.mesh_kind import MeshKind
from corporeal.discretization.mesh_measures import MeasuredObject, measure_assembled, oriented_box_size
from corporeal.discretization.open_vessel_sheet import find_vessel_outside
from corporeal.discretization.part_model import infer_structure, is_unseen_open_vessel, part_specification
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh

MAX_GRID_POINTS_ALONG_SIDE, MAX_SHELL_GRID_POINTS = 128, 300_000
"""Points of the grid along the longest side, and in all, at most."""
MIN_WALL_GRID_STEPS = 2.0
"""Steps of the grid that a wall is thick at least: a thinner one would have holes."""
OUTSIDE_VOTES_COUNT = 9
"""Places that say together whether a triangle is outside."""
SHELL_PROBE_SEED = 11
"""Of the places and probes that are asked."""


def hollow_all_vessels(anatomies: Sequence[MeasuredObject], field: MaterialField) -> list[MeasuredObject]:
    """Leave of open ware from pictures what lies along its outside, if it is drawn as a lump.

    What shows a wall with two faces keeps them.

    Args:
        anatomies: One per object.
        field: What all is made of, with walls as thick as in the scene.
    """
    return [_hollow_vessel(a, field) for a in anatomies]


def _hollow_vessel(anatomy: MeasuredObject, field: MaterialField) -> MeasuredObject:
    if anatomy.shape is None or len(anatomy.members) != 1:
        return anatomy
    member = anatomy.members[0]
    piece = part_specification(member.part, field)
    if member.build is not MeshKind.BODY or not is_unseen_open_vessel(member, piece.words):
        return anatomy
    thickness = infer_structure(member, piece).thickness
    body = vessel_shell_surface(anatomy.shape, member.body, thickness)
    if not len(body.triangles):
        return anatomy
    shape = QueryMesh(body)
    emptied = replace(
        member,
        body=body,
        sheet=body.only(np.zeros(len(body.triangles), dtype=bool)),
        closed=True,
        build=MeshKind.WALL,
        volume=0.0,
        size=oriented_box_size(body.corners.reshape(-1, 3)),
        whole=shape,
        measured=min(member.outer_sheet, member.volume / thickness),
    )
    of_face = np.full(len(body.triangles), member.part)
    rng = np.random.default_rng(SHELL_PROBE_SEED)
    return measure_assembled(body.vertices, shape, of_face, [emptied], rng)


def vessel_shell_surface(shape: QueryMesh, part: Mesh, thickness: float) -> Mesh:
    """Return the surface of what lies no deeper than a wall [m] below the outside of open ware.

    Places of a grid are asked how deep they lie in the material and how far they are from the outside; where the lesser
    of depth and what is left of the wall changes its sign it is meshed (``pouring.meshed``). Bubbles that nothing leads
    into are filled, crumbs are left out.
    """
    outer = _outside_triangles(shape, part)
    corners = part.corners.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = high - low
    step = max(float(size.max()) / MAX_GRID_POINTS_ALONG_SIDE, float(np.prod(size) / MAX_SHELL_GRID_POINTS) ** (1 / 3))
    wall = max(thickness, MIN_WALL_GRID_STEPS * step)
    counts = np.ceil(size / step).astype(int) + 5
    start = low - 2 * step
    grid = start + step * np.stack(np.indices(counts), axis=-1).reshape(-1, 3)
    left = np.full(len(grid), -step)
    if len(outer.triangles):
        reach = wall + 2 * step
        near = QueryMesh(outer).may_be_within(reach, grid)
        left[near] = wall - QueryMesh(outer).closest(grid[near])[0]
    some = left > -step
    depth = shape.closest(grid[some])[0]
    left[some] = np.minimum(left[some], np.where(shape.inside(grid[some]), depth, -depth))
    field = left.reshape(counts)
    field = np.where(_enclosed_voids(field <= 0), step, field)
    if field.max() <= 0:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    field = np.where(_loose_crumbs(field > 0), -step, field)
    # A surface right through a place of the grid would touch itself there.
    return sample_isosurface(np.where(np.abs(field) < 1e-3 * step, -1e-3 * step, field), step, start)


def _outside_triangles(shape: QueryMesh, part: Mesh) -> Mesh:
    """Return the triangles that lie on the outside: as most places that are near do, alike."""
    found = find_vessel_outside(shape, part, np.random.default_rng(SHELL_PROBE_SEED))
    scale = 0.1 * part.extent
    tree = KDTree(np.hstack([found.points, scale * found.normals]))
    centres = np.hstack([part.corners.mean(axis=1), scale * part.normals])
    return part.only(found.counts[tree.query(centres, k=OUTSIDE_VOTES_COUNT)[1]].mean(axis=1) > 0.5)


def _enclosed_voids(empty: Bool[np.ndarray, "X Y Z"]) -> Bool[np.ndarray, "X Y Z"]:
    """Return which empty places are shut off from the corner of the grid."""
    number = np.asarray(label(empty, connectivity=1))
    return empty & (number != number[0, 0, 0])


def _loose_crumbs(matter: Bool[np.ndarray, "X Y Z"]) -> Bool[np.ndarray, "X Y Z"]:
    """Return which places of material are none of its largest piece."""
    number = np.asarray(label(matter, connectivity=1))
    return matter & (number != 1 + np.argmax(np.bincount(number.ravel())[1:]))
