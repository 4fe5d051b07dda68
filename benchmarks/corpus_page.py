"""What a corpus came to as a page of the documentation: Markdown, measured rows only.

python benchmarks/corpus_page.py CORPUS docs/reference/corpus-results.md
"""

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from corporeal.core import store
from corporeal.lab.corpus.collect_results import CorpusResults, SceneMeasures, SceneRecord, collect_results
from corporeal.lab.corpus.corpus_breakdown import BreakdownLine, breakdowns, scene_materials, total_line

SCENE_TABLE_HEADS = ("scene", "what happens", "objects", "materials", "particles", "deepest overlap [dx]")
SCENE_TABLE_HEADS = (*SCENE_TABLE_HEADS, "energy gained", "time [s]", "memory [MB]", "happened", "audit")
BREAKDOWN_HEADS = ("scenes", "clean", "happened", "overlap [dx], median", "worst", "time [s], median")
BREAKDOWN_HEADS = (*BREAKDOWN_HEADS, "memory [MB], most", "materials")
BREAKDOWN_TITLES = {
    "interaction": "By interaction",
    "material class": "By material class",
    "law": "By law, as simulated",
}
COLUMN_NOTES = (
    "- **audit**: clean if no [bound](audit-json.md) is exceeded; else its message.",
    "- **happened**: whether what the interaction promises did: something came down, two met, what "
    "was struck struck a third, or the wind moved something.",
    "- **deepest overlap**: of an object with another or with the floor, in cells of the grid.",
    "- **energy gained**: kinetic and elastic, that no work accounts for, relative.",
    "- **time**: of the process that finished the scene, video included; **memory**: its maximum.",
)


def write_corpus_page(corpus: CorpusResults, path: Path) -> None:
    """Write the measured rows of a corpus as a page of documentation.

    Raises:
        UserError: The disk refuses it.

    """
    whole = total_line(corpus)
    lines = [f"# Corpus of {len(corpus.scenes)} scenes: results", "", _summary(corpus), ""]
    lines += [f"- {message}" for message in corpus.plan.messages]
    if whole is not None:
        lines += ["", "## Every scene", "", *_table(SCENE_TABLE_HEADS, map(_scene, corpus.run))]
        for key, title in BREAKDOWN_TITLES.items():
            group = [*breakdowns(corpus)[key], *([whole] if key == "interaction" else [])]
            lines += ["", f"## {title}", "", *_table((key, *BREAKDOWN_HEADS), map(_line, group))]
    lines += ["", "## Failures", "", *_wrong(corpus)]
    lines += ["", "## Columns", "", *COLUMN_NOTES, ""]
    store.write_bytes(path, "\n".join(lines).encode())


def _summary(corpus: CorpusResults) -> str:
    made = sum(s.made for s in corpus.scenes)
    numbers = [s.numbers for s in corpus.run if s.numbers]
    detail = {s.settings.fill.detail for s in corpus.run if s.settings}
    said = (
        f"Written by `python benchmarks/corpus_page.py CORPUS FILE`. Planned by "
        f"`corporeal corpus assemble CORPUS {corpus.plan.config.words}`: {len(corpus.scenes)} "
        f"scenes, {made} assembled, {len(numbers)} run"
    )
    if not numbers:
        return f"{said}."
    clean, seen = sum(n.clean for n in numbers), sum(n.seen for n in numbers)
    return (
        f"{said} at detail {', '.join(sorted(detail))}. {clean} of {len(numbers)} have a clean "
        f"audit; in {seen} what was planned happened. {sum(n.seconds for n in numbers) / 60:.0f} "
        f"minutes of computing in all, at most {max(n.peak_memory_mb for n in numbers):,.0f} MB."
    )


def _scene(scene: SceneRecord) -> Sequence[str]:
    found = scene.numbers
    if found is None:
        raise ValueError(f"{scene.name} was not run")
    return (
        scene.name,
        scene.planned.interaction,
        ", ".join(scene.planned.classes),
        ", ".join(scene_materials(scene)),
        f"{found.particles:,}",
        f"{found.max_penetration_dx:.2f}",
        f"{found.mechanical_growth:.0e}",
        f"{found.seconds:.0f}",
        f"{found.peak_memory_mb:,.0f}",
        "yes" if found.seen else "no",
        " ".join(found.breaches) or "clean",
    )


def _line(line: BreakdownLine) -> Sequence[str]:
    return (
        line.group,
        str(line.scenes),
        str(line.clean),
        str(line.seen),
        f"{line.penetration_median:.2f}",
        f"{line.penetration_worst:.2f}",
        f"{line.seconds_median:.0f}",
        f"{line.memory_worst_mb:,.0f}",
        ", ".join(line.materials) if line.group != "all" else "",
    )


def _wrong(corpus: CorpusResults) -> list[str]:
    """Name every scene that failed, is not clean or did not do what was planned."""
    said = [f"- {s.name}: failed: {s.error}" for s in corpus.scenes if s.error]
    said += [f"- {s.name}: {sentence}" for s in corpus.run for sentence in _faults(s.numbers)]
    left = [s.name for s in corpus.scenes if s.numbers is None and not s.error]
    if left:
        said.append(f"- Not run yet: {', '.join(left)}.")
    return said or ["Nothing: every scene ended with a clean audit, and did what was planned."]


def _faults(found: SceneMeasures | None) -> list[str]:
    if found is None:
        return []
    if found.seen:
        return list(found.breaches)
    touched, met = ", ".join(found.touched_before), ", then ".join(found.met_in_order)
    seen = [f"{touched} touched from the start"] * bool(touched) + [f"{met} met"] * bool(met)
    why = "; ".join(seen) or "no objects touched"
    return [*found.breaches, f"what was planned did not happen: {why}."]


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    lines: list[Sequence[str]] = [heads, ["---"] * len(heads), *rows]
    return ["| " + " | ".join(cell.replace("|", "/") for cell in line) + " |" for line in lines]


if __name__ == "__main__":
    write_corpus_page(collect_results(Path(sys.argv[1])), Path(sys.argv[2]))
