"""Videos of a short run: what controls do, what is shown and asked, and who may not be judged."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from video_judge import judge_pictures, judge_scenes
from video_judge.camera_staging import LOOK_TURNS_DEG, PICTURE_SIZE_PX, close_up_shots, stage_scene
from video_judge.control_effect import (
    MIN_VISIBLE_PATH,
    MIN_VISIBLE_SHAPE,
    MotionDifference,
    compare_motions,
)
from video_judge.edited_controls import EDITED_CONTROLS, GAINED_DISTANCE_RATIO, edit_motion
from video_judge.judge_pictures import PICTURES_PER_LOOK
from video_judge.judge_query import check_judging, query_judge
from video_judge.judge_scenes import (
    CONTROL_NAMES,
    REFERENCE_METHOD,
    JudgeConfig,
    SceneRuns,
    audit_breach,
    gather_videos,
)
from video_judge.judge_tables import CANNOT_TELL_TEXT, judge_record, judge_tables, weigh_judge
from video_judge.prompt_context import scene_facts
from video_judge.simulated_controls import SIMULATED_CONTROLS, exchange_materials
from video_judge.subquestions import question_catalogue
from video_judge.video_motion import VideoMotion, motion_of_run
from video_judge.video_question import VideoQuestion, motion_digest, video_question

from corporeal.core.errors import UserError
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import Settings
from corporeal.pipeline.stages.assemble import AssembleConfig
from corporeal.vlm import Reply
from corporeal.vlm.human_client import PendingQuestionsError
from sample_findings import run_audit

SHORT = 0.3
"""Long enough for both balls to bounce [s]."""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Two balls of steel and rubber that fall on the floor."""
    folder = tmp_path_factory.mktemp("balls")
    scene = run_pipeline.write_showcase("steel-and-rubber", folder / "input")
    settings = Settings(assemble=AssembleConfig(duration=SHORT))
    run_pipeline.run([scene], folder / REFERENCE_METHOD, settings, until="simulate")
    return folder / REFERENCE_METHOD


@pytest.fixture(scope="module")
def played(run):
    return run_pipeline.read_run(run).played


@pytest.fixture(scope="module")
def staging(played):
    return stage_scene(played)


@pytest.fixture(scope="module")
def told(played):
    return scene_facts(played.prepared)


@pytest.fixture
def edited_only(monkeypatch):
    """Leave out controls that take a simulation."""
    monkeypatch.setattr(judge_scenes, "CONTROL_NAMES", EDITED_CONTROLS)


# ---------------------------------------------------------------- controls


@pytest.mark.slow
def test_frozen_stays_reversed_ends_as_it_began_and_slow_takes_four_times_as_long(played):
    ours = motion_of_run(played)
    end = float(played.trajectory.time[-1])
    start = ours.at(0.0).position
    assert np.array_equal(edit_motion("frozen", played).at(end).position, start)
    assert np.array_equal(edit_motion("reversed", played).at(end).position, start)
    assert np.array_equal(edit_motion("slow", played).at(end).position, ours.at(end / 4).position)


def test_the_ghost_goes_on_through_the_floor_that_it_met(played):
    video, end = edit_motion("ghost", played), float(played.trajectory.time[-1])
    assert min(video.at(end).position[m, 2].max() for m in video.members) < 0.0
    assert motion_of_run(played).at(end).position[:, 2].min() > -0.01


def test_who_gains_rises_two_and_a_half_times_as_far(played):
    video, ours = edit_motion("gain", played), motion_of_run(played)
    ledger, time = played.trajectory.ledger, played.trajectory.time
    met = np.nanmin(ledger.first_contact[-1])
    low = int(np.searchsorted(time, met)) - 1
    end = float(time[-1])
    now, before = (f.centres(np.array([end]))[0, :, 2] for f in (video, ours))
    (thing,) = np.flatnonzero(now != before)
    rise = before[thing] - ledger.centre[low, thing, 2]
    assert rise > 0.02
    assert now[thing] - ledger.centre[low, thing, 2] == pytest.approx(GAINED_DISTANCE_RATIO * rise, rel=0.05)
    earlier = met - 0.03
    assert np.array_equal(video.at(earlier).position, ours.at(earlier).position)


def test_where_nothing_rests_nothing_glides(played):
    assert edit_motion("glide", played) is None


def test_what_rests_glides_aside(played):
    ledger = played.trajectory.ledger
    still = np.broadcast_to(ledger.centre[:1], ledger.centre.shape)
    lies = replace(played, trajectory=replace(played.trajectory, ledger=replace(ledger, centre=still)))
    video, end = edit_motion("glide", lies), float(played.trajectory.time[-1])
    way = video.centres(np.array([end]))[0] - motion_of_run(played).centres(np.array([end]))[0]
    moved = np.linalg.norm(way, axis=1)
    assert sorted(moved > 0.02) == [False, True] and way[:, 2] == pytest.approx([0, 0], abs=1e-6)


def test_stiff_and_soft_are_exchanged_and_likes_are_left_alone(played):
    p = played.prepared
    said = exchange_materials(p.scene, p.parts, p.field)
    given = {name: next(iter(thing["parts"].values()))["material"] for name, thing in said.items()}
    assert given == {"steel_ball_0": "rubber", "rubber_ball_0": "steel"}
    alike = replace(p.field, materials=(p.field.materials[0],) * len(p.field.materials))
    assert exchange_materials(p.scene, p.parts, alike) == {}


# ---------------------------------------------------------------- effect


def test_a_control_that_is_the_reference_is_not_effective(played, staging):
    ours = motion_of_run(played)
    same = compare_motions(ours, VideoMotion(played.prepared, ours.at), staging.times)
    assert same == MotionDifference(0.0, 0.0)
    assert not same.exceeds(MotionDifference(0.0, 0.0).limit)
    assert compare_motions(ours, edit_motion("frozen", played), staging.times).path > MIN_VISIBLE_PATH


def test_what_differs_less_than_twice_a_finer_run_is_not_effective():
    yardstick = MotionDifference(path=0.1, shape=0.05)
    assert yardstick.limit == MotionDifference(0.2, 0.1)
    assert not MotionDifference(0.19, 0.09).exceeds(yardstick.limit)
    assert MotionDifference(0.21, 0.0).exceeds(yardstick.limit)
    assert MotionDifference(0.0, 0.11).exceeds(yardstick.limit)
    assert MotionDifference(0.0, 0.0).limit == MotionDifference(MIN_VISIBLE_PATH, MIN_VISIBLE_SHAPE)


def test_a_squashed_body_differs_in_shape_alone(played, staging):
    def flat(time):
        frame = played.trajectory.frames[0]
        x = frame.position.copy()
        for m in motion_of_run(played).members:
            middle = np.average(x[m, 2], weights=played.prepared.particles.mass[m])
            x[m, 2] = middle + 0.5 * (x[m, 2] - middle)
        return replace(frame, position=x)

    whole = edit_motion("frozen", played)
    far = compare_motions(whole, VideoMotion(played.prepared, flat), staging.times)
    assert far.path < 1e-3 and far.shape > MIN_VISIBLE_SHAPE


# ---------------------------------------------------------------- what is shown


def test_instants_are_in_order_from_start_to_end(played, staging):
    assert staging.times[0] == 0.0
    assert staging.times[-1] == pytest.approx(played.trajectory.time[-1])
    assert np.all(np.diff(staging.times) >= 0)


def test_close_ups_show_the_first_contacts_and_the_end(played, staging):
    met = float(np.nanmin(played.trajectory.ledger.first_contact[-1]))
    first, second, last = staging.closes
    assert 0 < first.time - met < 0.05 and second.time >= first.time
    assert {first.contact.objects, second.contact.objects} == {(0,), (1,)}
    assert last.time == staging.end


def test_a_close_up_of_what_touches_nothing_is_nearer_than_the_dated_pictures(staging):
    reel = staging.reel
    still = replace(reel, boxes=reel.boxes[:1, :1], time=reel.time[:1])
    by_itself = replace(staging, reel=still, closes=close_up_shots([], staging.end))
    for close in by_itself.closes:
        aims = (by_itself.near(close, 0), by_itself.wide(0))
        near, wide = (np.linalg.norm(np.subtract(aim.eye, aim.target)) for aim in aims)
        assert near < wide


def test_a_video_is_sixteen_pictures_and_looks_come_from_other_sides(played, staging, told):
    video = motion_of_run(played)
    one, other = (video_question(video, staging, told, look).pictures for look in (0, 1))
    assert len(one) == PICTURES_PER_LOOK == 16
    assert {p.shape for p in one} == {(PICTURE_SIZE_PX[1], PICTURE_SIZE_PX[0], 3)}
    assert all(not np.array_equal(a, b) for a, b in zip(one[:-1], other[:-1], strict=True))


def test_the_facts_say_how_it_starts_and_not_what_happens(told):
    assert "steel_ball_0" in told and "solid" in told and "9.81 m/s²" in told
    assert "20.3 cm above the floor" in told or "cm above the floor" in told
    assert not re.search(r"rebound|bounce|contact|E =", told)


# ---------------------------------------------------------------- what is asked


def test_each_look_has_its_own_order_of_questions_and_it_is_always_the_same(played, staging, told):
    video = motion_of_run(played)
    texts = [video_question(video, staging, told, look).text for look in range(len(LOOK_TURNS_DEG))]
    assert len(set(texts)) == len(LOOK_TURNS_DEG)
    assert texts[0] == video_question(video, staging, told, 0).text
    for q in question_catalogue().question:
        assert all(text.count(f"- {q.id}: ") == 1 for text in texts)


def test_motions_that_differ_are_named_differently(played, staging):
    videos = [motion_of_run(played), *(edit_motion(c, played) for c in EDITED_CONTROLS if c != "glide")]
    names = [motion_digest(video, staging) for video in videos]
    assert len(set(names)) == len(videos)

    def nudged(by):
        return VideoMotion(
            played.prepared, lambda time: replace(f := played.trajectory.frames[0], position=f.position + by)
        )

    assert motion_digest(nudged(0.0), staging) == motion_digest(edit_motion("frozen", played), staging)
    assert motion_digest(nudged(0.01), staging) != motion_digest(nudged(0.0), staging)


@pytest.fixture
def blank(monkeypatch):
    """Take grey pictures: a hundred real ones cost 20 s, and only words are looked at."""
    monkeypatch.setattr(
        judge_pictures, "render_image", lambda stage, aim, *how: np.full((aim.height, aim.width, 3), 128, np.uint8)
    )


@pytest.mark.slow
def test_no_condition_is_named_in_a_question_or_on_its_page(run, tmp_path, edited_only, blank):
    videos = gather_videos([SceneRuns("balls", {REFERENCE_METHOD: run, "single": run})], tmp_path, JudgeConfig())
    conditions = [a.condition for a in videos.asked]
    assert "single" in conditions and "control:frozen" in conditions
    config = JudgeConfig(judge=f"ask:{tmp_path / 'asked'}")
    with pytest.raises(PendingQuestionsError, match="questions wait"):
        query_judge(videos, config, lambda words: None)
    pages = list((tmp_path / "asked" / "questions").glob("*.md"))
    # The baseline is the same run, and one motion is asked about once.
    assert len(pages) == len(videos.asked) - 1
    # Pages differ in the order of their questions alone, and are named by motions.
    lines = {tuple(sorted(page.read_text().splitlines())) for page in pages}
    assert len(lines) == 1
    assert all(re.fullmatch(r"film-[0-9a-f]{12}-dynamics-[0-9a-f]{6}", page.stem) for page in pages)
    told = scene_facts(run_pipeline.read_run(run).played.prepared)
    assert not any(word in told for word in (*CONTROL_NAMES, "control", "baseline", "reference"))


class Planted:
    """Answers by what a video is named."""

    looks = False

    def __init__(self, answer_of):
        self.answer_of = answer_of

    def ask(self, asked, answer, check=None):
        alarms = self.answer_of.get(asked.scene, ())
        said = {
            q.id: q.violation if q.id in alarms else ("no" if q.violation == "yes" else "yes")
            for q in question_catalogue().question
        }
        made = {"happens": "Balls fall.", "answers": said, "whole": 1 if alarms else 5}
        return Reply(answer.model_validate(made), "model", "planted:1")


def judged_by(oracle, run, folder):
    """Three scenes, all the same run: enough to be believed."""
    scenes = [SceneRuns(name, {REFERENCE_METHOD: run}) for name in "abc"]
    videos = gather_videos(scenes, folder, JudgeConfig())
    faults = {c.id: c.questions for c in question_catalogue().control}
    named = {
        a.question.scene: faults[a.condition.removeprefix("control:")][:1]
        for a in videos.asked
        if a.condition != REFERENCE_METHOD
    }
    judge = Planted(named if oracle else {})
    judged = query_judge(videos, JudgeConfig(judge="replay:none"), lambda words: None, judge=judge)
    return judged, weigh_judge(judged)


@pytest.mark.slow
def test_an_oracle_is_believed_of_what_its_controls_show_and_of_nothing_else(run, tmp_path, edited_only):
    judged, result = judged_by(True, run, tmp_path)
    assert result.believed == {
        "gravity": ["pace"], "inertia": ["backwards", "start"], "impenetrability": ["through"],
        "contact": [], "energy": ["gain"], "material": [], "friction": [],
    }  # fmt: skip
    assert {m.mark for m in result.by_law_of_physics} == {1.0}
    shown = judge_tables(judged, result)
    assert [row[1] for row in shown[0].rows].count(CANNOT_TELL_TEXT) == 3
    assert ("glide", "", "0", "", "", "", "has no place in these scenes") in shown[1].rows
    again = judged_by(True, run, tmp_path)
    assert json.dumps(judge_record(judged, result)) == json.dumps(judge_record(*again))


def test_who_finds_no_fault_is_believed_of_no_law_and_gives_no_mark(run, tmp_path, edited_only):
    judged, result = judged_by(False, run, tmp_path)
    assert not any(result.believed.values()) and result.by_law_of_physics == ()
    assert {row[1] for row in judge_tables(judged, result)[0].rows} == {CANNOT_TELL_TEXT}


def test_a_recording_of_another_motion_is_not_found(run, played, staging, told, tmp_path, edited_only):
    videos = gather_videos([SceneRuns("balls", {REFERENCE_METHOD: run})], tmp_path, JudgeConfig())
    from corporeal.vlm.recordings import RecordingClient

    kept = tmp_path / "recorded"
    query_judge(videos, JudgeConfig(), lambda words: None, judge=RecordingClient(Planted({}), kept))
    config = JudgeConfig(judge=f"replay:{kept}")
    again = query_judge(videos, config, lambda words: None)
    assert len(again.verdicts) == len(videos.asked) and again.answered_by == ("planted:1",)
    end = float(played.trajectory.time[-1])
    other = VideoMotion(played.prepared, lambda time: motion_of_run(played).at(end - time / 2))
    videos.asked.append(VideoQuestion("balls", "other", 0, video_question(other, staging, told, 0)))
    with pytest.raises(UserError, match="No recording in"):
        query_judge(videos, config, lambda words: None)


# ---------------------------------------------------------------- what is refused


@pytest.mark.parametrize(
    ("what", "words"), [({"mechanical_growth": 46.8}, "energy grew by 4680.0%"), ({"nan_count": 3}, "lost particles")]
)
def test_what_is_not_physics_is_not_judged(what, words, run, tmp_path, monkeypatch):
    assert audit_breach(run_audit()) == ""
    assert words in audit_breach(run_audit(**what))
    monkeypatch.setattr(judge_scenes, "read_audit", lambda folder: run_audit(**what))
    videos = gather_videos([SceneRuns("balls", {REFERENCE_METHOD: run})], tmp_path, JudgeConfig())
    assert videos.asked == []
    assert [(f.condition, words in f.reason) for f in videos.failed] == [(REFERENCE_METHOD, True)]


def test_a_baseline_that_failed_is_a_row_and_the_others_are_judged(run, tmp_path):
    scene = SceneRuns("balls", {REFERENCE_METHOD: run, "capped": tmp_path / "nothing"})
    videos = gather_videos([scene], tmp_path, JudgeConfig(control_scenes=0))
    assert [a.condition for a in videos.asked] == [REFERENCE_METHOD]
    (failed,) = videos.failed
    assert failed.condition == "capped" and "is not a run" in failed.reason


@pytest.mark.parametrize("looks", [0, 4])
def test_looks_are_one_to_three(looks):
    with pytest.raises(UserError, match="--looks"):
        check_judging(JudgeConfig(looks=looks))


def test_no_videos_to_judge_is_an_error():
    videos = judge_scenes.JudgedVideos([], [], [], {}, [REFERENCE_METHOD])
    with pytest.raises(UserError, match="No judge"):
        query_judge(videos, JudgeConfig(), lambda words: None)


# ---------------------------------------------------------------- what it costs


def test_the_price_is_reported_before_anybody_is_asked_and_more_than_5_dollars_want_a_yes(played, staging, told):
    one = VideoQuestion("balls", REFERENCE_METHOD, 0, video_question(motion_of_run(played), staging, told, 0))
    said = []

    class Asked(Planted):
        def ask(self, asked, answer, check=None):
            assert said, "the price comes first"
            return super().ask(asked, answer, check)

    def ask(count, **config):
        said.clear()
        many = [replace(one, question=replace(one.question, scene=f"film-{k}")) for k in range(count)]
        videos = judge_scenes.JudgedVideos(many, [], [], {}, [REFERENCE_METHOD])
        return query_judge(videos, JudgeConfig(**config), said.append, judge=Asked({}))

    ask(3, judge="openai:gpt-5.4")
    assert "3 videos to judge" in said[0] and "US$ at list prices" in said[0]
    with pytest.raises(UserError, match="Add --yes"):
        ask(400, judge="openai:gpt-5.4")
    ask(400, judge="openai:gpt-5.4", yes=True)
    with pytest.raises(UserError, match="price of openai:new is not known"):
        ask(1, judge="openai:new")
    ask(400, judge="replay:folder")
    assert "400 videos to judge" in said[0] and said[0].endswith("replay costs nothing.")


# ---------------------------------------------------------------- simulated controls


@pytest.mark.slow
def test_every_simulated_control_runs_and_is_not_done_twice(run, tmp_path):
    scene = SceneRuns("balls", {REFERENCE_METHOD: run})
    videos = gather_videos([scene], tmp_path, JudgeConfig())
    assert videos.failed == []
    assert {e.control for e in videos.effects} == {*CONTROL_NAMES} - {"glide"}
    done = {c: (tmp_path / "balls" / f"control-{c}" / "8-simulate" / "meta.json") for c in SIMULATED_CONTROLS}
    times = {c: path.stat().st_mtime_ns for c, path in done.items()}
    gather_videos([scene], tmp_path, JudgeConfig())
    assert {c: path.stat().st_mtime_ns for c, path in done.items()} == times
