"""What is wet by its name holds water: sponges and cloths weigh more, and sponges fall dead."""

import tomllib
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from corporeal.core.types import Ground, Range
from corporeal.materials.rebound import rebound, rebound_range
from corporeal.recognition.lexicon import Name


def values_when_wet(
    names: Sequence[Name], material: str | None, dry: Range | None
) -> dict[str, Ground]:
    """Return density, loss and rebound of what a name says is wet; nothing where it holds no water.

    A foam that is pressed pumps the water through its pores, which takes about the energy that its
    cells store: it falls dead where a dry one bounces.

    Args:
        names: Of the thing and of its part.
        material: What it is made of.
        dry: Density of that [kg/m³].

    """
    said = {word for name in names for word in name.words}
    for row in _table():
        found = said & set(row["words"])
        if found and dry is not None and material in row["of"]:
            low, usual, high = row["water"]
            span = Range(
                dry.low * (1 + low), dry.typical * (1 + usual), dry.high * (1 + high), row["source"]
            )
            reason = (
                f"By its name it is {sorted(found)[0]}: {usual:g} times its dry mass are water."
            )
            density = Ground(span.typical, span, "metadata", reason, 0.35)
            return {"density": density} | _pumped(row)
    return {}


def _pumped(row: dict) -> dict[str, Ground]:
    """Return what the water in pores makes of the loss factor, and so of the restitution."""
    if "loss" not in row:
        return {}
    low, usual, high = row["loss"]
    least, most = rebound_range(low, high)
    why = "Water is pumped through its pores."
    spans = {
        "loss": Range(low, usual, high, row["source"]),
        "restitution": Range(least, rebound(usual), most, row["source"]),
    }
    return {f: Ground(r.typical, r, "metadata", why, 0.35) for f, r in spans.items()}


@cache
def _table() -> list[dict]:
    path = files("corporeal.recognition").joinpath("wet.toml")
    (rows,) = tomllib.loads(path.read_text(encoding="utf-8")).values()
    return rows
