"""One closed surface for each thing that Gaussians show.

Cameras look at the Gaussians, space is carved by what they see, the floor closes what stands on it,
and where things touch every place inside belongs to the nearer one's Gaussians. Marching cubes
(Lewiner et al. 2003) make a surface of what is left.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array
from scipy.spatial import KDTree
from skimage import measure

from corporeal.errors import UserError
from corporeal.geometry.harmonics import DC
from corporeal.geometry.mesh import Mesh, signed_volume
from corporeal.geometry.shape import Shape
from corporeal.splats.carve import Grid, carved, gridded
from corporeal.splats.crew import Crew
from corporeal.splats.kernels_carve import paint
from corporeal.splats.sight import Sight, looked
from corporeal.types import Camera, Gaussians

Progress = Callable[[float, str], None]

CELLS = 1_000_000
"""Of the grid about each thing, about."""
ROUGH = 200_000
"""Of the grid about everything, where each thing is looked for."""
VOTERS = 4
"""A place belongs to those whose so many nearest Gaussians are nearer in the mean."""
DEEP = 3.0
"""Farther than so many cells from all Gaussians is deep inside."""
CRUMB = 0.02
"""A separate piece with less of the volume is no piece of the thing."""
AWAY = 0.02
"""Vertices stay so many cells away from the middles of cells, so that no triangle is degenerate."""
PASSES, PULLS = 8, (0.5, -0.53)
"""How often the surface is smoothed, and how far vertices go to their neighbours' mean and back."""
CHECKED = 4000
"""Places at which the winding number is compared."""
ASTRAY = 0.01
"""Share of them that may differ."""


@dataclass(frozen=True)
class Solid:
    """A thing's surface: closed, its triangles anticlockwise seen from outside."""

    vertices: Float[np.ndarray, "V 3"]
    """[m]"""
    triangles: Int[np.ndarray, "T 3"]
    colours: Float[np.ndarray, "V 3"]
    """sRGB in [0, 1]."""
    gaussian_of_vertex: Int[np.ndarray, " V"]
    """The nearest of the thing's own."""
    cell: float
    """Of the grid that it was carved from [m]."""
    warnings: tuple[str, ...] = field(default=())
    """What a reader of the report should know, in sentences."""

    @property
    def volume(self) -> float:
        """Inside [m³]."""
        return signed_volume(Mesh(self.vertices, self.triangles))


def solids(
    gaussians: Gaussians,
    object_of_gaussian: Int[np.ndarray, " N"],
    cameras: tuple[Camera, ...],
    floor: float = 0.0,
    threads: int | None = None,
    progress: Progress = lambda fraction, words: None,
) -> tuple[Solid, ...]:
    """Make a solid of each object, 0 to the largest label.

    Args:
        gaussians: Of things and, where there is one, of floor and background.
        object_of_gaussian: -1: floor or background, which hides things but is none.
        cameras: From where the Gaussians were learned, or are looked at: only what these see is
            known.
        floor: Height that nothing is below [m].
        threads: None: one per core that this process may use.
        progress: Told the fraction done and what is going on.

    Raises:
        UserError: An object has no Gaussians, or no camera sees any of it.

    """
    count = int(object_of_gaussian.max(initial=-1)) + 1
    if not count:
        raise UserError("The Gaussians show no object: all are floor or background.")
    lacking = np.setdiff1d(np.arange(count), object_of_gaussian)
    if len(lacking):
        raise UserError(f"No Gaussian belongs to object {lacking[0]}.")
    with Crew(threads) as crew:
        progress(0.0, "looking at the Gaussians")
        sight = looked(gaussians, cameras, crew)
        sight.met[object_of_gaussian[sight.met] < 0] = -1
        scene = _Scene(gaussians, object_of_gaussian, sight, floor)
        survey, made = _surveyed(scene, count, crew), []
        for k in range(count):
            progress((k + 0.5) / (count + 0.5), f"carving object {k + 1} of {count}")
            made.append(_solid(scene, k, survey, crew))
    return tuple(made)


@dataclass(frozen=True)
class _Scene:
    gaussians: Gaussians
    object_of_gaussian: Int[np.ndarray, " N"]
    sight: Sight
    floor: float

    def owner(self, places: Float[np.ndarray, "M 3"]) -> Int[np.ndarray, " M"]:
        """Whose the nearest Gaussian is."""
        return self.object_of_gaussian[KDTree(self.gaussians.mean).query(places)[1]]


@dataclass(frozen=True)
class _Survey:
    """What a rough grid about everything says."""

    grids: tuple[Grid, ...]
    """A fine one about each thing."""
    mesh: Mesh
    """The surface of all things together."""
    owner: Int[np.ndarray, " T"]
    """Of its triangles."""


def _surveyed(scene: _Scene, count: int, crew: Crew) -> _Survey:
    """Find where each thing is on a rough grid, and lay a fine one about it."""
    things = scene.gaussians.mean[scene.object_of_gaussian >= 0]
    low, high = np.percentile(things, (0.1, 99.9), axis=0)
    room = 0.1 * (high - low)
    rough = gridded(low - room, high + room, ROUGH, scene.floor)
    distance = carved(rough, scene.sight, scene.floor, crew)
    places = rough.points(distance < rough.cell)
    owner, grids = scene.owner(places), []
    margin = 1.5 * rough.cell
    for k in range(count):
        found = places[owner == k]
        if not len(found):
            raise _missing(k)
        low, high = found.min(axis=0) - margin, found.max(axis=0) + margin
        grids.append(gridded(low, high, CELLS, scene.floor))
    mesh = _surface(distance, rough)
    middles = mesh.vertices[mesh.triangles].mean(axis=1)
    return _Survey(tuple(grids), mesh, scene.owner(middles))


def _missing(k: int) -> UserError:
    what = f"Nothing solid is found of object {k}"
    return UserError(f"{what}: no camera sees it, or its Gaussians are haze.")


def _solid(scene: _Scene, k: int, survey: _Survey, crew: Crew) -> Solid:
    grid = survey.grids[k]
    distance = carved(grid, scene.sight, scene.floor, crew)
    _share(distance, grid, scene, k, survey)
    warnings = _cleaned(distance)
    if not (distance < 0).any():
        raise _missing(k)
    mesh = _smoothed(_surface(distance, grid), scene.floor)
    mine = np.flatnonzero(scene.object_of_gaussian == k)
    _, nearest = KDTree(scene.gaussians.mean[mine]).query(mesh.vertices)
    gaussian = mine[np.asarray(nearest)]
    return Solid(
        vertices=mesh.vertices,
        triangles=mesh.triangles,
        colours=_coloured(mesh, scene, gaussian, grid.cell, crew),
        gaussian_of_vertex=gaussian,
        cell=grid.cell,
        warnings=(*warnings, *_checked(mesh, distance, grid)),
    )


def _surface(distance: Float[np.ndarray, "X Y Z"], grid: Grid) -> Mesh:
    """Return the surface where distances change sign, closed at the grid's rim."""
    whole = np.pad(distance, 1, constant_values=grid.cell)
    near = AWAY * grid.cell
    whole = np.where(np.abs(whole) < near, np.where(whole < 0, -near, near), whole)
    vertices, triangles, _, _ = measure.marching_cubes(
        whole, 0.0, spacing=(grid.cell,) * 3, gradient_direction="descent"
    )
    vertices = vertices.astype(np.float64) + np.array(grid.low) - grid.cell
    return Mesh(vertices, triangles.astype(np.int64))


def _smoothed(mesh: Mesh, floor: float) -> Mesh:
    """Take the noise of single views off a surface without shrinking it (Taubin 1995).

    What lies on the floor stays on it.
    """
    count, f = len(mesh.vertices), mesh.triangles
    ends = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]).T
    edges = csr_array((np.ones(ends.shape[1]), (ends[0], ends[1])), shape=(count, count))
    mean = edges.multiply(1 / edges.sum(axis=1)[:, None]).tocsr()
    v = mesh.vertices.copy()
    low = v[:, 2] < floor + 1e-9
    for _ in range(PASSES):
        for step in PULLS:
            v += step * (mean @ v - v)
            v[low, 2] = floor
    v[:, 2] = np.maximum(v[:, 2], floor)
    return Mesh(v, f)


def _share(
    distance: Float[np.ndarray, "X Y Z"], grid: Grid, scene: _Scene, k: int, survey: _Survey
) -> None:
    """Leave to others what is theirs.

    Near Gaussians a place belongs to the nearer ones. Deep inside, below the rim of a contact, all
    are as near; there it belongs to whose share of the common surface encloses it more (generalised
    winding number, Jacobson et al. 2013), which spans the rim of the contact by a flat face.
    """
    mean, others = scene.gaussians.mean, scene.object_of_gaussian != k
    low, high = np.array(grid.low), np.array(grid.low) + grid.cell * np.array(grid.shape)
    if not np.all((mean[others] > low) & (mean[others] < high), axis=1).any():
        return
    asked = distance < 2 * grid.cell
    places = grid.points(asked)
    own, other = (_apart(mean[who], places) for who in (~others, others))
    excess = (own - other) / 2
    deep = np.minimum(own, other) > DEEP * grid.cell
    patches = (Shape(survey.mesh.only(who)) for who in (survey.owner == k, survey.owner != k))
    inner, outer = (patch.winding(places[deep]) for patch in patches)
    excess[deep] = grid.cell * (outer - inner)
    distance[asked] = np.maximum(distance[asked], excess)


def _apart(mean: Float[np.ndarray, "N 3"], places: Float[np.ndarray, "M 3"]) -> np.ndarray:
    """Mean distance of places to the nearest few [m]."""
    found, _ = KDTree(mean).query(places, k=min(VOTERS, len(mean)))
    return np.asarray(found).reshape(len(places), -1).mean(axis=1)


def _cleaned(distance: Float[np.ndarray, "X Y Z"]) -> tuple[str, ...]:
    """Remove crumbs that hang in the air; say so where a thing is in pieces."""
    pieces = np.asarray(measure.label(distance < 0, connectivity=1))
    count = int(pieces.max())
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)[1:]
    small = np.flatnonzero(sizes < CRUMB * sizes.sum()) + 1
    gone = np.isin(pieces, small)
    distance[gone] = np.abs(distance[gone])
    left = count - len(small)
    return (f"It was reconstructed in {left} separate pieces.",) if left > 1 else ()


def _coloured(
    mesh: Mesh, scene: _Scene, gaussian: np.ndarray, cell: float, crew: Crew
) -> Float[np.ndarray, "V 3"]:
    """Return what the cameras see of each vertex; where none does, its neighbour's colour."""
    total = np.zeros_like(mesh.vertices)
    for corner in range(3):
        np.add.at(total, mesh.triangles[:, corner], mesh.area_vectors)
    normals = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)
    out = np.empty((len(normals), 4))
    sight = scene.sight
    rest = mesh.vertices, normals, sight.rows, sight.depth, sight.rgb, 2 * cell, out
    crew.each(paint, [(*span, *rest) for span in crew.spans(len(out))])
    seen = out[:, 3] > 1e-3
    colour = np.clip(0.5 + DC * scene.gaussians.sh[gaussian, 0].astype(np.float64), 0, 1)
    colour[seen] = out[seen, :3] / out[seen, 3:]
    if seen.any():
        _, near = KDTree(mesh.vertices[seen]).query(mesh.vertices[~seen])
        colour[~seen] = colour[seen][near]
    return colour


def _checked(mesh: Mesh, distance: Float[np.ndarray, "X Y Z"], grid: Grid) -> tuple[str, ...]:
    """Compare the surface with the cells it was made from, by generalised winding numbers."""
    step = max(1, round(np.cbrt(distance.size / CHECKED)))
    some = np.zeros(distance.shape, bool)
    some[::step, ::step, ::step] = True
    inside = Shape(mesh).winding(grid.points(some)) > 0.5
    astray = np.mean(inside != (distance[some] < 0))
    if astray <= ASTRAY:
        return ()
    return (f"Its surface is not sound: {astray:.1%} of space is on the wrong side of it.",)
