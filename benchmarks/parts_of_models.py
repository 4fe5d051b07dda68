"""Parts found in pictures of models, compared with the files' own nodes and materials.

    python benchmarks/parts_of_models.py [FOLDER] [--names TOML] [--json FILE] [--figure FILE]

Each model is rendered from all sides and segmented in the visible points; default: four models of the showcase.
--structural dinov2 --semantic clip selects learned features.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro
from segmentation.parts_evaluation import (
    PartsEvaluationConfig,
    PartsMethod,
    evaluate_parts,
    parts_record,
    parts_tables,
    read_names,
)
from segmentation.parts_figure import draw_parts

from corporeal.core import store
from corporeal.core.terminal import progress_bars, show_table
from corporeal.description.describe_config import DescribeConfig
from corporeal.reconstruction.segment.part_clusters import PartsConfig


@dataclass(frozen=True)
class Options:
    """What is compared, and where the results go."""

    folder: Annotated[Path | None, tyro.conf.Positional] = None
    """Models, one object each."""
    names: Path | None = None
    """TOML with descriptions of parts: per file, the file's name of a part = another name."""
    json: Path | None = None
    """Output file for rows and errors (JSON)."""
    figure: Path | None = None
    """Output file for a picture of the parts (PNG)."""
    look: PartsEvaluationConfig = field(default_factory=PartsEvaluationConfig)
    clusters: PartsConfig = field(default_factory=PartsConfig)
    describe: DescribeConfig = field(default_factory=DescribeConfig)


def main(words: list[str] | None = None) -> None:
    """Segment every model, print the scores, and write what was asked for."""
    asked = tyro.cli(tyro.conf.OmitArgPrefixes[Options], description=__doc__, args=words)
    names = {} if asked.names is None else read_names(asked.names)
    with progress_bars() as tell:
        how = PartsMethod(asked.look, asked.clusters, asked.describe)
        found = evaluate_parts(asked.folder, names, how, tell("evaluate"))
    rows = [judged.row for judged in found]
    for table in parts_tables(rows):
        show_table(table.heads, table.rows, table.title)
    if asked.json is not None:
        store.write_json(asked.json, parts_record(rows))
    if asked.figure is not None:
        draw_parts(found, asked.figure)


if __name__ == "__main__":
    main()
