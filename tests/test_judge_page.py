"""The page of judged videos, and where the videos come from."""

from dataclasses import replace
from functools import partial

import judge
import numpy as np
import pytest
from video_judge.detectability import VideoVerdict
from video_judge.judge_page import PICTURES_PER_VIDEO, blind_spots_sentence, write_judge_page
from video_judge.judge_pictures import SequentialPictures
from video_judge.judge_query import JudgeVerdicts, distinct_questions
from video_judge.judge_runs import judged_scenes_in
from video_judge.judge_scenes import FailedVideo, JudgedVideos
from video_judge.judge_tables import weigh_judge
from video_judge.subquestions import question_catalogue
from video_judge.video_question import JudgingCost, VideoQuestion

from corporeal.core.errors import UserError
from corporeal.lab.evaluation.dynamics.compared_methods import reference_folder, run_folder
from corporeal.pipeline.run_pipeline import RUN_FILE
from corporeal.vlm import OnDemandPictures, Question


def asked(condition, motion):
    pictures = [np.full((30, 40, 3), 200, np.uint8)] * 16
    return VideoQuestion("balls", condition, 0, Question("dynamics", "?", motion, pictures=pictures))


def said(condition, words, alarm=0.0):
    return VideoVerdict("balls", condition, {q.id: alarm for q in question_catalogue().question}, 4.0, (words,))


@pytest.fixture
def judged():
    videos = JudgedVideos(
        [asked("ours", "film-1"), asked("single", "film-2")],
        [],
        [FailedVideo("duck", "ours", "energy grew by 12 %")],
        {},
        ["ours", "single"],
    )
    verdicts = [said("ours", "Both <script>alert(1)</script> bounce."), said("single", "It sticks.", 1.0)]
    return JudgeVerdicts(videos, verdicts, 0, "ask:x", JudgingCost(2, 10, None), ("by hand",))


def test_the_page_says_first_what_the_judge_cannot_tell_and_trusts_no_words(judged, tmp_path):
    path = tmp_path / "judge.html"
    write_judge_page(judged, weigh_judge(judged), path)
    text = path.read_text()
    assert text.index("cannot tell") < text.index("Both")
    assert "<script>" not in text and "&lt;script&gt;" in text
    assert "energy grew by 12 %" in text and "default-src 'none'" in text
    assert text.count("<figure>") == 2
    assert "hover, pace" in text


def test_the_page_renders_no_picture_that_it_does_not_show_and_none_twice(judged, tmp_path):
    taken = []

    def take(number):
        taken.append(number)
        return np.full((30, 40, 3), 200, np.uint8)

    pictures = SequentialPictures([partial(take, k) for k in range(16)])
    one = Question("dynamics", "?", "film-1", pictures=OnDemandPictures(lambda: pictures))
    both = [VideoQuestion("balls", c, 0, one) for c in ("ours", "single")]
    videos = replace(judged.videos, asked=both)
    judged = replace(judged, videos=videos)
    write_judge_page(judged, weigh_judge(judged), tmp_path / "judge.html")
    assert taken == sorted(set(taken)) and len(taken) == PICTURES_PER_VIDEO < len(pictures)


def test_without_controls_there_is_no_result(judged):
    result = weigh_judge(judged)
    assert not any(result.believed.values())
    assert all(law in blind_spots_sentence(result) for law in result.believed)


def test_one_motion_is_asked_about_once():
    twice = [asked("single", "film-2"), asked("control:single", "film-2"), asked("ours", "film-1")]
    assert [a.question.scene for a in distinct_questions(twice)] == ["film-1", "film-2"]


def test_runs_are_found_by_scene_and_method(tmp_path):
    for folder in (
        run_folder(tmp_path, "balls", "ours"),
        run_folder(tmp_path, "balls", "capped"),
        run_folder(tmp_path, "balls", "control-wrong"),
        run_folder(tmp_path, "duck", "single"),
        reference_folder(tmp_path, "balls", "normal"),
    ):
        folder.mkdir(parents=True)
        (folder / RUN_FILE).touch()
    (scene,) = judged_scenes_in(tmp_path)
    assert (scene.name, set(scene.runs)) == ("balls", {"ours", "capped"})
    assert scene.yardstick == reference_folder(tmp_path, "balls", "normal")


def test_a_folder_without_runs_is_an_error(tmp_path):
    with pytest.raises(UserError, match="holds no runs to judge"):
        judged_scenes_in(tmp_path)
    with pytest.raises(UserError, match="evaluate dynamics"):
        judged_scenes_in(tmp_path / "absent")


def test_a_folder_without_runs_is_told_where_they_come_from(tmp_path):
    with pytest.raises(UserError, match=r"holds no runs to judge.*evaluate dynamics"):
        judge.main([str(tmp_path), "--judge", "ask:answers"])
