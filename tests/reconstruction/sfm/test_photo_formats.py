"""Photographs of every kind that cameras, telephones and editors write, before poses are found."""

import os

import numpy as np
import pytest
from PIL import Image

from corporeal.core.errors import BadFileError, UserError
from corporeal.io.input_files import photos_in_folder
from corporeal.pipeline.stages.assemble import assemble
from corporeal.reconstruction.sfm.find_poses import _refusal
from corporeal.reconstruction.sfm.prepare_images import (
    PreparedImages,
    focal_from_exif,
    prepare_images,
    spread_selection,
)
from corporeal.reconstruction.sfm.video_frames import write_video_frames

COUNT = 5
EXIF, DESCRIPTION, FILM_FOCAL, PLACE = 0x8769, 0x010E, 0xA405, 0x8825


@pytest.fixture
def greys():
    """Noise that differs from picture to picture, (48, 64) each."""
    rng = np.random.default_rng(0)
    coarse = [rng.integers(0, 255, (6, 8)).astype(np.uint8) for _ in range(COUNT)]
    return [np.kron(grey, np.ones((8, 8), np.uint8)) for grey in coarse]


def gathered(tmp_path):
    return prepare_images(tmp_path / "photos", tmp_path / "poses", lambda fraction, words: None)


def saved(tmp_path, greys, suffix, made, **options):
    (tmp_path / "photos").mkdir(parents=True, exist_ok=True)
    for k, grey in enumerate(greys):
        made(grey).save(tmp_path / "photos" / f"{k}{suffix}", **options)


def test_sixteen_bits_are_scaled_not_clipped_to_white(tmp_path, greys):
    saved(tmp_path, greys, ".png", lambda grey: Image.fromarray(grey.astype(np.uint16) * 257))
    assert len(gathered(tmp_path).names) == COUNT
    with Image.open(tmp_path / "poses" / "images" / "0.jpg") as copy:
        assert np.abs(np.asarray(copy.convert("L"), float) - greys[0]).mean() < 3


def test_what_was_cut_out_in_an_editor_is_its_own_mask(tmp_path, greys):
    inside = np.zeros((48, 64), np.uint8)
    inside[10:30, 20:50] = 255

    def cut_out(grey):
        picture = Image.fromarray(grey).convert("RGB")
        picture.putalpha(Image.fromarray(inside))
        return picture

    saved(tmp_path, greys, ".png", cut_out)
    gathered(tmp_path)
    for k in range(COUNT):
        with Image.open(tmp_path / "poses" / "masks" / f"{k}.png") as mask:
            assert (np.asarray(mask) == inside).all()


def test_an_alpha_that_hides_nothing_is_no_mask(tmp_path, greys):
    saved(tmp_path, greys, ".png", lambda grey: Image.fromarray(grey).convert("RGBA"))
    gathered(tmp_path)
    assert not (tmp_path / "poses" / "masks").exists()


@pytest.mark.parametrize("hidden", ["few in parts", "all over"])
def test_an_alpha_that_few_have_or_that_hides_all_is_no_mask_and_reported(tmp_path, greys, hidden):
    def made(k, grey):
        picture = Image.fromarray(grey).convert("RGBA")
        if hidden == "all over":
            picture.putalpha(0)
        elif k < 2:
            picture.paste((0, 0, 0, 0), (0, 0, 20, 20))
        return picture

    for k, grey in enumerate(greys):
        saved(tmp_path / str(k), [grey], ".png", lambda grey, k=k: made(k, grey))
        (tmp_path / "photos").mkdir(exist_ok=True)
        (tmp_path / str(k) / "photos" / "0.png").rename(tmp_path / "photos" / f"{k}.png")
    found = gathered(tmp_path)
    assert len(found.names) == COUNT and not (tmp_path / "poses" / "masks").exists()
    many = COUNT if hidden == "all over" else 2
    assert found.said[0].startswith(f"{many} of {COUNT} photographs are transparent")
    assert "Cut out all of them, or none" in found.said[0]


@pytest.mark.parametrize("strips", [1, COUNT])
def test_a_panorama_among_photographs_is_left_out_and_named(tmp_path, greys, strips):
    saved(tmp_path, greys, ".jpg", Image.fromarray)
    for k in range(strips):
        wide = Image.fromarray(greys[k]).resize((600, 48))
        wide.save(tmp_path / "photos" / f"{k}.jpg")
    found = gathered(tmp_path)
    if strips == 1:
        assert "0.jpg" not in found.names and len(found.names) == COUNT - 1
        assert "0.jpg is a strip, as a panorama is" in found.said[0]
    else:
        assert len(found.names) == COUNT, "somebody cut all of them"


def test_pictures_in_folders_below_are_reported_unless_they_are_copies_or_masks(tmp_path, greys):
    saved(tmp_path, greys, ".jpg", Image.fromarray)
    photos = tmp_path / "photos"
    for place in ("masks", "images_2", ".thumbnails", "__MACOSX"):
        (photos / place).mkdir()
        Image.fromarray(greys[0]).save(photos / place / "0.jpg")
    Image.fromarray(greys[0]).save(photos / ".thumbnails" / "small.jpg")
    Image.fromarray(greys[0]).save(photos / "masks" / "0_object.png")
    assert gathered(tmp_path).said == ()
    (photos / "second round").mkdir()
    Image.fromarray(greys[0]).save(photos / "second round" / "b.jpg")
    (said,) = gathered(tmp_path).said
    assert said.startswith("1 more picture lies in folders below and was left out, such as second")


def test_of_exif_only_the_lens_is_copied_however_long_the_rest_is(tmp_path, greys):
    exif = Image.Exif()
    exif[DESCRIPTION] = "d" * 70_000  # more than a JPEG can hold
    exif.get_ifd(PLACE)[1] = "N"
    exif.get_ifd(EXIF)[FILM_FOCAL] = 26
    saved(tmp_path, greys, ".png", Image.fromarray, exif=exif)
    gathered(tmp_path)
    copy = tmp_path / "poses" / "images" / "0.jpg"
    assert focal_from_exif(copy) == 26
    with Image.open(copy) as picture:
        assert not picture.getexif().get_ifd(PLACE) and copy.stat().st_size < 20_000


def test_what_else_a_photograph_says_stays_in_it(tmp_path, greys):
    said = {"comment": b"of mine", "xmp": b"<x>of mine</x>"}
    saved(tmp_path, greys, ".jpg", Image.fromarray, **said)
    assert b"of mine" in (tmp_path / "photos" / "0.jpg").read_bytes()
    gathered(tmp_path)
    assert b"of mine" not in (tmp_path / "poses" / "images" / "0.jpg").read_bytes()


def test_files_that_systems_hide_beside_photographs_are_none(tmp_path, greys):
    saved(tmp_path, greys, ".jpg", Image.fromarray)
    for k in range(COUNT):
        (tmp_path / "photos" / f"._{k}.jpg").write_bytes(b"\0\5\x16\7" + bytes(100))
    (tmp_path / "photos" / "0.jpg").write_bytes(b"broken")  # with it, most would be
    assert len(gathered(tmp_path).names) == COUNT - 1


@pytest.mark.parametrize("suffix", [".tif", ".gif", ".DNG", ".avif"])
def test_pictures_of_another_kind_are_named_as_such(tmp_path, greys, suffix):
    saved(tmp_path, greys, suffix, Image.fromarray, format="TIFF")
    article = "an" if suffix == ".avif" else "a"
    said = f"is {article} {suffix[1:].upper()} picture: convert it to JP"
    with pytest.raises(BadFileError, match=said):
        gathered(tmp_path)
    Image.fromarray(greys[0]).save(tmp_path / "photos" / "0.jpg")
    assert [p.name for p in photos_in_folder(tmp_path / "photos")] == ["0.jpg"], "raws lie beside it"


def test_what_is_not_read_beside_photographs_is_reported_if_no_raw_picture(tmp_path, greys):
    saved(tmp_path, greys, ".jpg", Image.fromarray)
    (tmp_path / "photos" / "0.DNG").touch()
    assert gathered(tmp_path).said == ()
    (tmp_path / "photos" / "anders.tif").touch()
    assert gathered(tmp_path).said == (
        "1 more picture is of a kind that is not read (TIF), such as anders.tif: convert what is to be used to JPEG.",
    )


def test_copies_under_other_names_do_not_outnumber_what_they_are_copies_of(tmp_path, greys):
    for copy in ("", " (1)", " copy"):
        saved(tmp_path, greys, f"{copy}.jpg", Image.fromarray)
    found = gathered(tmp_path)
    assert len(found.names) == COUNT and "10 of 15 pictures were left out" in found.said[0]


def test_what_is_no_file_is_named_and_not_waited_for(tmp_path, greys):
    saved(tmp_path, greys, ".jpg", Image.fromarray)
    os.mkfifo(tmp_path / "photos" / "pipe.jpg")
    (tmp_path / "photos" / "lost.jpg").symlink_to("nowhere.jpg")
    (tmp_path / "photos" / "round.jpg").symlink_to("round.jpg")
    found = gathered(tmp_path)
    assert len(found.names) == COUNT
    assert all(f"{name}.jpg is no file" in found.said[0] for name in ("pipe", "lost", "round"))


def test_a_sentence_is_one_line_whatever_photographs_are_called(tmp_path, greys):
    saved(tmp_path, greys, ".jpg", Image.fromarray)
    (tmp_path / "photos" / "two\nlines \udcff.jpg").write_bytes(b"")
    said = gathered(tmp_path).said[0]
    assert "two lines ?.jpg is no PNG" in said and "\n" not in said


def test_one_picture_beside_a_folder_of_photographs_is_reported_where_these_are(tmp_path, greys):
    saved(tmp_path / "mine", greys, ".jpg", Image.fromarray)
    Image.fromarray(greys[0]).save(tmp_path / "mine" / "cover.jpg")
    with pytest.raises(BadFileError, match=r"5 more lie in folders of it: name .*photos\.$"):
        prepare_images(tmp_path / "mine", tmp_path / "poses", lambda fraction, words: None)


def test_folders_of_folders_and_single_files_are_reported_with_where_to_go_on(tmp_path, greys):
    lost = tmp_path / "DCIM" / "100" / "today"
    lost.mkdir(parents=True)
    Image.fromarray(greys[0]).save(lost / "a.jpg")
    with pytest.raises(UserError, match=r"They lie in .*today\. Name that folder"):
        assemble([tmp_path / "DCIM" / "100"])
    with pytest.raises(UserError, match=r"They lie in .*today\. Name that folder"):
        assemble([tmp_path / "DCIM"])
    with pytest.raises(UserError, match=r"is a single picture, which shows no depth\. Take 40"):
        assemble([lost / "a.jpg"])
    (tmp_path / "videos").mkdir()
    (tmp_path / "videos" / "a.MOV").touch()
    with pytest.raises(UserError, match=r"holds 1 videos and no model\. Name the video itself: .*a"):
        assemble([tmp_path / "videos"])


@pytest.mark.parametrize(
    ("name", "said"),
    [("a.jpg", r"is no PNG, JPEG or WebP picture\. Take 40"), ("a.gif", "is a GIF. Convert it to MP4")],
)
def test_what_only_its_name_calls_a_picture_is_not_called_one(tmp_path, name, said):
    """A text called .jpg was "a single picture, which shows no depth"."""
    (tmp_path / name).write_text("text")
    with pytest.raises(UserError, match=said):
        assemble([tmp_path / name])


@pytest.mark.parametrize(("count", "said"), [(1, "1 photograph is"), (2, "2 photographs are")])
def test_good_photographs_that_are_too_few_are_not_reported_to_be_bad(tmp_path, greys, count, said):
    saved(tmp_path, greys[:count], ".jpg", Image.fromarray)
    with pytest.raises(BadFileError, match=f"photos: {said} too few to show an object"):
        gathered(tmp_path)


def test_half_a_video_is_not_advised_to_become_the_kind_it_is(tmp_path):
    (tmp_path / "a.mp4").write_bytes(b"\0\0\0\x20ftypisom" + bytes(200))
    with pytest.raises(BadFileError, match="is damaged, or holds no moving pictures"):
        write_video_frames(tmp_path / "a.mp4", tmp_path / "frames", lambda fraction, words: None)


@pytest.mark.parametrize("turns", [2, 3, 5])
def test_objects_by_turns_are_all_among_the_photographs_that_are_used(turns, tmp_path):
    """Of two photographs at a time, or of five, at equal steps one thing only was looked at."""
    found = [tmp_path / f"{k:03d}" for k in range(500)]
    used = spread_selection(found, 5)
    assert len(used) == 100 and used == sorted(set(used))
    shares = np.bincount([int(file.name) % turns for file in used], minlength=turns) / 100
    assert shares.min() > 0.6 / turns and shares.max() < 1.5 / turns
    assert all(int(file.name) // 5 == k for k, file in enumerate(used))


def test_photographs_that_were_cropped_one_by_one_are_recognised_by_their_sizes(tmp_path, greys):
    saved(tmp_path, greys, ".jpg", Image.fromarray)
    with Image.open(tmp_path / "photos" / "0.jpg") as level:
        level.transpose(Image.Transpose.ROTATE_90).save(tmp_path / "photos" / "0.jpg")
    assert gathered(tmp_path).said == (), "held upright or level"
    for k, grey in enumerate(greys[:4]):
        Image.fromarray(grey[: 40 - k]).save(tmp_path / "photos" / f"{k}.jpg")
    assert gathered(tmp_path).said[0].startswith("5 of 5 photographs have a size that no other has")


def test_who_cropped_photographs_is_not_advised_to_put_down_a_newspaper():
    names = tuple(f"{k}.jpg" for k in range(COUNT))
    cropped = PreparedImages(names, tuple((64, 40 + k) for k in range(COUNT)), ())
    whole = PreparedImages(names, ((64, 48),) * COUNT, ())
    assert "original photographs" in _refusal(["why"], cropped, ()).what_to_do
    assert "newspaper" in _refusal(["why"], whole, ()).what_to_do


def test_masks_under_names_of_no_photograph_are_reported_to_be_none(tmp_path, greys):
    saved(tmp_path, greys, ".png", Image.fromarray)
    place = tmp_path / "photos" / "masks"
    place.mkdir()
    Image.fromarray(greys[0]).save(place / "m1.png")
    (said,) = gathered(tmp_path).said
    assert said.startswith("None of the 1 pictures in masks has the name of a photograph")


def test_masks_that_lie_across_their_photographs_are_refused_at_once(tmp_path, greys):
    saved(tmp_path, greys, ".png", Image.fromarray)
    (tmp_path / "photos" / "masks").mkdir()
    for k, grey in enumerate(greys):
        Image.fromarray(grey.T.copy()).save(tmp_path / "photos" / "masks" / f"{k}.png")
    with pytest.raises(BadFileError, match="a mask of 48 × 64 pixels, which lies across its 64"):
        gathered(tmp_path)


@pytest.mark.parametrize("kind", ["webp", "png"])
def test_a_picture_that_moves_is_no_single_one(tmp_path, greys, kind):
    path = tmp_path / f"spin.{kind}"
    frames = [Image.fromarray(grey) for grey in greys[:3]]
    frames[0].save(path, save_all=True, append_images=frames[1:])
    with pytest.raises(BadFileError, match=r"is a picture that moves\. Convert it to MP4"):
        assemble([path])
