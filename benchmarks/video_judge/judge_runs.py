"""Judgement of the runs in the folder of an evaluation: OUT/SCENE/METHOD."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress
from corporeal.lab.evaluation.dynamics.compared_methods import BASELINE_NAMES, OURS_NAME, reference_folder, run_folder
from corporeal.pipeline.run_pipeline import RUN_FILE
from video_judge.judge_query import JudgeVerdicts, check_judging, query_judge
from video_judge.judge_scenes import JudgeConfig, SceneRuns, gather_videos
from video_judge.judge_tables import JudgeResult, weigh_judge


@dataclass(frozen=True)
class JudgedRuns:
    """Answers of a judge, and what follows."""

    judged: JudgeVerdicts
    result: JudgeResult


def judge_runs(out: Path, config: JudgeConfig, say: Callable[[str], None], progress: Progress) -> JudgedRuns:
    """Judge all scenes of an evaluation; controls that are absent are simulated.

    Args:
        out: Holds ``SCENE/METHOD``, each a run.
        config: Settings of the judge.
        say: Called with the price before the first question.
        progress: Called with the fraction done and a description.

    Raises:
        UserError: There are no such runs, there is no judge, or it costs more than allowed.

    """
    check_judging(config)
    scenes = judged_scenes_in(out)
    videos = gather_videos(scenes, out, config, progress)
    judged = query_judge(videos, config, say, progress)
    return JudgedRuns(judged, weigh_judge(judged))


def judged_scenes_in(out: Path) -> list[SceneRuns]:
    """Find the scenes of an evaluation that have our own run.

    Raises:
        UserError: There are none.

    """
    folders = sorted(p for p in out.iterdir() if p.is_dir()) if out.is_dir() else []
    scenes = [_scene(out, p.name) for p in folders if (run_folder(out, p.name, OURS_NAME) / RUN_FILE).exists()]
    if not scenes:
        raise UserError(
            f"{out} holds no runs to judge: it has no SCENE/{OURS_NAME}. Make them with: corporeal evaluate dynamics."
        )
    return scenes


def _scene(out: Path, name: str) -> SceneRuns:
    runs = {m: run_folder(out, name, m) for m in (OURS_NAME, *BASELINE_NAMES)}
    finer = [reference_folder(out, name, detail) for detail in ("fine", "normal")]
    return SceneRuns(
        name,
        {m: folder for m, folder in runs.items() if (folder / RUN_FILE).exists()},
        next((folder for folder in finer if (folder / RUN_FILE).exists()), None),
    )
