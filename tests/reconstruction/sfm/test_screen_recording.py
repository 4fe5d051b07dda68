"""A page that is scrolled is no way around a thing."""

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from corporeal.core.errors import UserError
from corporeal.reconstruction.sfm.screen_recording import is_screen_recording, page_shift
from corporeal.reconstruction.sfm.video_frames import write_video_frames

HIGH, WIDE, STEP, COUNT = 320, 192, 40, 40


@pytest.fixture
def page():
    """Lines of words: marks of a letter's width that end anywhere."""
    rng = np.random.default_rng(0)
    marks = rng.random((STEP * COUNT // 8 + HIGH // 8, WIDE // 4)) > 0.4
    marks[1::2] = False
    return np.kron(~marks, np.ones((8, 4))) * 235.0 + 10


def windows(page):
    return [page[k * STEP : k * STEP + HIGH].astype(np.uint8) for k in range(COUNT)]


def written(frames, folder):
    for k, frame in enumerate(frames):
        Image.fromarray(frame).save(folder / f"{k:03d}.png")
    return sorted(folder.glob("*.png"))


@pytest.mark.parametrize("header", [0, 48])
def test_a_page_that_is_scrolled_is_reported_though_its_header_stays(page, tmp_path, header):
    frames = windows(page)
    for frame in frames:
        frame[:header] = np.roll(page[:header], 50, axis=1)
    assert is_screen_recording(written(frames, tmp_path))


def test_who_passes_by_near_and_far_objects_does_not_scroll(page, tmp_path):
    """What is near moves twice as far."""
    frames = windows(page)
    for k, frame in enumerate(frames):
        frame[HIGH // 2 :] = page[2 * k * STEP // 3 :][: HIGH // 2, ::-1]
    assert not is_screen_recording(written(frames, tmp_path))


def test_a_page_that_is_pushed_a_little_is_not_reported_to_be_scrolled(page, tmp_path):
    assert not is_screen_recording(written(windows(page)[:10], tmp_path))


def test_by_how_much_is_known(page):
    assert page_shift(page[:HIGH], page[STEP : STEP + HIGH]) == (-STEP, 0)
    assert page_shift(page[:HIGH], page[:HIGH]) is None


def test_a_video_of_it_is_refused_in_one_sentence(page, tmp_path):
    video = tmp_path / "page.mp4"
    writer = imageio_ffmpeg.write_frames(str(video), (WIDE, HIGH), fps=10, quality=8)
    writer.send(None)
    for frame in windows(page):
        writer.send(np.ascontiguousarray(np.dstack([frame] * 3)))
    writer.close()
    with pytest.raises(UserError, match=r"a recording of a page that is scrolled\. Record the object"):
        write_video_frames(video, tmp_path / "frames", lambda share, words: None)
