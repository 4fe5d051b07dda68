import numpy as np
import pytest
import trimesh
from test_embree import RED, ball, front, scene, sheet

from corporeal.core.types import Finish, Surface
from corporeal.geometry.srgb import linear_to_srgb
from corporeal.render import embree, shadow_culling
from corporeal.render.camera_placement import CameraAim
from corporeal.render.embree import RaySampling, RenderJob, identify_triangles, render_image
from corporeal.render.kernels_floor import TILE_CAST, TILE_PX
from corporeal.render.kernels_sparse_light import DIRECTION_SETS, direction_set_of, is_sampled_pixel
from corporeal.render.kernels_video import TONE_CURVE, TONE_CURVE_STEPS
from corporeal.render.liquid_surface import LiquidSurface
from corporeal.render.ray_scene import RayScene
from corporeal.render.secondary_rays import LightSampler
from corporeal.render.video_raycaster import VideoRaycaster

LEAF = Finish(
    "leaf", texture=np.tile([[[0, 150, 0, 255], [0, 150, 0, 0]]], (32, 16, 1)).astype(np.uint8), alpha_mode="MASK"
)
PANE = Finish("pane", (0.9, 0.05, 0.05, 0.5), alpha_mode="BLEND")
SHINY = Finish("shiny", (0.9, 0.9, 0.9, 1.0), roughness=0.1, metallic=1.0)
SCENES = {
    "a red ball": ([ball()], [RED]),
    "a mirror beside a ball": ([ball(), ball((0.5, -0.5, 0.2), 0.2, 1, k=1)], [RED, SHINY]),
    "a pane before a ball": ([sheet(-0.6, 1), ball()], [RED, PANE]),
    "holes before a ball": ([sheet(-0.6, 1), ball()], [RED, LEAF]),
    "nothing": ([], []),
}


def stage(name):
    return RayScene(scene(*SCENES[name]))


@pytest.mark.parametrize("name", SCENES)
def test_a_video_shows_what_an_even_cast_shows(name):
    """The measure is a picture of 3 × 3 samples; the even cast of the same word is as far off."""
    exact = render_image(stage(name), front(), "fine", 1).astype(float)
    even = render_image(stage(name), front(), "draft", 1).astype(float)
    video = VideoRaycaster().picture(stage(name), front(), "draft", 1).astype(float)
    off, usual = (np.sqrt(((x - exact) ** 2).mean()) for x in (video, even))
    assert off <= 1.1 * usual + 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_rays_that_are_not_cast_would_not_have_changed_the_picture(name, monkeypatch):
    made = VideoRaycaster().picture(stage(name), front(), "draft", 1)
    everywhere = np.array([[[-1e3] * 3, [1e3] * 3]], np.float32)
    monkeypatch.setattr(RayScene, "boxes", lambda self: everywhere)
    every = VideoRaycaster().picture(stage(name), front(), "draft", 1)
    assert np.abs(made.astype(int) - every).max() <= 1
    assert (made != every).mean() < 1e-3


def test_a_picture_hangs_neither_on_threads_nor_on_the_one_before():
    caster = VideoRaycaster()
    caster.picture(stage("a mirror beside a ball"), front(), "draft", 1)
    after = caster.picture(stage("a red ball"), front(), "draft", 3)
    assert np.array_equal(after, VideoRaycaster().picture(stage("a red ball"), front(), "draft", 1))


def test_the_empty_studio_hangs_on_no_band():
    near = front()
    tall = CameraAim(near.eye, near.target, 30.0, 64, 240)  # so that rows beside one another are alike

    def cast(*band: int) -> tuple[np.ndarray, ...]:
        caster = VideoRaycaster(*band)
        picture = caster.picture(stage("a red ball"), tall, "draft", 1)
        assert caster._empty is not None
        return picture, caster._empty.mirrored, caster._empty.glances, caster._empty.wall

    whole = cast()
    assert all(np.array_equal(a, b) for a, b in zip(cast(2), whole, strict=True))


def test_a_camera_that_moves_sees_another_floor():
    caster, near = VideoRaycaster(), front()
    caster.picture(stage("a red ball"), near, "draft", 1)
    far = CameraAim((0.0, -9.0, 2.0), near.target, 30.0, near.width, near.height)
    there = caster.picture(stage("a red ball"), far, "draft", 1)
    assert np.array_equal(there, VideoRaycaster().picture(stage("a red ball"), far, "draft", 1))


def test_surfaces_that_are_not_shown_still_throw_shadows():
    hidden = VideoRaycaster().picture(stage("a red ball").shadows(), front(), "draft", 1).astype(int)
    bare = VideoRaycaster().picture(stage("nothing"), front(), "draft", 1).astype(int)
    shown = VideoRaycaster().picture(stage("a red ball"), front(), "draft", 1).astype(int)
    assert (bare - hidden).max() > 30
    assert hidden[25, 48].max() - hidden[25, 48].min() < 60 < np.ptp(shown[25, 48])


def test_liquids_that_replace_surfaces_are_seen_where_they_went(monkeypatch):
    before = stage("a mirror beside a ball")
    gone = np.repeat([False, True], len(before.look.triangles) // 2)
    there = ball((-0.8, -0.4, 0.3), 0.25)
    assert there.normals is not None
    liquid = LiquidSurface(there.vertices, there.normals, there.triangles, 0)
    after = before.with_liquids(gone, [liquid])
    made = VideoRaycaster().picture(after, front(), "draft", 1)
    assert (made != VideoRaycaster().picture(before, front(), "draft", 1)).mean() > 0.02
    everywhere = np.array([[[-1e3] * 3, [1e3] * 3]], np.float32)
    monkeypatch.setattr(RayScene, "boxes", lambda self: everywhere)
    every = VideoRaycaster().picture(after, front(), "draft", 1)
    assert np.abs(made.astype(int) - every).max() <= 1


@pytest.mark.parametrize("corner", [(0, 0), (3, 5), (7, 2)])
def test_pixels_that_are_smoothed_over_look_along_every_direction_once(corner):
    top, left = corner
    places = [(i, j) for i in range(top, top + 12) for j in range(left, left + 12)]
    asked = sorted(direction_set_of(i, j) for i, j in places if is_sampled_pixel(i, j))
    assert asked == list(range(DIRECTION_SETS))


def test_floor_that_only_some_sky_is_hidden_from_is_darkened_evenly(monkeypatch):
    """Asked at the corners of tiles or by every fourth pixel: the same to two grey levels."""
    aim = CameraAim((0.0, -6.0, 3.0), (0.0, 0.0, 0.2), 40.0, 320, 240)
    tall = stage("a red ball")
    soft = VideoRaycaster().picture(tall, aim, "draft", 1).astype(int)
    bare = VideoRaycaster().picture(stage("nothing"), aim, "draft", 1).astype(int)
    monkeypatch.setattr("corporeal.render.video_raycaster.TILE_SOFT", TILE_CAST)
    cast = VideoRaycaster().picture(tall, aim, "draft", 1).astype(int)
    assert np.abs(soft - cast).max() <= 2
    assert 0 < np.abs(soft - cast).mean() < 0.1 < np.abs(bare - cast).mean()


@pytest.mark.parametrize("eye", [(0.0, -6.0, 1.5), (0.3, -0.9, 0.4), (0.0, -0.1, 0.2)])
@pytest.mark.parametrize("name", ["a mirror beside a ball", "a pane before a ball"])
def test_no_triangle_is_seen_beside_the_tiles_that_it_could_be_seen_in(name, eye):
    """From afar, from so near that most of it is beyond the picture, and from within."""
    there, aim = stage(name), CameraAim(eye, (0.1, 0.0, 0.3), 40.0, 90, 70)
    job = RenderJob(there, aim, RaySampling(1, 1, 1))
    rays = job.rays((0, aim.height))
    seen = there.hit(rays.origin, rays.direction)[0].reshape(aim.height, aim.width) >= 0
    size = aim.width, aim.height
    marked = shadow_culling.tiles_with_surfaces(there, job.eye, job.frame, job.tangent, size)
    pixels = np.repeat(np.repeat(marked, TILE_PX, axis=0), TILE_PX, axis=1)[: aim.height, : aim.width]
    assert seen.any()
    assert not (seen & ~pixels).any()
    if eye[1] < -5:
        assert pixels.sum() < 5 * seen.sum()


def test_the_displays_curve_is_that_of_srgb():
    light = np.linspace(0, 1, 100_001, dtype=np.float32)
    place = light * TONE_CURVE_STEPS
    number = np.minimum(place.astype(int), TONE_CURVE_STEPS - 1)
    grey = TONE_CURVE[number] + (place - number) * (TONE_CURVE[number + 1] - TONE_CURVE[number])
    assert np.abs(grey - 255 * linear_to_srgb(light)).max() < 1e-3


def test_floor_beside_a_contact_is_as_dark_as_many_rays_find_it(monkeypatch):
    """Without rays of their own, pixels there show the light of twelve pixels about them."""
    box = trimesh.creation.box((0.6, 0.6, 0.4))
    corners = np.asarray(box.vertices) + np.array([0, 0, 0.2])
    there = RayScene(scene([Surface("box", 0, 0, corners, np.asarray(box.faces))]))
    aim = CameraAim((-1.8, -2.2, 1.2), (0.0, 0.0, 0.2), 30.0, 400, 300)
    monkeypatch.setitem(embree.RAY_SAMPLING, "exact", RaySampling(3, 1, 16))
    exact = render_image(there, aim, "exact", 1).astype(float)
    floor = identify_triangles(there, aim)[0] < 0

    def off():
        made = VideoRaycaster().picture(there, aim, "draft", 1)
        return np.sqrt(((made - exact) ** 2).mean(axis=2)) * floor

    asked = off()
    monkeypatch.setattr(LightSampler, "again", lambda *_: None)
    shared = off()
    beside = shared > 8
    assert beside.sum() > 300
    assert np.sqrt((asked[beside] ** 2).mean()) < 0.5 * np.sqrt((shared[beside] ** 2).mean())
    assert np.sqrt((asked**2).mean()) < 0.6 * np.sqrt((shared**2).mean())
