"""Figures of a corpus as vector graphics: composition, audits, cost.

Colours are Tol's bright scheme, which readers with any colour vision can tell apart; interactions have a mark of their
own as well.
"""

import io
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from corporeal.lab.corpus.collect_results import RIGID_BODY_LAW, CorpusResults, SceneRecord
from corporeal.render.colours import LAW_COLOURS
from corporeal.scene.interactions import INTERACTION_KINDS, InteractionKind
from corporeal.simulation.audit_messages import ALLOWED_BREACHES

INK_COLOUR, SOFT_COLOUR, LINE_COLOUR = "#22262b", "#6a727c", "#d9dde2"
BAR_COLOUR = "#4477aa"
COLOUR_OF_INTERACTION: Mapping[InteractionKind, str] = dict(
    zip(INTERACTION_KINDS, ("#4477aa", "#aa3377", "#228833", "#ccbb44", "#66ccee"), strict=True)
)
MARKER_OF_INTERACTION: Mapping[InteractionKind, str] = dict(zip(INTERACTION_KINDS, "osD^v", strict=True))
COLOUR_OF_LAW = {name: colour for name, colour in LAW_COLOURS.values()} | {RIGID_BODY_LAW: "#bbbbbb"}
LOG_AXIS_MIN = 1e-8
"""What is smaller is drawn here on a logarithmic axis."""
MAX_REST_DRIFT_MM_PER_M = 1.0
"""Bound of a certificate [mm per m]."""
FIGURE_STYLE: Any = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.labelsize": 9,
    "axes.edgecolor": SOFT_COLOUR,
    "axes.labelcolor": INK_COLOUR,
    "xtick.color": SOFT_COLOUR,
    "ytick.color": SOFT_COLOUR,
    "text.color": INK_COLOUR,
    "svg.hashsalt": "corporeal",
    "font.family": "DejaVu Sans",
}


def corpus_figures(corpus: CorpusResults) -> dict[str, bytes]:
    """Return caption → SVG, for all figures that there is something to draw in."""
    found = {
        "What the corpus consists of. Left: objects of each class over all planned scenes. Right: "
        "scenes by interaction and number of objects.": _draw_figure(
            (10.4, 4.1), [1.15, 1], corpus, (_classes, _matrix)
        )
    }
    if any(s.certificate for s in corpus.scenes):
        found[
            "Scenes at rest before anything happens: how far the objects drift in one second, and "
            "how deep their original meshes overlap. Dashed: the bound on drift."
        ] = _draw_figure((10.4, 3.4), [1], corpus, (_rest,))
    if corpus.run:
        found[
            "The audits by interaction, one mark per scene, the bar at the median. Dashed: bounds "
            f"beyond which the audit warns. Values below {LOG_AXIS_MIN:.0e} are drawn there."
        ] = _draw_figure((10.4, 3.5), [1, 1, 1], corpus, (_penetration, _momentum, _energy))
        found[
            "Left: what the parts are made of, by material class and by the law that they were "
            "simulated with. Right: computing time of each scene over its particles."
        ] = _draw_figure((10.4, 3.8), [1.15, 1], corpus, (_materials, _cost))
    return found


PanelPainter = Callable[[Axes, CorpusResults], None]


def _draw_figure(
    size: tuple[float, float], widths: Sequence[float], corpus: CorpusResults, panels: Sequence[PanelPainter]
) -> bytes:
    with matplotlib.rc_context(FIGURE_STYLE):
        figure = Figure(figsize=size, layout="constrained", facecolor="white")
        FigureCanvasSVG(figure)
        every = figure.subplots(1, len(panels), width_ratios=list(widths), squeeze=False)[0]
        for axes, panel in zip(every, panels, strict=True):
            axes.spines[["top", "right"]].set_visible(False)
            axes.set_axisbelow(True)
            panel(axes, corpus)
        out = io.BytesIO()
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
        return out.getvalue()


def _classes(axes: Axes, corpus: CorpusResults) -> None:
    used = Counter(c for s in corpus.scenes for c in s.planned.classes)
    names = sorted(used, key=lambda n: (used[n], n))
    bars = axes.barh(names, [used[n] for n in names], color=BAR_COLOUR, height=0.7)
    axes.bar_label(bars, padding=3, fontsize=8, color=SOFT_COLOUR)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("objects")
    axes.set_title("Classes", loc="left")
    axes.tick_params(axis="y", length=0, labelcolor=INK_COLOUR, labelsize=8 if len(names) < 22 else 6)


def _matrix(axes: Axes, corpus: CorpusResults) -> None:
    numbers = sorted({s.planned.count for s in corpus.scenes})
    table = np.zeros((len(INTERACTION_KINDS), len(numbers)), int)
    for scene in corpus.scenes:
        table[INTERACTION_KINDS.index(scene.planned.interaction), numbers.index(scene.planned.count)] += 1
    axes.imshow(table, cmap="Blues", vmin=0, vmax=max(1, table.max() * 1.6), aspect="auto")
    for (row, column), value in np.ndenumerate(table):
        axes.text(column, row, str(value) if value else "–", ha="center", va="center", color=INK_COLOUR)
    rows = [f"{kind}  ({n})" for kind, n in zip(INTERACTION_KINDS, table.sum(axis=1), strict=True)]
    columns = [f"{n}\n({m})" for n, m in zip(numbers, table.sum(axis=0), strict=True)]
    axes.set_yticks(range(len(INTERACTION_KINDS)), rows, color=INK_COLOUR)
    axes.set_xticks(range(len(numbers)), columns, color=INK_COLOUR)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_xlabel("objects in the scene (scenes)")
    axes.set_title("Interactions (scenes)", loc="left")


def _rest(axes: Axes, corpus: CorpusResults) -> None:
    for kind in INTERACTION_KINDS:
        proofs = [s.certificate for s in corpus.scenes if s.certificate and s.planned.interaction == kind]
        drift = [1e3 * p.drift_m / p.extent_m for p in proofs]
        depth = [1e3 * p.penetration_m / p.extent_m for p in proofs]
        axes.scatter(
            np.maximum(drift, 1e-6), np.maximum(depth, 1e-6), s=26, marker=MARKER_OF_INTERACTION[kind],
            color=COLOUR_OF_INTERACTION[kind],
            edgecolor="white", linewidth=0.5, label=kind,
        )  # fmt: skip
    axes.axvline(MAX_REST_DRIFT_MM_PER_M, color=INK_COLOUR, lw=0.9, ls="--")
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("drift in one second [mm per metre of scene]")
    axes.set_ylabel("overlap of meshes\n[mm per metre of scene]")
    axes.grid(color=LINE_COLOUR, lw=0.5)
    axes.legend(frameon=False, fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _penetration(axes: Axes, corpus: CorpusResults) -> None:
    _by_kind(axes, corpus, "max_penetration_dx", log=False)
    axes.set_ylabel("deepest penetration [dx]")
    axes.set_title("Penetration", loc="left")
    axes.set_ylim(bottom=0)


def _momentum(axes: Axes, corpus: CorpusResults) -> None:
    _by_kind(axes, corpus, "momentum_residual", log=True)
    axes.set_ylabel("unaccounted momentum, relative")
    axes.set_title("Momentum", loc="left")


def _energy(axes: Axes, corpus: CorpusResults) -> None:
    _by_kind(axes, corpus, "mechanical_growth", log=True)
    axes.set_ylabel("energy created, relative")
    axes.set_title("Kinetic and elastic energy", loc="left")


def _by_kind(axes: Axes, corpus: CorpusResults, name: str, log: bool) -> None:
    """One column of marks per interaction, spread sideways in their order."""
    for column, kind in enumerate(INTERACTION_KINDS):
        values = sorted(_values(corpus.run, kind, name, log))
        if not values:
            continue
        aside = np.linspace(-0.26, 0.26, len(values)) if len(values) > 1 else np.zeros(1)
        axes.scatter(
            column + aside, values, s=22, marker=MARKER_OF_INTERACTION[kind], color=COLOUR_OF_INTERACTION[kind],
            edgecolor="white", linewidth=0.5, zorder=3,
        )  # fmt: skip
        axes.hlines(np.median(values), column - 0.36, column + 0.36, color=INK_COLOUR, lw=1.2, zorder=4)
    axes.axhline(ALLOWED_BREACHES[name], color=INK_COLOUR, lw=0.9, ls="--")
    if log:
        axes.set_yscale("log")
    axes.set_xlim(-0.6, len(INTERACTION_KINDS) - 0.4)
    axes.set_xticks(range(len(INTERACTION_KINDS)), INTERACTION_KINDS, color=INK_COLOUR, fontsize=8)
    axes.tick_params(axis="x", length=0)
    axes.grid(axis="y", color=LINE_COLOUR, lw=0.5)


def _values(scenes: Sequence[SceneRecord], kind: InteractionKind, name: str, log: bool) -> list[float]:
    mine = [s.numbers for s in scenes if s.numbers and s.planned.interaction == kind]
    return [max(getattr(n, name), LOG_AXIS_MIN) if log else getattr(n, name) for n in mine]


def _materials(axes: Axes, corpus: CorpusResults) -> None:
    parts = [p for s in corpus.run for p in s.parts]
    total = Counter(p.group for p in parts)
    names = sorted(total, key=lambda n: (total[n], n))
    left = np.zeros(len(names))
    for law, colour in COLOUR_OF_LAW.items():
        count = Counter(p.group for p in parts if p.law == law)
        width = np.array([count[n] for n in names])
        if width.any():
            axes.barh(names, width, left=left, color=colour, height=0.7, label=law)
            left += width
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("parts")
    axes.set_title("Material classes and laws", loc="left")
    axes.tick_params(axis="y", length=0, labelcolor=INK_COLOUR)
    axes.legend(frameon=False, fontsize=8, loc="lower right")


def _cost(axes: Axes, corpus: CorpusResults) -> None:
    for kind in INTERACTION_KINDS:
        mine = [s.numbers for s in corpus.run if s.numbers and s.planned.interaction == kind]
        axes.scatter(
            [n.particles for n in mine], [n.seconds for n in mine], s=26,
            marker=MARKER_OF_INTERACTION[kind], color=COLOUR_OF_INTERACTION[kind],
            edgecolor="white", linewidth=0.5, label=kind,
        )  # fmt: skip
    axes.set(xscale="log", yscale="log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter(lambda x, _: f"{x:,.0f}")
        axis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("particles")
    axes.set_ylabel("computing time [s]")
    axes.set_title("Cost", loc="left")
    axes.grid(color=LINE_COLOUR, lw=0.5)
    axes.legend(frameon=False, fontsize=8)
