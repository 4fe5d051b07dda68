"""What a finished run says in the terminal: what everything was taken for, and what to look at."""

from collections.abc import Sequence
from pathlib import Path

from corporeal.findings import Breakage, PartAudit
from corporeal.terminal import console, print_line, print_table
from corporeal.trajectory.audit_file import read_run_audit
from corporeal.trajectory.audit_words import breakage_words

MOST_PARTS = 12
"""Rows of the table; a scene of more parts is in the report."""
MOST_WARNINGS = 5
"""Warnings that are printed whole."""
MOST_BLOWS = 3
"""Blows that may break something and are printed."""
HEADS = ("object", "part", "material", "mass", "simulated as")


def show_summary(folder: Path) -> None:
    """Print what the parts of a finished run were taken for, its warnings and hints."""
    audit = read_run_audit(folder)
    rows = [_row(part) for part in audit.parts]
    print_table(HEADS, rows[:MOST_PARTS], console)
    if len(rows) > MOST_PARTS:
        print_line(f"and {len(rows) - MOST_PARTS} parts more: see the report.")
    _listed("warning", audit.warnings)
    for hint in audit.hints:
        print_line(f"hint: {hint}")
    _breaking(audit.breakage)


def _breaking(found: Sequence[Breakage]) -> None:
    """Say what the film shows whole although it would break, and how to see it break."""
    doubted = [b for b in found if b.word != "holds" and not b.pieces]
    for blow in doubted[:MOST_BLOWS]:
        print_line(f"hint: {breakage_words(blow)}")
    if len(doubted) > MOST_BLOWS:
        print_line(f"and {len(doubted) - MOST_BLOWS} more that may break: see the report.")
    if any(b.word == "would break" for b in doubted):
        print_line("hint: with --breaking what would break falls into pieces.")


def _row(part: PartAudit) -> tuple[str, ...]:
    return (part.object or "", part.name, part.material, f"{part.mass_kg:.3g} kg", part.treatment)


def _listed(word: str, sentences: Sequence[str]) -> None:
    for sentence in sentences[:MOST_WARNINGS]:
        print_line(f"{word}: {sentence}")
    if len(sentences) > MOST_WARNINGS:
        more = len(sentences) - MOST_WARNINGS
        print_line(f"and {more} {word}{'s' * (more > 1)} more: see the report.")
