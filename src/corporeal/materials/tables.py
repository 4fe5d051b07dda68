"""The library as text: for the terminal, and for the documentation page."""

from math import degrees

from corporeal.materials.library import Entry, citation, find, library, sources
from corporeal.materials.quantities import QUANTITIES

SCALES = {"Pa": ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (0.0, "Pa"))}
COLUMNS = ("young", "poisson", "density", "yield_stress", "friction_angle", "cohesion")
HEADS = ("material", "law", "E", "ν", "ρ", "σ_y", "φ", "c")


def table(library_name: str = "default") -> str:
    """Every material of a library, one line each: range, and the typical value in brackets."""
    rows = [HEADS, *(_row(e) for e in library(library_name).values())]
    widths = [max(len(row[i]) for row in rows) for i in range(len(HEADS))]
    lines = ["  ".join(c.ljust(w) for c, w in zip(r, widths, strict=True)).rstrip() for r in rows]
    return "\n".join([lines[0], "-" * max(map(len, lines)), *lines[1:]])


def show(name: str, library_name: str = "default") -> str:
    """Everything the library says of one material, with its sources."""
    entry = find(name, library_name)
    lines = [f"{entry.name}  ({entry.law.name.lower()})"]
    if entry.aliases:
        lines.append(f"also: {', '.join(entry.aliases)}")
    if entry.note:
        lines.append(entry.note)
    lines.append("")
    for field, r in entry.ranges.items():
        words = QUANTITIES[field].words
        lines.append(f"  {words:<18} {span(field, r.low, r.typical, r.high):<28} {r.source}")
    keys = sorted({key for r in entry.ranges.values() for key in r.source.split("+")})
    lines += ["", "Sources", *(f"  {key}: {citation(key)}" for key in keys)]
    return "\n".join(lines)


def markdown() -> str:
    """Write the documentation page: both libraries and their sources."""
    return "\n".join(
        [
            "# Materials",
            "",
            "Generated from the tables in `src/corporeal/materials` by `corporeal.materials."
            "markdown()`; a test holds this page equal to them. Each cell is the measured range "
            "with the usual value in brackets.",
            "",
            "## Library `default`",
            "",
            *_markdown_table("default"),
            "",
            "## Library `reference`: the vocabulary as first published",
            "",
            *_markdown_table("reference"),
            "",
            "## Sources",
            "",
            "*read*: the value was seen in the source while the library was compiled; *recalled*: "
            "cited from knowledge of the handbook; *ours*: derived, chosen or estimated by us.",
            "",
            *(f"- **{key}** ({row['check']}): {row['cite']}" for key, row in sources().items()),
            "",
        ]
    )


def span(field: str, low: float, typical: float, high: float) -> str:
    """Write a range in a readable unit, with the typical value in brackets."""
    factor, unit = _scale(field, high)
    bounds = f"{low * factor:.3g}–{high * factor:.3g}" if low < high else f"{low * factor:.3g}"
    middle = f" ({typical * factor:.3g})" if low < high else ""
    return f"{bounds}{middle}{' ' + unit if unit != '-' else ''}"


def _scale(field: str, largest: float) -> tuple[float, str]:
    unit = QUANTITIES[field].unit
    if unit == "rad":
        return degrees(1.0), "°"
    if unit == "m":
        return 1e3, "mm"
    for size, name in SCALES.get(unit, ()):
        if largest >= size:
            return 1.0 / (size or 1.0), name
    return 1.0, unit


def _row(entry: Entry) -> tuple[str, ...]:
    cells = (entry.ranges.get(field) for field in COLUMNS)
    written = (
        span(f, r.low, r.typical, r.high) if r else "" for f, r in zip(COLUMNS, cells, strict=True)
    )
    return (entry.name, entry.law.name.lower(), *written)


def _markdown_table(library_name: str) -> list[str]:
    rows = [HEADS, ("---",) * len(HEADS), *(_row(e) for e in library(library_name).values())]
    return [f"| {' | '.join(row)} |" for row in rows]
