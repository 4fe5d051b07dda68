"""Write everyday things whose masses nobody published: they follow from how they are built.

    python benchmarks/own_props.py OUT [--batch 2]

Ten in the first batch; twelve in the second, whose walls and fillings show less from outside.
``OUT/models`` gets one GLB a thing, with neutral names and without a word on what it is made of;
``OUT/truth/masses.csv`` what each weighs, and ``OUT/truth/recipes.md`` why. Whoever answers
questions about the models opens neither.
"""

import argparse
import csv
from pathlib import Path

from weighed import built_things, goods, household, vessels
from weighed.piece import Prop

from corporeal.io.gltf.glb_writer import write_glb

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
SECOND = (
    built_things.cool_box,
    household.wine_bottle,
    built_things.loaf,
    household.pear,
    built_things.toolbox,
    household.candle,
    built_things.side_table,
    household.tissue_roll,
    built_things.helmet,
    household.vacuum_flask,
    built_things.hammer,
    household.sand_bucket,
)
BATCHES = {1: PROPS, 2: SECOND}
"""Both in an order that says nothing."""


def names(batch: int = 1) -> list[str]:
    """Return the neutral names of a batch, in its order; they go on from the batch before."""
    before = sum(len(BATCHES[k]) for k in range(1, batch))
    return [f"thing_{before + k:02d}" for k in range(1, len(BATCHES[batch]) + 1)]


def write(folder: Path, batch: int = 1) -> None:
    """Write models, masses and recipes."""
    models, truth = folder / "models", folder / "truth"
    for below in (models, truth):
        below.mkdir(parents=True, exist_ok=True)
    made = {name: build() for name, build in zip(names(batch), BATCHES[batch], strict=True)}
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
    lines += ["| piece | volume [cm³] | density [kg/m³] | mass [g] | from |", "|---|--:|--:|--:|---|"]
    lines += [
        f"| {p.name} | {p.volume * 1e6:.1f} | {p.density:.0f} | {p.mass * 1e3:.1f} | {p.source} |" for p in prop.built
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the folder and print what stands where."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--batch", type=int, choices=sorted(BATCHES), default=1)
    asked = parser.parse_args()
    folder, count = asked.out, len(BATCHES[asked.batch])
    write(folder, asked.batch)
    print(f"{count} models in {folder / 'models'}; their masses are in {folder / 'truth'}.")


if __name__ == "__main__":
    main()
