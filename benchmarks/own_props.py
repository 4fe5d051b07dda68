"""Write ten everyday things whose masses nobody published: they follow from how they are built.

    python benchmarks/own_props.py OUT

``OUT/models`` gets one GLB a thing, with neutral names and without a word on what it is made of;
``OUT/truth/masses.csv`` what each weighs, and ``OUT/truth/recipes.md`` why. Whoever answers
questions about the models opens neither.
"""

import argparse
import csv
from pathlib import Path

from weighed import goods, vessels
from weighed.piece import Prop

from corporeal.formats.glb_writer import write_glb

PROPS = (
    goods.stool,
    vessels.jam_jar,
    goods.brick,
    vessels.cola_bottle,
    goods.play_ball,
    vessels.frying_pan,
    goods.dictionary,
    vessels.tomato_can,
    goods.cushion,
    vessels.flower_pot,
)
"""In an order that says nothing."""


def names() -> list[str]:
    """Return the neutral names, in the order of ``PROPS``."""
    return [f"thing_{k:02d}" for k in range(1, len(PROPS) + 1)]


def write(folder: Path) -> None:
    """Write models, masses and recipes."""
    models, truth = folder / "models", folder / "truth"
    for below in (models, truth):
        below.mkdir(parents=True, exist_ok=True)
    made = {name: build() for name, build in zip(names(), PROPS, strict=True)}
    for name, prop in made.items():
        write_glb(models / f"{name}.glb", prop.scene(name))
    with (truth / "masses.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(["object", "mass_kg", "fill", "what"])
        table.writerows([n, f"{p.mass:.4f}", p.fill, p.what] for n, p in made.items())
    text = "\n".join(recipe(name, prop) for name, prop in made.items())
    (truth / "recipes.md").write_text(text, encoding="utf-8")


def recipe(name: str, prop: Prop) -> str:
    """Tell how a prop is built, as Markdown."""
    lines = [f"## {name}: {prop.what}, {prop.mass:.3f} kg", ""]
    lines += [
        "| piece | volume [cm³] | density [kg/m³] | mass [g] | from |",
        "|---|--:|--:|--:|---|",
    ]
    lines += [
        f"| {p.name} | {p.volume * 1e6:.1f} | {p.density:.0f} | {p.mass * 1e3:.1f} | {p.source} |"
        for p in prop.built
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the folder and print what stands where."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", type=Path)
    folder = parser.parse_args().out
    write(folder)
    print(f"{len(PROPS)} models in {folder / 'models'}; their masses are in {folder / 'truth'}.")


if __name__ == "__main__":
    main()
