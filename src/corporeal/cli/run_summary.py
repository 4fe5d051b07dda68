"""What a finished run says in the terminal: what everything was taken for, and what to look at."""

from collections.abc import Sequence
from pathlib import Path

from rich.table import Table
from rich.text import Text

from corporeal.core.findings import Breakage, PartAudit
from corporeal.core.terminal import console, print_line, print_table
from corporeal.simulation.audit_file import read_run_audit
from corporeal.simulation.audit_words import breakage_words
from corporeal.simulation.closing_words import DOUBT, LEFT_OUT, Section, closing_words, parted

MOST_PARTS = 12
"""Rows of the table; a scene of more parts is in the report."""
MOST_WARNINGS = 5
"""Sentences of a section that are printed whole."""
MOST_BLOWS = 3
"""Blows that may break something and are printed."""
HEADS = ("object", "part", "material", "mass", "simulated as")


def show_summary(folder: Path) -> None:
    """Print what the parts of a finished run were taken for, and what it says last, by weight."""
    audit = read_run_audit(folder)
    rows = [_row(part) for part in audit.parts]
    print_table(HEADS, rows[:MOST_PARTS], console)
    if len(rows) > MOST_PARTS:
        print_line(f"and {len(rows) - MOST_PARTS} parts more: see the report.")
    for section, sentences in closing_words(audit).items():
        _listed(section, sentences)
    _breaking(audit.breakage)


def _breaking(found: Sequence[Breakage]) -> None:
    """Say what the film shows whole although it would break, and how to see it break."""
    doubted = [b for b in found if b.word != "holds" and not b.pieces]
    for blow in doubted[:MOST_BLOWS]:
        _say("hint", breakage_words(blow))
    if len(doubted) > MOST_BLOWS:
        print_line(f"and {len(doubted) - MOST_BLOWS} more that may break: see the report.")
    if any(b.word == "would break" for b in doubted):
        _say("hint", "with --breaking what would break falls into pieces.")


def _row(part: PartAudit) -> tuple[str, ...]:
    return (part.object or "", part.name, part.material, f"{part.mass_kg:.3g} kg", part.treatment)


def _listed(section: Section, sentences: Sequence[str]) -> None:
    for sentence in sentences[:MOST_WARNINGS]:
        _say(section.word, sentence)
    more = len(sentences) - MOST_WARNINGS
    if more > 0:
        what = section.word if more == 1 else section.several
        what = f"more {what}" if section is LEFT_OUT else f"{what} more"
        print_line(f"and {more} {what}: see the report.")


def _say(word: str, sentences: str) -> None:
    """Print what is the matter, and dim what follows from it; in a log, one line."""
    if not console.is_terminal:
        print_line(f"{word}: {sentences}")
        return
    first, rest = parted(sentences)
    row = Table.grid(padding=(0, 1))
    style = "bold yellow" if word == DOUBT.word else "bold"
    row.add_row(Text(f"{word}:", style), Text.assemble(first, " ", (rest, "dim")))
    console.print(row)
