"""Videos of runs, judged by a vision-language model that is validated on control videos.

    python benchmarks/judge.py OUT --judge openai:MODEL [--looks 3] [--record DIR] [--json FILE] [--page FILE]

OUT holds runs SCENE/METHOD, written by ``corporeal evaluate dynamics``. Controls are the run "ours" with one known
fault each. For a law of physics the judge counts only if its answers detect the controls of that law; else the tables
say that this judge cannot tell. See docs/how-to/judge-videos-with-a-model.md.
"""

import argparse
import sys
from pathlib import Path

from video_judge.judge_page import write_judge_page
from video_judge.judge_runs import judge_runs
from video_judge.judge_scenes import DEFAULT_CONTROL_SCENES, JudgeConfig
from video_judge.judge_tables import judge_record, judge_tables

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.terminal import console, progress_bars, show_table


def main(words: list[str] | None = None) -> None:
    """Judge the runs in a folder, print the result, and write it to the files asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, metavar="OUT", help="runs, as evaluate dynamics leaves them")
    parser.add_argument("--judge", required=True, help="model that judges the videos: as --vlm of corporeal")
    parser.add_argument("--looks", type=int, default=1, help="looks at each video, each from another side: 1 to 3")
    parser.add_argument("--control-scenes", type=int, default=DEFAULT_CONTROL_SCENES, help="scenes with controls")
    parser.add_argument("--record", type=Path, help="folder where answers are recorded, for replay:FOLDER")
    parser.add_argument("--yes", action="store_true", help="allow more than 5 US$, or a price that is not known")
    parser.add_argument("--json", type=Path, help="output file for answers, intervals and marks")
    parser.add_argument("--page", type=Path, help="output file for a page with every video (HTML)")
    asked = parser.parse_args(words)
    config = JudgeConfig(asked.judge, asked.record, asked.looks, asked.control_scenes, asked.yes)
    with progress_bars() as tell:
        found = judge_runs(asked.out, config, console.print, tell("judge"))
        for table in judge_tables(found.judged, found.result):
            if table.rows:
                show_table(table.heads, table.rows, table.title)
        if asked.json is not None:
            store.write_json(asked.json, judge_record(found.judged, found.result))
        if asked.page is not None:
            write_judge_page(found.judged, found.result, asked.page, tell("page"))


if __name__ == "__main__":
    try:
        main()
    except UserError as error:
        sys.exit(str(error))
