"""The library as a page of the documentation.

python benchmarks/materials_page.py > docs/reference/materials.md
"""

from collections.abc import Sequence

from corporeal.core.types import Law
from corporeal.materials.contact_pairs import measured_friction_pairs, measured_restitution_pairs
from corporeal.materials.flat_crush import layered_materials
from corporeal.materials.library import library
from corporeal.materials.library_entry import MaterialEntry, source_table
from corporeal.materials.library_listing import LISTING_FIELDS, LISTING_HEADS, range_text
from corporeal.materials.quantities import QUANTITIES
from corporeal.materials.restitution_speed import rated_restitutions
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

SURFACE_FIELDS = ("friction", "restitution", "loss", "strength", "strength_local", "hardening", "shell_thickness")
FLUID_FIELDS = ("density", "viscosity", "consistency", "flow_index", "yield_shear")
SURFACE_HEADS = ("material", "group", "μ", "e", "η", "S", "S_loc", "H", "wall")
FLUID_HEADS = ("material", "ρ", "viscosity", "consistency K_c", "n", "τ_y")
INTRODUCTION_TEXT = """# Materials

Generated from the tables in `src/corporeal/materials` by `benchmarks/materials_page.py`; a test holds this page equal
to them. Each cell is the measured range with the usual value in
brackets: E Young's modulus, ν Poisson's ratio, ρ density, σ_y yield stress, φ friction angle and c
cohesion of granular matter; μ the surface's own sliding friction, e restitution, η loss factor, S
strength of brittle materials (a whole bar's, in bending or tension), S_loc their tensile strength
over a square millimetre, H hardening modulus, wall the usual thickness of objects made as
shells.

`corporeal materials` lists them, `corporeal materials show NAME` shows all of one with its sources.
"""
OWN_LIBRARY_TEXT = """## A library of your own

```toml
extends = "default"              # leave it out, and the file stands alone

[sources.my-bench]
cite = "Our tensile test of 2026-03-14, five specimens"

[lamp_steel]
law = "von_mises"                # %(laws)s
group = "metal"
young_GPa = { low = 195, typical = 205, high = 210, source = "my-bench" }
poisson = { low = 0.28, typical = 0.29, high = 0.30, source = "elastic-tables" }
density_kg_m3 = { low = 7800, typical = 7850, high = 7900, source = "my-bench" }
yield_MPa = { low = 240, typical = 260, high = 300, source = "my-bench" }
```

`corporeal run scene.glb --library my.toml` uses it everywhere. **One rule**: a file that starts
with `extends = "default"` (or `"reference"`) is merged, material by material: its table replaces
the namesake whole. Any other file replaces the library, and must then hold every material that the
scene is found to be made of, the floor (`--floor`) and what stands for the unknown (`--neutral`).

`corporeal materials check my.toml` lists every mistake with its line and what to do: ends swapped,
a Poisson's ratio of 0.5, a number without a source, a source that nothing explains, a key or law
that does not exist, a law without the numbers that it reads, and numbers that lie three times
beyond those of the material's namesake or of all that share its group and law, which
reveals wrong units. Of soft materials (groups soft, fibrous, polymer, elastomer, foam, food) it
checks the loss factor against the restitution, which a ball's rebound ties together (see below):
ranges that cannot both be true are a mistake, unless the restitution has a note on what else takes
the energy. A range that is right all the same is marked: `{ low = …, unusual = true }`. A library
with a mistake is not used. Every law needs E, ν and ρ; %(needs)s.
Without friction or restitution of its own a material gets 0.5.
"""
LOSS_TEXT = """## Loss and rebound

The loss factor is that of an impact: what a ball of the material loses in its bulk when it meets
something hard, at 10 to 1000 Hz and the strains of an impact. It ties down the restitution,
e = exp(-1.385 η + 0.133 η²): hereditary Hertz contact (Lee and Radok 1960) with a loss factor that
is flat around the impact. Where the two disagree something else takes energy, and a note says what:

"""
FRICTION_RULE_TEXT = """## Friction between two surfaces

Measured pairs come first, the most particular one: a material's own name before its family's
("wood" for plywood), that before its group's ("metal"). Published tables disagree; the range holds
them all. What is simulated is sliding friction. For an unmeasured pair the rule is
μ = √(μ_a μ_b) of the surfaces' own values, which were chosen so that the rule comes near the
measured pairs.
"""
RESTITUTION_RULE_TEXT = """## Restitution of two rigid bodies

Measured pairs come first here too, most particular one first, where both bodies are solid: what was
measured are balls, and walls ring. A restitution that a person states for a material outranks it.
Solid metals, glass and ceramics return what their loss factors leave; a metal that yields returns
3.8 (Y/E*)^½ (⅔ π ρ v²/Y)^(-⅛) at most (Johnson, Contact Mechanics, eq. 11.43), here at 1 m/s, in a
simulation at the speed of the first impact.
For all other pairs e² = (E_b e_a² + E_a e_b²)/(E_a + E_b) of the materials' own values with the
plane-strain moduli, so the softer body decides (Cross, Am. J. Phys. 68 (2000) 1025); where both are
soft and lossy (elastomer, foam, food, soft) their loss factors add up by the same shares instead.
"""
LAYERED_TEXT = """These are weak across their layers: an impact on the face of a sheet crushes it at this
pressure (`materials/flat_crush.py`).
"""
RATED_TEXT = """These were rated at a speed, and return less of a faster impact; their loss factor
follows.
"""
SOURCES_TEXT = """## Sources

*read*: the value was seen in the source while the library was compiled; *recalled*: cited from
knowledge of the handbook; *ours*: derived, chosen or estimated by us.
"""


def library_markdown() -> str:
    """Write the page: both libraries, friction, how to make one's own, and the sources."""
    default = list(library().values())
    reference = list(library("reference").values())
    counts = f"{len(default)} materials. {_counts()}"
    return "\n".join(
        [
            INTRODUCTION_TEXT,
            OWN_LIBRARY_TEXT % {"laws": ", ".join(law.name.lower() for law in Law), "needs": _needs()},
            *("## Library `default`", "", counts, "", *_table(LISTING_HEADS, default, _core), ""),
            *("### Surface, damping, hardening, walls", "", *_table(SURFACE_HEADS, default, _other)),
            *("", "### Liquids and pastes", "", *_table(FLUID_HEADS, _liquids(default), _flowing)),
            "",
            LOSS_TEXT + "\n".join(_notes()),
            "",
            *("## Library `reference`: the vocabulary as first published", ""),
            *("`--library reference`: 22 materials, errors included; a baseline only.", ""),
            *(*_table(LISTING_HEADS, reference, _core), ""),
            FRICTION_RULE_TEXT,
            *(*_friction(), ""),
            RESTITUTION_RULE_TEXT,
            *(*_rebounds(), ""),
            RATED_TEXT,
            *(*_ratings(), ""),
            LAYERED_TEXT,
            *(*_layered(), ""),
            SOURCES_TEXT,
            *(f"- **{k}** ({row['check']}): {row['cite']}" for k, row in source_table().items()),
            "",
        ]
    )


def _needs() -> str:
    """Describe what some laws cannot do without."""
    asked = {law.name.lower(): CONSTITUTIVE_LAWS[law].needs for law in Law if CONSTITUTIVE_LAWS[law].needs}
    return ",\n".join(
        f"`{name}` also {' and '.join(QUANTITIES[f].words.lower() for f in fields)}" for name, fields in asked.items()
    )


def _counts() -> str:
    """Return how well founded the numbers are."""
    counts = {"read": 0, "recalled": 0, "ours": 0}
    for entry in library().values():
        for field in ("young_pa", "poisson", "density", "yield_stress"):
            if field in entry.ranges:
                keys = entry.ranges[field].source.split("+")
                checks = [source_table()[k]["check"] for k in keys]
                counts[max(checks, key=list(counts).index)] += 1
    total = sum(counts.values())
    return (
        f"Of their {total} values of E, ν, ρ and σ_y, {counts['read']} rest on sources that were "
        f"read, {counts['recalled']} on handbooks that were recalled, and {counts['ours']} at "
        "least in part on an estimate of ours."
    )


def _table(heads: Sequence[str], entries: Sequence[MaterialEntry], row) -> list[str]:
    rows = [heads, ("---",) * len(heads), *(row(entry) for entry in entries)]
    return [f"| {' | '.join(cells)} |" for cells in rows]


def _core(entry: MaterialEntry) -> tuple[str, ...]:
    return (entry.name, entry.law.name.lower(), *_cells(entry, LISTING_FIELDS))


def _other(entry: MaterialEntry) -> tuple[str, ...]:
    return (entry.name, entry.group, *_cells(entry, SURFACE_FIELDS))


def _liquids(known: Sequence[MaterialEntry]) -> list[MaterialEntry]:
    return [entry for entry in known if CONSTITUTIVE_LAWS[entry.law].liquid]


def _flowing(entry: MaterialEntry) -> tuple[str, ...]:
    return (entry.name, *_cells(entry, FLUID_FIELDS))


def _cells(entry: MaterialEntry, fields: Sequence[str]) -> list[str]:
    ranges = [(f, entry.ranges.get(f)) for f in fields]
    return [range_text(f, r.low, r.typical, r.high) if r else "" for f, r in ranges]


def _notes() -> list[str]:
    """Collect what else takes the energy of an impact, and of which materials."""
    names_of: dict[str, list[str]] = {}
    for entry in library().values():
        if "restitution" in entry.notes:
            names_of.setdefault(entry.notes["restitution"], []).append(entry.name)
    return [f"- {', '.join(names)}: {note}" for note, names in names_of.items()]


def _friction() -> list[str]:
    lines = ["| pair | static | sliding | source |", "| --- | --- | --- | --- |"]
    for row in measured_friction_pairs().values():
        low, high = row["static"]
        static = f"{low:g}–{high:g}" if low < high else f"{low:g}"
        note = f" ({row['note']})" if "note" in row else ""
        sliding = range_text("friction", *row["sliding"])
        pair = " on ".join(row["of"])
        lines.append(f"| {pair}{note} | {static} | {sliding} | {row['source']} |")
    return lines


def _rebounds() -> list[str]:
    lines = ["| pair | restitution | source |", "| --- | --- | --- |"]
    for row in measured_restitution_pairs().values():
        note = f" ({row['note']})" if "note" in row else ""
        value = range_text("restitution", *row["restitution"])
        lines.append(f"| {' on '.join(row['of'])}{note} | {value} | {row['source']} |")
    return lines


def _ratings() -> list[str]:
    lines = ["| material | rated at | less for every m/s more | source |", "|---|---:|---:|---|"]
    for name, row in rated_restitutions().items():
        lines.append(f"| {name} | {row.speed_m_s:g} m/s | {row.slope_s_m:g} | {row.source} |")
    return lines


def _layered() -> list[str]:
    lines = ["| material | E across | crushed at | source |", "|---|---:|---:|---|"]
    for name, row in layered_materials().items():
        young_pa, crush = f"{1e-6 * row.young_across_pa:g} MPa", f"{1e-3 * row.crush_pa:g} kPa"
        lines.append(f"| {name} | {young_pa} | {crush} | {row.source} |")
    return lines


if __name__ == "__main__":
    print(library_markdown())
