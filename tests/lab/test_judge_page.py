"""The page of judged films, and where the films come from."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from corporeal.core.errors import UserError
from corporeal.lab.evaluation.dynamics.places import reference_folder, run_folder
from corporeal.lab.evaluation.judge.film_question import FilmAsked, Price
from corporeal.lab.evaluation.judge.judge_page import ROW, cannot_tell, write_page
from corporeal.lab.evaluation.judge.judge_pictures import TakenSingly
from corporeal.lab.evaluation.judge.judge_runs import scenes_in
from corporeal.lab.evaluation.judge.judge_scenes import Failed, Films
from corporeal.lab.evaluation.judge.judge_tables import weigh_judge
from corporeal.lab.evaluation.judge.put_to_judge import Judged, distinct
from corporeal.lab.evaluation.judge.subquestions import catalogue
from corporeal.lab.evaluation.judge.telling import FilmVerdict
from corporeal.pipeline.runner import RUN
from corporeal.vlm import Album, Question


def asked(condition, motion):
    pictures = [np.full((30, 40, 3), 200, np.uint8)] * 16
    return FilmAsked("balls", condition, 0, Question("dynamics", "?", motion, pictures=pictures))


def said(condition, words, alarm=0.0):
    return FilmVerdict(
        "balls", condition, {q.id: alarm for q in catalogue().question}, 4.0, (words,)
    )


@pytest.fixture
def judged():
    films = Films(
        [asked("ours", "film-1"), asked("single", "film-2")],
        [],
        [Failed("duck", "ours", "energy grew by 12 %")],
        {},
        ["ours", "single"],
    )
    verdicts = [
        said("ours", "Both <script>alert(1)</script> bounce."),
        said("single", "It sticks.", 1.0),
    ]
    return Judged(films, verdicts, 0, "ask:x", Price(2, 10, None), ("by hand",))


def test_the_page_says_first_what_the_judge_cannot_tell_and_trusts_no_words(judged, tmp_path):
    path = tmp_path / "judge.html"
    write_page(judged, weigh_judge(judged), path)
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

    pictures = TakenSingly([partial(take, k) for k in range(16)])
    one = Question("dynamics", "?", "film-1", pictures=Album(lambda: pictures))
    both = [FilmAsked("balls", c, 0, one) for c in ("ours", "single")]
    films = replace(judged.films, asked=both)
    judged = replace(judged, films=films)
    write_page(judged, weigh_judge(judged), tmp_path / "judge.html")
    assert taken == sorted(set(taken)) and len(taken) == ROW < len(pictures)


def test_without_controls_nothing_can_be_told(judged):
    result = weigh_judge(judged)
    assert not any(result.believed.values())
    assert all(law in cannot_tell(result) for law in result.believed)


def test_one_motion_is_asked_about_once():
    twice = [asked("single", "film-2"), asked("control:single", "film-2"), asked("ours", "film-1")]
    assert [a.question.scene for a in distinct(twice)] == ["film-1", "film-2"]


def test_runs_are_found_by_scene_and_method(tmp_path):
    for folder in (
        run_folder(tmp_path, "balls", "ours"),
        run_folder(tmp_path, "balls", "capped"),
        run_folder(tmp_path, "balls", "control-wrong"),
        run_folder(tmp_path, "duck", "single"),
        reference_folder(tmp_path, "balls", "normal"),
    ):
        folder.mkdir(parents=True)
        (folder / RUN).touch()
    (scene,) = scenes_in(tmp_path)
    assert (scene.name, set(scene.runs)) == ("balls", {"ours", "capped"})
    assert scene.yardstick == reference_folder(tmp_path, "balls", "normal")


def test_a_folder_without_runs_is_an_error(tmp_path):
    with pytest.raises(UserError, match="holds no runs to judge"):
        scenes_in(tmp_path)
    with pytest.raises(UserError, match="evaluate dynamics"):
        scenes_in(tmp_path / "absent")
