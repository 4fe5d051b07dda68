"""A video file: pictures go to a separate ffmpeg program one by one; memory stays flat."""

import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import imageio_ffmpeg
import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.store import DiskError, disk_errors
from corporeal.recognition.readable_names import single_line_text

X264_PRESET, X264_CRF = "veryfast", 14
"""x264's preset and constant rate factor: 0 is lossless, 23 its default. "medium" at 17
makes files as large, and errors as large, in twice the time."""

MIN_SIDE_PX, MAX_SIDE_PX = 16, 4096
"""Sides of a video [px]."""
MAX_CREDIT_CHARACTERS = 20_000
"""Of a video [characters]: a command line takes no more than 128 KiB at a time."""


class VideoWriter:
    """A video being written; ``add`` takes the next picture."""

    def __init__(self, program: "subprocess.Popen[bytes]", log: IO[Any], path: Path) -> None:
        self.program, self.log, self.path = program, log, path

    def add(self, picture: np.ndarray) -> None:
        """Append one picture (height, width, 3) uint8."""
        assert self.program.stdin is not None
        try:
            self.program.stdin.write(np.ascontiguousarray(picture).tobytes())
        except (BrokenPipeError, OSError) as error:
            raise self.failure() from error

    def close(self) -> None:
        """Wait until the encoder has finished."""
        try:
            if self.program.stdin is not None:
                self.program.stdin.close()
        except OSError as error:
            raise self.failure() from error
        if self.program.wait() != 0:
            raise self.failure()

    def failure(self) -> UserError:
        """Describe what went wrong, in the encoder's words."""
        self.program.kill()
        self.program.wait()
        self.log.seek(0)
        words = self.log.read().decode(errors="replace").strip().splitlines()
        if any("No space left" in line for line in words):
            return DiskError(
                f"Cannot write {self.path}: the disk is full. Free some space, then run the same "
                "command again: finished stages are kept."
            )
        last = words[-1] if words else "it stopped without a word"
        return UserError(
            f"Cannot write {self.path}: ffmpeg failed ({last}). Check that "
            f"{self.program.args[0]} -encoders lists libx264, or point IMAGEIO_FFMPEG_EXE to "  # type: ignore[index]
            "another ffmpeg."
        )


def check_size(width: int, height: int) -> None:
    """Raise UserError where a video cannot have such a size."""
    if width % 2 or height % 2 or min(width, height) < MIN_SIDE_PX or max(width, height) > MAX_SIDE_PX:
        raise UserError(
            f"A video cannot be {width} × {height} pixels. Both must be even, from {MIN_SIDE_PX} to {MAX_SIDE_PX}."
        )


@contextmanager
def open_video(path: Path, fps: int, size: tuple[int, int], credit: str = "") -> Iterator[VideoWriter]:
    """Write H.264 that any browser plays to ``path``, which appears only when it is finished.

    Args:
        path: Of the video.
        fps: Pictures per second.
        size: Width and height [px].
        credit: Whose objects are to be seen, and under which licences; the video carries it.

    Raises:
        UserError: The size is odd, the disk is full, or the encoder is missing or fails.
    """
    check_size(*size)
    partial = path.with_name(f".{path.stem}.part{path.suffix}")
    with disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        log = tempfile.TemporaryFile()
    try:
        options = [*_picture_options(fps, size), *_credit_options(credit)]
        video = VideoWriter(_encoder(partial, options, log), log, path)
        try:
            yield video
            video.close()
        except BaseException:
            video.program.kill()
            video.program.wait()
            raise
        with disk_errors(path):
            partial.replace(path)
    finally:
        log.close()
        partial.unlink(missing_ok=True)


def _encoder(path: Path, options: list[str], log: IO[Any]) -> Any:
    try:
        program = imageio_ffmpeg.get_ffmpeg_exe()
        command = [program, "-y", "-loglevel", "error", *options, str(path)]
        return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=log)
    except (RuntimeError, OSError) as error:
        raise UserError(
            f"Cannot write {path}: no ffmpeg program can be started ({error}). "
            "Install it, or point IMAGEIO_FFMPEG_EXE to one."
        ) from error


def _picture_options(fps: int, size: tuple[int, int]) -> list[str]:
    colour = ["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"]
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}"]
    return [
        *(*source, "-r", str(fps), "-i", "-", "-an"),
        *("-vf", "scale=out_color_matrix=bt709:out_range=tv", "-pix_fmt", "yuv420p"),
        *("-c:v", "libx264", "-preset", X264_PRESET, "-crf", str(X264_CRF), "-threads", "2"),
        *(*colour, "-color_range", "tv", "-movflags", "+faststart"),
    ]


def _credit_options(credit: str) -> list[str]:
    """Return what puts the credit where players and catalogues look for it."""
    words = single_line_text(credit)[:MAX_CREDIT_CHARACTERS]
    return ["-metadata", f"copyright={words}", "-metadata", f"comment={words}"] if words else []


def _unreadable(path: Path, error: Exception) -> UserError:
    """State that a video cannot be read, by the last line of all that the program says."""
    if not path.exists():
        return UserError(f"{path}: there is no such video. Make it again.")
    last = (str(error).strip().splitlines() or ["it is empty"])[-1].strip(" .)")
    return UserError(f"{path}: cannot be read as a video ({last}). Make it again.")


def count_frames(path: Path) -> int:
    """Count the frames of a video.

    Raises:
        UserError: The video cannot be read.
    """
    try:
        count, _ = imageio_ffmpeg.count_frames_and_secs(str(path))
    except (OSError, RuntimeError) as error:
        raise _unreadable(path, error) from error
    return int(count or 0)


def read_frames(path: Path, wanted: list[int]) -> list[np.ndarray]:
    """Read some frames (height, width, 3) uint8 of a video, by number, in order.

    Raises:
        UserError: The video cannot be read.
    """
    numbers = sorted(set(wanted))
    chosen = "+".join(rf"eq(n\,{k})" for k in numbers)
    # New times, one after the other: else the gaps between the chosen ones would be filled.
    only = ["-vf", f"select={chosen},setpts=N/FRAME_RATE/TB"]
    try:
        reader = imageio_ffmpeg.read_frames(str(path), output_params=only)
        meta: dict[str, Any] = next(reader)  # type: ignore[assignment]
    except (OSError, RuntimeError, StopIteration) as error:
        raise _unreadable(path, error) from error
    width, height = meta["source_size"]
    found: dict[int, np.ndarray] = {}
    try:
        for number, data in zip(numbers, reader, strict=False):
            found[number] = np.frombuffer(data, np.uint8).reshape(height, width, 3)
    finally:
        reader.close()
    return [found[min(k, max(found))] for k in wanted] if found else []
