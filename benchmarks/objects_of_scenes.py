"""Objects segmented in pictures of settled scenes, compared with the scenes' own.

    python benchmarks/objects_of_scenes.py FOLDER [--points-from gaussians] [--json FILE] [--figure FILE]

FOLDER holds scenes that ``corporeal assemble`` wrote. Objects are segmented in points on the visible surfaces, or in
Gaussians. ``objects.py`` composes pairs of real models and writes a page about them.
"""

from dataclasses import dataclass, field
from pathlib import Path

import tyro
from segmentation.objects_evaluation import ObjectsEvaluationConfig, evaluate_objects, objects_record, objects_tables
from segmentation.objects_figure import draw_objects

from corporeal.core import store
from corporeal.core.terminal import progress_bars, show_table


@dataclass(frozen=True)
class Options:
    """What is compared, and where the results go."""

    folder: tyro.conf.Positional[Path]
    """Settled scenes."""
    json: Path | None = None
    """Output file for rows and errors (JSON)."""
    figure: Path | None = None
    """Output file for a picture of the objects (PNG)."""
    scenes: ObjectsEvaluationConfig = field(default_factory=ObjectsEvaluationConfig)


def main(words: list[str] | None = None) -> None:
    """Segment every scene, print the scores, and write what was asked for."""
    asked = tyro.cli(tyro.conf.OmitArgPrefixes[Options], description=__doc__, args=words)
    with progress_bars() as tell:
        found = evaluate_objects(asked.folder, asked.scenes, tell("evaluate"))
    rows = [judged.row for judged in found]
    for table in objects_tables(rows):
        show_table(table.heads, table.rows, table.title)
    if asked.json is not None:
        store.write_json(asked.json, objects_record(rows))
    if asked.figure is not None:
        draw_objects(found, asked.figure)


if __name__ == "__main__":
    main()
