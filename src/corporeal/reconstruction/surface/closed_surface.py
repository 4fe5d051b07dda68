"""Closed surfaces of objects from Gaussians.

Cameras look at the Gaussians, space is carved by what they see, the floor closes what stands on it, and where objects
touch every place inside belongs to the nearer one's Gaussians. Marching cubes (Lewiner et al. 2003) make a surface of
what is left. Where surfaces of two objects still overlap, both are drawn back to a common face.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from scipy.ndimage import distance_transform_edt
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist
from skimage import measure

from corporeal.core.errors import UserError
from corporeal.core.types import Camera, Gaussians, Note, NoteKind, Views
from corporeal.geometry.connected_components import connected_pieces
from corporeal.geometry.mesh import Mesh, signed_triangle_volumes, signed_volume
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.reconstruction.gaussians.depth_rendering import DepthRendering, render_depth, restrict_depth_to_objects
from corporeal.reconstruction.gaussians.kernels_space_carving import paint_points
from corporeal.reconstruction.gaussians.space_carving import VoxelGrid, carve_signed_distance, grid_over_box
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.surface.ball_opening import open_by_ball
from corporeal.reconstruction.surface.fairing import (
    FLOOR_TOLERANCE_M,
    fair_unobserved_patches,
    neighbour_mean_matrix,
    smooth_taubin,
)
from corporeal.reconstruction.surface.flatten_bumps import flatten_bumps
from corporeal.reconstruction.surface.hull_top import HullTop, lower_hull_top
from corporeal.reconstruction.surface.outline_fitting import find_object_outlines, fit_to_outlines
from corporeal.reconstruction.surface.photo_consistency import AgreedSurface, move_to_agreement, object_photographs
from corporeal.reconstruction.surface.refine_depth import refine_depth
from corporeal.reconstruction.surface.remove_flakes import remove_flakes
from corporeal.reconstruction.surface.separate_overlaps import separate_overlaps
from corporeal.reconstruction.surface.silhouette_guard import restore_silhouettes
from corporeal.reconstruction.surface.surface_config import DEFAULT_CLOSED_SURFACE, ClosedSurfaceConfig

FLOOR_HEIGHT_M = 0.0
"""Height that nothing is below [m]."""
MAX_OBJECT_GRID_CELLS = 4_000_000
"""Where an object is thin."""
WALL_THICKNESS_CELLS = 6.0
"""Cells that its mean wall has then, if so many suffice and none is finer than a pixel."""
OWNER_NEIGHBOURS = 4
"""A place belongs to those whose so many nearest Gaussians are nearer in the mean."""
DEEP_INSIDE_CELLS = 3.0
"""Farther than so many cells from all Gaussians is deep inside."""
MIN_PIECE_VOLUME_FRACTION = 0.02
"""A separate piece with less of the volume is no piece of the object."""
CELL_MIDDLE_CLEARANCE_CELLS = 0.02
"""Vertices stay so many cells away from the middles of cells, so that no triangle is degenerate."""
SMOOTHING_PASSES = 8
"""How often the surface is smoothed."""
OPENING_RADIUS_PX = 4.0
"""Radius of the ball that enters what photographs see into [px]."""
OUTLINE_REFITS = 2
"""How often it is moved to outlines after it was moved to where photographs agree."""
MIN_SEEN_WEIGHT = 1e-3
"""Weight of views from which on a vertex is seen."""
COLOUR_NEIGHBOURS = 500
"""Seen vertices that others are coloured by, about."""
COLOUR_FALLOFF_POWER = 4
"""Power of the distance by which one counts less."""
TINY_EXTENT_FRACTION = 1e-9
"""Shares of the object's extent that can be divided by."""
WINDING_CHECK_PLACES = 4000
"""Places at which the winding number is compared."""
MAX_SURFACE_MOVE_CELLS = 2.0
"""Cells by which a surface may be moved after carving."""
MAX_WINDING_ERROR_FRACTION = 0.01
"""Share of them that may differ."""
CERTAIN_HULL_TOP = HullTop()


@dataclass(frozen=True)
class ClosedSurface:
    """An object's surface: closed, its triangles anticlockwise seen from outside."""

    vertices: Float[np.ndarray, "V 3"]
    """[m]"""
    triangles: Int[np.ndarray, "T 3"]
    colours: Float[np.ndarray, "V 3"]
    """sRGB in [0, 1]."""
    gaussian_of_vertex: Int[np.ndarray, " V"]
    """The nearest of the object's own."""
    cell: float
    """Of the grid that it was carved from [m]."""
    pieces: int = 1
    """How many separate ones it is in."""
    unsound: tuple[str, ...] = ()
    """What is wrong with the surface, in sentences."""
    roof: HullTop = CERTAIN_HULL_TOP
    """What nothing holds of its height."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader of the report should know, in sentences."""
        apart = (f"It was reconstructed in {self.pieces} separate pieces.",)
        return (*apart * (self.pieces > 1), *self.unsound, *self.roof.warnings)

    @property
    def volume(self) -> float:
        """Inside [m³]."""
        return signed_volume(Mesh(self.vertices, self.triangles))


def build_closed_surfaces(
    gaussians: Gaussians,
    object_of_gaussian: Int[np.ndarray, " N"],
    cameras: tuple[Camera, ...],
    masks: Bool[np.ndarray, "V H W"] | None = None,
    views: Views | None = None,
    config: ClosedSurfaceConfig = DEFAULT_CLOSED_SURFACE,
) -> tuple[ClosedSurface, ...]:
    """Make a solid of each object, 0 to the largest label.

    Args:
        gaussians: Of objects and, where there is one, of floor and background.
        object_of_gaussian: -1: floor or background, which hides objects but is none.
        cameras: From where the Gaussians were learned, or are looked at: only what these see is known.
        masks: Pixels of the cameras' pictures that show objects, where given: outlines
            are made to fit them. What Gaussians cover is too coarse for that.
        views: Photographs by these cameras, in any frame of the same unit, where there are some and masks: they may see
            deeper than Gaussians do.
        config: How finely.

    Raises:
        UserError: An object has no Gaussians, or no camera sees any of it.
    """
    count = int(object_of_gaussian.max(initial=-1)) + 1
    if not count:
        raise UserError("The Gaussians show no object: all are floor or background.")
    lacking = np.setdiff1d(np.arange(count), object_of_gaussian)
    if len(lacking):
        raise UserError(f"No Gaussian belongs to object {lacking[0]}.")
    with ThreadPool(config.threads) as pool:
        rendering = render_depth(gaussians, cameras, pool)
        rendering = restrict_depth_to_objects(rendering, object_of_gaussian >= 0, masks)
        shown = None if masks is None else _owner_of_pixels(rendering, object_of_gaussian, masks)
        shallow, rgb = None, None if views is None else views.rgb
        if views is not None and masks is not None:
            shallow, rendering = rendering, refine_depth(rendering, views, masks, pool, config.hull)
        scene = _SurfaceInput(gaussians, object_of_gaussian, rendering, shallow, shown, rgb, FLOOR_HEIGHT_M)
        survey, made = _survey_objects(scene, count, pool, config), []
        for k in range(count):
            made.append(_build_closed_surface(scene, k, survey, pool))
    meshes = [Mesh(one.vertices, one.triangles) for one in made]
    meshes = separate_overlaps(meshes, [one.cell for one in made], FLOOR_HEIGHT_M)
    return tuple(replace(s, vertices=m.vertices) for s, m in zip(made, meshes, strict=True))


@dataclass(frozen=True)
class _SurfaceInput:
    gaussians: Gaussians
    object_of_gaussian: Int[np.ndarray, " N"]
    rendering: DepthRendering
    """As deep as photographs see, where there are some."""
    shallow: DepthRendering | None
    """As deep as Gaussians are; None: there are no photographs."""
    shown: Int[np.ndarray, "V H W"] | None
    """Whose each pixel is; -1: no object's; None: no masks say it."""
    rgb: UInt8[np.ndarray, "V H W 3"] | None
    """Photographs; None: there are none."""
    floor: float

    def owner(self, places: Float[np.ndarray, "M 3"]) -> Int[np.ndarray, " M"]:
        """Whose the nearest Gaussian is."""
        return self.object_of_gaussian[KDTree(self.gaussians.mean).query(places)[1]]


def _owner_of_pixels(
    rendering: DepthRendering, object_of_gaussian: np.ndarray, masks: Bool[np.ndarray, "V H W"]
) -> Int[np.ndarray, "V H W"]:
    """Return whose each pixel is: what only masks give to objects goes with what is next to it."""
    shown = np.where(rendering.met >= 0, object_of_gaussian[rendering.met], -1)
    for own, mask in zip(shown, masks, strict=True):
        if (own >= 0).any():
            nearest = distance_transform_edt(own < 0, return_distances=False, return_indices=True)
            y, x = np.asarray(nearest)
            own[:] = np.where(mask, own[y, x], -1)
    return shown


@dataclass(frozen=True)
class _CoarseSurvey:
    """What a rough grid about everything says."""

    grids: tuple[VoxelGrid, ...]
    """A fine one about each object."""
    mesh: Mesh
    """The surface of all objects together."""
    owner: Int[np.ndarray, " T"]
    """Of its triangles."""


def _survey_objects(scene: _SurfaceInput, count: int, pool: ThreadPool, config: ClosedSurfaceConfig) -> _CoarseSurvey:
    """Find where each object is on a rough grid, and lay a fine one about it."""
    foreground = scene.gaussians.mean[scene.object_of_gaussian >= 0]
    low, high = np.percentile(foreground, (0.1, 99.9), axis=0)
    room = 0.1 * (high - low)
    rough = grid_over_box(low - room, high + room, config.survey_grid_cells, scene.floor)
    distance = carve_signed_distance(rough, scene.rendering, scene.floor, pool)
    places = rough.points(distance < rough.cell)
    owner, grids = scene.owner(places), []
    margin = 1.5 * rough.cell
    for k in range(count):
        found = places[owner == k]
        if not len(found):
            raise _missing_object_error(k)
        low, high = found.min(axis=0) - margin, found.max(axis=0) + margin
        grids.append(grid_over_box(low, high, config.object_grid_cells, scene.floor))
    mesh = _extract_surface(distance, rough)
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    return _CoarseSurvey(tuple(grids), mesh, scene.owner(middles))


def _missing_object_error(k: int) -> UserError:
    return UserError(
        f"Nothing solid is found of object {k + 1}: no camera sees it, or its Gaussians are haze. "
        "Check that masks, if any, show the same object in all photographs; give the number of "
        "objects with --count; or photograph it from more sides."
    )


def _build_closed_surface(scene: _SurfaceInput, k: int, survey: _CoarseSurvey, pool: ThreadPool) -> ClosedSurface:
    grid = survey.grids[k]
    distance, cut, count = _carve_object(grid, scene, k, survey, pool)
    mesh = _extract_surface(distance, grid)
    finer = _finer_grid(mesh, grid, scene, k)
    if finer is not None:
        grid = finer
        distance, cut, count = _carve_object(grid, scene, k, survey, pool)
        mesh = _extract_surface(distance, grid)
    mesh = _remove_specks(mesh)
    contact = cut[*grid.at(mesh.vertices).T]
    mesh, belief = _fit_surface(mesh, scene, k, contact, grid.cell, pool)
    unsound, over = _check_winding(mesh, distance, grid), CERTAIN_HULL_TOP
    if belief is not None:
        rows, shape = scene.rendering.rows, scene.rendering.depth.shape[1:]
        mesh, over = lower_hull_top(mesh, belief, contact, rows, shape, pool)
    mine = np.flatnonzero(scene.object_of_gaussian == k)
    _, nearest = KDTree(scene.gaussians.mean[mine]).query(mesh.vertices)
    gaussian = mine[np.asarray(nearest)]
    return ClosedSurface(
        vertices=mesh.vertices,
        triangles=mesh.triangles,
        colours=_vertex_colours(mesh, scene, gaussian, _painted_vertices(mesh, scene.rendering, grid.cell, pool)),
        gaussian_of_vertex=gaussian,
        cell=grid.cell,
        pieces=count,
        unsound=unsound,
        roof=over,
    )


def _carve_object(
    grid: VoxelGrid, scene: _SurfaceInput, k: int, survey: _CoarseSurvey, pool: ThreadPool
) -> tuple[Float[np.ndarray, "X Y Z"], Bool[np.ndarray, "X Y Z"], int]:
    """Carve an object; return its distance [m], where it meets others, and its pieces."""
    distance = carve_signed_distance(grid, scene.rendering, scene.floor, pool)
    if scene.shallow is not None:
        assert scene.shown is not None
        shallow, mouth = (
            carve_signed_distance(grid, scene.shallow, scene.floor, pool),
            OPENING_RADIUS_PX * _object_pixel_width(scene, k),
        )
        rows = scene.rendering.rows
        distance = restore_silhouettes(shallow, distance, grid, scene.shown == k, rows, pool)
        distance = open_by_ball(shallow, distance, mouth / grid.cell)
    cut = _yield_to_neighbours(distance, grid, scene, k, survey)
    count = _remove_crumbs(distance)
    if not (distance < 0).any():
        raise _missing_object_error(k)
    return distance, cut, count


def _finer_grid(mesh: Mesh, grid: VoxelGrid, scene: _SurfaceInput, k: int) -> VoxelGrid | None:
    """Lay a finer grid close about an object with walls or legs of few cells; None: it has none.

    2 V / A is a plate's thickness, half that of a rod and a third of a ball's diameter. Of what is finer than a pixel
    pictures say nothing: there the surface would only be rough.
    """
    thick = 2 * signed_volume(mesh) / float(mesh.areas.sum())
    finest = max(thick / WALL_THICKNESS_CELLS, _object_pixel_width(scene, k))
    if finest >= grid.cell:
        return None
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    margin = MAX_SURFACE_MOVE_CELLS * grid.cell
    return grid_over_box(low - margin, high + margin, MAX_OBJECT_GRID_CELLS, scene.floor, finest=finest)


def _object_pixel_width(scene: _SurfaceInput, k: int) -> float:
    """Return how wide a pixel is at an object, in the mean [m]."""
    met, rows = scene.rendering.met, scene.rendering.rows
    wide = scene.rendering.depth / rows[:, 12, None, None]
    mine = wide[(met >= 0) & (scene.object_of_gaussian[met] == k)]
    return float(mine.mean()) if len(mine) else np.inf


def _extract_surface(distance: Float[np.ndarray, "X Y Z"], grid: VoxelGrid) -> Mesh:
    """Return the surface where distances change sign, closed at the grid's rim."""
    whole = np.pad(distance, 1, constant_values=grid.cell)
    near = CELL_MIDDLE_CLEARANCE_CELLS * grid.cell
    whole = np.where(np.abs(whole) < near, np.where(whole < 0, -near, near), whole)
    vertices, triangles, _, _ = measure.marching_cubes(
        whole, 0.0, spacing=(grid.cell,) * 3, gradient_direction="descent"
    )
    vertices = vertices.astype(np.float64) + np.array(grid.low) - grid.cell
    return Mesh(vertices, triangles.astype(np.int64))


def _remove_specks(mesh: Mesh) -> Mesh:
    """Leave out what is small and apart: hollows that no camera can see into, and crumbs."""
    piece = connected_pieces(mesh)
    volume = np.abs(np.bincount(piece, signed_triangle_volumes(mesh)))
    kept = mesh.only((volume >= MIN_PIECE_VOLUME_FRACTION * volume.sum())[piece])
    used, triangles = np.unique(kept.triangles, return_inverse=True)
    return Mesh(kept.vertices[used], triangles.reshape(-1, 3))


def _yield_to_neighbours(
    distance: Float[np.ndarray, "X Y Z"], grid: VoxelGrid, scene: _SurfaceInput, k: int, survey: _CoarseSurvey
) -> Bool[np.ndarray, "X Y Z"]:
    """Leave to others what is theirs, and return where that is.

    Near Gaussians a place belongs to the nearer ones. Deep inside, below the rim of a contact, all are as near; there
    it belongs to whose share of the common surface encloses it more (generalised winding number, Jacobson et al. 2013),
    which spans the rim of the contact by a flat face.
    """
    mean, others = scene.gaussians.mean, scene.object_of_gaussian != k
    low, high = np.array(grid.low), np.array(grid.low) + grid.cell * np.array(grid.shape)
    cut = np.zeros(distance.shape, bool)
    if not np.all((mean[others] > low) & (mean[others] < high), axis=1).any():
        return cut
    asked = distance < 2 * grid.cell
    places = grid.points(asked)
    own, other = (_mean_neighbour_distance(mean[who], places) for who in (~others, others))
    excess = (own - other) / 2
    deep = np.minimum(own, other) > DEEP_INSIDE_CELLS * grid.cell
    patches = (QueryMesh(survey.mesh.only(who)) for who in (survey.owner == k, survey.owner != k))
    inner, outer = (patch.winding(places[deep]) for patch in patches)
    excess[deep] = grid.cell * (outer - inner)
    cut[asked] = distance[asked] < excess
    distance[asked] = np.maximum(distance[asked], excess)
    return cut


def _mean_neighbour_distance(mean: Float[np.ndarray, "N 3"], places: Float[np.ndarray, "M 3"]) -> np.ndarray:
    """Mean distance of places to the nearest few [m]."""
    found, _ = KDTree(mean).query(places, k=min(OWNER_NEIGHBOURS, len(mean)))
    return np.asarray(found).reshape(len(places), -1).mean(axis=1)


def _remove_crumbs(distance: Float[np.ndarray, "X Y Z"]) -> int:
    """Remove crumbs that hang in the air; return how many pieces are left."""
    pieces = np.asarray(measure.label(distance < 0, connectivity=1))
    count = int(pieces.max())
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)[1:]
    small = np.flatnonzero(sizes < MIN_PIECE_VOLUME_FRACTION * sizes.sum()) + 1
    gone = np.isin(pieces, small)
    distance[gone] = np.abs(distance[gone])
    return count - len(small)


def _fit_surface(
    mesh: Mesh, scene: _SurfaceInput, k: int, contact: Bool[np.ndarray, " V"], cell: float, pool: ThreadPool
) -> tuple[Mesh, Float[np.ndarray, " V"] | None]:
    """Take noise off a surface, give it the outlines that masks show, and close it where unseen.

    Returns:
        It, and how far photographs know each vertex; None: there are none.
    """
    rendering, mean, belief = scene.rendering, neighbour_mean_matrix(mesh), None
    mesh = smooth_taubin(mesh, scene.floor, SMOOTHING_PASSES, mean)
    seen = _painted_vertices(mesh, rendering, cell, pool)[:, 3] > MIN_SEEN_WEIGHT
    if scene.shown is not None:
        lines = find_object_outlines(scene.shown == k, rendering, cell, pool)
        mesh = fit_to_outlines(mesh, lines, seen, contact, scene.floor, pool)
        if scene.rgb is not None:
            mesh = remove_flakes(mesh, _object_pixel_width(scene, k), scene.floor)
            close = _fit_to_photographs(mesh, scene, k, seen & ~contact, cell, pool)
            belief = close.belief
            lines = replace(lines, rounds=OUTLINE_REFITS)
            again = fit_to_outlines(close.mesh, lines, seen, contact, scene.floor, pool)
            # Where photographs agree outlines, of which faces have none, have nothing to add.
            way = (1 - close.belief)[:, None] * (again.vertices - close.mesh.vertices)
            mesh = replace(again, vertices=close.mesh.vertices + way)
    lies = mesh.vertices[:, 2] < scene.floor + FLOOR_TOLERANCE_M
    still = lies | contact
    return fair_unobserved_patches(mesh, ~(seen | still), still, cell, scene.floor, mean), belief


def _fit_to_photographs(
    mesh: Mesh, scene: _SurfaceInput, k: int, movable: Bool[np.ndarray, " V"], cell: float, pool: ThreadPool
) -> AgreedSurface:
    """Move a surface to where photographs agree, and what stands before that back."""
    assert scene.shown is not None and scene.rgb is not None
    mine, rows = scene.shown == k, scene.rendering.rows
    pictures = object_photographs(scene.rgb, mine, rows, _object_pixel_width(scene, k))
    close = move_to_agreement(mesh, pictures, movable, cell, scene.floor, pool)
    movable = movable & (close.mesh.vertices[:, 2] >= scene.floor + FLOOR_TOLERANCE_M)
    return flatten_bumps(close, movable, pictures.pixel, cell, scene.floor)


def _painted_vertices(mesh: Mesh, rendering: DepthRendering, cell: float, pool: ThreadPool) -> Float[np.ndarray, "V 4"]:
    """Return the sum of what cameras see of each vertex: red, green, blue, and its weight."""
    out = np.empty((len(mesh.vertices), 4))
    rest = (mesh.vertices, mesh.vertex_normals, rendering.rows, rendering.depth, rendering.rgb, 2 * cell, out)
    pool.each(paint_points, [(*span, *rest) for span in pool.spans(len(out))])
    return out


def _vertex_colours(
    mesh: Mesh, scene: _SurfaceInput, gaussian: np.ndarray, painted: Float[np.ndarray, "V 4"]
) -> Float[np.ndarray, "V 3"]:
    """Return what the cameras see of each vertex; where none does, the mean of seen ones about.

    They count by a power of their distance (Shepard 1968): of the nearest alone an underside would be patches.
    """
    seen = painted[:, 3] > MIN_SEEN_WEIGHT
    colour = np.clip(0.5 + SH_DC_COEFFICIENT * scene.gaussians.sh[gaussian, 0].astype(np.float64), 0, 1)
    colour[seen] = painted[seen, :3] / painted[seen, 3:]
    some = np.flatnonzero(seen)[:: max(1, np.count_nonzero(seen) // COLOUR_NEIGHBOURS)]
    if len(some) and not seen.all():
        away = cdist(mesh.vertices[~seen], mesh.vertices[some])
        share = 1 / np.maximum(away, TINY_EXTENT_FRACTION * np.ptp(mesh.vertices)) ** COLOUR_FALLOFF_POWER
        colour[~seen] = share @ colour[some] / share.sum(axis=1, keepdims=True)
    return colour


def _check_winding(mesh: Mesh, distance: Float[np.ndarray, "X Y Z"], grid: VoxelGrid) -> tuple[str, ...]:
    """Compare the surface with the cells it was made from, by generalised winding numbers."""
    step = max(1, round(np.cbrt(distance.size / WINDING_CHECK_PLACES)))
    some = np.zeros(distance.shape, bool)
    some[::step, ::step, ::step] = True
    some &= np.abs(distance) > MAX_SURFACE_MOVE_CELLS * grid.cell  # nearer, the surface was smoothed and fitted
    inside = QueryMesh(mesh).winding(grid.points(some)) > 0.5
    astray = np.mean(inside != (distance[some] < 0))
    if astray <= MAX_WINDING_ERROR_FRACTION:
        return ()
    return (Note(f"Its surface is not sound: {astray:.1%} of space is on the wrong side of it.", NoteKind.GRAVE),)
