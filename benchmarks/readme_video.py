"""Make the moving picture at the top of the README: three showcase scenes side by side.

    python benchmarks/readme_video.py [--folder runs/showcase] [--sheet FILE]

Simulates each scene at detail draft (what lies in ``--folder`` already is used again), renders its video,
and writes docs/images/showcase.webp. All scenes share one clock: a shorter one waits at its end.
``--sheet`` writes six instants as a still picture, to look at.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import STAGE_FOLDERS, Settings
from corporeal.pipeline.stages.video import VideoConfig

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "showcase.webp"
PANEL = 300, 225
"""Width and height of a scene in the picture [px]."""
VIDEO_SIZE_PX = 400, 300
"""Width and height of its video [px]."""
FPS = 60
"""Of the showcase's simulations."""
EVERY = 1
"""Simulated frames from one picture to the next."""
SLOWER = 1.5
"""Seconds of the picture to a second of a scene."""
REST = 1.2
"""How long the last picture stays [s]."""
QUALITY = 80
"""Of the WebP encoder, up to 100."""
LIMIT = 3_000_000
"""Bytes that the picture may have."""
INK = (60, 60, 66)


@dataclass(frozen=True)
class Panel:
    """One scene and the part of its video that is shown."""

    scene: str
    words: str
    """What the scene shows."""
    left: float = 0.0
    """Share of the video's width that is cut off at the left."""
    top: float = 0.0
    """Share of the video's height that is cut off above."""
    share: float = 1.0
    """Share of the video's width and height that is kept."""

    def cut(self, picture: Image.Image) -> Image.Image:
        """Return the part that is shown, at the size of a panel, with its words below."""
        width, height = picture.size
        x, y = self.left * width, self.top * height
        box = (x, y, x + self.share * width, y + self.share * height)
        shown = picture.resize(PANEL, Image.Resampling.LANCZOS, box)
        middle = (PANEL[0] / 2, PANEL[1] - 14)
        font = ImageFont.load_default(size=14)
        ImageDraw.Draw(shown).text(middle, self.words, fill=INK, font=font, anchor="mm")
        return shown


PANELS = (
    Panel("duck-on-mud", "mud: plastic flow", 0.0, 0.06, 0.94),
    Panel("vase-ball-armchair", "contact and separation"),
    Panel("tree-and-ball-in-sand", "sand: granular flow", 0.08, 0.1, 0.86),
)


def stills(panel: Panel, folder: Path) -> list[Image.Image]:
    """Simulate a scene and render its video; return its frames as panels."""
    run = folder / f"{panel.scene}-draft"
    scene = run_pipeline.write_showcase(panel.scene, run / "input")
    video = VideoConfig(width=VIDEO_SIZE_PX[0], height=VIDEO_SIZE_PX[1], stills=True)
    run_pipeline.run([scene], run, Settings(video=video), until="video")
    paths = sorted((run / STAGE_FOLDERS["video"] / "stills").glob("*.png"))
    return [panel.cut(Image.open(path).convert("RGB")) for path in paths[::EVERY]]


def side_by_side(videos: list[list[Image.Image]]) -> list[Image.Image]:
    """Join panels of the same instant; a video that is over stays at its last frame."""
    joined = []
    for instant in range(max(map(len, videos))):
        picture = Image.new("RGB", (len(videos) * PANEL[0], PANEL[1]))
        for column, video in enumerate(videos):
            picture.paste(video[min(instant, len(video) - 1)], (column * PANEL[0], 0))
        joined.append(picture)
    return joined


def write(pictures: list[Image.Image]) -> None:
    """Write the animation, which repeats without end.

    Raises:
        SystemExit: It is larger than a README should load.

    """
    step = round(1000 * EVERY * SLOWER / FPS)
    durations = [step] * (len(pictures) - 1) + [round(1000 * REST)]
    rest = {"append_images": pictures[1:], "duration": durations, "loop": 0}
    pictures[0].save(PICTURE, save_all=True, quality=QUALITY, method=6, **rest)
    size = PICTURE.stat().st_size
    print(f"{PICTURE}: {len(pictures)} pictures, {size / 1e6:.2f} MB")
    if size > LIMIT:
        raise SystemExit(f"More than {LIMIT / 1e6:.0f} MB. Lower QUALITY, or raise EVERY.")


def sheet(pictures: list[Image.Image], path: Path) -> None:
    """Write six instants one below the other."""
    chosen = [pictures[round(k * (len(pictures) - 1) / 5)] for k in range(6)]
    width, height = chosen[0].size
    joined = Image.new("RGB", (width, 6 * height))
    for row, picture in enumerate(chosen):
        joined.paste(picture, (0, row * height))
    joined.save(path)


def main() -> None:
    """Make the picture."""
    ask = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    ask.add_argument("--folder", type=Path, default=Path("runs/showcase"))
    ask.add_argument("--sheet", type=Path)
    told = ask.parse_args()
    pictures = side_by_side([stills(panel, told.folder) for panel in PANELS])
    if told.sheet:
        sheet(pictures, told.sheet)
    write(pictures)


if __name__ == "__main__":
    main()
