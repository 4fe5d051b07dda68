"""Video: render the scene's surfaces or Gaussians, which move with the particles.

Either textured surfaces, or the Gaussians of a reconstruction, whose covariances deform with the material (F Σ F^T);
their surfaces then only cast shadows on the floor.

The camera sees the whole motion and is fixed, as is the light; random numbers of the ray caster are fixed per pixel,
which prevents flicker.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int
from PIL import Image
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress, no_progress
from corporeal.core.types import Frame, Gaussians, Particles, Scene, Trajectory, Vector, Video
from corporeal.geometry.srgb import srgb_to_linear
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.pipeline.settings import VideoConfig
from corporeal.reconstruction.gaussians import rasteriser_numba
from corporeal.render import colours, video_file, video_overlay
from corporeal.render.camera_placement import CameraAim, camera_from_aim
from corporeal.render.camera_track import CameraTrack, MotionBounds, camera_track, first_contact
from corporeal.render.figures import (
    PAPER_LIGHT,
    CategoryPanel,
    ColourQuantity,
    NumericPanel,
    colour_panels,
    part_colours,
    si_prefix_text,
    write_image_row,
)
from corporeal.render.frame_reuse import LastRenderedPose
from corporeal.render.liquid_surface import LiquidSurface, liquid_surface
from corporeal.render.png_writer import write_png
from corporeal.render.ray_scene import RayScene
from corporeal.render.skin_binding import SkinBinding, bind_vertices
from corporeal.render.time_remap import frame_positions, interpolate_frames, is_slow
from corporeal.render.unoccluded_view import unoccluded_view
from corporeal.render.video_raycaster import VideoRaycaster
from corporeal.simulation.moving_gaussians import MovingGaussians, fluid_parts, granular_parts, moving_gaussians
from corporeal.simulation.simulation_result import PreparedScene, SimulationResult

VIDEO_FILE = "video.mp4"
THUMBNAIL_FILE = "thumbnail.png"
CLOSE_UP_FILE = "close-up.png"
CLOSE_UP_SIZE_PX = (340, 256)
"""Width of the close-up [px]."""
CLOSE_UP_TIMES_S = (-0.03, 0.0, 0.02, 0.05, 0.12, 0.4)
"""Pictures of the close-up, from the first contact on [s]."""
MAX_FRAMES_FOR_CAMERA = 60
"""Maximum number of frames used to place the camera."""
OCCLUSION_CHECK_FRACTIONS = (0.0, 0.35, 0.7, 1.0)
"""Instants at which occlusion is tested, as shares of the video."""
STRAY_PARTICLES_PERCENT = 0.4
"""Percent of an object's particles, at either end, that may be out of view."""
CORE_MASS_FRACTION = 0.5
"""Share of an object's mass that defines its size [-]: scattered drops or grains do not count."""
HAZE_DISTANCE_RATIO = 0.1
"""Gaussians nearer than this share of the distance to the scene are haze, and not drawn."""
MAX_FOLLOWED_SCENE_SIZES = 2.5
"""Distance beyond which the camera ignores objects [sizes of the scene]."""


def render_video(
    played: SimulationResult, config: VideoConfig, folder: Path, progress: Progress = no_progress
) -> Video:
    """Write ``video.mp4`` and ``thumbnail.png``: the scene, moved by its particles.

    Args:
        played: Surfaces, or Gaussians if the scene was reconstructed, bound to material points at the start; those of
            no object are static.
        config: Size, quality, view.
        folder: Folder of the video.
        progress: Called with the fraction done and a description.

    Raises:
        UserError: The scene is empty, Gaussians are asked for and there are none, the disk
            is full, or the encoder fails.
    """
    scene, trajectory = played.prepared.scene, played.trajectory
    if len(trajectory.frames) == 0:
        raise UserError(f"{trajectory.folder} holds no frames. Run corporeal simulate again.")
    progress(0.0, "placing the camera")
    staged = _video_setup(played, config)
    troupe, reel, camera, config = staged.troupe, staged.reel, staged.camera, staged.config
    size, paint = (config.width, config.height), troupe.paint
    fps = max(round(scene.fps * config.speed), 1)
    credit = "; ".join(dict.fromkeys(o.credit for o in scene.objects if o.credit))
    about = None if reel.contact is None else reel.contact.time
    places = frame_positions(trajectory.time, config.slow, about)
    times, caster = [], VideoRaycaster()
    with video_file.open_video(folder / VIDEO_FILE, fps, size, credit) as made:
        for number, scenery in enumerate(_frame_scenes(troupe, trajectory, places, camera.at)):
            picture = scenery.picture(caster, camera.at(scenery.time), config.quality)
            picture = picture if paint is None else paint.keyed(picture)
            _save_stills(picture, number, len(places), config, folder)
            times.append(scenery.time)
            made.add(write_caption(picture, scenery.time, config, about))
            progress((number + 1) / len(places), f"frame {number + 1} of {len(places)}")
    _close_up(troupe, reel, trajectory, config, folder)
    return Video(folder / VIDEO_FILE, fps, *size, times=tuple(times))


@dataclass(frozen=True)
class _VideoSetup:
    """A video, ready to be rendered."""

    troupe: "_AnimatedScene"
    reel: MotionBounds
    camera: CameraTrack
    config: VideoConfig
    """With the chosen view if none was asked for."""


def _video_setup(played: SimulationResult, config: VideoConfig) -> _VideoSetup:
    """Bind surfaces to particles, and place the camera."""
    prepared, trajectory = played.prepared, played.trajectory
    scene, field = prepared.scene, prepared.field
    skin = bind_vertices(scene, prepared.parts, prepared.particles, granular_parts(field), fluid_parts(field))
    reel = motion_summary(skin, scene, prepared.particles, trajectory)
    size, stage = (config.width, config.height), RayScene(scene)
    if config.view is None:
        config = replace(config, view=_clear_view(scene, stage, skin, reel, trajectory, size))
    troupe = _AnimatedScene(
        stage,
        skin,
        _gaussian_deformer(config, played),
        _particle_colours(config.colour_by, played),
        liquid_parts(prepared),
    )
    return _VideoSetup(troupe, reel, camera_track(config.shot, reel, size, config.view), config)


def frame_scenes(
    played: SimulationResult, config: VideoConfig, frames: Int[np.ndarray, " N"]
) -> Iterator[tuple[RayScene, CameraAim]]:
    """Return the surfaces shown in some frames, each with its camera."""
    staged = _video_setup(played, config)
    at = staged.camera.at
    for scenery in _frame_scenes(staged.troupe, played.trajectory, frames.astype(float), at):
        yield scenery.stage, at(scenery.time)


def _clear_view(
    scene: Scene, stage: RayScene, skin: SkinBinding, reel: MotionBounds, trajectory: Trajectory, size: tuple[int, int]
) -> Vector | None:
    """Return a view direction without occlusion between objects."""
    if len(scene.objects) < 2:
        return None
    last = len(trajectory.frames) - 1
    numbers = dict.fromkeys(round(share * last) for share in OCCLUSION_CHECK_FRACTIONS)
    stages = [stage.posed(*skin.pose(trajectory.frames[k])) for k in numbers]
    owner = np.repeat([s.object for s in scene.surfaces], [len(s.vertices) for s in scene.surfaces])
    return unoccluded_view(stages, owner, reel.boxes, size)


def _close_up(
    troupe: "_AnimatedScene", reel: MotionBounds, trajectory: Trajectory, config: VideoConfig, folder: Path
) -> None:
    """Render the first contact from close by as a row of pictures, if there is one."""
    if reel.contact is None:
        return
    camera = camera_track("close", reel, CLOSE_UP_SIZE_PX, config.view)
    last = float(trajectory.time[-1])
    times = np.unique([min(max(reel.contact.time + s, 0.0), last) for s in CLOSE_UP_TIMES_S])
    places = np.interp(times, trajectory.time, np.arange(len(trajectory.time)))
    caster = VideoRaycaster()
    pictures = [
        scenery.picture(caster, camera.at(scenery.time), config.quality)
        for scenery in _frame_scenes(troupe, trajectory, places, camera.at)
    ]
    write_image_row(pictures, [f"{t:.3f} s" for t in times.tolist()], folder / CLOSE_UP_FILE)


def write_caption(picture: np.ndarray, time: float, config: VideoConfig, about: float | None) -> np.ndarray:
    """Write the time [s] into a picture, and the slow motion."""
    if not config.caption:
        return picture
    slower = config.slow / config.speed if is_slow(time, about) else 1.0 / config.speed
    words = f"{time:.2f} s"
    if slower > 1.0:
        words += f"  slowed {slower:.3g} times"
    elif slower < 1.0:
        words += f"  {1.0 / slower:.3g} times as fast"
    return video_overlay.draw_caption(picture, words)


def motion_summary(skin: SkinBinding, scene: Scene, particles: Particles, trajectory: Trajectory) -> MotionBounds:
    """Return the motion for the camera: boxes of the initial surfaces, then of particles."""
    count = len(trajectory.frames)
    numbers = np.unique(np.linspace(0, count - 1, min(count, MAX_FRAMES_FOR_CAMERA)).round().astype(int))
    members = [np.flatnonzero(particles.object == k) for k in range(len(scene.objects))]
    fullness = [_reach_ratio(particles.position[mine], particles.mass[mine]) for mine in members]
    boxes = [_surface_boxes(skin, scene)]
    for k in numbers:
        place = trajectory.frames[int(k)].position
        boxes.append(
            np.array(
                [_box(place[mine], particles.mass[mine], full) for mine, full in zip(members, fullness, strict=True)]
            )
        )
    time = np.concatenate([trajectory.time[:1], trajectory.time[numbers]])
    contact = first_contact(trajectory.ledger, len(scene.objects))
    return MotionBounds(time, _limit_boxes(np.array(boxes)), contact)


def _mass_core(points: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, float]:
    """Median place of an object's particles, and the radius of most of its mass [m]."""
    middle = np.median(points, axis=0)
    away = np.linalg.norm(points - middle, axis=1)
    order = np.argsort(away)
    share = np.cumsum(mass[order]) / mass.sum()
    return middle, float(away[order][min(np.searchsorted(share, CORE_MASS_FRACTION), len(away) - 1)])


def _reach_ratio(points: np.ndarray, mass: np.ndarray) -> float:
    """Return the initial extent of an object over the radius of most of its mass [-]."""
    if len(points) == 0:
        return 1.0
    middle, core = _mass_core(points, mass)
    return float(np.linalg.norm(points - middle, axis=1).max()) / core if core > 0.0 else np.inf


def _box(points: np.ndarray, mass: np.ndarray, fullness: float) -> np.ndarray:
    """Corners (2, 3) of an object [m], of which a few stray points are left out.

    It is as large about its middle as it was at the start, for how far most of its mass reaches: what keeps its shape
    is seen whole, and of what scatters where half of it is.
    """
    here = np.isfinite(points).all(axis=1)
    points, mass = points[here], mass[here]
    if len(points) == 0:
        return np.full((2, 3), np.nan)
    low, high = np.percentile(points, (STRAY_PARTICLES_PERCENT, 100 - STRAY_PARTICLES_PERCENT), axis=0)
    middle, core = _mass_core(points, mass)
    reach = core * fullness if core > 0.0 else np.inf
    return np.array([np.maximum(low, middle - reach), np.minimum(high, middle + reach)])


def _surface_boxes(skin: SkinBinding, scene: Scene) -> np.ndarray:
    out = np.full((len(scene.objects), 2, 3), np.nan)
    owner = np.repeat([s.object for s in scene.surfaces], [len(s.vertices) for s in scene.surfaces])
    for k in range(len(scene.objects)):
        mine = skin.rest[owner == k]
        if len(mine):
            out[k] = mine.min(axis=0), mine.max(axis=0)
    return out


def _limit_boxes(boxes: np.ndarray) -> np.ndarray:
    """Drop boxes that went far away, and clip at the floor."""
    first = boxes[0]
    if not np.isfinite(first).any():
        return np.nan_to_num(boxes)
    low, high = np.nanmin(first[:, 0], axis=0), np.nanmax(first[:, 1], axis=0)
    reach = MAX_FOLLOWED_SCENE_SIZES * max(float(np.linalg.norm(high - low)), 1e-9)
    middle = (boxes[:, :, 0] + boxes[:, :, 1]) / 2
    away = np.linalg.norm(middle - (low + high) / 2, axis=-1) > reach
    boxes = np.where(away[:, :, None, None], np.nan, boxes)
    boxes[..., 2] = np.maximum(boxes[..., 2], 0.0)
    return boxes


@dataclass(frozen=True)
class LiquidParts:
    """Liquid parts, whose surface is rebuilt in every frame."""

    of_triangle: Bool[np.ndarray, " T"]
    """Which triangles are its surface at the start."""
    bodies: tuple[tuple[Int[np.ndarray, " N"], int], ...]
    """Particles of each liquid part, and its finish."""
    spacing: float
    """Between particles [m]."""

    def at(self, position: Float[np.ndarray, "P 3"]) -> list[LiquidSurface]:
        """Return the surfaces where particles are at some places [m]."""
        return [
            replace(liquid_surface(position[mine].astype(np.float64), self.spacing), finish=finish)
            for mine, finish in self.bodies
        ]

    def nearest(self, position: np.ndarray, surfaces: list[LiquidSurface]) -> Int[np.ndarray, " N"]:
        """Particle next to each triangle of those surfaces."""
        found = [np.zeros(0, np.int64)]
        for surface, (mine, _) in zip(surfaces, self.bodies, strict=True):
            corner = surface.vertices[surface.triangles[:, 0]]
            if len(corner):
                found.append(mine[KDTree(np.nan_to_num(position[mine])).query(corner)[1]])
        return np.concatenate(found)


def liquid_parts(prepared: PreparedScene) -> LiquidParts:
    """Find the liquid parts of a scene."""
    scene, particles = prepared.scene, prepared.particles
    part = prepared.parts.part_of_point
    counts = [len(s.triangles) for s in scene.surfaces]
    finish = np.repeat([s.finish for s in scene.surfaces], counts)
    wet = [k for k, m in enumerate(prepared.field.materials) if CONSTITUTIVE_LAWS[m.law].liquid]
    rigid = [t.kind == "rigid" for t in particles.treatments]
    wet = [k for k in wet if not rigid[k] and (part == k).any()]
    bodies = [(np.flatnonzero(particles.part == k), int(finish[part == k][0])) for k in wet]
    return LiquidParts(np.isin(part, wet), tuple(bodies), 0.5 * particles.cell)


@dataclass(frozen=True)
class _FrameScene:
    """Surfaces or Gaussians at one instant."""

    stage: RayScene
    gaussians: Gaussians | None
    time: float
    """[s]"""

    def picture(
        self, caster: VideoRaycaster, camera: CameraAim, quality: Literal["draft", "normal", "fine"]
    ) -> np.ndarray:
        behind = caster.picture(self.stage, camera, quality)
        if self.gaussians is None:
            return behind
        near = HAZE_DISTANCE_RATIO * float(np.linalg.norm(np.subtract(camera.eye, camera.target)))
        front = rasteriser_numba.render(self.gaussians, camera_from_aim(camera), near=near)
        through = (1 - front.alpha[..., None]) * behind
        return np.clip(255 * front.rgb + through + 0.5, 0, 255).astype(np.uint8)


def _gaussian_deformer(config: VideoConfig, played: SimulationResult) -> MovingGaussians | None:
    found = played.reconstruction
    if config.look == "surfaces" or (config.look is None and found is None):
        return None
    if found is None:
        raise UserError(
            "This scene has no Gaussians to render. Use look 'surfaces', or run it from photographs or a splat."
        )
    return moving_gaussians(found, played.prepared)


@dataclass(frozen=True)
class _ParticleColours:
    """Colours of particles by a quantity."""

    panel: CategoryPanel | NumericPanel
    of_particle: Float[np.ndarray, "P 3"] | None
    """sRGB; None where they change with time."""
    trajectory: Trajectory
    fastest: float = 1.0
    """[m/s]"""

    def at(self, number: int) -> np.ndarray:
        """Colours (P, 3) of all particles in one frame."""
        if self.of_particle is not None:
            return self.of_particle
        share = np.clip(particle_speeds(self.trajectory, number) / self.fastest, 0, 1)
        return colours.ramp_colours(share)

    def keyed(self, picture: np.ndarray) -> np.ndarray:
        """Draw the colour bar."""
        p = self.panel
        if isinstance(p, CategoryPanel):
            return video_overlay.draw_names(picture, p.title, p.label, p.colour)
        return video_overlay.draw_scale(picture, p.title, *(si_prefix_text(f(p.value), p.unit) for f in (min, max)))


def _particle_colours(
    colour_by: Literal["itself", "speed"] | ColourQuantity, played: SimulationResult
) -> _ParticleColours | None:
    prepared, trajectory = played.prepared, played.trajectory
    if colour_by == "itself":
        return None
    if colour_by == "speed":
        count = len(trajectory.frames)
        some = np.unique(np.linspace(0, count - 1, min(count, MAX_FRAMES_FOR_CAMERA)).round().astype(int))
        top = max(float(np.percentile(particle_speeds(trajectory, int(k)), 99.5)) for k in some)
        return _ParticleColours(NumericPanel("Speed", "m/s", [0.0, top]), None, trajectory, max(top, 1e-9))
    panel = colour_panels(prepared.scene, prepared.parts, prepared.field)[colour_by]
    return _ParticleColours(panel, part_colours(panel)[prepared.particles.part], trajectory)


def particle_speeds(trajectory: Trajectory, number: int) -> Float[np.ndarray, " P"]:
    """Speed of every particle on its way to the next frame, or to the last one [m/s]."""
    last = len(trajectory.frames) - 1
    if last == 0:
        return np.zeros(len(trajectory.frames[0].position))
    a = trajectory.frames[min(number, last - 1)]
    b = trajectory.frames[min(number, last - 1) + 1]
    way = np.linalg.norm(b.position.astype(float) - a.position, axis=1)
    return np.nan_to_num(way / (b.time - a.time))


@dataclass(frozen=True)
class _AnimatedScene:
    """Everything that moves, in its initial pose."""

    stage: RayScene
    skin: SkinBinding
    puppet: MovingGaussians | None
    paint: _ParticleColours | None
    liquids: LiquidParts

    @property
    def holds(self) -> bool:
        """Whether its surfaces, or what moves with them, are all that is shown."""
        painted = self.paint is not None and self.paint.of_particle is None
        return not self.liquids.bodies and not painted

    def at(self, number: int, frame: Frame, pose: tuple[np.ndarray, np.ndarray]) -> _FrameScene:
        stage = self.stage.posed(*pose)
        colour = None if self.paint is None else self.paint.at(number)
        if self.puppet is not None:
            return _FrameScene(stage.shadows(), self.puppet.at(frame, colour), frame.time)
        nearest = self.skin.near[self.stage.look.triangles[:, 0], 0]
        if self.liquids.bodies:
            surfaces = self.liquids.at(frame.position)
            stage = stage.with_liquids(self.liquids.of_triangle, surfaces)
            nearest = np.concatenate(
                [nearest[~self.liquids.of_triangle], self.liquids.nearest(frame.position, surfaces)]
            )
        if colour is not None:
            stage = stage.painted(srgb_to_linear(colour), nearest, PAPER_LIGHT)
        return _FrameScene(stage, None, frame.time)


def _frame_scenes(
    troupe: _AnimatedScene,
    trajectory: Trajectory,
    places: Float[np.ndarray, " N"],
    aim_at: Callable[[float], CameraAim],
) -> Iterator[_FrameScene]:
    """Scenes of all pictures in order; the next is prepared while one is rendered.

    Without visible motion the previous one is reused.
    """
    held, made = LastRenderedPose(aim_at), None

    def ready(place: float) -> _FrameScene:
        nonlocal made
        first = int(place)
        frame = trajectory.frames[first]
        if place > first:
            frame = interpolate_frames(frame, trajectory.frames[first + 1], place - first)
        pose = troupe.skin.pose(frame)
        moved = held.moved(*pose, frame.time)
        if made is None or moved or not troupe.holds:
            made = troupe.at(round(place), frame, pose)
        else:
            made = replace(made, time=frame.time)
        return made

    with ThreadPoolExecutor(1) as ahead:
        coming = ahead.submit(ready, float(places[0]))
        for number in range(len(places)):
            current = coming.result()
            if number + 1 < len(places):
                coming = ahead.submit(ready, float(places[number + 1]))
            yield current


def _save_stills(picture: np.ndarray, number: int, count: int, config: VideoConfig, folder: Path) -> None:
    """Save the thumbnail (at two thirds of the video) and the stills asked for."""
    names = [f"stills/{number:05d}.png"] if config.stills else []
    names += [THUMBNAIL_FILE] if number == (2 * (count - 1)) // 3 else []
    for name in names:
        write_png(Image.fromarray(picture), folder / name)
