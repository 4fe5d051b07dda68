"""The library as text for the terminal, and materials.json of a scene."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import degrees

from corporeal.core.types import (
    Hypothesis,
    MassPosterior,
    Material,
    MaterialField,
    Part,
    PartComponent,
    PartDescription,
    Parts,
    Provenance,
    ScanThickening,
    Structure,
)
from corporeal.materials.contact_pairs import measured_friction_pairs, measured_restitution_pairs
from corporeal.materials.library import find_material, library
from corporeal.materials.library_entry import MaterialEntry, citation, source_table
from corporeal.materials.material_candidates import fraction_of, is_logarithmic
from corporeal.materials.quantities import QUANTITIES
from corporeal.materials.range_modifiers import is_within_range, range_modifiers

PREFIXES_OF_UNIT = {"Pa": ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (0.0, "Pa"))}
LISTING_FIELDS = ("young_pa", "poisson", "density", "yield_stress", "friction_angle", "cohesion")
LISTING_HEADS = ("material", "law", "E", "ν", "ρ", "σ_y", "φ", "c")


def list_materials(library_name: str = "default") -> str:
    """Every material of a library, one line each: range, and the typical value in brackets."""
    rows = [LISTING_HEADS, *(_row(e) for e in library(library_name).values())]
    widths = [max(len(row[i]) for row in rows) for i in range(len(LISTING_HEADS))]
    lines = ["  ".join(c.ljust(w) for c, w in zip(r, widths, strict=True)).rstrip() for r in rows]
    return "\n".join([lines[0], "-" * max(map(len, lines)), *lines[1:]])


def describe_material(name: str, library_name: str = "default") -> str:
    """Everything the library says of one material, with its sources."""
    entry = find_material(name, library_name)
    lines = [f"{entry.name}  ({', '.join(w for w in (entry.group, entry.law.name.lower()) if w)})"]
    if entry.aliases:
        lines.append(f"also: {', '.join(entry.aliases)}")
    if entry.note:
        lines.append(entry.note)
    lines.append("")
    for field, r in entry.ranges.items():
        words = QUANTITIES[field].words
        lines.append(f"  {words:<18} {range_text(field, r.low, r.typical, r.high):<26} {r.source}")
        lines += [f"    {entry.notes[field]}"] if field in entry.notes else []
    lines += _uses(entry)
    lines += _measured_pairs_text(
        "Measured sliding friction, clean and dry", "sliding", measured_friction_pairs(), entry
    )
    lines += _measured_pairs_text(
        "Measured restitution of solid bodies", "restitution", measured_restitution_pairs(), entry
    )
    keys = sorted({key for r in entry.ranges.values() for key in _keys(r.source)})
    lines += ["", "Sources", *(f"  {key}{_seen(key)}" for key in keys)]
    return "\n".join(lines)


def _uses(entry: MaterialEntry) -> list[str]:
    """Return how use or treatment narrows the ranges, as a model is offered them."""
    rows = []
    for use in range_modifiers(entry.name):
        bands = [
            f"{QUANTITIES[f].words.lower()} {range_text(f, low, low, high).split(' (')[0]}{_unit(f, low)}"
            for f, (low, high) in use.bands.items()
            if f in entry.ranges and is_within_range(low, high, entry.ranges[f])
        ]
        rows += [f"  {use.words}: {', '.join(bands)}"] if bands else []
    return ["", "Uses", *rows] if rows else []


def _unit(field: str, value: float) -> str:
    unit = _scale(field, value)[1]
    return "" if unit == "-" else f" {unit}"


def _measured_pairs_text(title: str, key: str, known: Mapping[frozenset[str], dict], entry: MaterialEntry) -> list[str]:
    """List the measured pairs of this material or its group."""
    rows = []
    for names, row in known.items():
        own = [n for n in entry.kin if n in names]
        if own:
            other = next(iter(names - {own[0]}), own[0])
            low, typical, high = row[key]
            rows.append(f"  as {own[0]} on {other}: {range_text('friction', low, typical, high)}")
    return ["", title, *rows] if rows else []


def _keys(source: str) -> list[str]:
    """Return the keys of a source; a source that a user's file explains is one text."""
    keys = source.split("+")
    return keys if set(keys) <= set(source_table()) else [source]


def _seen(key: str) -> str:
    row = source_table().get(key)
    return f" ({row['check']}): {row['cite']}" if row else ""


def materials_json(
    field: MaterialField, parts: Parts, masses: Sequence[float] = (), scales: Sequence[float] = ()
) -> dict:
    """Return the materials of all parts as plain data, with the grounds of every value [SI].

    A part whose mesh several objects share has ``pieces``; its own values, with which it moves, are those of the piece
    that matters most, and it weighs what its pieces weigh together. Lengths are those of the real object, whatever its
    scale in the scene.

    Args:
        field: What they are made of.
        parts: The catalogue.
        masses: Of each part in the scene [kg], where they are known.
        scales: Scene size over real size of each part.
    """
    pieces = field.pieces or ((),) * len(field.materials)
    rows = zip(parts.catalogue, field.materials, field.structures, field.words, pieces, strict=True)
    weighed = zip(masses, scales, strict=True)
    heavy = [{"scale": s, "mass_kg": m, "real_mass_kg": m / s**3} for m, s in weighed]
    rows_of_parts = [_part_json(*row) for row in rows]
    mixtures = {"masses": [_mass_json(m) for m in field.mixtures]} if field.mixtures else {}
    return mixtures | {
        "units": {q.field: q.unit for q in QUANTITIES.values()},
        "parts": [part | own for part, own in zip(rows_of_parts, heavy or [{}] * len(rows_of_parts), strict=True)],
        "friction": field.friction.round(4).tolist(),
        "restitution": field.restitution.round(4).tolist(),
        "order": "rows and columns are the parts in order, then the floor and the walls",
    }


def _mass_json(mixture: MassPosterior) -> dict:
    """Describe what an object may weigh, by each of several answers too where several were given."""
    row = asdict(mixture)
    return row if mixture.answers else {n: value for n, value in row.items() if n != "answers"}


def _part_json(
    part: Part, material: Material, made: Structure, words: PartDescription, pieces: tuple[PartComponent, ...]
) -> dict:
    row = {"name": part.name, "object": part.object, "found_by": part.found_by}
    row |= _made_json(material, made, words)
    return row | ({"pieces": [_piece_json(p) for p in pieces]} if pieces else {})


def _piece_json(piece: PartComponent) -> dict:
    words = piece.words
    shares = {"volume_share": words.volume_share, "surface_share": words.surface_share}
    return {"name": words.name} | shares | _made_json(piece.material, piece.structure, words)


def _made_json(material: Material, made: Structure, words: PartDescription) -> dict:
    return {
        "material": material.name,
        "recognised": words.material,
        "answered_by": words.answered_by,
        "margin": words.margin,
        "reason": words.reason,
        "alternatives": [{"material": m, "probability": p} for m, p in words.alternatives],
        "ways": [_way_json(way) for way in words.hypotheses],
        "law": material.law.name.lower(),
        "structure": _structure_json(made),
        **_swelling_json(words.swelling),
        "values": {name: _ground_json(name, g) for name, g in material.grounds.items()},
    }


def _swelling_json(said: ScanThickening | None) -> dict:
    """Stated ratio of real to scanned volume."""
    return {"real_share": asdict(said)} if said else {}


def _way_json(way: Hypothesis) -> dict:
    row = {
        "material": way.material,
        "built": way.structure,
        "contents": way.contents,
        "fill": way.fill,
        "solidity": way.solidity,
        "reading": way.reading,
    }
    return {k: v for k, v in row.items() if v not in (None, "")} | {
        "probability": way.probability,
        "reason": way.reason,
    }


def _structure_json(made: Structure) -> dict:
    row: dict = {"kind": made.kind, "thickness": made.thickness, "reason": made.reason}
    if made.solidity < 1:
        row["solidity"] = made.solidity
    if made.contents is not None:
        inner = made.contents
        row |= {"contents": inner.name, "fill": made.fill}
        row["contents_values"] = {name: _ground_json(name, g) for name, g in inner.grounds.items()}
    return row


def _ground_json(name: str, ground: Provenance) -> dict:
    return {
        "value": ground.value,
        "range": [ground.range.low, ground.range.high],
        "unit": QUANTITIES[name].unit,
        "place": round(fraction_of(ground.range, ground.value), 4),
        "scale": "logarithmic" if is_logarithmic(ground.range) else "linear",
        "chosen_by": ground.chosen_by,
        "margin": ground.margin,
        "reason": ground.reason,
        "source": citation(ground.range.source),
    }


def range_text(field: str, low: float, typical: float, high: float) -> str:
    """Write a range in a readable unit, with the typical value in brackets."""
    factor, unit = _scale(field, typical)
    words = [_number(value * factor) for value in (low, high, typical)]
    bounds = f"{words[0]}–{words[1]} ({words[2]})" if low < high else words[0]
    return bounds if unit == "-" else f"{bounds} {unit}"


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def _scale(field: str, value: float) -> tuple[float, str]:
    unit = QUANTITIES[field].unit
    if unit == "rad":
        return degrees(1.0), "°"
    if unit == "m":
        return 1e3, "mm"
    for size, name in PREFIXES_OF_UNIT.get(unit, ()):
        if value >= size:
            return 1.0 / (size or 1.0), name
    return 1.0, unit


def _row(entry: MaterialEntry) -> tuple[str, ...]:
    cells = (entry.ranges.get(field) for field in LISTING_FIELDS)
    written = (range_text(f, r.low, r.typical, r.high) if r else "" for f, r in zip(LISTING_FIELDS, cells, strict=True))
    return (entry.name, entry.law.name.lower(), *written)
