"""A folder of two places is told from one that is seen from all around, before a long search."""

import shutil

import numpy as np
import pytest
from PIL import Image

from corporeal.core.errors import BadFileError
from corporeal.reconstruction.sfm.find_poses import find_poses
from corporeal.reconstruction.sfm.place_groups import (
    MIN_SHARED_POINTS,
    PlaceGroups,
    copies_share_enough,
    describe_missing_poses,
    drop_other_places,
    hopelessness_reason,
    match_small_copies,
    place_groups,
)
from corporeal.reconstruction.sfm.prepare_images import PreparedImages, prepare_images
from patterned_scene import patterned, photographs, ring


def silent(*_):
    pass


def circle(count, reach=3):
    """Pictures each of which shares points with its neighbours on both sides."""
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    apart = np.minimum(apart, count - apart)
    return np.where((apart > 0) & (apart <= reach), 100, 0)


def beside(*blocks):
    sizes = [len(b) for b in blocks]
    whole = np.zeros((sum(sizes), sum(sizes)), np.int64)
    for block, at in zip(blocks, np.cumsum([0, *sizes[:-1]]), strict=True):
        whole[at : at + len(block), at : at + len(block)] = block
    return whole


def test_one_circle_is_one_place():
    found = place_groups(circle(40))
    assert [len(g) for g in found.certain] == [40] and not found.mixed and found.beside == ()


def test_two_circles_are_two_places_unless_one_link_joins_them():
    shared = beside(circle(30), circle(20))
    found = place_groups(shared)
    assert found.mixed and [len(g) for g in found.certain] == [30, 20] and found.beside == ()
    shared[3, 40] = shared[40, 3] = MIN_SHARED_POINTS
    assert not place_groups(shared).mixed


def test_a_small_other_place_is_left_out():
    found = place_groups(beside(circle(40), circle(8)))
    assert not found.mixed and found.beside == tuple(range(40, 48))


def test_pictures_that_share_little_say_nothing():
    """As 16 of a banana on a carpet, in groups of 7, 4 and 3 when small: COLMAP places 15."""
    found = place_groups(beside(circle(7, 1), circle(4, 1), circle(3, 1), np.zeros((2, 2), int)))
    assert found == PlaceGroups(())


def test_a_folder_of_which_two_fifths_show_something_else_each_goes_on_without_these():
    """As 500 photographs of which 200 are of other days; of fewer COLMAP leaves out its own."""
    found = place_groups(beside(circle(60), np.zeros((40, 40), int)))
    assert not found.mixed and found.beside == tuple(range(60, 100))
    assert place_groups(beside(circle(60), np.zeros((14, 14), int))).beside == ()
    few = place_groups(beside(circle(40), np.zeros((60, 60), int)))
    assert few.beside == (), "nobody can say that the fewer are what is meant"


def test_what_joins_but_a_few_others_is_left_out_with_what_joins_none():
    """As 100 of 500 pictures: 59 of a doll, 18 of an axe head, and 23 of a pot in small pieces.

    With the 23 all but one of the 59 would have to be placed, for seven tenths to fit together.
    """
    pieces = [circle(k, 1) for k in (4, 3, 2, 2, 2)]
    found = place_groups(beside(circle(59, 6), circle(18, 4), *pieces, np.zeros((10, 10), int)))
    assert not found.mixed and found.beside == tuple(range(59, 100))


def test_why_pictures_are_left_out_is_reported_as_far_as_it_is_known():
    """Ten of 25 of a ball on a white table shared nothing, and 'showed another place'."""
    names = tuple(f"{k}.jpg" for k in range(25))
    there = PreparedImages(names, ((640, 480),) * 25, ())
    left = drop_other_places(there, place_groups(beside(circle(15), np.zeros((10, 10), int))))
    assert left.names == names[:15] and len(left.said) == 1
    assert left.said[0].startswith("10 photographs share too few points with the others and were")
    left = drop_other_places(there, place_groups(beside(circle(19, 6), circle(6, 4))))
    assert [s[:34] for s in left.said] == ["6 photographs show another place a"]


def test_pictures_that_share_much_when_small_need_no_finer_points():
    large, small = [(1280, 960)] * 40, [(640, 480)] * 40
    assert copies_share_enough(circle(40, 6), large) and not copies_share_enough(circle(40, 3), large)
    assert not copies_share_enough(circle(40, 6), small), "they would have no more points than copies"


def test_a_search_is_in_vain_where_few_pictures_share_anything():
    assert hopelessness_reason(np.zeros((20, 20), int)) == "none of 20 pictures share points with any other"
    few = beside(circle(4, 1), np.zeros((16, 16), int))
    assert hopelessness_reason(few) == "only 4 of 20 pictures share points with any other"
    banana = beside(circle(7, 1), circle(4, 1), circle(3, 1), np.zeros((2, 2), int))
    assert hopelessness_reason(banana) is None, "in groups when small, and yet 15 of 16 are placed"


def test_pictures_of_nothing_alike_are_refused_before_the_long_search(tmp_path):
    pytest.importorskip("pycolmap")
    photos = tmp_path / "photos"
    photos.mkdir()
    for k in range(10):
        noise = np.random.default_rng(k).integers(0, 255, (30, 40, 3), dtype=np.uint8)
        picture = Image.fromarray(noise).resize((320, 240), Image.Resampling.BICUBIC)
        picture.save(photos / f"{k}.jpg", quality=95)
    told = "cannot be found: none of 10 pictures share points with any other[.]"
    with pytest.raises(BadFileError, match=told) as error:
        find_poses(photos, tmp_path / "poses", silent)
    assert "newspaper" in str(error.value) and "\n" not in str(error.value)
    assert not (tmp_path / "poses" / "plain").exists(), "before the long search"


@pytest.fixture(scope="module")
def two_places(tmp_path_factory):
    folder = tmp_path_factory.mktemp("places") / "photos"
    for k, count in enumerate((14, 12)):
        aims = ring(np.arange(count) * 20, (320, 240))
        photographs(folder / f"own{k}", aims, patterned(seed=10 * k))
        for file in sorted((folder / f"own{k}").iterdir()):
            shutil.move(file, folder / f"{'ab'[k]}_{file.name}")
        (folder / f"own{k}").rmdir()
    return folder


@pytest.mark.slow
def test_two_places_in_one_folder_are_refused_in_one_sentence(two_places, tmp_path):
    pytest.importorskip("pycolmap")
    told = "show 2 objects or places .* 14 like a_photo_000.jpg, 12 like b_photo_000.jpg"
    with pytest.raises(BadFileError, match=told) as error:
        find_poses(two_places, tmp_path / "poses", silent)
    assert "folder of their own" in str(error.value) and "\n" not in str(error.value)
    assert not (tmp_path / "poses" / "plain").exists(), "before the long search"


@pytest.mark.slow
def test_points_are_shared_within_a_place_alone(two_places, tmp_path):
    pytest.importorskip("pycolmap")
    gathered = prepare_images(two_places, tmp_path, silent)
    shared = match_small_copies(tmp_path, gathered, silent).shared
    assert (shared == shared.T).all() and (shared[:14, 14:] < MIN_SHARED_POINTS).all()
    assert (np.diagonal(shared[:14, :14], 1) >= MIN_SHARED_POINTS).all()
    again = match_small_copies(tmp_path, gathered, silent).shared
    assert (again == shared).all(), "seeded"


def test_who_is_refused_hears_how_many_pictures_show_something_else():
    why = describe_missing_poses(["only 54 of 86 pictures fit together"], 34)
    assert why.endswith("only 54 of 86 pictures fit together; 34 more show another place.")
    assert describe_missing_poses(["only 54 of 86 pictures fit together"], 0).endswith("fit together.")
