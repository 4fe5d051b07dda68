"""Middle surfaces of thin parts, as triangles of about one size with the true thickness of the wall."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.errors import UserError
from corporeal.discretization.board_junctions import Board, join_boards
from corporeal.discretization.drawn_walls import MAX_WALL_MEDIAN_RATIO, WallThickness, measure_walls, wall_base_faces
from corporeal.discretization.mesh_kind import MeshKind, mesh_kind_of
from corporeal.discretization.mesh_measures import is_nearly_closed, oriented_box_size
from corporeal.geometry.mesh import Mesh, TriangleSurface
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.remeshing import (
    FeaturePatches,
    PatchProjection,
    find_patches,
    fit_to_patches,
    remesh,
    smooth_noise,
    smooth_rim,
    split_long_edges,
    unique_edges,
)
from corporeal.geometry.sliver_removal import without_slivers
from corporeal.geometry.solid_pieces import solid_pieces, weld_solids

MAX_DRAWN_WALL_RATIO = 2.0
"""What is thinner than so many walls has no room between two of them: its mesh draws both faces of one."""
MAX_WALL_WIDTH_FRACTION = 0.3
"""Walls are thinner than this share of the root of the area of a face."""
MIN_OFFSET_DIRECTION_RATIO = 0.03
"""Directions in which normals at a vertex are spread by less, over the greatest, are not offset in [-]."""
MAX_MITRE_RATIO = 3.0
"""Longest way of a vertex at a sharp corner, over half the thickness of the wall."""


MIN_WALL_MEDIAN_RATIO = 0.1
"""No wall is drawn thinner, over its median thickness."""


@dataclass(frozen=True)
class MiddleSurface:
    """Triangles of the middle surface of a thin part, at rest.

    Boards that meet share vertices, and edges there may have three triangles and more. Boards are wound each for
    itself.
    """

    vertices: Float[np.ndarray, "V 3"]
    """[m]"""
    triangles: Int[np.ndarray, "T 3"]
    thickness: Float[np.ndarray, " T"]
    """Of the wall [m]."""


def middle_surface(mesh: TriangleSurface, thickness: float | None, spacing: float) -> MiddleSurface:
    """Return the middle surface of a thin part, with edges of about ``spacing``.

    - An open surface is the sheet itself.
    - A closed surface with room for two walls behind it is a skin: its wall lies inside, and where that leaves no room,
      both sides share what there is.
    - A closed surface that draws both faces of its walls (a board, a cup) lies in the middle between them.
    - Boards that touch or overlap, as separate solids or as one, meet in edges that they share; not where they are as
      many as leaves or pages.

    Creases of more than 40° and rims stay.

    Args:
        mesh: Any triangles; seams are welded, orientation is found.
        thickness: Of the wall [m]; None: as drawn, in a mesh with both faces.
        spacing: Edge length wanted [m].

    Raises:
        UserError: No triangles, what is not finite, no thickness, or a solid that draws no wall.
    """
    _check_input(mesh, thickness, spacing)
    whole = weld_solids(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.triangles, np.int64))
    if not len(whole.triangles):
        raise UserError("The surface of a thin part has no triangle with an area. Repair it or remove the part.")
    piece = solid_pieces(whole)
    boards, sheets, lumps = [], np.zeros(len(piece), dtype=bool), []
    for number in range(piece.max() + 1):
        own = _compact(whole.only(piece == number))
        if not is_nearly_closed(own):
            sheets |= piece == number
            continue
        walls = _closed_piece_boards(own, thickness, spacing)
        boards += walls
        lumps += [] if walls else [own]
    known = thickness or _mean_thickness(boards)
    if not known:
        raise UserError("No thickness is stated for a thin part, and its mesh draws none. State its thickness.")
    boards += [_skin_board(lump, np.inf, spacing) for lump in lumps]
    if sheets.any():
        boards.append(_sheet_board(_compact(whole.only(sheets)), known, spacing))
    return _as_shell(join_boards(boards, spacing))


def _check_input(mesh: TriangleSurface, thickness: float | None, spacing: float) -> None:
    if thickness is not None and not (np.isfinite(thickness) and thickness > 0):
        raise UserError(f"The thickness of a thin part is {thickness} m. Give a positive number.")
    if not (np.isfinite(spacing) and spacing > 0):
        raise UserError(f"The spacing of a thin part's mesh is {spacing} m. Give a positive number.")
    if not len(mesh.triangles):
        raise UserError("The mesh of a thin part has no triangles. Give it a surface or remove the part.")
    if not np.isfinite(np.asarray(mesh.vertices)[np.unique(mesh.triangles)]).all():
        raise UserError("The mesh of a thin part has vertices that are not finite. Repair the mesh.")


def _compact(mesh: Mesh) -> Mesh:
    used, triangles = np.unique(mesh.triangles, return_inverse=True)
    return Mesh(mesh.vertices[used], np.ascontiguousarray(triangles.reshape(-1, 3)))


def _mean_thickness(boards: Sequence[Board]) -> float:
    if not boards:
        return 0.0
    area = np.concatenate([b.mesh.areas for b in boards])
    return float(np.average(np.concatenate([b.thickness for b in boards]), weights=area))


def _as_shell(board: Board) -> MiddleSurface:
    mesh, source = without_slivers(board.mesh)
    return MiddleSurface(mesh.vertices, mesh.triangles, board.thickness[source])


def _sheet_board(sheet: Mesh, thickness: float, spacing: float) -> Board:
    source = find_patches(smooth_noise(sheet, spacing), spacing)
    mesh = fit_to_patches(*remesh(source, spacing)).mesh
    same = np.full(len(mesh.triangles), thickness)
    return Board(mesh, same, same)


def _closed_piece_boards(piece: Mesh, thickness: float | None, spacing: float) -> list[Board]:
    """Return the boards of a closed piece; none: it is solid, and no thickness is known."""
    smooth = smooth_noise(piece, spacing)
    fine = split_long_edges(find_patches(smooth, spacing), spacing)
    shape = QueryMesh(fine.mesh)
    walls = measure_walls(fine.mesh, shape)
    if _draws_both_faces(shape, walls, thickness):
        drawn = _DrawnWall(shape, walls.median, thickness)
        faces = [_compact(fine.mesh.only(face)) for face in wall_base_faces(fine, walls)]
        # What was smoothed is a scan, whose rims are ragged.
        return [_wall_board(f if smooth is piece else smooth_rim(f), drawn, spacing) for f in faces]
    return [] if thickness is None else [_skin_board(smooth, thickness, spacing)]


@dataclass(frozen=True)
class _DrawnWall:
    """A closed mesh that draws both faces of a wall."""

    shape: QueryMesh
    median: float
    """Distance between its faces [m]."""
    thickness: float | None
    """Stated [m]."""


def _draws_both_faces(shape: QueryMesh, walls: WallThickness, thickness: float | None) -> bool:
    thin = walls.median < MAX_WALL_WIDTH_FRACTION * np.sqrt(0.5 * shape.mesh.areas.sum())
    if not thin or thickness is None or walls.median < MAX_DRAWN_WALL_RATIO * thickness:
        return bool(thin)
    size = oriented_box_size(shape.mesh.vertices)
    return mesh_kind_of(shape, size, np.random.default_rng(0)) is MeshKind.WALL


def _skin_board(skin: Mesh, thickness: float, spacing: float) -> Board:
    """Lay the wall below a closed skin; where it would meet the opposite one each takes half of the room."""
    now, projection = remesh(find_patches(skin, spacing), spacing)
    now = fit_to_patches(now, projection)
    through = _through_at(now, projection, QueryMesh(skin), np.inf)
    room = np.where(np.isfinite(through), 0.5 * through, np.inf)
    wall = np.minimum(thickness, room)
    typical = float(np.median(wall[np.isfinite(wall)])) if np.isfinite(wall).any() else spacing
    wall = np.where(np.isfinite(wall), np.maximum(wall, MIN_WALL_MEDIAN_RATIO * typical), typical)
    return Board(Mesh(_offset_inward(now, 0.5 * wall), now.mesh.triangles), wall, wall)


def _wall_board(face: Mesh, wall: _DrawnWall, spacing: float) -> Board:
    """Move one face of a wall to the middle."""
    now, projection = remesh(find_patches(face, spacing), spacing)
    now = fit_to_patches(now, projection)
    drawn = _smoothed(
        now.mesh, _through_at(now, projection, wall.shape, MAX_WALL_MEDIAN_RATIO * wall.median), wall.median
    )
    made = drawn if wall.thickness is None else np.full(len(drawn), wall.thickness)
    return Board(Mesh(_offset_inward(now, 0.5 * drawn), now.mesh.triangles), made, drawn)


def _through_at(
    now: FeaturePatches, projection: PatchProjection, shape: QueryMesh, most: float
) -> Float[np.ndarray, " T"]:
    """Return how thick what is behind each triangle is [m]; inf: more than ``most``, or nothing."""
    centres = now.mesh.corners.mean(axis=1)
    foot, triangle = projection.onto_patches(centres, now.patch)
    normals = projection.source.mesh.normals[triangle]
    step = 1e-6 * shape.mesh.extent
    through = shape.reach(foot - step * normals, -normals) + step
    return np.where(through <= most, through, np.inf)


def _smoothed(mesh: Mesh, thickness: Float[np.ndarray, " T"], typical: float) -> Float[np.ndarray, " T"]:
    """Give triangles whose thickness is not known that of their neighbours; take out outliers."""
    _, number, count = unique_edges(mesh.triangles)
    order = np.argsort(number.ravel(), kind="stable")
    first = np.concatenate([[0], np.cumsum(count)[:-1]])[count == 2]
    one, other = order[first] // 3, order[first + 1] // 3
    beside = np.full((len(thickness), 4), np.nan)
    beside[:, 3] = np.where(np.isfinite(thickness), thickness, np.nan)
    for _ in range(len(thickness)):
        beside[one, order[first] % 3] = beside[other, 3]
        beside[other, order[first + 1] % 3] = beside[one, 3]
        unknown = np.isnan(beside[:, 3])
        found = unknown & ~np.isnan(beside[:, :3]).all(axis=1)
        if not found.any():
            break
        beside[found, 3] = np.nanmean(beside[found, :3], axis=1)
    beside[np.isnan(beside[:, 3]), 3] = typical
    return np.maximum(np.nanmedian(beside, axis=1), MIN_WALL_MEDIAN_RATIO * typical)


def _offset_inward(now: FeaturePatches, depth: Float[np.ndarray, " T"]) -> Float[np.ndarray, "V 3"]:
    """Move vertices so that all triangles at them lie deeper by their depth [m], mitred at creases."""
    mesh, count = now.mesh, len(now.mesh.vertices)
    areas, normals = mesh.areas, mesh.normals
    outer = areas[:, None, None] * normals[:, :, None] * normals[:, None, :]
    pull = -(areas * depth)[:, None] * normals
    system, right, reach = np.zeros((count, 3, 3)), np.zeros((count, 3)), np.zeros(count)
    for k in range(3):
        np.add.at(system, mesh.triangles[:, k], outer)
        np.add.at(right, mesh.triangles[:, k], pull)
        np.maximum.at(reach, mesh.triangles[:, k], depth)
    value, vector = np.linalg.eigh(system)
    usable = value > MIN_OFFSET_DIRECTION_RATIO * value[:, -1:]
    along = np.einsum("vij,vi->vj", vector, right)
    way = np.einsum("vij,vj->vi", vector, np.where(usable, along / np.where(usable, value, 1.0), 0.0))
    length = np.linalg.norm(way, axis=1)
    way *= np.minimum(1.0, MAX_MITRE_RATIO * reach / np.maximum(length, 1e-300))[:, None]
    return _without_folds(mesh, way)


def _without_folds(mesh: Mesh, way: Float[np.ndarray, "V 3"]) -> Float[np.ndarray, "V 3"]:
    """Shorten the ways of vertices whose triangles would turn over."""
    before = mesh.area_vectors
    for _ in range(8):
        after = Mesh(mesh.vertices + way, mesh.triangles).area_vectors
        folded = np.einsum("ij,ij->i", before, after) < 0.2 * np.einsum("ij,ij->i", before, before)
        folded &= np.einsum("ij,ij->i", before, after) < 0.5 * np.linalg.norm(before, axis=1) * np.linalg.norm(
            after, axis=1
        )
        if not folded.any():
            break
        way = way.copy()
        way[np.unique(mesh.triangles[folded])] *= 0.5
    return mesh.vertices + way
