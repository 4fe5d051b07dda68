import numpy as np
import pytest
from test_embree import RED, ball, front, scene, sheet

from corporeal.render.camera import Aim
from corporeal.render.embree import Stage, render
from corporeal.render.film_picture import FilmCaster
from corporeal.types import Finish

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
