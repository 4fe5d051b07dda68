"""Figures as papers show them: the scene coloured by what it is made of, and a film as a strip."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from PIL import Image, ImageDraw, ImageFont

from corporeal.core.errors import UserError
from corporeal.core.types import Film, MaterialField, Parts, Scene
from corporeal.geometry.srgb import linear
from corporeal.render import colours, video
from corporeal.render.camera import place
from corporeal.render.choices import Quantity
from corporeal.render.embree import identify
from corporeal.render.figure_keys import INK, LARGE, Entry, Key, Line, Mark, legend, scale
from corporeal.render.glyphs import drawable
from corporeal.render.png import write_png
from corporeal.render.repainted import render_each
from corporeal.render.stage import Light, Stage

PAPER = Light(
    sun_colour=(2.6, 2.6, 2.6),
    zenith=(0.95, 0.97, 1.0),
    horizon=(1.0, 1.0, 1.0),
    floor="#f4f4f4",
    backdrop=("#ffffff", "#ffffff"),
)
"""A white studio: colours are data here."""
PANEL = (520, 390)
"""[px]"""
ENTRIES = 8
"""Names in a legend before the rest is summed up."""
LETTERS = 24
"""Of a name in a legend before it is cut."""
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"))
SHEET, SHOWN = (1485, 1045), (472, 354)
"""The page of all panels, and the picture of each [px]."""
FIRST, STEP = (18, 41), (489, 522)
"""Left and top of the first picture, and from one to the next [px]."""

ORDER: tuple[Quantity, ...] = ("material", "law", "young", "poisson", "density", "object")
"""Panels of the figure, row by row."""


@dataclass(frozen=True)
class Names:
    """A panel of discrete colours."""

    title: str
    label: Sequence[str]
    """One per part."""
    colour: Sequence[colours.Colour]
    """One per part, sRGB."""


@dataclass(frozen=True)
class Numbers:
    """A panel of a continuous quantity."""

    title: str
    unit: str
    value: Sequence[float]
    """One per part, SI."""
    log: bool = False


def fields_figure(scene: Scene, parts: Parts, field: MaterialField, path: Path) -> None:
    """Draw six panels: material, law, stiffness, Poisson's ratio, density and object.

    Raises:
        UserError: The file cannot be written.

    """
    stage = Stage(scene)
    camera = place(_boxes(scene), PANEL, fill=0.93)
    seen, _ = identify(stage, camera)
    share = _share(seen, parts)
    sheet = Image.new("RGB", SHEET, "white")
    shown = panels(scene, parts, field)
    chosen = [shown[name] for name in ORDER]
    pictures = render_each([_painted(stage, parts, shades(p)) for p in chosen], camera, "draft")
    for k, (panel, picture) in enumerate(zip(chosen, pictures, strict=True)):
        left, top = FIRST[0] + k % 3 * STEP[0], FIRST[1] + k // 3 * STEP[1]
        small = Image.fromarray(picture).resize(SHOWN, Image.Resampling.LANCZOS)
        sheet.paste(small, (left, top))
        key_of(panel, share, (left, top)).draw(sheet)
    write_png(sheet, path)


def key_of(panel: Names | Numbers, share: np.ndarray, corner: tuple[int, int]) -> Key:
    """Place a panel's title, and below its picture what its colours mean.

    Args:
        panel: What is shown.
        share: Pixels in which each part is seen.
        corner: Left and top of its picture [px].

    """
    left, top = corner
    middle, below = left + SHOWN[0] / 2, top + SHOWN[1]
    if isinstance(panel, Names):
        made = legend(_entries(panel, share), middle, below + 6)
    else:
        made = scale(*_scale(panel), middle, below + 19)
    title = Line(panel.title, (left, top - 9), "ls", LARGE)
    return Key((title, *made.lines), made.swatches)


def strip(film: Film, path: Path, count: int = 6, width: int = 340) -> None:
    """Set evenly chosen frames of a film in a row with thin white gaps, each with its time.

    Raises:
        UserError: The film cannot be read, or the file cannot be written.

    """
    last = max((len(film.times) or video.length(film.path)) - 1, 0)
    numbers = [int(k) for k in np.unique(np.linspace(0, last, count).round())]
    pictures = video.pictures(film.path, numbers)
    if not pictures:
        raise UserError(f"{film.path}: has no frames. Make it again.")
    small = (width, round(width * film.height / film.width))
    shown = [
        np.asarray(Image.fromarray(p).resize(small, Image.Resampling.LANCZOS)) for p in pictures
    ]
    times = [film.times[k] if film.times else k / film.fps for k in numbers]
    row_of(shown, [f"{t:.2f} s" for t in times], path)


def row_of(pictures: Sequence[np.ndarray], words: Sequence[str], path: Path) -> None:
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
        draw.text(middle, label, fill=INK, font=font, anchor="mm")
    write_png(row, path)


def si(value: float, unit: str) -> str:
    """Three digits and a prefix: 2.1e11 Pa is 210 GPa."""
    if unit != "Pa" and 1e3 <= abs(value) < 1e5:
        return f"{value:.0f} {unit}".strip()
    if unit != "Pa" or value == 0:
        return f"{value:.3g} {unit}".strip()
    factor, prefix = next((p for p in PREFIXES if abs(value) >= p[0]), PREFIXES[-1])
    return f"{value / factor:.3g} {prefix}{unit}"


def panels(scene: Scene, parts: Parts, field: MaterialField) -> dict[Quantity, Names | Numbers]:
    """Return what parts can be coloured by."""
    made, palette = field.materials, [colours.of_hex(c) for c in colours.OBJECTS]
    laws = [colours.LAWS[m.law] for m in made]
    things = [part.object for part in parts.catalogue]
    numbers = range(len(parts.catalogue))
    return {
        "material": Names(
            "Material",
            [m.name.replace("_", " ") for m in made],
            colours.apart([m.name for m in made]),
        ),
        "law": Names(
            "Constitutive law", [n for n, _ in laws], [colours.of_hex(c) for _, c in laws]
        ),
        "object": Names(
            "Object",
            [scene.objects[k].name.replace("_", " ") for k in things],
            [palette[k % len(palette)] for k in things],
        ),
        "part": Names(
            "Part",
            [part.name.replace("_", " ") for part in parts.catalogue],
            [palette[k % len(palette)] for k in numbers],
        ),
        "young": Numbers("Young's modulus E", "Pa", [m.young for m in made], log=True),
        "poisson": Numbers("Poisson's ratio ν", "", [m.poisson for m in made]),
        "density": Numbers("Density ρ", "kg/m³", [m.density for m in made], log=True),
    }


def shades(panel: Names | Numbers) -> Float[np.ndarray, "K 3"]:
    """Return the colour of every part, sRGB."""
    if isinstance(panel, Names):
        return np.array(panel.colour, dtype=float).reshape(-1, 3)
    return colours.turbo(panel.value or [0.0], panel.log)[0]


def _painted(stage: Stage, parts: Parts, colour_of_part: np.ndarray) -> Stage:
    """Paint each part; what is of none, number -1, is grey."""
    table = np.vstack([colour_of_part, [[0.75] * 3]])
    return stage.painted(linear(table), np.mod(parts.part_of_point, len(table)), PAPER)


def _share(seen: np.ndarray, parts: Parts) -> np.ndarray:
    """Pixels in which each part is seen."""
    part = parts.part_of_point[seen[seen >= 0]]
    return np.bincount(part[part >= 0], minlength=len(parts.catalogue))


def _entries(panel: Names, share: np.ndarray) -> list[Entry]:
    """List names by how much is seen of them; as many as fit."""
    total: dict[str, float] = {}
    colour: dict[str, colours.Colour] = {}
    for k, label in enumerate(panel.label):
        name = drawable(label, f"{panel.title.lower()} {panel.label.index(label) + 1}")
        total[name] = total.get(name, 0) + float(share[k])
        colour[name] = panel.colour[k]
    ranked = sorted(total, key=lambda n: (-total[n], n))
    shown = ranked if len(ranked) <= ENTRIES else ranked[: ENTRIES - 1]
    rest = [Entry(f"and {len(ranked) - len(shown)} more", None)] if len(ranked) > len(shown) else []
    return [*(Entry(_cut(n), colour[n]) for n in shown), *rest]


def _cut(name: str) -> str:
    return name if len(name) <= LETTERS else name[: LETTERS - 1].rstrip() + "…"


def _scale(panel: Numbers) -> tuple[list[Mark], np.ndarray]:
    """Give the lowest value, the highest and what lies between, and the colours along them."""
    _, low, high = colours.turbo(panel.value or [0.0], panel.log)
    ramp = colours.ramp(np.linspace(0, 1, 256))
    if high - low <= 1e-9 * max(abs(high), 1e-30):
        return [Mark(0.5, si(low, panel.unit))], np.repeat(ramp[128:129], 256, axis=0)
    middle = np.sqrt(low * high) if panel.log else (low + high) / 2
    marks = [(0.0, low), (0.5, float(middle)), (1.0, high)]
    return [Mark(x, si(value, panel.unit)) for x, value in marks], ramp


def _boxes(scene: Scene) -> np.ndarray:
    out = np.full((1, len(scene.objects), 2, 3), np.nan)
    for k in range(len(scene.objects)):
        mine = [s.vertices for s in scene.surfaces if s.object == k and len(s.vertices)]
        if mine:
            points = np.concatenate(mine)
            out[0, k] = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    return out
