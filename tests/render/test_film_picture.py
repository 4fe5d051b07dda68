import numpy as np
import pytest
import trimesh
from test_embree import RED, ball, front, scene, sheet

from corporeal.core.types import Finish, Surface
from corporeal.geometry.srgb import encoded
from corporeal.render import cull, embree, film_picture
from corporeal.render.arriving import Asker
from corporeal.render.camera import Aim
from corporeal.render.embree import Job, Sampling, identify, render
from corporeal.render.film_picture import FilmCaster
from corporeal.render.kernels_ask import WAYS, asks, number_of
from corporeal.render.kernels_film import CURVE, CURVED
from corporeal.render.kernels_floor import NEAR, TILE
from corporeal.render.liquid_surface import LiquidSurface
from corporeal.render.stage import Stage

LEAF = Finish(
    "leaf",
    texture=np.tile([[[0, 150, 0, 255], [0, 150, 0, 0]]], (32, 16, 1)).astype(np.uint8),
    alpha_mode="MASK",
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
    return Stage(scene(*SCENES[name]))


@pytest.mark.parametrize("name", SCENES)
def test_a_film_shows_what_an_even_cast_shows(name):
    """The measure is a picture of 3 × 3 samples; the even cast of the same word is as far off."""
    exact = render(stage(name), front(), "fine", 1).astype(float)
    even = render(stage(name), front(), "draft", 1).astype(float)
    film = FilmCaster().picture(stage(name), front(), "draft", 1).astype(float)
    off, usual = (np.sqrt(((x - exact) ** 2).mean()) for x in (film, even))
    assert off <= 1.1 * usual + 0.1


@pytest.mark.parametrize("name", SCENES)
def test_rays_that_are_not_cast_would_not_have_changed_the_picture(name, monkeypatch):
    made = FilmCaster().picture(stage(name), front(), "draft", 1)
    everywhere = np.array([[[-1e3] * 3, [1e3] * 3]], np.float32)
    monkeypatch.setattr(Stage, "boxes", lambda self: everywhere)
    every = FilmCaster().picture(stage(name), front(), "draft", 1)
    assert np.abs(made.astype(int) - every).max() <= 1
    assert (made != every).mean() < 1e-3


def test_a_picture_hangs_neither_on_threads_nor_on_the_one_before():
    caster = FilmCaster()
    caster.picture(stage("a mirror beside a ball"), front(), "draft", 1)
    after = caster.picture(stage("a red ball"), front(), "draft", 3)
    assert np.array_equal(after, FilmCaster().picture(stage("a red ball"), front(), "draft", 1))


def test_the_empty_studio_hangs_on_no_band(monkeypatch):
    near = front()
    tall = Aim(near.eye, near.target, 30.0, 64, 240)  # so that rows beside one another are alike

    def cast() -> tuple[np.ndarray, ...]:
        caster = FilmCaster()
        picture = caster.picture(stage("a red ball"), tall, "draft", 1)
        assert caster._empty is not None
        return picture, caster._empty.mirrored, caster._empty.glances, caster._empty.wall

    whole = cast()
    monkeypatch.setattr(film_picture, "EMPTY_BAND", 2)
    assert all(np.array_equal(a, b) for a, b in zip(cast(), whole, strict=True))


def test_a_camera_that_moves_sees_another_floor():
    caster, near = FilmCaster(), front()
    caster.picture(stage("a red ball"), near, "draft", 1)
    far = Aim((0.0, -9.0, 2.0), near.target, 30.0, near.width, near.height)
    there = caster.picture(stage("a red ball"), far, "draft", 1)
    assert np.array_equal(there, FilmCaster().picture(stage("a red ball"), far, "draft", 1))


def test_surfaces_that_are_not_shown_still_throw_shadows():
    hidden = FilmCaster().picture(stage("a red ball").shadows(), front(), "draft", 1).astype(int)
    bare = FilmCaster().picture(stage("nothing"), front(), "draft", 1).astype(int)
    shown = FilmCaster().picture(stage("a red ball"), front(), "draft", 1).astype(int)
    assert (bare - hidden).max() > 30
    assert hidden[25, 48].max() - hidden[25, 48].min() < 60 < np.ptp(shown[25, 48])


def test_liquids_that_replace_surfaces_are_seen_where_they_went(monkeypatch):
    before = stage("a mirror beside a ball")
    gone = np.repeat([False, True], len(before.look.triangles) // 2)
    there = ball((-0.8, -0.4, 0.3), 0.25)
    assert there.normals is not None
    liquid = LiquidSurface(there.vertices, there.normals, there.triangles, 0)
    after = before.with_liquids(gone, [liquid])
    made = FilmCaster().picture(after, front(), "draft", 1)
    assert (made != FilmCaster().picture(before, front(), "draft", 1)).mean() > 0.02
    everywhere = np.array([[[-1e3] * 3, [1e3] * 3]], np.float32)
    monkeypatch.setattr(Stage, "boxes", lambda self: everywhere)
    every = FilmCaster().picture(after, front(), "draft", 1)
    assert np.abs(made.astype(int) - every).max() <= 1


@pytest.mark.parametrize("corner", [(0, 0), (3, 5), (7, 2)])
def test_pixels_that_are_smoothed_over_look_along_every_direction_once(corner):
    top, left = corner
    places = [(i, j) for i in range(top, top + 12) for j in range(left, left + 12)]
    asked = sorted(number_of(i, j) for i, j in places if asks(i, j))
    assert asked == list(range(WAYS))


def test_floor_that_only_some_sky_is_hidden_from_is_darkened_evenly(monkeypatch):
    """Asked at the corners of tiles or by every fourth pixel: the same to two grey levels."""
    aim = Aim((0.0, -6.0, 3.0), (0.0, 0.0, 0.2), 40.0, 320, 240)
    tall = stage("a red ball")
    soft = FilmCaster().picture(tall, aim, "draft", 1).astype(int)
    bare = FilmCaster().picture(stage("nothing"), aim, "draft", 1).astype(int)
    monkeypatch.setattr("corporeal.render.film_picture.FAR", NEAR)
    cast = FilmCaster().picture(tall, aim, "draft", 1).astype(int)
    assert np.abs(soft - cast).max() <= 2
    assert 0 < np.abs(soft - cast).mean() < 0.1 < np.abs(bare - cast).mean()


@pytest.mark.parametrize("eye", [(0.0, -6.0, 1.5), (0.3, -0.9, 0.4), (0.0, -0.1, 0.2)])
@pytest.mark.parametrize("name", ["a mirror beside a ball", "a pane before a ball"])
def test_no_triangle_is_seen_beside_the_tiles_that_it_could_be_seen_in(name, eye):
    """From afar, from so near that most of it is beyond the picture, and from within."""
    there, aim = stage(name), Aim(eye, (0.1, 0.0, 0.3), 40.0, 90, 70)
    job = Job(there, aim, Sampling(1, 1, 1))
    rays = job.rays((0, aim.height))
    seen = there.hit(rays.origin, rays.direction)[0].reshape(aim.height, aim.width) >= 0
    size = aim.width, aim.height
    marked = cull.outlined(there, job.eye, job.frame, job.tangent, size)
    pixels = np.repeat(np.repeat(marked, TILE, axis=0), TILE, axis=1)[: aim.height, : aim.width]
    assert seen.any()
    assert not (seen & ~pixels).any()
    if eye[1] < -5:
        assert pixels.sum() < 5 * seen.sum()


def test_the_displays_curve_is_that_of_srgb():
    light = np.linspace(0, 1, 100_001, dtype=np.float32)
    place = light * CURVED
    number = np.minimum(place.astype(int), CURVED - 1)
    grey = CURVE[number] + (place - number) * (CURVE[number + 1] - CURVE[number])
    assert np.abs(grey - 255 * encoded(light)).max() < 1e-3


def test_floor_beside_a_contact_is_as_dark_as_many_rays_find_it(monkeypatch):
    """Without rays of their own, pixels there show the light of twelve pixels about them."""
    box = trimesh.creation.box((0.6, 0.6, 0.4))
    corners = np.asarray(box.vertices) + np.array([0, 0, 0.2])
    there = Stage(scene([Surface("box", 0, 0, corners, np.asarray(box.faces))]))
    aim = Aim((-1.8, -2.2, 1.2), (0.0, 0.0, 0.2), 30.0, 400, 300)
    monkeypatch.setitem(embree.SAMPLING, "exact", Sampling(3, 1, 16))
    exact = render(there, aim, "exact", 1).astype(float)
    floor = identify(there, aim)[0] < 0

    def off():
        made = FilmCaster().picture(there, aim, "draft", 1)
        return np.sqrt(((made - exact) ** 2).mean(axis=2)) * floor

    asked = off()
    monkeypatch.setattr(Asker, "again", lambda *_: None)
    shared = off()
    beside = shared > 8
    assert beside.sum() > 300
    assert np.sqrt((asked[beside] ** 2).mean()) < 0.5 * np.sqrt((shared[beside] ** 2).mean())
    assert np.sqrt((asked**2).mean()) < 0.6 * np.sqrt((shared**2).mean())
