"""What is wet by its name weighs what it holds of water as well: sponges and cloths."""

import tomllib
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from corporeal.types import Ground, Range
from corporeal.vlm.lexicon import Name


def density_when_wet(
    names: Sequence[Name], material: str | None, dry: Range | None
) -> dict[str, Ground]:
    """Return the density of what a name says is wet; nothing where it is not, or holds no water.

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
            return {"density": Ground(span.typical, span, "metadata", reason, 0.35)}
    return {}


@cache
def _table() -> list[dict]:
    path = files("corporeal.vlm").joinpath("wet.toml")
    (rows,) = tomllib.loads(path.read_text(encoding="utf-8")).values()
    return rows
