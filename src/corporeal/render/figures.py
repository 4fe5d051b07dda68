"""Figures: the scene coloured by materials, and a video as a strip of frames.

One scene in several sets of plain colours, in the same light.

What is seen does not depend on colours. Which light arrives at a surface does not depend on its colour, nor on that of
others where all are matt. Both are asked for once, and shaded in each set of colours.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw, ImageFont

from corporeal.core.errors import UserError
from corporeal.core.process_resources import usable_cores
from corporeal.core.types import MaterialField, Parts, Scene, Video
from corporeal.geometry.srgb import srgb_to_linear
from corporeal.render import colours, video_file
from corporeal.render.camera_placement import CameraAim, fit_camera
from corporeal.render.embree import (
    MIN_BAND_ROWS,
    RAY_SAMPLING,
    PixelBlock,
    Quality,
    Rays,
    RaySampling,
    RenderJob,
    identify_triangles,
)
from corporeal.render.figure_legends import (
    INK_COLOUR,
    LARGE_FONT_PX,
    LegendEntry,
    PanelLegend,
    ScaleTick,
    TextLine,
    drawable_name,
    names_legend,
    scale_legend,
)
from corporeal.render.kernels_hits import HitBuffer
from corporeal.render.png_writer import write_png
from corporeal.render.ray_scene import RayScene, StudioLight
from corporeal.render.video_choices import ColourQuantity


def render_recoloured(
    stages: Sequence[RayScene], camera: CameraAim, quality: Quality
) -> list[UInt8[np.ndarray, "H W 3"]]:
    """Take a picture of each stage: the bytes of ``render``, with one search for light."""
    size = camera.height, camera.width
    pictures = [np.empty((*size, 3), np.uint8) for _ in stages]
    threads = usable_cores()
    band = max(MIN_BAND_ROWS, -(-camera.height // (2 * threads)))
    rows = [(k, min(k + band, camera.height)) for k in range(0, camera.height, band)]

    def take(some: tuple[int, int]) -> None:
        job = _RecolouredJob(stages[0], camera, RAY_SAMPLING[quality])
        for stage, picture in zip(stages, pictures, strict=True):
            job.stage = stage
            job.band(some, picture)

    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(take, rows):
            pass
    return pictures


class _RecolouredJob(RenderJob):
    """Some rows of pictures, the first of which asks for what is seen, and for light."""

    def __init__(self, stage: RayScene, camera: CameraAim, sampling: RaySampling) -> None:
        super().__init__(stage, camera, sampling)
        self._hit: tuple[np.ndarray, ...] | None = None
        self._arrived: np.ndarray | None = None

    def first_hit(self, rays: Rays) -> tuple[np.ndarray, ...]:
        """Return what rays from the camera meet, the same in each picture."""
        if self._hit is None:
            self._hit = super().first_hit(rays)
        return self._hit

    def gather(self, s: HitBuffer, d: np.ndarray, on: np.ndarray, block: PixelBlock) -> np.ndarray:
        """Light that arrives at the samples ``on``, which are the same in each picture."""
        if self._arrived is None:
            self._arrived = super().gather(s, d, on, block)
        return self._arrived


PAPER_LIGHT = StudioLight(
    sun_colour=(2.6, 2.6, 2.6),
    zenith=(0.95, 0.97, 1.0),
    horizon=(1.0, 1.0, 1.0),
    floor="#f4f4f4",
    backdrop=("#ffffff", "#ffffff"),
)
"""A white studio: colours are data here."""
PANEL_SIZE_PX = (520, 390)
"""[px]"""
MAX_LEGEND_ENTRIES = 8
"""Names in a legend before the rest is summed up."""
MAX_LEGEND_CHARACTERS = 24
"""Of a name in a legend before it is cut."""
SI_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"))
SHEET_SIZE_PX, SHEET_PANEL_SIZE_PX = (1485, 1045), (472, 354)
"""The page of all panels, and the picture of each [px]."""
FIRST_PANEL_CORNER_PX, PANEL_STEP_PX = (18, 41), (489, 522)
"""Left and top of the first picture, and from one to the next [px]."""

PANEL_ORDER: tuple[ColourQuantity, ...] = ("material", "law", "young_pa", "poisson", "density", "object")
"""Panels of the figure, row by row."""


@dataclass(frozen=True)
class CategoryPanel:
    """A panel of discrete colours."""

    title: str
    label: Sequence[str]
    """One per part."""
    colour: Sequence[colours.Colour]
    """One per part, sRGB."""


@dataclass(frozen=True)
class NumericPanel:
    """A panel of a continuous quantity."""

    title: str
    unit: str
    value: Sequence[float]
    """One per part, SI."""
    log: bool = False


def fields_figure(
    scene: Scene, parts: Parts, field: MaterialField, path: Path, picture_px: tuple[int, int] = PANEL_SIZE_PX
) -> None:
    """Draw six panels: material, law, stiffness, Poisson's ratio, density and object.

    picture_px: width and height of what is rendered for each panel; it is scaled to the panel.

    Raises:
        UserError: The file cannot be written.
    """
    stage = RayScene(scene)
    camera = fit_camera(_boxes(scene), picture_px, fill=0.93)
    seen, _ = identify_triangles(stage, camera)
    share = _visible_pixels(seen, parts)
    sheet = Image.new("RGB", SHEET_SIZE_PX, "white")
    shown = colour_panels(scene, parts, field)
    chosen = [shown[name] for name in PANEL_ORDER]
    pictures = render_recoloured([_paint_parts(stage, parts, part_colours(p)) for p in chosen], camera, "draft")
    for k, (panel, picture) in enumerate(zip(chosen, pictures, strict=True)):
        left, top = (
            FIRST_PANEL_CORNER_PX[0] + k % 3 * PANEL_STEP_PX[0],
            FIRST_PANEL_CORNER_PX[1] + k // 3 * PANEL_STEP_PX[1],
        )
        small = Image.fromarray(picture).resize(SHEET_PANEL_SIZE_PX, Image.Resampling.LANCZOS)
        sheet.paste(small, (left, top))
        panel_legend(panel, share, (left, top)).draw(sheet)
    write_png(sheet, path)


def panel_legend(panel: CategoryPanel | NumericPanel, share: np.ndarray, corner: tuple[int, int]) -> PanelLegend:
    """Place a panel's title, and below its picture what its colours mean.

    Args:
        panel: What is shown.
        share: Pixels in which each part is seen.
        corner: Left and top of its picture [px].
    """
    left, top = corner
    middle, below = left + SHEET_PANEL_SIZE_PX[0] / 2, top + SHEET_PANEL_SIZE_PX[1]
    if isinstance(panel, CategoryPanel):
        made = names_legend(_entries(panel, share), middle, below + 6)
    else:
        made = scale_legend(*_scale(panel), middle, below + 19)
    title = TextLine(panel.title, (left, top - 9), "ls", LARGE_FONT_PX)
    return PanelLegend((title, *made.lines), made.swatches)


def write_filmstrip(video: Video, path: Path, count: int = 6, width: int = 340) -> None:
    """Set evenly chosen frames of a video in a row with thin white gaps, each with its time.

    Raises:
        UserError: The video cannot be read, or the file cannot be written.
    """
    last = max((len(video.times) or video_file.count_frames(video.path)) - 1, 0)
    numbers = [int(k) for k in np.unique(np.linspace(0, last, count).round())]
    pictures = video_file.read_frames(video.path, numbers)
    if not pictures:
        raise UserError(f"{video.path}: has no frames. Make it again.")
    small = (width, round(width * video.height / video.width))
    shown = [np.asarray(Image.fromarray(p).resize(small, Image.Resampling.LANCZOS)) for p in pictures]
    times = [video.times[k] if video.times else k / video.fps for k in numbers]
    write_image_row(shown, [f"{t:.2f} s" for t in times], path)


def write_image_row(pictures: Sequence[np.ndarray], words: Sequence[str], path: Path) -> None:
    """Set pictures of one size in a row with thin white gaps, each over its words.

    Raises:
        UserError: The file cannot be written.
    """
    height, width = pictures[0].shape[:2]
    gap, foot = 6, 30
    row = Image.new("RGB", (len(pictures) * (width + gap) - gap, height + foot), "white")
    draw = ImageDraw.Draw(row)
    font = ImageFont.load_default(size=17)
    for k, (picture, label) in enumerate(zip(pictures, words, strict=True)):
        row.paste(Image.fromarray(picture), (k * (width + gap), 0))
        middle = (k * (width + gap) + width / 2, height + foot / 2 + 1)
        draw.text(middle, label, fill=INK_COLOUR, font=font, anchor="mm")
    write_png(row, path)


def si_prefix_text(value: float, unit: str) -> str:
    """Three digits and a prefix: 2.1e11 Pa is 210 GPa."""
    if unit != "Pa" and 1e3 <= abs(value) < 1e5:
        return f"{value:.0f} {unit}".strip()
    if unit != "Pa" or value == 0:
        return f"{value:.3g} {unit}".strip()
    factor, prefix = next((p for p in SI_PREFIXES if abs(value) >= p[0]), SI_PREFIXES[-1])
    return f"{value / factor:.3g} {prefix}{unit}"


def colour_panels(
    scene: Scene, parts: Parts, field: MaterialField
) -> dict[ColourQuantity, CategoryPanel | NumericPanel]:
    """Return what parts can be coloured by."""
    made, palette = field.materials, [colours.colour_from_hex(c) for c in colours.OBJECT_COLOURS]
    laws = [colours.LAW_COLOURS[m.law] for m in made]
    things = [part.object for part in parts.catalogue]
    numbers = range(len(parts.catalogue))
    return {
        "material": CategoryPanel(
            "Material", [m.name.replace("_", " ") for m in made], colours.distinct_colours([m.name for m in made])
        ),
        "law": CategoryPanel("Constitutive law", [n for n, _ in laws], [colours.colour_from_hex(c) for _, c in laws]),
        "object": CategoryPanel(
            "Object",
            [scene.objects[k].name.replace("_", " ") for k in things],
            [palette[k % len(palette)] for k in things],
        ),
        "part": CategoryPanel(
            "Part",
            [part.name.replace("_", " ") for part in parts.catalogue],
            [palette[k % len(palette)] for k in numbers],
        ),
        "young_pa": NumericPanel("Young's modulus E", "Pa", [m.young_pa for m in made], log=True),
        "poisson": NumericPanel("Poisson's ratio ν", "", [m.poisson for m in made]),
        "density": NumericPanel("Density ρ", "kg/m³", [m.density for m in made], log=True),
    }


def part_colours(panel: CategoryPanel | NumericPanel) -> Float[np.ndarray, "K 3"]:
    """Return the colour of every part, sRGB."""
    if isinstance(panel, CategoryPanel):
        return np.array(panel.colour, dtype=float).reshape(-1, 3)
    return colours.turbo(panel.value or [0.0], panel.log)[0]


def _paint_parts(stage: RayScene, parts: Parts, colour_of_part: np.ndarray) -> RayScene:
    """Paint each part; what is of none, number -1, is grey."""
    table = np.vstack([colour_of_part, [[0.75] * 3]])
    return stage.painted(srgb_to_linear(table), np.mod(parts.part_of_point, len(table)), PAPER_LIGHT)


def _visible_pixels(seen: np.ndarray, parts: Parts) -> np.ndarray:
    """Pixels in which each part is seen."""
    part = parts.part_of_point[seen[seen >= 0]]
    return np.bincount(part[part >= 0], minlength=len(parts.catalogue))


def _entries(panel: CategoryPanel, share: np.ndarray) -> list[LegendEntry]:
    """List names by how much is seen of them; as many as fit."""
    total: dict[str, float] = {}
    colour: dict[str, colours.Colour] = {}
    for k, label in enumerate(panel.label):
        name = drawable_name(label, f"{panel.title.lower()} {panel.label.index(label) + 1}")
        total[name] = total.get(name, 0) + float(share[k])
        colour[name] = panel.colour[k]
    ranked = sorted(total, key=lambda n: (-total[n], n))
    shown = ranked if len(ranked) <= MAX_LEGEND_ENTRIES else ranked[: MAX_LEGEND_ENTRIES - 1]
    rest = [LegendEntry(f"and {len(ranked) - len(shown)} more", None)] if len(ranked) > len(shown) else []
    return [*(LegendEntry(_shorten(n), colour[n]) for n in shown), *rest]


def _shorten(name: str) -> str:
    return name if len(name) <= MAX_LEGEND_CHARACTERS else name[: MAX_LEGEND_CHARACTERS - 1].rstrip() + "…"


def _scale(panel: NumericPanel) -> tuple[list[ScaleTick], np.ndarray]:
    """Return the lowest value, the highest and what lies between, and the colours along them."""
    _, low, high = colours.turbo(panel.value or [0.0], panel.log)
    ramp = colours.ramp_colours(np.linspace(0, 1, 256))
    if high - low <= 1e-9 * max(abs(high), 1e-30):
        return [ScaleTick(0.5, si_prefix_text(low, panel.unit))], np.repeat(ramp[128:129], 256, axis=0)
    middle = np.sqrt(low * high) if panel.log else (low + high) / 2
    marks = [(0.0, low), (0.5, float(middle)), (1.0, high)]
    return [ScaleTick(x, si_prefix_text(value, panel.unit)) for x, value in marks], ramp


def _boxes(scene: Scene) -> np.ndarray:
    out = np.full((1, len(scene.objects), 2, 3), np.nan)
    for k in range(len(scene.objects)):
        mine = [s.vertices for s in scene.surfaces if s.object == k and len(s.vertices)]
        if mine:
            points = np.concatenate(mine)
            out[0, k] = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    return out
