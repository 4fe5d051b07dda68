"""Masks of the things on a floor, where nobody gave any.

A picture of the bare floor is the median of all views of each spot of it; shadows, which do not
move, are in it. What looks otherwise in a view stands above the floor; so does what has another
colour than the floor around, which a median takes for floor where a thing hides it from all sides.
Of that, only what all views agree on in space is kept (its visual hull), so that backgrounds go.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import (
    binary_closing,
    binary_dilation,
    binary_erosion,
    binary_fill_holes,
    label,
    median_filter,
    zoom,
)

from corporeal.errors import UserError
from corporeal.geometry.region import Region, region
from corporeal.geometry.similarity import moved_cameras
from corporeal.geometry.upright import Stated, upright
from corporeal.splats.crew import Crew
from corporeal.splats.start import Carved, carved
from corporeal.types import Camera, Vector, Views

Masks = Bool[np.ndarray, "V H W"]

SPOTS = 400
"""Along each edge of the square of floor that is looked at."""
REACH = 3.0
"""Half of that edge, in radii of what the cameras look at."""
WITNESSES = 1 / 8
"""Share of the views that must see a spot."""
WIDE = 0.17
"""Side of the patch that tells the floor's colour around a spot, in sides of the square."""
SHRUNK = 4
"""Spots along one of the picture that this is found in."""
NOISE = 10.0
"""Difference from the floor that is none, beside what views of the spot differ by [of 255]."""
TINT = 0.04
"""Difference in colour over brightness from the floor around that is none."""
BRIGHTER, DARKER = 1.07, 0.45
"""Brightness over that of the floor around: shadows are between."""
USUAL = 5.0
"""How far beyond the usual differences of the floor itself all that must be."""
ASTRAY = 0.12
"""Share of the views that may take a place of a thing for floor."""
PROVEN = 0.5
"""Share of a piece's silhouettes that must look other than the floor in front of a known floor."""
LEAST = 2e-5
"""Of the box that is carved: smaller pieces are specks."""
MOST = 0.6
"""Share of the pictures that masks may cover: else there is no floor to speak of."""


@dataclass(frozen=True)
class _Floor:
    """The bare floor as a picture, S × S spots about what the cameras look at."""

    around: Region
    colour: Float[np.ndarray, "S S 3"]
    """Median of the views [0–255]."""
    noise: Float[np.ndarray, "S S"]
    """What they differ by: standard deviation, robustly."""
    known: Bool[np.ndarray, "S S"]
    wide: Float[np.ndarray, "S S 3"]
    """The floor's colour around each spot."""


def cut_out(
    views: Views,
    points: Float[np.ndarray, "N 3"],
    z_up: bool = False,
    stated: Vector | None = None,
    threads: int | None = None,
) -> Masks | None:
    """Return which pixels are on things; None: there is no floor, or nothing differs from it.

    Args:
        views: Of things on a floor, in the file's own frame.
        points: On what is in the pictures, floor and all.
        z_up: Whether the file says that its +z is up.
        stated: What somebody says is up.
        threads: None: one per processor.

    """
    frame = upright(views.cameras, points, z_up, stated=Stated(stated))
    if frame.floor_by != "plane":
        return None
    cameras = moved_cameras(views.cameras, frame.world_from_file)
    with Crew(threads) as crew:
        return _above_floor(Views(views.rgb, cameras), crew)


def _above_floor(views: Views, crew: Crew) -> Masks | None:
    """Return which pixels are on things above the floor, z = 0."""
    floor = _floor(views)
    if not floor.known.any():
        return None
    odd, proven = np.ones(views.rgb.shape[:3], bool), np.zeros(views.rgb.shape[:3], bool)
    for k, camera in enumerate(views.cameras):
        differs, known = _compared(views.rgb[k], camera, floor)
        proven[k] = known & differs
        odd[k] = binary_closing(~known | differs) | ~known | differs
    middle, radius = np.array(floor.around.centre), floor.around.radius
    low, high = middle - radius, middle + radius
    low[2] = 0.0
    try:
        hull = carved(low, np.maximum(high, low + radius), views, odd, crew, ASTRAY)
    except UserError:  # nothing is above the floor in all views
        return None
    masks = _silhouettes(hull, views, odd, proven)
    share = masks.mean()
    return masks if 0 < share < MOST else None


# ---------------------------------------------------------------- the floor


def _floor(views: Views) -> _Floor:
    """Look at the floor from all views."""
    around = region(views.cameras)
    line = ((np.arange(SPOTS) + 0.5) / SPOTS * 2 - 1) * REACH * around.radius
    x, y = np.meshgrid(around.centre[0] + line, around.centre[1] + line, indexing="ij")
    spots = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    colour, noise = np.zeros((len(spots), 3)), np.zeros(len(spots))
    known = np.zeros(len(spots), bool)
    least = max(3.0, WITNESSES * len(views.cameras))
    for start in range(0, len(spots), 4 * SPOTS):
        some = slice(start, start + 4 * SPOTS)
        seen = np.stack(
            [_sampled(p, c, spots[some]) for p, c in zip(views.rgb, views.cameras, strict=True)]
        )
        known[some] = np.isfinite(seen[..., 0]).sum(axis=0) >= least
        seen = np.where(known[some, None], seen, 0)
        colour[some] = np.nanmedian(seen, axis=0)
        noise[some] = 1.4826 * np.nanmedian(np.abs(seen - colour[some]), axis=0).max(axis=-1)
    shape = SPOTS, SPOTS
    picture, known = colour.reshape(*shape, 3), known.reshape(shape)
    return _Floor(around, picture, noise.reshape(shape), known, _widened(picture, known))


def _sampled(picture: np.ndarray, camera: Camera, points: np.ndarray) -> np.ndarray:
    """Return what a picture shows of points, NaN where it does not."""
    pose = camera.world_from_camera
    x, y, depth = camera.K @ ((points - pose[:3, 3]) @ pose[:3, :3]).T
    ahead = np.maximum(depth, 1e-12)
    column, row = np.floor(x / ahead), np.floor(y / ahead)
    seen = (depth > 0) & (column >= 0) & (column < camera.width) & (row >= 0)
    seen &= row < camera.height
    out = np.full((len(points), 3), np.nan, np.float32)
    out[seen] = picture[row[seen].astype(int), column[seen].astype(int)]
    return out


def _widened(picture: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the median of a wide patch about each spot."""
    whole = np.where(known[..., None], picture, np.median(picture[known], axis=0))
    small, side = whole[::SHRUNK, ::SHRUNK], int(WIDE * SPOTS / SHRUNK) | 1
    flat = median_filter(small, size=(side, side, 1))
    return np.asarray(zoom(flat, (SHRUNK, SHRUNK, 1), order=1))[:SPOTS, :SPOTS]


# ---------------------------------------------------------------- one view


def _compared(picture: np.ndarray, camera: Camera, floor: _Floor) -> tuple[np.ndarray, np.ndarray]:
    """Return which pixels look other than the floor behind them, and where that is known."""
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    local = np.linalg.solve(camera.K, np.stack([u.ravel(), v.ravel(), np.ones(u.size)]))
    rays, eye = local.T @ camera.world_from_camera[:3, :3].T, camera.world_from_camera[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        meet = eye[:2] - (eye[2] / rays[:, 2])[:, None] * rays[:, :2]
        place = ((meet - floor.around.centre[:2]) / (REACH * floor.around.radius) + 1) / 2 * SPOTS
    hit = (rays[:, 2] * eye[2] < 0) & (place >= 0).all(axis=1) & (place < SPOTS).all(axis=1)
    i, j = np.where(hit[:, None], place, 0).astype(int).T
    own = picture.reshape(-1, 3).astype(float)
    differs = np.abs(own - floor.colour[i, j]).max(axis=1) > NOISE + 3 * floor.noise[i, j]
    differs |= _strange(own, floor.wide[i, j], floor)
    shape = picture.shape[:2]
    return differs.reshape(shape), (hit & floor.known[i, j]).reshape(shape)


def _strange(own: np.ndarray, wide: np.ndarray, floor: _Floor) -> np.ndarray:
    """Tell what is of another colour than the floor around, or of a brightness no shadow has."""
    tint, light = _tint_and_light(own, wide)
    all_tints, all_lights = _tint_and_light(floor.colour[floor.known], floor.wide[floor.known])
    usual, uneven = np.median(all_tints), np.median(np.abs(all_lights - 1))
    dark = max(0.1, DARKER - USUAL * uneven)
    bright = max(BRIGHTER, 1 + USUAL * uneven)
    return (tint > max(TINT, USUAL * usual)) | (light > bright) | (light < dark)


def _tint_and_light(own: np.ndarray, wide: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    bright, around = own.mean(axis=1), np.maximum(wide.mean(axis=1), 1)
    tint = np.abs(own / np.maximum(bright, 8)[:, None] - wide / around[:, None]).max(axis=1)
    return tint, bright / around


# ---------------------------------------------------------------- all views


def _silhouettes(hull: Carved, views: Views, odd: Masks, proven: Masks) -> Masks:
    """Return where pieces are seen that look other than the floor."""
    found = label(hull.inside)
    assert isinstance(found, tuple)
    piece, cells = found[0][hull.inside], hull.cells[hull.inside]
    count = int(found[1]) + 1
    seen = [_pixels(cells, piece, camera) for camera in views.cameras]
    pixels, sure = np.zeros(count), np.zeros(count)
    for (owner, pixel), flat in zip(seen, proven.reshape(len(proven), -1), strict=True):
        pixels += np.bincount(owner, minlength=count)
        sure += np.bincount(owner, flat[pixel], minlength=count)
    large = np.bincount(piece, minlength=count) >= LEAST * hull.inside.size
    kept = large & (sure > PROVEN * pixels)
    masks = np.zeros_like(odd)
    for k, ((owner, pixel), camera) in enumerate(zip(seen, views.cameras, strict=True)):
        silhouette = np.zeros(odd.shape[1:], bool)
        silhouette.ravel()[pixel[kept[owner]]] = True
        depth = np.linalg.norm(camera.world_from_camera[:3, 3] - cells.mean(axis=0))
        masks[k] = _joined(silhouette, odd[k], 1 + int(hull.side * camera.K[0, 0] / depth))
    return masks


def _joined(silhouette: np.ndarray, odd: np.ndarray, blur: int) -> np.ndarray:
    """Return a silhouette as sharp as the picture.

    blur: the size of a cell of the hull [px]: between cells there are gaps, and what is that near
    to the outline is what it looks like.
    """
    whole = binary_closing(silhouette, iterations=blur)
    near = binary_dilation(whole, iterations=blur)
    within = np.asarray(binary_erosion(whole, iterations=blur + 1), bool)
    return np.asarray(binary_fill_holes((odd & near) | within))


def _pixels(cells: np.ndarray, piece: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return each pixel that shows a piece once: the piece, and the pixel's number."""
    pose = camera.world_from_camera
    x, y, depth = camera.K @ ((cells - pose[:3, 3]) @ pose[:3, :3]).T
    ahead = np.maximum(depth, 1e-12)
    column, row = np.floor(x / ahead), np.floor(y / ahead)
    seen = (depth > 0) & (column >= 0) & (column < camera.width) & (row >= 0)
    seen &= row < camera.height
    size = camera.height * camera.width
    pixel = row[seen].astype(np.int64) * camera.width + column[seen].astype(np.int64)
    both = np.unique(piece[seen] * np.int64(size) + pixel)
    return both // size, both % size
