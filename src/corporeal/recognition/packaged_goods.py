"""Packaged goods: contents and vessels."""

import tomllib
from collections.abc import Iterator
from functools import cache
from importlib.resources import files


@cache
def contents_table() -> dict:
    """Return what names say of vessels: how full they are, of what, and what goods come in."""
    path = files("corporeal.recognition").joinpath("contents_from_name.toml")
    return tomllib.loads(path.read_text(encoding="utf-8"))


def packaged_goods() -> Iterator[tuple[str, dict]]:
    """Yield every vessel with goods as a phrase, and what it is: "pesticide bottle".

    The first row that names one counts: oil is oil, and in a bottle of glass.
    """
    inside = {good: name for name, goods in contents_table()["contents"].items() for good in goods}
    named: set[str] = set()
    for row in contents_table()["sold"]:
        goods = [
            *row["of"],
            *(g for kind in row.get("kinds", ()) for g in contents_table()["kinds"][kind]),
        ]
        for phrase, good in ((f"{good} {v}", good) for v in row["vessels"] for good in goods):
            if phrase not in named:
                named.add(phrase)
                contents = row.get("contents") or inside[good]
                yield phrase, {**row, "contents": contents, "of": ()}
