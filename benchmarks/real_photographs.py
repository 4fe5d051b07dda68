"""Real photographs: poses, quality, up, size and silhouettes of every set in a folder.

    python benchmarks/real_photographs.py FOLDER [--only axe] [--cases all bare]
        [--training draft normal] [--out runs/real] [--json FILE] [--docs [made]]

Each folder in FOLDER with ``images`` and a COLMAP model, ``sparse/0``, is a set; it may have
``masks``. It is reconstructed in up to four cases: with all that it has, without its masks, without
its poses, and from the photographs alone (bare); or, where it has ``video.mp4`` whose frames have
the numbers of its images, from that video. Measured are: photographs registered, of these the
share within 1.5° and 3 % of the given poses, and the medians; quality on photographs held out,
whole and on objects; the angle between up and the normal of the plane with the most sparse points,
where the object is known to stand on one; sides of all objects together against what the set's
``known.toml`` or ``real_sets.toml`` states, the one that is farthest off, and against a second
yardstick where these have one (for made sets all that is there, what nobody sees included);
intersection over union of the closed surfaces' silhouettes with the masks of the set, mean and
worst; minutes of the processor, all threads together. A set that is refused or fails is a row that
says why. Rows that are there already are kept, and a training or a search for poses that was
interrupted is continued. The page is written whole from rows: the table, what is known of each set,
and what the runs from photographs alone said; with what ``photograph_notes.toml`` says of it.
"""

import argparse
import json
import shutil
import time
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, NoReturn, get_args

import numpy as np
import real_measures as measure

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.progress import Progress
from corporeal.core.terminal import progress_bars, show_table
from corporeal.pipeline.stages.reconstruct import ReconstructedScene, reconstruct
from corporeal.reconstruction.gaussian_source import OBJECT_POSES_FOLDER
from corporeal.reconstruction.gaussians.training_schedule import TRAINING_PRESETS
from corporeal.reconstruction.reconstruct_config import ReconstructConfig
from corporeal.reconstruction.sfm.find_poses import POSES_FOLDER

Case = Literal["all", "unmasked", "unposed", "bare", "video"]
WORDS: dict[Case, str] = {
    "all": "as given",
    "unmasked": "no masks",
    "unposed": "no poses",
    "bare": "photographs alone",
    "video": "a video alone",
}
ALONE: tuple[Case, ...] = ("bare", "video")
VIDEO = "video.mp4"
HEADS = (
    "set", "given", "training", "registered", "right", "rotation off", "place off",
    "held out, object [dB]", "up off", "size off", "IoU, worst", "one closed piece", "minutes",
    "why not",
)  # fmt: skip
DOCS = Path(__file__).parents[1] / "docs" / "reference"
TITLES = {"real": "Real photographs benchmark", "made": "Rendered photographs benchmark"}
"""Of the pages, each at `page_of` its kind."""
MADE = "`python benchmarks/made_sets.py MODEL FOLDER/NAME …` makes sets; model and options are below."
NOTES = Path(__file__).with_name("photograph_notes.toml")
"""For each kind of page: what stands in its head (``page``), and beside sets by name (``sets``)."""
EVERY = 2.0
"""Between two readings of the clock that are kept [s]."""


class Clock:
    """Seconds of the processor, all threads together, also those before an interruption."""

    def __init__(self, path: Path) -> None:
        self.path, self.start = path, time.process_time()
        self.before = store.read_json(path)["seconds"] if path.exists() else 0.0
        self.written = self.seconds

    @property
    def seconds(self) -> float:
        """Spent so far [s]."""
        return self.before + time.process_time() - self.start

    def beside(self, progress: Progress) -> Progress:
        """Tell as before, and write down now and then how long it took."""

        def told(fraction: float, words: str) -> None:
            if self.seconds > self.written + EVERY:
                self.written = self.seconds
                store.write_json(self.path, {"seconds": self.written})
            progress(fraction, words)

        return told


def cases_of(folder: Path) -> list[Case]:
    """Return in which ways a set can be given, none twice."""
    if (folder / VIDEO).exists():
        return ["video"]
    masked = (folder / "masks").is_dir()
    return ["all", "unmasked", "unposed", "bare"] if masked else ["all", "bare"]


def given_as(folder: Path, case: Case, place: Path) -> Path:
    """Copy of a set what a case gives."""
    if case == "video":
        place.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copy(folder / VIDEO, place / f"{folder.name}.mp4"))
    photos = place / folder.name
    wanted = ["images"]
    wanted += ["masks"] if case in ("all", "unposed") else []
    wanted += ["sparse"] if case in ("all", "unmasked") else []
    for name in wanted:
        if (folder / name).is_dir() and not (photos / name).exists():
            shutil.copytree(folder / name, photos / name)
    return photos


def row_of(folder: Path, case: Case, training: str, out: Path) -> dict[str, Any]:
    """Reconstruct a set in one case; return a row of the table."""
    place = out / f"{folder.name}-{case}"
    kept = place / f"{training}.json"
    if kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    photos, work = given_as(folder, case, place), place / training
    row: dict[str, Any] = {"set": folder.name, "case": case, "training": training}
    clock = Clock(place / f"{training}-seconds.json")
    facts = measure.known(folder)
    posed = case in ("all", "unmasked")
    unit = facts.unit if posed else None
    config = ReconstructConfig(training=training, metres_per_unit=unit)  # type: ignore[arg-type]
    with progress_bars() as bars:
        try:
            told = clock.beside(bars(f"{folder.name} {case}"))
            made = reconstruct(photos, config, folder=work, progress=told)
            row |= results(made, folder, None if posed else poses_in(work))
        except UserError as problem:
            row["why"] = str(problem).replace(str(photos), folder.name)
            row |= {} if posed else poses_row(folder, poses_in(work))
        except Exception as problem:  # a row says that it failed; the other sets go on
            row["why"] = f"failed: {type(problem).__name__}: {problem}"
    row["seconds"] = clock.seconds
    store.write_json(kept, row)
    return row


def poses_in(work: Path) -> Path:
    """Return where the poses lie that a reconstruction used: of the object alone, or of all."""
    alone = work / OBJECT_POSES_FOLDER
    return alone if (alone / "sparse" / "0").is_dir() else work / POSES_FOLDER


def poses_row(folder: Path, poses: Path) -> dict[str, Any]:
    """Compare poses that were found, if there are some, with those given."""
    if not (poses / "sparse" / "0").is_dir():
        return {}
    given = measure.model_of(folder)
    found = measure.pose_errors(measure.model_of(poses), given)
    return {
        "registered": found.registered,
        "right": found.right / found.given,
        "angle_deg": found.angle,
        "place": found.place,
    }


def results(made: ReconstructedScene, folder: Path, poses: Path | None) -> dict[str, Any]:
    """Measure a reconstruction; poses: where those lie that were found."""
    given, facts, way = measure.model_of(folder), measure.known(folder), np.eye(4)
    row: dict[str, Any] = {"registered": len(given.images)}
    if poses is not None:
        way = measure.pose_errors(measure.model_of(poses), given).given_from_found
        row = poses_row(folder, poses)
    result = measure.came(made, way)
    row |= measure.held_out(made) | measure.whole(result) | measure.sizes(result, facts)
    row |= measure.silhouettes(result, folder, given) | measure.up_off(result, folder, given)
    return row | {"warnings": list(made.found.warnings)}


def cells(row: dict[str, Any], pictures: int) -> tuple[str, ...]:
    """Return a row of the table."""

    def shown(form: str, *keys: str) -> str:
        values = [row[key] for key in keys if row.get(key) is not None]
        return ", ".join(form.format(value) for value in values) or "–"

    registered = f"{row['registered']}/{pictures}" if "registered" in row else "–"
    good = "–"
    if "watertight" in row:
        pieces = row["objects"] == 1 and row["pieces"] == [1]
        good = "yes" if row["watertight"] and pieces else f"{row['things']} objects"
    return (
        row["set"],
        WORDS[row["case"]],
        row["training"],
        registered,
        shown("{:.0%}", "right"),
        shown("{:.2f}°", "angle_deg"),
        shown("{:.2%}", "place"),
        shown("{:.1f}", "psnr", "psnr_thing"),
        shown("{:.1f}°", "up_off_deg"),
        shown("{:+.1%}", "size_off", "size_off_all"),
        shown("{:.2f}", "iou", "iou_worst"),
        good,
        f"{row['seconds'] / 60:.1f}",
        row.get("why", ""),
    )


def with_more(note: str, more: str) -> str:
    """Return what is known of a set, and what there is to say beside."""
    return f"{note.removesuffix('.')}. {more}" if note and more else note or more


def page_of(kind: str) -> Path:
    """Return the page of real or of made photographs."""
    name = {"real": "real", "made": "rendered"}[kind]
    return DOCS / f"{name}-photographs-benchmark.md"


def write_docs(
    rows: list[dict[str, Any]], table: list[tuple[str, ...]], folders: list[Path], kind: str, said: str
) -> None:
    """Write the page, whole."""
    about = (__doc__ or "").split("\n\n")
    beside = tomllib.loads(NOTES.read_text(encoding="utf-8")).get(kind, {})
    written = " ".join(filter(None, [f"Written by `{said}`.", beside.get("page")]))
    lines = [f"# {TITLES[kind]}", "", written]
    lines += [MADE] * (kind == "made")
    lines += [" ".join(about[2].replace("``", "`").split()), ""]
    lines += ["| " + " | ".join(HEADS) + " |", "|---" * len(HEADS) + "|"]
    lines += ["| " + " | ".join(cell.replace("|", "/") for cell in row) + " |" for row in table]
    lines += ["", "## Sets", ""]
    more = beside.get("sets", {})
    notes = {f.name: with_more(measure.known(f).note, more.get(f.name, "")) for f in folders}
    lines += [f"- *{name}*: {note}" for name, note in notes.items() if note]
    lines += ["", "## Messages of runs from photographs alone", ""]
    for row in rows:
        if row["case"] in ALONE:
            warnings = " ".join(row.get("warnings", [])) or row.get("why", "Nothing.")
            lines += [f"- *{row['set']}* at {row['training']}: {warnings}"]
    page_of(kind).write_text("\n".join(lines) + "\n", encoding="utf-8")


def sets_in(folder: Path, only: Sequence[str], refuse: Callable[[str], NoReturn]) -> list[Path]:
    """Return the sets of a folder that are asked for; none named: all."""
    found = sorted(p.parent.parent for p in folder.glob("*/sparse/0") if p.is_dir())
    if not found:
        refuse(f"{folder} holds no set: a folder with images and sparse/0 in it.")
    if strange := set(only) - {f.name for f in found}:
        there = ", ".join(f.name for f in found)
        refuse(f"{folder} has no set {', '.join(sorted(strange))}. It has {there}.")
    return [f for f in found if not only or f.name in only]


def main() -> None:
    """Reconstruct all sets asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", help="sets, by the names of their folders")
    parser.add_argument("--cases", nargs="*", choices=get_args(Case))
    parser.add_argument("--training", nargs="+", choices=tuple(TRAINING_PRESETS), default=["draft"])
    parser.add_argument("--out", type=Path, default=Path("runs/real"))
    parser.add_argument("--json", type=Path, help="rows as data")
    parser.add_argument("--docs", nargs="?", const="real", choices=TITLES, help="write its page")
    asked = parser.parse_args()
    folders = sets_in(asked.folder, asked.only or (), parser.error)
    rows, table = [], []
    for folder in folders:
        pictures = sum(1 for _ in (folder / "images").iterdir())
        for case in cases_of(folder):
            if asked.cases and case not in asked.cases:
                continue
            for training in asked.training:
                rows.append(row_of(folder, case, training, asked.out))
                table.append(cells(rows[-1], pictures))
                show_table(HEADS, table[-1:])
    if asked.json:
        store.write_json(asked.json, rows)
    if asked.docs:
        more = "" if asked.training == ["draft"] else f" --training {' '.join(asked.training)}"
        more += " --docs" if asked.docs == "real" else f" --docs {asked.docs}"
        said = f"python benchmarks/real_photographs.py FOLDER{more}"
        write_docs(rows, table, folders, asked.docs, said)


if __name__ == "__main__":
    main()
