"""The dent of scene 2 and the separation of scene 3, beside the two controls that spoil them.

    python benchmarks/controls.py [--docs]

Each scene runs three times at detail draft: as it should be, with one velocity field for all
(``--contact single``), and with Young's moduli capped by the published rule (``--stiffness
capped``). The pictures of the three stand side by side; ``--docs`` keeps them for the pages.
"""

import argparse
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.axes import Axes
from stories import Told, tell

from corporeal.core.audit_data import pair_name
from corporeal.geometry.rotation import fit_rigid_motion
from corporeal.pipeline.run_pipeline import Settings
from corporeal.pipeline.stages.fill import FillConfig
from corporeal.pipeline.stages.simulate import SimulateConfig

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "controls.png"
COLOURS = {"corporeal": "#1f6f8b", "single field": "#c8553d", "capped stiffness": "#8a8a3c"}


def variants(name: str, folder: Path) -> dict[str, Told]:
    """Run a scene as it should be, and both controls."""
    single = Settings(simulate=SimulateConfig(contact="single"))
    capped = Settings(fill=FillConfig(stiffness="capped"))
    return {
        "corporeal": tell(name, folder / name, Settings()),
        "single field": tell(name, folder / f"{name}-single", single),
        "capped stiffness": tell(name, folder / f"{name}-capped", capped),
    }


def dent_profile(told: Told) -> tuple[np.ndarray, np.ndarray]:
    """Deepest inward displacement [m] along the can's axis [m] at the end."""
    can = told.particles.object == next(k for k, o in enumerate(told.scene.objects) if o.name == "soda_can_0")
    start = told.video.frames[0].position[can].astype(float)
    fit = fit_rigid_motion(start, told.video.frames[-1].position[can].astype(float), np.ones(can.sum()))
    shift = fit.undo(told.video.frames[-1].position[can].astype(float)) - start
    middle = start.mean(axis=0)
    outward = (start - middle) * [0.0, 1.0, 1.0]
    outward /= np.maximum(np.linalg.norm(outward, axis=1), 1e-9)[:, None]
    inward = -np.sum(shift * outward, axis=1)
    along = start[:, 0] - middle[0]
    edges = np.linspace(along.min(), along.max(), 16)
    place = np.clip(np.digitize(along, edges) - 1, 0, 14)
    deepest = np.array([inward[place == k].max(initial=0.0) for k in range(15)])
    return 0.5 * (edges[1:] + edges[:-1]), deepest


def draw_dents(axes: Axes, told: dict[str, Told]) -> None:
    """Draw how deep the can is dented along its axis."""
    for name, run in told.items():
        along, depth = dent_profile(run)
        axes.plot(1e3 * along, 1e3 * depth, color=COLOURS[name], label=name, lw=2)
    axes.set(
        title="Scene 2: the dent that stays in the can",
        xlabel="along the can [mm]",
        ylabel="inward displacement at the end [mm]",
    )
    axes.legend(frameon=False)


def draw_gaps(axes: Axes, told: dict[str, Told], pair: tuple[int, int], title: str) -> None:
    """Draw the distance between two objects over time."""
    for name, run in told.items():
        axes.plot(run.video.time, run.gap(*pair), color=COLOURS[name], label=name, lw=2)
    axes.axhline(1.0, color="black", lw=0.8, ls=":")
    axes.annotate("parted: more than one cell", (0.0, 1.0), fontsize=8, va="bottom")
    axes.set(title=title, xlabel="time [s]", ylabel="gap [cells]")


def say(name: str, told: dict[str, Told]) -> None:
    """Print the numbers behind the figure."""
    for variant, run in told.items():
        seen = run.outcome
        if name == "duck-on-can":
            can = seen.objects["soda_can_0"]
            place = can.dent_from_contact_m.get("rubber_duck_0")
            where = "no contact is booked" if place is None else f"{1e3 * place:.1f} mm from impact"
            print(f"{name:20s} {variant:18s} dent {1e3 * can.dent_depth_m:6.1f} mm, {where}")
            continue
        for pair in (("vase_0", "ball_0"), ("ball_0", "armchair_0")):
            gap = seen.pair(*pair).gap_end_dx
            print(f"{name:20s} {variant:18s} {pair_name(*pair):20s} ends {gap:6.2f} cells apart")


def main() -> None:
    """Run what has not been run yet, print the numbers, draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path("runs/controls"), help="of the runs")
    parser.add_argument("--docs", action="store_true", help=f"write {PICTURE.name} for the pages")
    chosen = parser.parse_args()
    dents = variants("duck-on-can", chosen.folder)
    gaps = variants("vase-ball-armchair", chosen.folder)
    say("duck-on-can", dents)
    say("vase-ball-armchair", gaps)
    figure, axes = pyplot.subplots(1, 3, figsize=(15, 4.2), constrained_layout=True)
    draw_dents(axes[0], dents)
    draw_gaps(axes[1], gaps, (0, 1), "Scene 3: vase and ball")
    draw_gaps(axes[2], gaps, (1, 2), "Scene 3: ball and armchair")
    picture = PICTURE if chosen.docs else chosen.folder / PICTURE.name
    figure.savefig(picture, dpi=110)
    print(picture)


if __name__ == "__main__":
    main()
