"""docs/reference/substep-benchmark.md and its figures, made from what was measured."""

import os
import platform
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import warp as wp

from corporeal.core.types import Law
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from cost.blocks import Drop

matplotlib.use("Agg")
from matplotlib import pyplot as plt

NAMES = {law: rule.name for law, rule in CONSTITUTIVE_LAWS.items()}
BLUE, GREY, RED = "#2b6cb0", "#718096", "#c53030"


@dataclass(frozen=True)
class Result:
    """What one contestant needed."""

    engine: str
    drop: Drop
    particles: int
    cost: float
    """Least of five batches [ns per particle and substep]."""
    cpu: float
    """The same, but the time of all threads on the processor [ns]."""
    bytes: float
    """Of all arrays of the engine; nan: not known."""
    grown: float
    """What the process grew by while the engine was made [bytes]; nan: not known."""
    version: str = ""
    upkeep: dict[str, float] = field(default_factory=dict)
    """What is done once a frame beside the substeps [s]."""

    def row(self) -> dict[str, Any]:
        """Return what --json writes."""
        return {
            "engine": self.engine,
            "device": self.device,
            "threads": self.drop.threads,
            "law": self.drop.law.name.lower(),
            "particles": self.particles,
            "objects": self.drop.objects,
            "ns_per_particle_substep": round(self.cost, 2),
            "bytes_per_particle": _number(self.bytes / self.particles),
        }

    @property
    def device(self) -> str:
        """The processor, or the name of the card."""
        if self.drop.device == "cpu":
            return "cpu"
        return f"cuda:{wp.get_device(self.drop.device).name}"

    @property
    def setting(self) -> str:
        """How the objects lie."""
        if not self.drop.floor:
            return "in free flight"
        if self.drop.extent:
            return f"spread over {self.drop.extent}³ cells"
        if self.drop.objects > 1:
            return "a heap" if self.drop.heap else "side by side"
        return "on the floor"

    def cells(self) -> tuple[str, ...]:
        """Return a row of the page's table."""
        return (
            " ".join((self.engine, self.version)).strip(),
            self.device,
            str(self.drop.threads),
            NAMES[self.drop.law],
            f"{self.particles:,}",
            f"{self.drop.objects}",
            self.setting,
            f"{self.cost:.1f}",
            f"{self.cpu:.1f}",
            "–" if np.isnan(self.bytes) else f"{self.bytes / self.particles:.0f}",
        )


HEAD = tuple("engine device threads law particles objects which ns CPU-ns bytes".split())


def _number(value: float) -> float | None:
    return None if np.isnan(value) else round(value, 1)


def machine() -> str:
    """Say on what is measured."""
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        names = [line.split(":", 1)[1].strip() for line in file if line.startswith("model name")]
    return (
        f"{names[0] if names else platform.processor()}, {os.cpu_count()} cores, "
        f"{platform.system()}, Python {platform.python_version()}, Warp {wp.__version__}, "
        f"{time.strftime('%Y-%m-%d')}; load {os.getloadavg()[0]:.1f}"
    )


def write(results: list[Result], where: str, command: str, docs: Path) -> None:
    """Write docs/reference/substep-benchmark.md and its figures."""
    images = docs / "images"
    images.mkdir(parents=True, exist_ok=True)
    figures = {
        "particles": (_particles, "Cost against the number of particles; one thread."),
        "threads": (_threads, "Cost against the number of threads."),
        "laws": (_laws, "All laws; one thread."),
    }
    shown = []
    for name, (draw, words) in figures.items():
        figure, axes = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
        draw(axes, results)
        figure.savefig(images / f"benchmarks-{name}.png", dpi=110)
        plt.close(figure)
        shown.append(f"![{words}](../images/benchmarks-{name}.png)\n")
    text = PAGE.format(
        machine=where,
        load=os.getloadavg()[0],
        command=command,
        targets=_table(("what", "measured", "target", ""), _targets(results)),
        figures="\n".join(shown),
        upkeep=_upkeep(results),
        rows=_table(HEAD, [result.cells() for result in results]),
    )
    (docs / "reference").mkdir(exist_ok=True)
    (docs / "reference" / "substep-benchmark.md").write_text(text, encoding="utf-8")


PAGE = """# Substep benchmark

Made by `{command}`; don't edit.

Measured on: {machine} when it began, {load:.1f} when it ended. With a load above the number of
cores more than one thread cannot show what it can do.

Cubes of one material (E = 0.1 MPa, ν = 0.3, 1000 kg/m³, eight particles to the cell) drop on the
floor and slide along it at 1 m/s, so that contact works and particles are sorted again and again
throughout. A batch is a run of substeps as a simulation takes them, stability, sorting and ledger
included. All engines take turns, one batch each, and the best of five batches counts: ratios within
one run mean more than numbers of two.
Ratios of one thread each are those of `CPU-ns`.
`ns` are nanoseconds per particle and substep, `CPU-ns` those that all threads together spent on
the processor (which depends less on what else the machine does), `bytes` are those of all arrays
that the engine holds, per particle. genesis-world takes its own substeps of nearly the same length
with its corotated elastic material, on a dense grid of 64³ cells, in single precision, in a process
of its own.

{targets}

{figures}
{upkeep}

{rows}

How to measure again (the peer is optional, and needs 3 GB of disk):

```
python benchmarks/engine.py --peer-install ~/genesis
python benchmarks/engine.py --docs --peer ~/genesis
```

Where the machine has a CUDA card, the engine for it takes part as well.
"""


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in (head, ("---",) * len(head), *rows)]
    return "\n".join(lines)


# ---------------------------------------------------------------- targets


def _find(results: list[Result], **wanted: Any) -> list[Result]:
    """All results of ours on the CPU that are as wanted; one cube on the floor unless told."""
    usual = {"objects": 1, "extent": 0, "floor": True, "device": "cpu", "heap": False}
    wanted = usual | {"engine": "corporeal"} | wanted
    return [r for r in results if all(getattr(r if k == "engine" else r.drop, k) == v for k, v in wanted.items())]


def _targets(results: list[Result]) -> list[tuple[str, ...]]:
    """Compare with what the engine is held to, as far as it was measured."""
    usual = _find(results, law=Law.COROTATED, threads=1)[0]
    across = usual.drop.across
    cost = {t: _find(results, law=Law.COROTATED, threads=t, across=across) for t in (1, 2, 4)}
    peer = {t: _find(results, engine="genesis", threads=t) for t in (1, 2, 4)}
    laws = [r.cost for r in _find(results, threads=1, across=across)]
    rows = [
        _judged("fixed corotated, one thread", usual.cost, "ns", 80.0, at_most=True),
        _judged("slowest of all laws", max(laws), "ns", 150.0, at_most=True),
        _judged("memory", usual.bytes / usual.particles, "bytes", 400.0, at_most=True),
    ]
    for threads, target in ((2, 1.7), (4, 2.8)):
        if cost[threads]:
            gain = usual.cost / cost[threads][0].cost
            rows.append(_judged(f"{threads} threads against one", gain, "×", target))
    for threads in (1, 2, 4):
        if peer[threads]:
            gain = peer[threads][0].cost / cost[threads][0].cost
            words = f"genesis-world against ours, {threads} thread{'s'[: threads > 1]} each"
            rows.append(_judged(words, gain, "×", 12.0))
    if peer[1]:
        gain = peer[1][0].cpu / cost[1][0].cpu
        rows.append(_judged("the same on one thread, in time of the processor", gain, "×", 12.0))
    return rows + _together(results) + _linear(results)


def _together(results: list[Result]) -> list[tuple[str, ...]]:
    """Compare sixteen objects with one, and their threads with one thread."""
    usual = _find(results, law=Law.COROTATED, threads=1)[0]
    rows = []
    for heap, words, most in ((False, "side by side", 1.2), (True, "in a heap, touching", 1.5)):
        many = {t: _find(results, objects=16, heap=heap, threads=t) for t in (1, 2, 4)}
        if many[1]:
            ratio = many[1][0].cpu / usual.cpu
            rows.append(_judged(f"16 objects {words}, against one", ratio, "×", most, at_most=True))
        for threads in (2, 4):
            if many[threads]:
                gain = many[1][0].cost / many[threads][0].cost
                rows.append(_judged(f"that, {threads} threads against one", gain, "×"))
    return rows


def _linear(results: list[Result]) -> list[tuple[str, ...]]:
    """Compare what a particle costs among many with what it costs among a hundred thousand."""
    large = [r for r in _series(results) if r.particles >= 90_000]
    rows = []
    for one in large[1:]:
        words = f"{one.particles:,} particles against {large[0].particles:,}, each"
        rows.append(_judged(words, one.cpu / large[0].cpu, "×", 1.1, at_most=True))
    return rows


def _judged(what: str, value: float, unit: str, target: float | None = None, at_most: bool = False) -> tuple[str, ...]:
    figure = f"{value:.0f} {unit}" if unit != "×" else f"{value:.2f} ×"
    if target is None:
        return what, figure, "", ""
    met = value <= target if at_most else value >= target
    sign = "≤" if at_most else "≥"
    return what, figure, f"{sign} {target:g} {unit}", "✓" if met else "missed"


def _upkeep(results: list[Result]) -> str:
    """Say what the largest problem needs beside its substeps."""
    largest = max((r for r in results if r.upkeep), key=lambda r: (r.particles, r.grown))
    seconds = "; ".join(f"{words} {value:.2f} s" for words, value in largest.upkeep.items())
    return (
        f"With {largest.particles:,} particles the engine holds {largest.bytes / 1e6:.0f} MB, and "
        f"the process grows by {largest.grown / 1e6:.0f} MB when it is made. A substep takes "
        f"{largest.cost * largest.particles / 1e9:.3f} s. Once a frame: {seconds}."
    )


# ---------------------------------------------------------------- figures


def _series(results: list[Result]) -> list[Result]:
    """One cube on one thread, by size; the last measured of each size."""
    found = _find(results, law=Law.COROTATED, threads=1)
    return [r for _, r in sorted({r.particles: r for r in found}.items())]


def _particles(axes: Any, results: list[Result]) -> None:
    sizes = _series(results)
    axes.loglog([r.particles for r in sizes], [r.cost for r in sizes], "o-", color=BLUE)
    for r in sizes:
        axes.annotate(f"{r.cost:.0f}", (r.particles, r.cost), (0, 8), textcoords="offset points", ha="center")
    for r in _find(results, engine="genesis", threads=1):
        axes.loglog([r.particles], [r.cost], "s", color=RED)
        axes.annotate("genesis-world", (r.particles, r.cost), (8, -4), textcoords="offset points")
    axes.set(xlabel="particles", ylabel="ns per particle and substep", ylim=(10, 5000))
    axes.grid(which="both", alpha=0.2)


def _threads(axes: Any, results: list[Result]) -> None:
    across = _find(results, law=Law.COROTATED, threads=1)[0].drop.across

    def line(kept: list[Result], words: str, **style: Any) -> None:
        first = {r.drop.threads: r.cost for r in reversed(kept)}
        if first:
            count = np.array(sorted(first))
            axes.loglog(count, [first[t] for t in count], label=words, **style)
            axes.loglog(count, first[1] / count, ":", color=GREY)

    for law, shade in zip(Law, plt.get_cmap("viridis")(np.linspace(0.1, 0.85, len(Law))), strict=True):
        line(_find(results, law=law, across=across), NAMES[law], marker="o", color=shade)
    line(_find(results, engine="genesis"), "genesis-world, corotated", marker="s", color=RED)
    axes.set(xlabel="threads (dotted: in proportion)", ylabel="ns per particle and substep")
    axes.set_ylim(top=1e4)
    axes.set_xticks([1, 2, 4], ["1", "2", "4"])
    axes.minorticks_off()
    axes.legend(fontsize=8, ncols=3, loc="upper center")
    axes.grid(which="both", alpha=0.2)


def _laws(axes: Any, results: list[Result]) -> None:
    across = _find(results, law=Law.COROTATED, threads=1)[0].drop.across
    one = {r.drop.law: r.cost for r in reversed(_find(results, threads=1, across=across))}
    bars = axes.bar([NAMES[law] for law in Law], [one[law] for law in Law], color=BLUE)
    axes.bar_label(bars, fmt="%.0f")
    axes.axhline(150.0, color=GREY, linestyle=":")
    axes.annotate("target", (-0.4, 150.0), (0, 3), textcoords="offset points")
    axes.set(ylabel="ns per particle and substep")
    axes.tick_params(axis="x", labelsize=8)
