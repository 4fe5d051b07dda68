"""Selection of sharp, distinct frames of a video.

ffmpeg decodes the video twice: once small and grey, to choose, and once to write what was chosen. It turns pictures as
the video's own matrix says.

Share of static pixels of a video: a screen's frame, or the surroundings of a turntable.

Where a camera moves about an object, whatever has contrast moves in its pictures. What does not would be taken for the
world that stands still, and all cameras put at one place.
"""

import contextlib
import logging
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from jaxtyping import Float, Float32, UInt8
from PIL import Image
from scipy.ndimage import laplace

from corporeal.core.errors import BadFileError
from corporeal.core.progress import Progress
from corporeal.reconstruction.sfm.screen_recording import is_screen_recording

MIN_PIXEL_CONTRAST_U8 = 12.0
"""Mean difference of neighbouring pixels, of 255, from which on one would see a pixel move."""
STATIC_RANGE_U8 = 10
"""Range of a pixel's greys over the video, of 255, that compression makes of what stands still."""
MIN_CONTRAST_PIXELS = 50
"""Pixels of contrast without which there is no result."""


class StaticPixels:
    """Told all frames of a video, one after the other."""

    def __init__(self) -> None:
        self.frames = 0
        self.low: UInt8[np.ndarray, "H W"] = np.zeros((0, 0), np.uint8)
        self.high: UInt8[np.ndarray, "H W"] = np.zeros((0, 0), np.uint8)
        self.contrast: Float32[np.ndarray, "H W"] = np.zeros((0, 0), np.float32)

    def look(self, grey: UInt8[np.ndarray, "H W"]) -> None:
        """Take in one more frame, of the same size."""
        if not self.frames:
            self.low, self.high = grey.copy(), grey.copy()
            self.contrast = np.zeros(grey.shape, np.float32)
        self.frames += 1
        np.minimum(self.low, grey, out=self.low)
        np.maximum(self.high, grey, out=self.high)
        signed = grey.astype(np.float32)
        self.contrast[:, 1:] += np.abs(np.diff(signed, axis=1))
        self.contrast[1:] += np.abs(np.diff(signed, axis=0))

    @property
    def share(self) -> float:
        """Of the pixels of contrast, those that never changed [-]."""
        clear = self.contrast > MIN_PIXEL_CONTRAST_U8 * self.frames
        if np.count_nonzero(clear) < MIN_CONTRAST_PIXELS:
            return 0.0
        still = self.high.astype(int) - self.low <= STATIC_RANGE_U8
        return float((clear & still).sum() / clear.sum())


CHOSEN_FRAMES = 60
"""Stretches of equal change; each gives one frame."""
MIN_FRAMES = 20
"""Frames from which an object is seen from all sides."""
MIN_SHARPNESS_RATIO = 0.3
"""Sharpness, over the median of the frames around, below which a frame is smeared."""
SHARPNESS_WINDOW_FRAMES = 15
"""Frames on either side that sharpness is compared with."""
MAX_VIDEO_S = 600.0
"""Of a video [s]."""
MAX_DECODED_FRAMES = 3000
"""Frames that are looked at; of longer videos every second, third … one."""
SHARPNESS_PICTURE_PX, CHANGE_THUMBNAIL_PX = 480, (32, 24)
"""Longer side of the pictures in which sharpness is measured; size of those for change [px]."""
CHANGE_NOISE_U8 = 0.05
"""Mean difference of neighbouring thumbnails, of 255, that is noise."""
MAX_STATIC_FRACTION = 0.25
"""Share of what has contrast that never moves, from which on a video shows no way around an object."""
VIDEO_HINT = "Record the object slowly, all around and from above, for 20 to 60 s."


@dataclass(frozen=True)
class VideoInfo:
    """Metadata of a video."""

    path: Path
    seconds: float
    rate: float
    """Frames per second."""

    @property
    def looked(self) -> float:
        """Frames per second that are looked at."""
        return min(self.rate, MAX_DECODED_FRAMES / max(self.seconds, 1e-3))


def write_video_frames(path: Path, folder: Path, progress: Progress, max_seconds: float = MAX_VIDEO_S) -> list[str]:
    """Write the chosen frames of a video as PNG; return messages about them.

    Args:
        path: The video.
        folder: Where frames go, named by their number.
        progress: Called with the fraction done and a description.
        max_seconds: Longer videos are rejected [s].

    Raises:
        BadFileError: It cannot be read, is too long, fewer than 20 frames of it are of use, or it is a recording of a
            screen.
    """
    video = _open_video(path, max_seconds)
    change, sharp = [0.0], []
    before, standstill = None, StaticPixels()
    expected = max(video.looked * video.seconds, 1.0)
    for grey in _grey_frames(video):
        small = np.asarray(Image.fromarray(grey).resize(CHANGE_THUMBNAIL_PX, Image.Resampling.BOX), float)
        standstill.look(grey)
        sharp.append(float(laplace(grey.astype(np.float32)).var()))
        if before is not None:
            change.append(float(np.abs(small - before).mean()))
        before = small
        progress(min(len(sharp) / expected, 1.0) * 0.7, "looking for sharp frames")
    if len(sharp) < MIN_FRAMES:
        raise BadFileError(path, f"holds {len(sharp)} frames; at least {MIN_FRAMES} are needed.", VIDEO_HINT)
    chosen = choose_frames(np.array(change), np.array(sharp), CHOSEN_FRAMES)
    if len(chosen) < MIN_FRAMES:
        count = f"only {len(chosen)}" if len(chosen) else "none"
        what = f"{count} of {len(sharp)} frames are sharp and differ from one another"
        raise BadFileError(path, f"{what}; at least {MIN_FRAMES} are needed.", VIDEO_HINT)
    if standstill.share > MAX_STATIC_FRACTION:
        what = f"{standstill.share:.0%} of what has contrast in it never moves: it is a recording"
        what += " of a screen, or the camera stood still."
        raise BadFileError(path, what, f"{VIDEO_HINT} Do not turn the object instead.")
    progress(0.7, "writing frames")
    _write_chosen(video, chosen, folder)
    if is_screen_recording(sorted(folder.glob("frame_*.png"))):
        what = "what it shows is pushed aside as a whole, many times as far as a picture is long: "
        raise BadFileError(path, f"{what}it is a recording of a page that is scrolled.", VIDEO_HINT)
    return [
        f"{len(chosen)} frames of {len(sharp)} that were looked at in {path.name} were chosen: "
        "sharp ones, at equal steps of change."
    ]


def choose_frames(change: Float[np.ndarray, " F"], sharp: Float[np.ndarray, " F"], count: int) -> list[int]:
    """Return the numbers of the sharpest frame of each stretch of equal change, if it is sharp.

    Args:
        change: Difference of each frame from the one before [-].
        sharp: Variance of each frame's Laplacian [-].
        count: Stretches.
    """
    way = np.cumsum(np.where(change > CHANGE_NOISE_U8, change, 0.0))
    if way[-1] <= 0:
        return []
    stretch = np.minimum((way / way[-1] * count).astype(int), count - 1)
    chosen = []
    for k in np.unique(stretch):
        inside = np.flatnonzero(stretch == k)
        best = int(inside[sharp[inside].argmax()])
        around = sharp[max(0, best - SHARPNESS_WINDOW_FRAMES) : best + SHARPNESS_WINDOW_FRAMES + 1]
        if sharp[best] > MIN_SHARPNESS_RATIO * np.median(around):
            chosen.append(best)
    return chosen


def _open_video(path: Path, max_seconds: float) -> VideoInfo:
    # It warns that a turned video is not as wide as its frames are stored: so it should be.
    logging.getLogger("imageio_ffmpeg").setLevel(logging.ERROR)
    reading = imageio_ffmpeg.read_frames(str(path))
    try:
        said = next(reading)
        video = VideoInfo(path, float(said["duration"]), float(said["fps"]))
    except Exception as problem:  # it raises what ffmpeg says, of several kinds
        what = "cannot be read as a video: it is damaged, or holds no moving pictures."
        step = "Copy it from the camera again, to its end, or convert it to MP4."
        raise BadFileError(path, what, step) from problem
    finally:
        with contextlib.suppress(Exception):
            reading.close()
    if video.seconds > max_seconds:
        what = f"is {video.seconds / 60:.0f} minutes long; at most {max_seconds / 60:.0f} are looked at."
        raise BadFileError(path, what, "Cut out the part that goes around the object.")
    return video


def _grey_frames(video: VideoInfo) -> Iterator[UInt8[np.ndarray, "H W"]]:
    """Yield the frames that are looked at, small and grey."""
    scale = f"scale={SHARPNESS_PICTURE_PX}:{SHARPNESS_PICTURE_PX}:force_original_aspect_ratio=decrease"
    command = [*_decode_command(video, scale), "-pix_fmt", "gray", "-c:v", "pgm", "-f", "image2pipe", "-"]
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as program:
        assert program.stdout is not None
        try:
            while program.stdout.readline().strip() == b"P5":
                width, height = map(int, program.stdout.readline().split())
                program.stdout.readline()  # the largest grey
                data = program.stdout.read(width * height)
                if len(data) < width * height:
                    return
                yield np.frombuffer(data, np.uint8).reshape(height, width)
        finally:
            program.kill()


def _decode_command(video: VideoInfo, *filters: str) -> list[str]:
    """Return a command that decodes the frames that are looked at."""
    thinned = [f"fps={video.looked:.6f}"] if video.looked < video.rate else []
    program = imageio_ffmpeg.get_ffmpeg_exe()
    chain = ",".join([*thinned, *filters])
    return [program, "-v", "error", "-i", str(video.path), "-vf", chain, "-fps_mode", "passthrough"]


def _write_chosen(video: VideoInfo, chosen: list[int], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    wanted = "+".join(f"eq(n\\,{k})" for k in chosen)
    out = [*_decode_command(video, f"select={wanted}"), str(folder / "%05d.png")]
    done = subprocess.run(out, stdin=subprocess.DEVNULL, capture_output=True, check=False)
    written = sorted(folder.glob("?????.png"))
    if done.returncode or len(written) != len(chosen):
        words = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["no reason"]
        raise BadFileError(video.path, f"its frames cannot be written ({words[0][:80]}).")
    for file, number in zip(written, chosen, strict=True):
        file.rename(folder / f"frame_{number:05d}.png")
