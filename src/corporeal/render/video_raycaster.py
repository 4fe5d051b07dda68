"""Pictures of a video: one ray a pixel, more at edges, and none where nothing stands.

Most of a video is floor and backdrop: where no ray to sky or sun could meet a box about an object, a pixel keeps the
light of the empty studio, which is cast once for as long as the camera stands still. Where objects are far and hide
only some sky, the sky is asked at the corners of tiles. What is left is seen by one ray a pixel; every fourth pixel
asks for light, and neighbours on one surface share what they found. Where that is not theirs, each pixel asks for
itself. Pixels beside which another surface is seen in another colour are cast again, finer. Nothing hangs on the
picture before: equal input gives equal bytes, and what does not move does not flicker.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, UInt8

from corporeal.core.process_resources import usable_cores
from corporeal.render import (
    kernels_floor,
    kernels_hits,
    kernels_light,
    kernels_sparse_light,
    kernels_video,
    shadow_culling,
)
from corporeal.render.camera_placement import CameraAim
from corporeal.render.embree import (
    MIN_BAND_ROWS,
    PixelBlock,
    PixelPlaces,
    Quality,
    Rays,
    RaySampling,
    RenderJob,
    render_image,
)
from corporeal.render.kernels_floor import NEAR_OBJECT_TILES, TILE_CAST, TILE_PX, TILE_SOFT, TILE_UNTOUCHED
from corporeal.render.kernels_hits import HIT_NOTHING, HitBuffer
from corporeal.render.kernels_light import LIGHT_CHANNELS, SHARP_MIRROR_ROUGHNESS
from corporeal.render.kernels_sparse_light import LIGHT_CHANNELS_PADDED
from corporeal.render.kernels_video import EDGE_SAMPLE_OFFSETS, EDGE_SUPERSAMPLING
from corporeal.render.ray_scene import MAX_TRANSPARENT_LAYERS, RayScene, continue_ray
from corporeal.render.secondary_rays import (
    LIGHT_DEPENDENCE_REACH_PX,
    SHARED_LIGHT_REACH_PX,
    IncomingLight,
    LightSampler,
)


def block_around(near: Bool[np.ndarray, "h w"], block: PixelBlock, reach: int) -> PixelBlock | None:
    """Return the part of a block that holds marked pixels and those within ``reach``."""
    rows, columns = (np.flatnonzero(near.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return None
    top, left = max(rows[0] - reach, 0), max(columns[0] - reach, 0)
    bottom = min(rows[-1] + reach + 1, block.rows)
    right = min(columns[-1] + reach + 1, block.columns)
    return PixelBlock(int(block.first + top), int(bottom - top), int(right - left), int(left))


def block_window(block: PixelBlock, part: PixelBlock) -> tuple[slice, slice]:
    """Rows and columns of a block that a part of it takes."""
    top = part.first - block.first
    return slice(top, top + part.rows), slice(part.left, part.left + part.columns)


def crop_values(values: np.ndarray, block: PixelBlock, part: PixelBlock) -> np.ndarray:
    """Copy what belongs to a part from the values of a block's pixels, (P, ...) or (h, w)."""
    flat = values.ndim < 2 or values.shape != (block.rows, block.columns)
    trailing = values.shape[1:] if flat else ()
    there = values.reshape(block.rows, block.columns, *trailing)[block_window(block, part)].copy()
    return there.reshape(-1, *trailing) if flat else there


LIGHT_FILTER_REACH_PX = 7
"""Pixels over which the light filter spreads what one of them met."""
HALO_TILES = NEAR_OBJECT_TILES + 1 + -(-LIGHT_DEPENDENCE_REACH_PX // TILE_PX)
"""Tiles above and below a band that what is seen in it hangs on."""
EMPTY_HALO_TILES = -(-SHARED_LIGHT_REACH_PX // TILE_PX)
"""The same of the empty studio; where nothing is hidden it is not computed again."""
EMPTY_BAND_TILES = 24
"""Tiles of the empty studio that are cast at once: its memory is that of a part of the picture."""
TEXTURE_FILTER_PX = 0.65
"""Pixels that textures are filtered over: their pyramid's levels are blurred as they are."""


@dataclass(frozen=True)
class _SkySampling:
    """How finely a video is cast."""

    sky: int
    """Rays to the sky where light is asked for."""


SKY_SAMPLING: dict[Quality, _SkySampling] = {"draft": _SkySampling(2)}
"""What is not here is cast evenly."""


@dataclass(frozen=True)
class _EmptyStudio:
    """The studio with nothing in it, before one camera."""

    aim: CameraAim
    place: tuple[float, ...]
    """Where scene and floor are: pictures of another scene need another studio."""
    rays: Rays
    """Of all pixels."""
    glances: Float32[np.ndarray, "P 3"]
    """How pixels see the floor: see ``kernels_floor.glances``."""
    wall: Float32[np.ndarray, "P 3"]
    """Light of the backdrop, without the floor."""
    mirrored: Float32[np.ndarray, "P 3"]
    """What the floor mirrors."""
    printed: UInt8[np.ndarray, "H W 3"]


class VideoRaycaster:
    """Takes a video's pictures one after the other; keeps the empty studio of the last camera.

    A stage that is given twice, to the same camera, is cast once.
    """

    def __init__(self, empty_band_tiles: int = EMPTY_BAND_TILES) -> None:
        self._empty_band_tiles = empty_band_tiles
        self._empty: _EmptyStudio | None = None
        self._last: tuple[RayScene, CameraAim, Quality, np.ndarray] | None = None
        self._pool: tuple[int, ThreadPoolExecutor] | None = None

    def picture(
        self, stage: RayScene, camera: CameraAim, quality: Quality, threads: int | None = None
    ) -> UInt8[np.ndarray, "H W 3"]:
        """Cast one picture of a video.

        Args:
            stage: Surfaces in one pose; all pictures of a caster are of one scene in one light.
            camera: Where from.
            quality: How finely.
            threads: At once; None: as many as there are cores.
        """
        last = self._last
        if last is None or last[0] is not stage or last[1:3] != (camera, quality):
            picture = self._cast(stage, camera, quality, threads or usable_cores())
            self._last = last = stage, camera, quality, picture
        return last[3].copy()

    def _workers(self, threads: int) -> ThreadPoolExecutor:
        """Return threads that stay, and their memory with them."""
        if self._pool is None or self._pool[0] != threads:
            self._pool = threads, ThreadPoolExecutor(threads)
        return self._pool[1]

    def _cast(self, stage: RayScene, camera: CameraAim, quality: Quality, threads: int) -> UInt8[np.ndarray, "H W 3"]:
        if quality not in SKY_SAMPLING:
            return render_image(stage, camera, quality, threads)
        # No more bands than threads, since bands overlap.
        lines = max(MIN_BAND_ROWS, -(-camera.height // threads))
        band = -(-lines // TILE_PX) * TILE_PX
        rows = [(k, min(k + band, camera.height)) for k in range(0, camera.height, band)]
        pool = self._workers(threads)
        known = self._empty
        if known is None or (known.aim, known.place) != (camera, _scene_and_floor_key(stage)):
            known = self._empty = _cast_empty_studio(stage, camera, SKY_SAMPLING[quality], pool, self._empty_band_tiles)
        out = known.printed.copy()
        job = _FrameRender(stage, camera, SKY_SAMPLING[quality], known)
        for _ in pool.map(lambda r: job.band(r, out), rows):
            pass
        return out


def _scene_and_floor_key(stage: RayScene) -> tuple[float, ...]:
    return (*stage.origin.tolist(), *stage.centre.tolist(), stage.size)


def _cast_empty_studio(
    stage: RayScene, camera: CameraAim, plan: _SkySampling, pool: ThreadPoolExecutor, band_tiles: int
) -> _EmptyStudio:
    """Cast the studio without objects, so many rows of tiles at once."""
    band = band_tiles * TILE_PX
    rows = [(k, min(k + band, camera.height)) for k in range(0, camera.height, band)]
    pixels, cleared = camera.width * camera.height, stage.cleared()
    rays = RenderJob(cleared, camera, RaySampling(1, 1, 1)).rays((0, camera.height))
    # All begin at the eye: it is kept once.
    rays = Rays(np.broadcast_to(rays.origin[0].copy(), rays.direction.shape), rays.direction)
    # Above the horizon no floor is seen.
    glances = np.zeros((pixels, 3), np.float32)
    wall, mirrored = (np.empty((pixels, 3), np.float32) for _ in range(2))
    printed = np.empty((camera.height, camera.width, 3), np.uint8)
    made = _EmptyStudio(camera, _scene_and_floor_key(stage), rays, glances, wall, mirrored, printed)
    job = _FrameRender(cleared, camera, plan, made)
    for _ in pool.map(job.empty_band, rows):
        pass
    return made


class _FrameRender(RenderJob):
    """One picture being taken."""

    def __init__(self, stage: RayScene, camera: CameraAim, plan: _SkySampling, empty: _EmptyStudio) -> None:
        super().__init__(stage, camera, RaySampling(1, 1, plan.sky))
        self.pixel *= TEXTURE_FILTER_PX
        self.plan, self.empty, self.boxes = plan, empty, stage.boxes()
        self.asker = LightSampler(stage, self.lamps, self.boxes)
        self.ways = shadow_culling.floor_light_directions(self.lamps, 1)
        self.open = (1.0, float(shadow_culling.floor_light_directions(self.lamps, plan.sky)[:-1, 2].mean()))
        self.blur = np.float32(shadow_culling.shadow_blur_width(self.lamps, self.boxes))
        size = camera.width, camera.height
        self.outlined = shadow_culling.tiles_with_surfaces(stage, self.eye, self.frame, self.tangent, size)

    def wide(self, rows: tuple[int, int], tiles: int = HALO_TILES) -> tuple[int, int]:
        """Rows with those above and below, so many tiles, that the light filter looks at."""
        halo = tiles * TILE_PX
        return max(rows[0] - halo, 0), min(rows[1] + halo, self.camera.height)

    def rays_of(self, here: slice) -> Rays:
        """Return those of some pixels of the picture."""
        return Rays(self.empty.rays.origin[here], self.empty.rays.direction[here])

    def empty_band(self, rows: tuple[int, int]) -> None:
        """Cast rows of the empty studio."""
        width, height = self.camera.width, self.camera.height
        wide = self.wide(rows, EMPTY_HALO_TILES)
        rays = self.rays_of(slice(wide[0] * width, wide[1] * width))
        light = np.empty((len(rays.origin), 3), np.float32)
        kernels_light.backdrop(self.lamps, wide, height, width, 1, light)
        wall = light.copy()
        block = PixelBlock(wide[0], wide[1] - wide[0], width)
        index = np.arange(len(light))
        everywhere = np.ones((block.rows, width), np.bool_)
        missed = self.stage.missed(rays.origin)
        s, arrived = self.cast(rays, index, everywhere, block, light, missed)
        toned = np.empty_like(light)
        kernels_video.tone_map(light, index, toned)
        mine = slice((rows[0] - wide[0]) * width, (rows[1] - wide[0]) * width)
        here = slice(rows[0] * width, rows[1] * width)
        self.empty.wall[here] = wall[mine]
        floor = np.flatnonzero(s.kind[mine] == kernels_hits.HIT_FLOOR)
        eye, glances = self.eye.astype(np.float32), self.empty.glances[here]
        kernels_floor.floor_view_terms(rays.direction[mine], floor, eye, self.lamps, glances)
        self.empty.mirrored[here] = arrived.light.reshape(-1, LIGHT_CHANNELS_PADDED)[mine, 4:LIGHT_CHANNELS]
        size = width, height
        every = np.ones(len(light), np.uint8)
        kernels_video.write_srgb(toned, every, wide[0], size, rows, self.empty.printed)

    def band(self, rows: tuple[int, int], out: np.ndarray) -> None:
        """Cast some rows of a picture where it differs from the empty studio."""
        width = self.camera.width
        wide = self.wide(rows)
        here = slice(wide[0] * width, wide[1] * width)
        rays = self.rays_of(here)
        block = PixelBlock(wide[0], wide[1] - wide[0], width)
        shape = block.rows, width
        # What is seen, and where light differs: on objects, and where they may be in its way.
        hit = self.seen(rays, block)
        tiles = self.tiles(rays, hit[0], block)
        kind = shadow_culling.tiles_to_pixels(tiles, shape)
        if not kind.any():
            return
        toned = np.empty((len(rays.origin), 3), np.float32)
        self.soften(_of_rows(tiles, rows, wide[0]), block, here, toned)
        near = kind == TILE_CAST
        last = rows[1] - wide[0] + LIGHT_DEPENDENCE_REACH_PX
        near[: max(rows[0] - wide[0] - LIGHT_DEPENDENCE_REACH_PX, 0)] = near[last:] = False
        part = block_around(near, block, LIGHT_FILTER_REACH_PX)
        if part is not None:
            near = crop_values(near, block, part)
            bright = self.closely(rays, hit, near, (block, part), rows)
            there = toned.reshape(*shape, 3)[block_window(block, part)]
            np.copyto(there, bright.reshape(there.shape), where=near[..., None])
        size = width, self.camera.height
        kernels_video.write_srgb(toned, kind.reshape(-1), wide[0], size, rows, out)

    def closely(
        self,
        rays: Rays,
        hit: tuple[np.ndarray, ...],
        near: Bool[np.ndarray, "h w"],
        blocks: tuple[PixelBlock, PixelBlock],
        rows: tuple[int, int],
    ) -> Float32[np.ndarray, "P 3"]:
        """Cast some pixels one by one; return the filmic light of the part that they lie in.

        Args:
            rays: Of the band.
            hit: What they met.
            near: Which pixels of the part, and those above and below that they hang on.
            blocks: The band, and the part of it.
            rows: The first row of the picture to answer for and the one after the last.
        """
        block, part = blocks
        rays = Rays(crop_values(rays.origin, *blocks), crop_values(rays.direction, *blocks))
        hit = tuple(crop_values(x, *blocks) for x in hit)
        wall = self.empty.wall[block.first * block.columns :][: block.rows * block.columns]
        light = crop_values(wall, *blocks)
        toned = np.empty_like(light)
        known = kernels_video.dilate_mask(near, LIGHT_FILTER_REACH_PX)
        inner = max(rows[0] - part.first - 1, 0), min(rows[1] - part.first + 1, part.rows)
        near = near.copy()
        near[: inner[0]] = near[inner[1] :] = False
        active = np.flatnonzero(near)
        s, arrived = self.cast(rays, active, known, part, light, hit)
        kernels_video.tone_map(light, active, toned)
        # Once more, finer, beside other surfaces of another colour.
        edge = np.zeros(len(light), np.bool_)
        kernels_video.mark_edges(s, toned, near.ravel(), near.shape, inner, edge)
        pixels = np.flatnonzero(edge)
        if len(pixels):
            self.refine(pixels, part, arrived, toned)
        return toned

    def seen(self, rays: Rays, block: PixelBlock) -> tuple[np.ndarray, ...]:
        """Nearest triangle and where, of each pixel; rays that could hit nothing are not cast."""
        if not self.stage.shown:
            return self.stage.missed(rays.origin)
        asked = shadow_culling.tiles_to_pixels(self.outlined[block.first // TILE_PX :], (block.rows, block.columns))
        index, many = np.flatnonzero(asked), len(rays.origin)
        # All rays begin at the eye.
        eye = np.broadcast_to(rays.origin[0], (len(index), 3)).copy()
        found = self.stage.hit(eye, np.take(rays.direction, index, axis=0))
        # Memory that comes zeroed costs nothing where no ray hits.
        hit = np.full(many, -1, np.int32), *(np.zeros(many, np.float32) for _ in range(3))
        for whole, part in zip(hit, found, strict=True):
            whole[index] = part
        return hit

    def tiles(self, rays: Rays, prim: np.ndarray, block: PixelBlock) -> UInt8[np.ndarray, "rows columns"]:
        """Tell the tiles apart: what they show is as it was, darkened softly, or to be cast."""
        shape = block.rows, block.columns
        things = np.zeros([-(-n // TILE_PX) for n in shape], np.bool_)
        kernels_floor.mark_object_tiles(prim, shape, things)
        near, far = kernels_floor.dilate_tiles(things, NEAR_OBJECT_TILES), np.zeros_like(things)
        eye = self.eye.astype(np.float32)
        kernels_floor.mark_shadowed_tiles(
            rays.direction, eye, self.lamps, self.ways, self.boxes, self.blur, shape, near, far
        )
        # Smoothing carries light into the tile beside.
        near = kernels_floor.dilate_tiles(near, 1)
        return np.where(near, TILE_CAST, np.where(far, TILE_SOFT, TILE_UNTOUCHED)).astype(np.uint8)

    def soften(self, tiles: np.ndarray, block: PixelBlock, here: slice, toned: np.ndarray) -> None:
        """Shade the tiles of floor from which objects hide a little of the sky."""
        height, width = tiles.shape
        size = self.camera.width, self.camera.height
        view = self.eye, self.frame, self.tangent, size, block.first
        room = kernels_floor.count_soft_corners(tiles) * (len(self.ways) - 1)
        o, w = (np.empty((room, 3), np.float32) for _ in range(2))
        asker = np.empty(room, np.int64)
        n = kernels_floor.queue_corner_rays(tiles, *view, self.lamps, self.ways, self.boxes, o, w, asker)
        free = self.stage.free(o[:n], w[:n], asker[:n])
        sky = np.full((height + 1, width + 1, 2), self.open, np.float32)
        kernels_floor.subtract_hidden_sky(asker, free, self.ways, width + 1, sky)
        empty, shape = self.empty, (block.rows, block.columns)
        known = empty.glances[here], empty.mirrored[here], empty.wall[here]
        kernels_floor.shade_soft_tiles(tiles, shape, self.lamps, sky, *known, toned)

    def cast(
        self,
        rays: Rays,
        active: np.ndarray,
        known: Bool[np.ndarray, "h w"],
        block: PixelBlock,
        light: np.ndarray,
        hit: tuple[np.ndarray, ...],
    ) -> tuple[HitBuffer, IncomingLight]:
        """Shade what pixels ``active`` see into light; return that, and the light that arrived."""
        d, index = rays.direction, np.flatnonzero(known)
        s = self.meet(rays.origin, d, index, tuple(x[index] for x in hit))
        thin = active[s.traits[active, 4] < 1]
        if len(thin):
            self.behind(rays, s, thin, block, light, 0)
        # Every fourth pixel asks for light, which is smoothed over each surface.
        on = index[s.kind[index] != HIT_NOTHING]
        shape = block.rows, block.columns
        asks = np.zeros(len(light), np.bool_)
        kernels_sparse_light.mark_sampled_pixels(s, on, known, (block.first, block.left), asks)
        asking = np.flatnonzero(asks)
        arriving = np.zeros((len(light), LIGHT_CHANNELS_PADDED), np.float32)
        arriving[asking] = self.asker.sparsely(s, d, asking, block.places(asking), self.plan.sky)
        lit = np.zeros(len(light), np.bool_)
        lit[on] = True
        log = np.zeros(len(light), np.float32)
        log[on] = np.log(s.depth[on])
        arrived = IncomingLight(
            arriving.reshape(*shape, LIGHT_CHANNELS_PADDED),
            s.normal.reshape(*shape, 3),
            s.depth.reshape(shape),
            log.reshape(shape),
            lit.reshape(shape),
        )
        surface, spare = (arrived.normal, arrived.log), np.empty_like(arrived.light)
        kernels_sparse_light.smooth_shared_light(arrived.light, *surface, arrived.known, asks.reshape(shape), spare)
        if len(self.boxes):
            self.asker.again(s, d, on, block, arrived)
        self.reflect_sharply(s, d, on, arriving)
        seen = active[lit[active]]
        near = np.zeros(light.shape, np.float32)
        kernels_light.shade(s, seen, d, arriving, self.lamps, near)
        kernels_light.blend_layers(s, seen, near, self.lamps, light)
        return s, arrived

    def reflect_sharply(self, s: HitBuffer, d: np.ndarray, on: np.ndarray, light: np.ndarray) -> None:
        """Let each smooth surface mirror what it sees itself, instead of its neighbours."""
        sharp = on[(s.traits[on, 1] <= SHARP_MIRROR_ROUGHNESS) & (s.kind[on] == kernels_hits.HIT_OBJECT)]
        if len(sharp):
            self.reflect(s, d, sharp, np.zeros(len(sharp), np.int64), light, sharp)

    def refine(self, pixels: np.ndarray, block: PixelBlock, arrived: IncomingLight, toned: np.ndarray) -> None:
        """Replace pixels by the mean of finer samples."""
        count = len(EDGE_SAMPLE_OFFSETS)
        total = len(pixels) * count
        o, d = (np.empty((total, 3), np.float32) for _ in range(2))
        row, column = (np.empty(total, np.float32) for _ in range(2))
        size, view = (self.camera.width, self.camera.height), (self.eye, self.frame, self.tangent)
        within = block.first, block.left, block.columns
        kernels_video.finer_rays(*view, size, within, pixels, o, d, row, column)
        middle = block.places(pixels)
        light = np.repeat(self.empty.wall[middle.row * size[0] + middle.column], count, axis=0)
        # Dice hang on the sample's place in a picture of so many samples.
        places = PixelPlaces(
            ((row + block.first + 0.5) * EDGE_SUPERSAMPLING).astype(np.int64),
            ((column + block.left + 0.5) * EDGE_SUPERSAMPLING).astype(np.int64),
        )
        lit = np.zeros((total, LIGHT_CHANNELS_PADDED), np.float32)

        def known(s: HitBuffer) -> Bool[np.ndarray, " S"]:
            return kernels_video.share_neighbour_light(
                s, row, column, arrived.light, arrived.normal, arrived.depth, arrived.known, lit
            )

        self.look_closely(Rays(o, d), places, light, lit, known)
        kernels_video.tone_map_means(light, pixels, toned)

    def look_closely(
        self,
        rays: Rays,
        places: PixelPlaces,
        light: np.ndarray,
        lit: np.ndarray,
        known: Callable[[HitBuffer], np.ndarray],
        depth: int = 0,
    ) -> None:
        """Shade what each ray hits over what is behind it, into light.

        Args:
            rays: All of them.
            places: Of each, for its dice.
            light: Behind everything (S, 3); then what the eye gets.
            lit: Room for the light that arrives (S, WIDE).
            known: Fills ``lit`` where light is known already, and says where it is not.
            depth: Surfaces that were looked through.
        """
        o, d = rays.origin, rays.direction
        hit = self.stage.hit(o, d) if self.stage.shown else self.stage.missed(o)
        s = self.meet(o, d, np.arange(len(o)), hit, EDGE_SUPERSAMPLING)
        thin = np.flatnonzero(s.traits[:, 4] < 1)
        if len(thin) and depth < MAX_TRANSPARENT_LAYERS:
            past = continue_ray(s.point[thin], d[thin], np.zeros(1, np.float32), self.stage.size)
            there, deeper = PixelPlaces(places.row[thin], places.column[thin]), light[thin]
            further = Rays(past, np.ascontiguousarray(d[thin]))
            room = np.zeros((len(thin), LIGHT_CHANNELS_PADDED), np.float32)
            self.look_closely(further, there, deeper, room, _all_unknown, depth + 1)
            light[thin] = deeper
        on = np.flatnonzero(s.kind != HIT_NOTHING)
        lone = on[known(s)[on]]
        there = PixelPlaces(places.row[lone], places.column[lone])
        lit[lone] = self.asker.sparsely(s, d, lone, there, 2 * self.plan.sky)
        self.reflect_sharply(s, d, on, lit)
        near = np.zeros(light.shape, np.float32)
        kernels_light.shade(s, on, d, lit, self.lamps, near)
        kernels_light.blend_layers(s, on, near, self.lamps, light)

    def free(self, o: np.ndarray, w: np.ndarray, ray: np.ndarray) -> np.ndarray:
        """Whether each ray gets away; only those are cast that could meet something."""
        could = np.empty(len(o), np.bool_)
        kernels_video.could_meet(o, w, self.boxes, could)
        index = np.flatnonzero(could)
        if len(index) == len(o):
            return self.stage.free(o, w, ray)
        free = np.ones(len(o), np.bool_)
        free[index] = self.stage.free(o[index], w[index], ray[index])
        return free


def _all_unknown(s: HitBuffer) -> Bool[np.ndarray, " S"]:
    return np.ones(len(s.kind), np.bool_)


def _of_rows(tiles: np.ndarray, rows: tuple[int, int], first: int) -> np.ndarray:
    """Kinds of the tiles in some rows of pixels; of those above and below none is to be changed."""
    kept = np.full_like(tiles, TILE_UNTOUCHED)
    mine = slice((rows[0] - first) // TILE_PX, -(-(rows[1] - first) // TILE_PX))
    kept[mine] = tiles[mine]
    return kept
