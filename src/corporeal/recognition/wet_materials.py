"""Wet materials by name: sponges and cloths weigh more, and sponges don't rebound."""

import tomllib
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from corporeal.core.types import MeasuredRange, Provenance
from corporeal.materials.loss_restitution import restitution_of_loss, restitution_range_of_loss
from corporeal.recognition.lexicon import TokenisedName


def wet_material_values(
    names: Sequence[TokenisedName], material: str | None, dry: MeasuredRange | None
) -> dict[str, Provenance]:
    """Return density, loss and restitution of a wet material; empty if it holds no water.

    A foam that is pressed pumps the water through its pores, which takes about the energy that its cells store: it
    doesn't rebound as a dry one does.

    Args:
        names: Of the object and of its part.
        material: What it is made of.
        dry: Density of that [kg/m³].
    """
    said = {word for name in names for word in name.words}
    for row in _table():
        found = said & set(row["words"])
        if found and dry is not None and material in row["of"]:
            low, usual, high = row["water"]
            span = MeasuredRange(dry.low * (1 + low), dry.typical * (1 + usual), dry.high * (1 + high), row["source"])
            reason = f"By its name it is {sorted(found)[0]}: {usual:g} times its dry mass are water."
            density = Provenance(span.typical, span, "metadata", reason, 0.35)
            return {"density": density} | _pore_pumping_values(row)
    return {}


def _pore_pumping_values(row: dict) -> dict[str, Provenance]:
    """Return what the water in pores makes of the loss factor, and so of the restitution."""
    if "loss" not in row:
        return {}
    low, usual, high = row["loss"]
    least, most = restitution_range_of_loss(low, high)
    why = "Water is pumped through its pores."
    spans = {
        "loss": MeasuredRange(low, usual, high, row["source"]),
        "restitution": MeasuredRange(least, restitution_of_loss(usual), most, row["source"]),
    }
    return {f: Provenance(r.typical, r, "metadata", why, 0.35) for f, r in spans.items()}


@cache
def _table() -> list[dict]:
    path = files("corporeal.recognition").joinpath("wet_materials.toml")
    (rows,) = tomllib.loads(path.read_text(encoding="utf-8")).values()
    return rows
