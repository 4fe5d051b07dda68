"""What a verb's help shows: six options that most people need, then all others."""

import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal, get_args, get_origin

import pytest
import tyro

from corporeal import cli
from corporeal.cli.help_layout import OPTIONS_BEFORE_MORE, lay_out, options_of
from corporeal.pipeline.run_pipeline import Settings

NEEDED = ("detail", "vlm", "annotations", "drop", "object-names", "out")


@dataclass(frozen=True)
class Place:
    """Where it goes."""

    out: Path = Path("runs")
    """A folder, whose
    name is on two lines."""


@dataclass(frozen=True)
class Everything:
    """As `run` has it."""

    inputs: tyro.conf.Positional[tuple[Path, ...]]
    place: Place = Place()
    settings: Annotated[Settings, tyro.conf.arg(name="")] = field(default_factory=Settings)


def verbs_of(command):
    """Return every verb, with its second word where it has some, and its help."""
    for verb in cli.COMMANDS:
        code, said = command(verb, "--help")
        assert code == 0, said.err
        words = re.findall(rf"^  corporeal {verb} (\w+)", said.out, re.MULTILINE)
        listed = "WORD --help shows its options" in said.out
        if listed:
            yield from (((verb, word), command(verb, word, "--help")[1].out) for word in words)
        else:
            yield (verb,), said.out


def headings(said):
    """Return the heading of each option of a help text, in order."""
    found, heading = {}, ""
    for line in said.splitlines():
        if title := re.match(r"╭─ (.+?) ─+╮", line):
            heading = title[1]
        elif flag := re.match(r"│ (--[\w-]+)", line):
            found[flag[1]] = heading
    return found


def test_no_verb_shows_more_than_six_options_before_the_others(command, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    seen = dict(verbs_of(command))
    assert ("evaluate", "materials") in seen and ("corpus", "run") in seen and ("video",) in seen
    for words, said in seen.items():
        found = headings(said)
        before = [flag for flag, heading in found.items() if not heading.startswith("more")]
        assert len(before) <= OPTIONS_BEFORE_MORE, words
        assert len(before) == min(OPTIONS_BEFORE_MORE, len(found)), words
        assert list(found)[: len(before)] == before, words


def value(annotation):
    """Return words for the command line that are no option's default."""
    if get_origin(annotation) is Annotated:
        return value(get_args(annotation)[0])
    inner = [a for a in get_args(annotation) if a not in (type(None), Ellipsis)]
    if get_origin(annotation) is Literal:
        return [inner[-1]]
    if get_origin(annotation) is tuple:
        return [word for a in inner for word in value(a)]
    if inner:
        return value(inner[0])
    return {int: ["7"], float: ["7.5"], str: ["x"], Path: ["x"]}[annotation]


def words_of(option):
    """Return words for the command line that type an option."""
    if option.positional:
        return ["b.glb"]
    if option.annotation is bool:
        return [f"--{'no-' if option.default else ''}{option.name}"]
    return [f"--{option.name}", *value(option.annotation)]


NUMBERED = list(enumerate(options_of(Everything), start=1))
LINES = range(len(NUMBERED).bit_length())


@pytest.mark.parametrize("line", LINES)
def test_every_option_means_the_same_wherever_it_stands_in_the_help(line):
    """A line has the options with one bit in their numbers: each in some, no two in the same ones.

    So one that is taken for another shows in a line that has only one of them.
    """
    words = ["a.glb"]
    for number, option in sorted(NUMBERED, key=lambda one: not one[1].positional):
        words += words_of(option) if number >> line & 1 else []
    layout = lay_out(Everything, NEEDED)
    plain = tyro.cli(tyro.conf.OmitArgPrefixes[Everything], args=words)
    ordered = layout.settings(tyro.cli(tyro.conf.OmitArgPrefixes[layout.shape], args=words))
    assert ordered == plain


def test_words_below_an_option_stay_with_it_wherever_it_stands(capsys):
    for first in (NEEDED, ("fps", *NEEDED[:-1])):
        layout = lay_out(Everything, first)
        with pytest.raises(SystemExit):
            tyro.cli(tyro.conf.OmitArgPrefixes[layout.shape], args=["--help"])
        assert "A folder, whose name is on two lines." in capsys.readouterr().out


def test_an_option_that_is_not_there_cannot_come_first():
    with pytest.raises(ValueError, match=r"Everything: .*\['nowhere'\] cannot come first"):
        lay_out(Everything, ("nowhere",))


def test_an_unknown_second_word_shows_the_menu(command):
    code, said = command("evaluate", "weight", "scans/")
    assert code == 2
    assert "Unknown word after evaluate 'weight'" in said.err
    assert "Choose one of: dynamics, mass, materials." in said.err


def test_the_second_words_stand_in_a_column_of_their_own(command):
    _, said = command("evaluate", "--help")
    rows = [line for line in said.out.splitlines() if line.startswith("  corporeal evaluate ")]
    starts = {re.match(r"  corporeal evaluate (\w+ +)", row).end() for row in rows}
    assert len(rows) == 3 and len(starts) == 1


def test_an_option_of_another_sub_command_is_refused(command):
    code, said = command("evaluate", "materials", "scenes/", "--anonymous")
    assert code == 2
    assert "--anonymous" in said.err


HEAVY = ("warp", "numba", "scipy", "igl", "embreex", "trimesh", "pydantic", "corporeal.pipeline.run_pipeline")


@pytest.mark.parametrize("words", [["--version"], ["run", "--help"]])
def test_who_asks_for_help_waits_for_nothing_that_simulates(words):
    asked = (
        "import sys\nfrom corporeal import cli\n"
        f"sys.argv = ['corporeal', *{words}]\n"
        "try:\n    cli.main()\nexcept SystemExit:\n    pass\n"
        f"print('loaded:', *(name for name in {HEAVY} if name in sys.modules))"
    )
    told = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert told.stdout.rstrip().endswith("loaded:")
