"""Figures as papers show them: the scene coloured by what it is made of, and a film as a strip."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from PIL import Image, ImageDraw, ImageFont

from corporeal.errors import UserError
from corporeal.geometry.srgb import linear
from corporeal.render import colours, video
from corporeal.render.camera import place
from corporeal.render.embree import Light, Stage, identify, render
from corporeal.render.glyphs import drawable
from corporeal.store import writing
from corporeal.types import Film, MaterialField, Parts, Scene

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
INK = "#222222"


Quantity = Literal["material", "law", "object", "part", "young", "poisson", "density"]
"""What parts can be coloured by."""


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
    figure = Figure(figsize=(13.5, 9.5), dpi=110, facecolor="white")
    FigureCanvasAgg(figure)
    shown = panels(scene, parts, field)
    order: tuple[Quantity, ...] = ("material", "law", "young", "poisson", "density", "object")
    for k, panel in enumerate(shown[name] for name in order):
        column, row = k % 3, k // 3
        box = (0.012 + column * 0.329, 0.622 - row * 0.500, 0.318, 0.339)
        axes = figure.add_axes(box)
        picture, key = _coloured(panel)
        axes.imshow(render(_painted(stage, parts, picture), camera, "draft"))
        axes.set_axis_off()
        axes.set_title(panel.title, fontsize=12.5, color=INK, pad=6, loc="left")
        key(axes, share)
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".{path.stem}.{os.getpid()}.part.png")
        try:
            figure.savefig(partial)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


def strip(film: Film, path: Path, count: int = 6, width: int = 340) -> None:
    """Set evenly chosen frames of a film in a row with thin white gaps, each with its time.

    Raises:
        UserError: The film cannot be read, or the file cannot be written.

    """
    last = max(video.length(film.path) - 1, 0)
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
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".{path.stem}.{os.getpid()}.part.png")
        try:
            row.save(partial)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


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


def _coloured(
    panel: Names | Numbers,
) -> tuple[np.ndarray, Callable[[Axes, np.ndarray], None]]:
    """Give the colour of every part (K, 3) sRGB, and what draws the key."""
    if isinstance(panel, Names):
        return shades(panel), lambda axes, share: _legend(axes, panel, share)
    _, low, high = colours.turbo(panel.value or [0.0], panel.log)
    return shades(panel), lambda axes, share: _scale(axes, panel, low, high)


def _painted(stage: Stage, parts: Parts, colour_of_part: np.ndarray) -> Stage:
    table = np.vstack([colour_of_part, [[0.75] * 3]])
    return stage.painted(linear(table)[parts.part_of_point], PAPER)


def _share(seen: np.ndarray, parts: Parts) -> np.ndarray:
    """Pixels in which each part is seen."""
    part = parts.part_of_point[seen[seen >= 0]]
    return np.bincount(part[part >= 0], minlength=len(parts.catalogue))


def _legend(axes: Axes, panel: Names, share: np.ndarray) -> None:
    """List names by how much is seen of them; as many as fit."""
    total: dict[str, float] = {}
    colour: dict[str, Any] = {}
    for k, label in enumerate(panel.label):
        name = drawable(label, f"{panel.title.lower()} {panel.label.index(label) + 1}")
        total[name] = total.get(name, 0) + float(share[k])
        colour[name] = panel.colour[k]
    ranked = sorted(total, key=lambda n: (-total[n], n))
    shown = ranked if len(ranked) <= ENTRIES else ranked[: ENTRIES - 1]
    keys = [Patch(facecolor=colour[n], edgecolor="none", label=_cut(n)) for n in shown]
    if len(ranked) > len(shown):
        rest = f"and {len(ranked) - len(shown)} more"
        keys.append(Patch(facecolor="none", edgecolor="none", label=rest))
    axes.legend(
        handles=keys,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.01),
        ncols=2 if len(keys) > 1 else 1,
        frameon=False,
        fontsize=10.5,
        labelcolor=INK,
        handlelength=1.0,
        handleheight=1.0,
        columnspacing=1.6,
        labelspacing=0.35,
    )


def _cut(name: str) -> str:
    return name if len(name) <= LETTERS else name[: LETTERS - 1].rstrip() + "…"


def _scale(axes: Axes, panel: Numbers, low: float, high: float) -> None:
    """Draw a bar of the colours with the lowest, the highest and what lies between."""
    inset = axes.inset_axes((0.1, -0.1, 0.8, 0.045))
    flat = high - low <= 1e-9 * max(abs(high), 1e-30)
    middle = np.sqrt(low * high) if panel.log else (low + high) / 2
    ramp = colours.ramp(np.linspace(0, 1, 256))
    if flat:
        ramp[:] = ramp[128]
    inset.imshow(ramp[None], aspect="auto", extent=(0, 1, 0, 1))
    marks = [(0.5, low)] if flat else [(0.0, low), (0.5, middle), (1.0, high)]
    inset.set_yticks([])
    inset.set_xticks([x for x, _ in marks], [si(v, panel.unit) for _, v in marks])
    inset.tick_params(labelsize=10.5, length=3, color="#888888", labelcolor=INK)
    for spine in inset.spines.values():
        spine.set_visible(False)


def _boxes(scene: Scene) -> np.ndarray:
    out = np.full((1, len(scene.objects), 2, 3), np.nan)
    for k in range(len(scene.objects)):
        mine = [s.vertices for s in scene.surfaces if s.object == k and len(s.vertices)]
        if mine:
            points = np.concatenate(mine)
            out[0, k] = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    return out
