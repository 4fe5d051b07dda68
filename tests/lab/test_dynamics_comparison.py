"""Two runs of one scene are compared by paths, contacts, shapes; methods by who comes first."""

import json
from dataclasses import replace

import numpy as np
import pytest
from dynamics_docs import write_dynamics_docs
from hypothesis import given
from hypothesis import strategies as st
from sample_dynamics import body, expecting, pair, run
from scipy.stats import kendalltau

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.lab.evaluation.dynamics import dynamics_page, dynamics_tables
from corporeal.lab.evaluation.dynamics.compared_methods import OUR_METHOD, method_settings, parse_method
from corporeal.lab.evaluation.dynamics.dynamics_evaluation import scenes_of, select_scenes
from corporeal.lab.evaluation.dynamics.dynamics_jobs import EvaluatedScene, MethodComparison, dynamics_jobs
from corporeal.lab.evaluation.dynamics.dynamics_summary import dynamics_record, summarise_dynamics
from corporeal.lab.evaluation.dynamics.method_ranking import MethodResult, rank_correlation, rank_scene
from corporeal.lab.evaluation.dynamics.run_difference import compare_runs
from corporeal.lab.evaluation.dynamics.run_measures import read_run_measures, write_run_measures
from corporeal.pipeline.run_pipeline import Settings
from sample_findings import object_outcome

# ---------------------------------------------------------------- differences


def test_a_run_does_not_differ_from_itself():
    bounced = object_outcome(rebound_ratio=0.5, shape_error_max=0.1)
    one = run(objects={"ball_0": bounced}, pairs={"ball_0|floor": pair(0.4)})
    same = compare_runs(one, one)
    assert (same.path, same.contacts, same.delay, same.at_rest) == (0, 1, 0, 1)
    assert (same.shape, same.rebound, same.parted, same.dent) == (0, 0, None, None)


def test_contents_that_one_run_alone_has_are_left_out():
    """With one material for all, the water in a glass is no object of its own."""
    glass, both = [body("glass")], [body("glass"), body("glass_water", velocity=(1.0, 0.0, 0.0))]
    bare, filled = run(glass), run(both, pairs={"glass|glass_water": pair(0.2)})
    found = compare_runs(bare, filled)
    assert (found.path, found.contacts, found.parted) == (0, 0, None)
    assert compare_runs(filled, bare).path == 0
    with pytest.raises(ValueError, match="two scenes"):
        compare_runs(run([body("duck")]), bare)


def test_the_distance_of_paths_is_in_diagonals_of_the_object():
    """Apart by t [m] from 0 to 1 s: the root mean square is 1/√3 m, over a diagonal of 2 m."""
    still, moving = run([body(diagonal=2.0)]), run([body(diagonal=2.0, velocity=(1.0, 0.0, 0.0))])
    assert compare_runs(moving, still).path == pytest.approx(0.5 / np.sqrt(3), rel=0.02)


def test_paths_count_until_shortly_after_the_first_new_contact():
    """Who rests on the floor from the start touches it anew when something strikes it, not then."""
    away = body(velocity=(1.0, 0.0, 0.0))
    lying = {"ball_0|floor": pair(0.0, start=None)}
    whole = compare_runs(run([away], pairs=lying), run(pairs=lying)).path
    struck = lying | {"ball_0|duck_0": pair(0.1)}
    until = compare_runs(run([away], pairs=struck), run(pairs=struck)).path
    assert whole == pytest.approx(1 / np.sqrt(3), rel=0.02)
    assert until == pytest.approx(0.3 / np.sqrt(3), rel=0.05)


def test_runs_of_other_frame_rates_are_compared_at_the_same_instants():
    fast = run([body(velocity=(1.0, 0.0, 0.0))])
    (only,) = fast.bodies
    slow = replace(fast, time=fast.time[::4], bodies=(replace(only, path=only.path[::4]),))
    assert compare_runs(slow, fast).path == pytest.approx(0, abs=1e-9)


def test_contacts_are_compared_as_sets_and_by_time():
    mine = run(pairs={"a|b": pair(0.5, True), "a|floor": pair(0.7), "b|floor": pair()})
    other = run(pairs={"a|b": pair(0.4, False), "a|floor": pair(), "b|floor": pair(0.2)})
    found = compare_runs(mine, other)
    assert found.contacts == pytest.approx(1 / 3)
    assert found.delay == pytest.approx(0.1)
    assert found.parted == 0


def test_a_dent_elsewhere_and_another_shape_are_seen():
    here = object_outcome(dent_place=(0, 0, 0), dent_depth_dx=3.0, length_m=0.2, shape_error_max=0.1)
    there = replace(here, dent_place=(0.1, 0, 0), shape_error_max=0.01)
    found = compare_runs(run(objects={"ball_0": there}), run(objects={"ball_0": here}))
    assert found.dent == pytest.approx(0.5) and found.shape == pytest.approx(1.0)
    shallow = replace(here, dent_depth_dx=0.5)
    assert compare_runs(run(objects={"ball_0": there}), run(objects={"ball_0": shallow})).dent is None


# ---------------------------------------------------------------- ranks


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=2, max_size=12))
def test_within_one_group_the_correlation_is_kendalls(rows):
    x, y = zip(*rows, strict=True)
    wanted = kendalltau(x, y).statistic
    tau = rank_correlation([[(float(a), float(b)) for a, b in rows]]).tau
    assert (tau is None and np.isnan(wanted)) or tau == pytest.approx(wanted)


def test_pairs_of_two_groups_are_not_compared():
    rising = [[(1.0, 10.0), (2.0, 20.0)], [(3.0, 1.0), (4.0, 2.0)]]
    assert rank_correlation(rising).tau == 1
    assert rank_correlation([rising[0] + rising[1]]).tau < 1


# ---------------------------------------------------------------- who comes first


def rows_of(**numbers):
    wanted = run()
    made = {}
    for name, one in numbers.items():
        made[name] = MethodResult("scene", name, one, compare_runs(one, wanted))
    return made


def test_who_meets_more_and_moves_alike_comes_first():
    good = expecting(run(), True, True)
    bad = expecting(run([body(velocity=(1.0, 0.0, 0.0))]), True, False)
    assert rank_scene("scene", rows_of(ours=good, single=bad)).first
    behind = rank_scene("scene", rows_of(ours=bad, single=good))
    assert not behind.first
    assert any("single 2 of 2, ours 1" in s for s in behind.lost)


def test_a_path_nearer_to_the_reference_than_ours_is_no_better():
    """Ours at this detail is the yardstick of what the comparison can tell."""
    away = run([body(velocity=(0.5, 0.0, 0.0))])
    found = rank_scene("scene", rows_of(ours=away, single=run()))
    assert found.first and not found.lost


def test_a_single_method_has_no_rank():
    assert rank_scene("scene", rows_of(ours=run())) is None


# ---------------------------------------------------------------- methods


def test_a_baseline_changes_one_setting_of_ours():
    base = Settings()
    single = method_settings(parse_method("single"), base, "s")
    assert single == replace(base, simulate=replace(base.simulate, contact="single"))
    capped = method_settings(parse_method("capped"), base, "s")
    assert capped == replace(base, fill=replace(base.fill, stiffness="capped"))
    one = method_settings(parse_method("one:E=1e5"), base, "s")
    assert one == replace(base, ground=replace(base.ground, field="one:E=1e5"))
    omni = method_settings(parse_method("omniphysgs"), base, "s")
    assert (omni.ground.field, omni.simulate.contact) == ("omniphysgs", "single")
    assert method_settings(OUR_METHOD, base, "s") == base


def test_a_folder_of_fields_may_hold_a_file_or_a_folder_per_scene(tmp_path):
    (tmp_path / "a.npz").touch()
    (tmp_path / "b").mkdir()
    method = parse_method(f"vomp:{tmp_path}")

    def field(scene):
        return method_settings(method, Settings(), scene).ground.field

    assert field("a") == f"vomp:{tmp_path / 'a.npz'}"
    assert field("b") == f"vomp:{tmp_path / 'b'}"
    assert field("c") == f"vomp:{tmp_path}"


@pytest.mark.parametrize("spec", ["double", "single:x", "vomp:nowhere", "vomp:", "one:E=0"])
def test_an_unknown_baseline_is_refused(spec):
    with pytest.raises(UserError):
        parse_method(spec)


# ---------------------------------------------------------------- summing up


@pytest.fixture
def evaluated(tmp_path):
    """An evaluation of two scenes whose runs were made by hand: of one all, of the other ours."""
    path = tmp_path / "scene.glb"
    path.write_bytes(b"scene")
    scenes = [EvaluatedScene("falls", path), EvaluatedScene("rolls", path)]
    comparison = MethodComparison(tmp_path / "out", (OUR_METHOD, parse_method("single")), "normal", Settings())
    pairs = {"ball_0|floor": pair(0.4), "duck_0|floor": pair(0.3)}
    bodies = [body(), body("duck_0", young_pa=1e9)]
    soft = {"ball_0": object_outcome(shape_error_max=0.1)}
    good = expecting(run(bodies, soft, pairs), True, True)
    bad = expecting(run([body(velocity=(1.0, 0, 0)), bodies[1]], soft, pairs, faults=("Overlap.",)), True, False)
    made = {"falls.ours": good, "falls.single": bad, "falls.reference-normal": good}
    made["rolls.ours"] = good
    for job in dynamics_jobs(scenes, comparison):
        if job.name in made:
            finish(job, made[job.name])
    return scenes, comparison


def finish(job, numbers):
    store.begin_result(job.folder)
    write_run_measures(job.folder, numbers)
    store.finish_result(job.folder, job.key, {}, 1.0)


def test_numbers_of_a_run_are_read_back_as_they_were(tmp_path):
    numbers = expecting(run(pairs={"ball_0|floor": pair(0.4)}), True)
    write_run_measures(tmp_path, numbers)
    assert read_run_measures(tmp_path) == numbers
    (tmp_path / "dynamics.json").write_text("{}")
    with pytest.raises(UserError, match="run again"):
        read_run_measures(tmp_path)


def test_all_runs_are_rows_and_groups_and_ranks(evaluated):
    found = summarise_dynamics(*evaluated, {"rolls.single": "failed: no room."})
    assert found.row("falls", "ours").against.path == 0
    assert found.row("falls", "single").against.path > 0
    assert found.row("rolls", "single").error == "failed: no room."
    assert found.row("rolls", "ours").against is None
    assert [s.first for s in found.standings] == [True]
    everything = {m.method: m for m in found.means["all"]}
    assert everything["ours"].met == 1 and everything["single"].met == 0.5
    assert everything["ours"].clean == 1 and everything["single"].clean == 0
    assert {m.group for m in found.means["law"]} == {"neo hookean"}
    assert found.ranks[0].stiffness.tau == 1
    text = dynamics_tables.missing_references(found)
    assert text == ["rolls: no reference (not run yet)"]


def test_a_baseline_without_contents_of_their_own_has_ranks(evaluated):
    scenes, comparison = evaluated
    for job in dynamics_jobs(scenes, comparison):
        if job.name == "rolls.single":
            finish(job, run([body("duck_0")], pairs={"duck_0|floor": pair(0.3)}))
    found = summarise_dynamics(scenes, comparison, {})
    assert found.row("rolls", "single").numbers is not None
    assert [r.method for r in found.ranks] == ["ours", "single"]


def test_a_reference_that_gained_energy_is_refused(evaluated):
    scenes, comparison = evaluated
    reference = next(j for j in dynamics_jobs(scenes, comparison) if j.name == "falls.reference-normal")
    finish(reference, replace(run(), faults=("Energy grew.",), growth=1.0))
    found = summarise_dynamics(scenes, comparison, {})
    assert found.references[0].numbers is None
    assert "its audit is not clean: Energy grew." in found.references[0].error
    assert found.row("falls", "ours").against is None


def test_a_baseline_that_gained_energy_is_a_failed_row(evaluated):
    scenes, comparison = evaluated
    single = next(j for j in dynamics_jobs(scenes, comparison) if j.name == "falls.single")
    finish(single, replace(read_run_measures(single.folder), growth=0.5))
    row = summarise_dynamics(scenes, comparison, {}).row("falls", "single")
    assert row.against is None and row.error == "failed: energy grew by 50.0%"


def test_what_was_run_with_other_settings_does_not_count(evaluated):
    scenes, comparison = evaluated
    finer = replace(comparison.settings, fill=replace(comparison.settings.fill, detail="fine"))
    found = summarise_dynamics(scenes, replace(comparison, settings=finer), {})
    assert found.row("falls", "ours").error == "not run yet"


def test_runs_of_an_earlier_state_of_the_code_are_counted(evaluated):
    scenes, comparison = evaluated
    said = dynamics_page.summary_sentence(summarise_dynamics(scenes, comparison, {}))
    assert "4 of 4 runs, references included, were made by an earlier state of the code" in said
    for job in dynamics_jobs(scenes, comparison):
        if job.done:
            finish(job, replace(read_run_measures(job.folder), source=store.source_digest()))
    assert "earlier state" not in dynamics_page.summary_sentence(summarise_dynamics(scenes, comparison, {}))


def test_json_page_figure_and_docs_tell_the_same_twice(evaluated, tmp_path):
    found, again = summarise_dynamics(*evaluated, {}), summarise_dynamics(*evaluated, {})
    assert json.dumps(dynamics_record(found)) == json.dumps(dynamics_record(again))
    assert '"path": [[' not in json.dumps(dynamics_record(found))
    dynamics_page.write_dynamics_page(found, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "falls: ours first, beside single." in page and "rolls: no reference" in page and "$" not in page
    dynamics_page.draw_dynamics(found, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    write_dynamics_docs(found, "corporeal evaluate dynamics", tmp_path / "page.md")
    docs = (tmp_path / "page.md").read_text()
    assert "| falls | single | 1 of 2 |" in docs
    assert "| rolls | single" not in docs


def test_scenes_are_those_of_the_showcase_or_of_a_corpus(tmp_path):
    with pytest.raises(UserError, match="not a corpus"):
        scenes_of(str(tmp_path), tmp_path / "out")
    scenes = [EvaluatedScene("a", tmp_path), EvaluatedScene("b", tmp_path)]
    assert [s.name for s in select_scenes(scenes, ("b",))] == ["b"]
    with pytest.raises(UserError, match="scene"):
        select_scenes(scenes, ("c",))
