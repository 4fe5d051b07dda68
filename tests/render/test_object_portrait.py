import numpy as np
import pytest

from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.render.object_portrait import PART_COLOURS, PortraitOptions, part_colour_names, render_portraits

BOX = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)])
SIDES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


def block(number, finish, at, size=1.0):
    return Surface(f"block {number}", number, finish, BOX * size + np.asarray(at), SIDES)


def scene(*surfaces):
    things = tuple(SceneObject(f"o{k}", "box", 1.0) for k in range(3))
    finishes = (Finish("a"), Finish("b", colour=(0.0, 0.0, 0.0, 1.0)))
    return Scene("s", "by hand", things, surfaces, finishes)


SMALL = PortraitOptions(count=3, size=48)


def test_an_object_is_pictured_alone_and_where_it_stands_does_not_matter():
    alone = render_portraits(scene(block(0, 0, (0, 0, 0))), [0], SMALL)
    crowded = render_portraits(scene(block(1, 1, (0.1, 0, 1)), block(0, 0, (7, -3, 2))), [None, 0], SMALL)
    assert [p.shape for p in alone] == [(48, 48, 3)] * 3
    for one, other in zip(alone, crowded, strict=True):
        assert np.abs(one.astype(int) - other).mean() < 1.0


def test_views_differ_follow_the_seed_and_are_the_same_again():
    thing = scene(block(0, 0, (0, 0, 0)), block(0, 1, (0.2, 0.3, 1), 0.4))
    pictures = render_portraits(thing, [0, 0], SMALL)
    assert len({p.tobytes() for p in pictures}) == 3
    assert all(np.array_equal(a, b) for a, b in zip(pictures, render_portraits(thing, [0, 0], SMALL), strict=True))
    other = render_portraits(thing, [0, 0], PortraitOptions(3, 48, seed=1))
    assert any(not np.array_equal(a, b) for a, b in zip(pictures, other, strict=True))


def test_parts_are_shown_in_their_colours_from_where_most_of_them_are_seen():
    behind = scene(block(0, 0, (0, 0, 0)), block(0, 1, (1, 0.3, 0.3), 0.4))
    *_, last = render_portraits(behind, [0, 1], PortraitOptions(8, 64))
    red, green, blue = (last[..., k].astype(int) for k in range(3))
    assert ((red > 2 * green) & (red > 2 * blue)).sum() > 300
    assert ((blue > 1.5 * green) & (blue > 2 * red)).sum() > 60


def test_every_part_has_a_colour_with_a_name():
    assert part_colour_names(3) == ["red", "blue", "yellow"]
    many = part_colour_names(40)
    assert len(many) == 40
    assert set(many) == set(PART_COLOURS)


@pytest.mark.parametrize("count", [1, 8])
def test_as_many_views_as_asked_for(count):
    assert len(render_portraits(scene(block(0, 0, (0, 0, 0))), [0], PortraitOptions(count, 16))) == count
    assert PortraitOptions(count, 16).words == f"{count} of 8 views, 16 px, seed 0"


def test_the_bytes_by_which_answers_are_cached_do_not_depend_on_the_number_of_cores(monkeypatch):
    thing = scene(block(0, 0, (0, 0, 0)), block(0, 1, (0.2, 0.3, 1), 0.4))
    taken = []
    for count in (1, 4):
        for module in ("object_portrait", "embree"):
            monkeypatch.setattr(f"corporeal.render.{module}.usable_cores", lambda n=count: n)
        taken.append(render_portraits(thing, [0, 1], PortraitOptions(2, 256)))
    assert all(np.array_equal(a, b) for a, b in zip(*taken, strict=True))
