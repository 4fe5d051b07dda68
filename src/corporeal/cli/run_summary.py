"""Summary of a finished run in the terminal: materials of the parts, and warnings."""

from collections.abc import Sequence
from pathlib import Path

from rich.table import Table
from rich.text import Text

from corporeal.core.audit_data import PartAudit, PredictedBreakage
from corporeal.core.terminal import console, print_line, print_table
from corporeal.simulation.audit_file import read_run_audit
from corporeal.simulation.audit_messages import breakage_message
from corporeal.simulation.summary_text import (
    FINDINGS_SECTION,
    LEFT_OUT_SECTION,
    WARNINGS_SECTION,
    SummarySection,
    split_advice,
    summary_sections,
)

MAX_PART_ROWS = 12
"""Rows of the table; larger scenes are in the report."""
MAX_SENTENCES_PER_SECTION = 5
"""Sentences of a section that are printed in full."""
MAX_LISTED_IMPACTS = 3
"""Impacts with possible breakage that are printed."""
WORD_STYLES = {FINDINGS_SECTION.word: "bold red", WARNINGS_SECTION.word: "bold yellow"}
"""How a section's word is printed; all others bold."""
TABLE_HEADS = ("object", "part", "material", "mass", "simulated as")


def show_summary(folder: Path) -> None:
    """Print the materials of a finished run's parts, and its warnings by severity."""
    audit = read_run_audit(folder)
    rows = [_row(part) for part in audit.parts]
    print_table(TABLE_HEADS, rows[:MAX_PART_ROWS], console)
    if len(rows) > MAX_PART_ROWS:
        print_line(f"and {len(rows) - MAX_PART_ROWS} parts more: see the report.")
    sections = summary_sections(audit)
    for section, sentences in sections.items():
        if section is not FINDINGS_SECTION:
            _listed(section, sentences)
    _breakage_sentences(audit.breakage)
    for sentence in sections[FINDINGS_SECTION]:  # what is read last, each
        _say(FINDINGS_SECTION.word, sentence)


def _breakage_sentences(found: Sequence[PredictedBreakage]) -> None:
    """Describe what the video shows whole although it would break, and how to simulate breaking."""
    doubted = [b for b in found if b.word != "holds" and not b.pieces]
    for impact in doubted[:MAX_LISTED_IMPACTS]:
        _say("hint", breakage_message(impact))
    if len(doubted) > MAX_LISTED_IMPACTS:
        print_line(f"and {len(doubted) - MAX_LISTED_IMPACTS} more that may break: see the report.")
    if any(b.word == "would break" for b in doubted):
        _say("hint", "with --breaking such objects break into pieces.")


def _row(part: PartAudit) -> tuple[str, ...]:
    return (part.object or "", part.name, part.material, f"{part.mass_kg:.3g} kg", part.treatment)


def _listed(section: SummarySection, sentences: Sequence[str]) -> None:
    for sentence in sentences[:MAX_SENTENCES_PER_SECTION]:
        _say(section.word, sentence)
    more = len(sentences) - MAX_SENTENCES_PER_SECTION
    if more > 0:
        what = section.word if more == 1 else section.several
        what = f"more {what}" if section is LEFT_OUT_SECTION else f"{what} more"
        print_line(f"and {more} {what}: see the report.")


def _say(word: str, sentences: str) -> None:
    """Print a warning, its details dimmed; in a log, one line."""
    if not console.is_terminal:
        print_line(f"{word}: {sentences}")
        return
    first, rest = split_advice(sentences)
    row = Table.grid(padding=(0, 1))
    style = WORD_STYLES.get(word, "bold")
    row.add_row(Text(f"{word}:", style), Text.assemble(first, " ", (rest, "dim")))
    console.print(row)
