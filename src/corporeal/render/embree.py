"""A ray caster on Embree: sun with soft shadow, sky with occlusion, one reflection, endless floor.

The picture is cast in bands of rows, each on its own from rays to colours, so that bands share nothing and run in
threads (Embree and the compiled loops release Python's lock). Linear light throughout; a filmic curve and sRGB at the
end.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float32, Int

from corporeal.core.process_resources import usable_cores
from corporeal.geometry.srgb import srgb_to_linear
from corporeal.render import kernels_hits, kernels_light
from corporeal.render.camera_placement import CameraAim, camera_axes
from corporeal.render.kernels_hits import HIT_NOTHING, HitBuffer
from corporeal.render.kernels_light import GLOSSY_ROUGHNESS, LIGHT_CHANNELS, SHARP_MIRROR_ROUGHNESS, StudioLamps
from corporeal.render.ray_scene import MAX_TRANSPARENT_LAYERS, RayScene, continue_ray

Quality = Literal["draft", "normal", "fine"]
MIN_BAND_ROWS = 32
"""Rows of pixels cast together, at least: bands overlap by a dozen."""
RAYS_PER_BATCH = 2**18
"""Rays that are cast together where no light is asked for."""


@dataclass(frozen=True)
class RaySampling:
    """How many rays."""

    grid: int
    """Samples a pixel: grid × grid."""
    every: int
    """Light is asked for at every so-many-th sample in each direction."""
    sky: int
    """Rays to the sky where light is asked for."""


RAY_SAMPLING: dict[str, RaySampling] = {
    "draft": RaySampling(2, 2, 3),
    "normal": RaySampling(2, 1, 2),
    "fine": RaySampling(3, 1, 4),
}


def render_image(
    stage: RayScene, camera: CameraAim, quality: Quality = "normal", threads: int | None = None
) -> np.ndarray:
    """One picture (height, width, 3) uint8. Equal input gives equal bytes."""
    job = RenderJob(stage, camera, RAY_SAMPLING[quality])
    out = np.empty((camera.height, camera.width, 3), np.uint8)
    threads = threads or usable_cores()
    band = max(MIN_BAND_ROWS, -(-camera.height // (2 * threads)))
    rows = [(k, min(k + band, camera.height)) for k in range(0, camera.height, band)]
    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(lambda r: job.band(r, out), rows):
            pass
    return out


def identify_triangles(stage: RayScene, camera: CameraAim, grid: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """For each sample, the triangle it sees (-1: none) and its depth [m]; rows first."""
    job = RenderJob(stage, camera, RaySampling(grid, 1, 1))
    rays = job.rays((0, camera.height))
    prim, _, _, t = stage.hit(rays.origin, rays.direction)
    shape = camera.height * grid, camera.width * grid
    return prim.reshape(shape), t.reshape(shape)


def first_seen(stage: RayScene, camera: CameraAim) -> HitBuffer:
    """Return what the middle of each pixel shows, holes looked through; rows first.

    Depths [m] are along the ray; points are about the stage's origin.
    """
    job = RenderJob(stage, camera, RaySampling(1, 1, 1))
    seen = kernels_hits.hit_buffer(camera.width * camera.height)
    lines = max(1, RAYS_PER_BATCH // camera.width)
    for row in range(0, camera.height, lines):
        rays = job.rays((row, min(row + lines, camera.height)))
        o, d = rays.origin, rays.direction
        part = slice(row * camera.width, row * camera.width + len(o))
        met = job.meet(o, d, np.arange(len(o)), stage.hit(o, d))
        for whole, piece in zip(seen, met, strict=True):
            whole[part] = piece
    return seen


def studio_lamps(stage: RayScene, camera: CameraAim) -> StudioLamps:
    """Set up the studio about its front."""
    light = stage.light
    back = np.subtract(camera.eye, camera.target) if light.front is None else light.front
    right, _, _ = camera_axes(back)
    ahead = np.array([-right[1], right[0], 0.0])
    sun = light.sun[0] * right + light.sun[1] * ahead + [0, 0, light.sun[2]]

    def colour(text: str) -> np.ndarray:
        return srgb_to_linear(np.array([int(text[k : k + 2], 16) for k in (1, 3, 5)]) / 255)

    f = np.float32
    return StudioLamps(
        sun=(sun / np.linalg.norm(sun)).astype(f),
        side=right.astype(f),
        sun_colour=np.array(light.sun_colour, f),
        softness=light.softness,
        zenith=np.array(light.zenith, f),
        horizon=np.array(light.horizon, f),
        floor=np.array([*colour(light.floor), 0.0], f),
        backdrop=np.array([colour(c) for c in light.backdrop], f),
        size=stage.size,
        centre=stage.centre,
    )


@dataclass(frozen=True)
class Rays:
    """R rays from the camera, or from behind what they passed."""

    origin: Float32[np.ndarray, "R 3"]
    """[m], in the stage's frame."""
    direction: Float32[np.ndarray, "R 3"]
    """Unit."""


@dataclass(frozen=True)
class PixelBlock:
    """A part of a picture's samples; ``first`` and ``left``: its first row and column there."""

    first: int
    rows: int
    columns: int
    left: int = 0

    def places(self, index: np.ndarray) -> "PixelPlaces":
        """Return where in the picture some samples are."""
        return PixelPlaces(index // self.columns + self.first, index % self.columns + self.left)


@dataclass(frozen=True)
class PixelPlaces:
    """Rows and columns of samples in the picture; their dice hang on them."""

    row: Int[np.ndarray, " N"]
    column: Int[np.ndarray, " N"]


class RenderJob:
    """One picture being taken."""

    def __init__(self, stage: RayScene, camera: CameraAim, sampling: RaySampling) -> None:
        self.stage, self.camera, self.sampling = stage, camera, sampling
        self.frame = camera_axes(np.subtract(camera.eye, camera.target))
        self.eye = np.subtract(camera.eye, stage.origin)
        self.tangent = float(np.tan(np.radians(camera.field_of_view) / 2))
        self.lamps = studio_lamps(stage, camera)
        self.pixel = 2 * self.tangent / (camera.height * sampling.grid)
        """What textures are filtered over, as an angle [rad]."""

    def rays(self, rows: tuple[int, int]) -> Rays:
        """Return those of all samples in some rows of the picture."""
        size, grid = (self.camera.width, self.camera.height), self.sampling.grid
        return Rays(*kernels_hits.camera_rays(self.eye, self.frame, self.tangent, size, rows, grid))

    def band(self, rows: tuple[int, int], out: np.ndarray) -> None:
        """Cast some rows with as many more above and below as the light filter looks at."""
        grid, every = self.sampling.grid, self.sampling.every
        height, width = self.camera.height, self.camera.width
        halo = -(-6 * every // grid)
        wide = max(rows[0] - halo, 0), min(rows[1] + halo, height)
        # The studio behind everything, where rays miss.
        rays = self.rays(wide)
        light = np.empty((len(rays.origin), 3), np.float32)
        kernels_light.backdrop(self.lamps, wide, height, width, grid, light)
        shape = (wide[1] - wide[0]) * grid, width * grid
        hit = self.first_hit(rays)
        # Shade what is worth a sample of its own; the rest takes its neighbours' light.
        looked = kernels_hits.needs_own_sample(hit[0], shape, every)
        index = np.flatnonzero(looked)
        hit = tuple(x[index] for x in hit)
        self.layer(rays, index, PixelBlock(wide[0] * grid, *shape), light, hit)
        kernels_hits.copy_block_samples(light, looked, shape, every)
        # Develop the band's own rows only, without the halo.
        line = width * grid * grid
        mine = light[(rows[0] - wide[0]) * line : (rows[1] - wide[0]) * line]
        kernels_light.develop_image(mine, rows, (width, height), grid, out)

    def first_hit(self, rays: Rays) -> tuple[np.ndarray, ...]:
        """Nearest triangle and where, of each ray from the camera."""
        o, d = rays.origin, rays.direction
        return self.stage.hit(o, d) if self.stage.shown else self.stage.missed(o)

    def layer(
        self,
        rays: Rays,
        index: np.ndarray,
        block: PixelBlock,
        light: np.ndarray,
        hit: tuple[np.ndarray, ...],
        depth: int = 0,
    ) -> None:
        """Shade what rays ``index`` hit, over what is behind, into light."""
        o, d = rays.origin, rays.direction
        s = self.meet(o, d, index, hit)
        thin = index[s.traits[index, 4] < 1]
        if len(thin) and depth < MAX_TRANSPARENT_LAYERS:
            self.behind(rays, s, thin, block, light, depth)
        on = index[s.kind[index] != HIT_NOTHING]
        arriving = self.gather(s, d, on, block)
        near = np.zeros(light.shape, np.float32)
        kernels_light.shade(s, on, d, arriving, self.lamps, near)
        kernels_light.blend_layers(s, on, near, self.lamps, light)

    def behind(
        self, rays: Rays, s: HitBuffer, thin: np.ndarray, block: PixelBlock, light: np.ndarray, depth: int
    ) -> None:
        """Shade what is to be seen through surfaces that rays ``thin`` met."""
        start = np.zeros(rays.origin.shape, np.float32)
        d = rays.direction
        past = continue_ray(s.point[thin], d[thin], np.zeros(1, np.float32), self.stage.size)
        start[thin] = past
        hit = self.stage.hit(past, d[thin])
        self.layer(Rays(start, d), thin, block, light, hit, depth + 1)

    def meet(
        self, o: np.ndarray, d: np.ndarray, index: np.ndarray, hit: tuple[np.ndarray, ...], grid: int = 1
    ) -> HitBuffer:
        """First surface that is not a hole; of samples so many times finer in each direction."""
        stage, s = self.stage, kernels_hits.hit_buffer(len(o))
        o, e = np.take(o, index, axis=0), np.take(d, index, axis=0)
        walked = np.zeros(len(index), np.float32)
        for _ in range(4 * MAX_TRANSPARENT_LAYERS):
            prim, u, v, t = hit
            kernels_hits.fill_hits(
                stage.look, stage.vertices, stage.normals, self.lamps.floor, self.pixel / grid,
                o, e, prim, u, v, t, index, s,
            )  # fmt: skip
            if walked.any():
                s.depth[index] += walked
            hole = (s.traits[index, 4] == 0) & (prim >= 0)
            if not hole.any():
                break
            o, e = (continue_ray(o[hole], e[hole], t[hole], stage.size), np.ascontiguousarray(e[hole]))
            index, walked = index[hole], walked[hole] + t[hole]
            hit = stage.hit(o, e)
        return s

    def gather(self, s: HitBuffer, d: np.ndarray, on: np.ndarray, block: PixelBlock) -> np.ndarray:
        """Light (G, CHANNELS) that arrives at the samples ``on``."""
        first, height, width = block.first, block.rows, block.columns
        every = self.sampling.every
        rows = np.arange(-first % every, height, every)
        chosen = (rows[:, None] * width + np.arange(0, width, every)).ravel()
        shape = len(rows), -(-width // every)
        present = np.zeros(len(s.kind), np.bool_)
        present[on] = True
        active = present[chosen]
        lattice = np.zeros((len(chosen), LIGHT_CHANNELS), np.float32)
        lattice[active] = self.ask(s, d, chosen[active], block.places(chosen[active]))
        normal = s.normal[chosen].reshape(*shape, 3)
        depth = np.log(np.maximum(s.depth[chosen], 1e-12)).reshape(shape)
        grid = active.reshape(shape)
        lattice = lattice.reshape(*shape, LIGHT_CHANNELS)
        kernels_light.smooth_light(lattice, normal, depth, grid)
        light = np.zeros((len(s.kind), LIGHT_CHANNELS), np.float32)
        missing = kernels_light.spread_light(s, on, (height, width), lattice, normal, depth, grid, every, light)
        lone = np.flatnonzero(missing)
        light[lone] = self.ask(s, d, lone, block.places(lone), 2)
        sharp = on[(s.traits[on, 1] <= SHARP_MIRROR_ROUGHNESS) & (s.kind[on] == kernels_hits.HIT_OBJECT)]
        if len(sharp):
            self.reflect(s, d, sharp, np.zeros(len(sharp), np.int64), light, sharp)
        return light

    def ask(self, s: HitBuffer, d: np.ndarray, index: np.ndarray, places: PixelPlaces, times: int = 1) -> np.ndarray:
        """Send rays to sky (so many times the usual) and sun and along the mirrored direction."""
        every, sky = self.sampling.every, times * self.sampling.sky
        row, column = places.row, places.column
        cells = ((row // every % 4) * 4 + column // every % 4) * 7 % 16
        pixels = row * 65536 + column
        light = np.zeros((len(index), LIGHT_CHANNELS), np.float32)
        o, w = (np.empty((len(index), 3), np.float32) for _ in range(2))
        for number in range(sky):
            kernels_light.sky_rays(s, index, cells, self.lamps, number, sky, o, w)
            free = self.free(o, w, pixels + number)
            kernels_light.gather_sky(s, index, w, free, self.lamps, np.float32(1 / sky), light)
        ask = np.empty(len(index), np.bool_)
        kernels_light.sun_rays(s, index, cells, pixels, self.lamps, o, w, ask)
        light[ask, 3] = self.free(o[ask], w[ask], pixels[ask])
        self.reflect(s, d, index, cells, light, np.arange(len(index)))
        return light

    def free(self, o: np.ndarray, w: np.ndarray, ray: np.ndarray) -> np.ndarray:
        """Whether each ray gets away."""
        return self.stage.free(o, w, ray)

    def reflect(
        self, s: HitBuffer, d: np.ndarray, index: np.ndarray, cells: np.ndarray, light: np.ndarray, rows: np.ndarray
    ) -> None:
        """Write what glossy surfaces mirror into light[rows, 4:]."""
        stage = self.stage
        o, w = (np.empty((len(index), 3), np.float32) for _ in range(2))
        kernels_light.mirror_rays(s, index, d, cells, self.lamps, o, w)
        prim = np.full(len(index), -1, np.int32)
        u, v, t = (np.zeros(len(index), np.float32) for _ in range(3))
        glossy = (s.traits[index, 1] < GLOSSY_ROUGHNESS) & (s.kind[index] == kernels_hits.HIT_OBJECT)
        if glossy.any():
            prim[glossy], u[glossy], v[glossy], t[glossy] = stage.hit(o[glossy], w[glossy])
        seen = np.zeros((len(index), 3), np.float32)
        kernels_light.write_mirrored(stage.look, stage.normals, self.lamps, s, index, w, prim, u, v, t, seen, 0)
        light[rows, 4:LIGHT_CHANNELS] = seen
