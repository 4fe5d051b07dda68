"""The report counts what happened, hides no failure, and needs no other file to be read."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from corpus_page import write_corpus_page
from PIL import Image
from test_plan import pool

from corporeal.core import store
from corporeal.core.audit_data import Expectation
from corporeal.core.errors import UserError
from corporeal.jobs.job import ManifestRow
from corporeal.lab.corpus.collect_results import RIGID_BODY_LAW, collect_results, scene_measures
from corporeal.lab.corpus.corpus_breakdown import asset_credits, breakdowns, total_line
from corporeal.lab.corpus.corpus_plan import CorpusConfig, plan_corpus, write_plan
from corporeal.lab.corpus.corpus_report import report_corpus
from corporeal.scene.collision_chain import impact_hops
from corporeal.scene.rest_certificate import RestCertificate
from corporeal.scene.scene_composition import ComposedObject, SceneComposition, write_certificate, write_composition
from corporeal.simulation.audit_file import write_audit
from sample_findings import object_outcome, outcome, pair_outcome, part_audit, run_audit

SETTINGS = {
    "ground": {"library": "default"},
    "fill": {"detail": "draft"},
    "simulate": {"engine": "cpu", "contact": "multi"},
    "describe": {"vlm": "metadata"},
}


PARTS = (
    part_audit(object="a_0", material="steel", law="von_mises", treatment="rigid", mass_kg=5.0),
    part_audit(object="b_0", material="rubber", law="neo_hookean"),
)
HAPPENED = outcome(
    {"a_0": object_outcome(dent_depth_dx=0.1), "b_0": object_outcome(dent_depth_dx=0.1, at_rest=False)},
    {
        "a_0|b_0": pair_outcome(first_contact_s=0.5, separated=True),
        "a_0|floor": pair_outcome(first_contact_s=0.0),
        "b_0|floor": pair_outcome(first_contact_s=0.8),
    },
    [("a_0", "b_0")],
)


def audit(**what):
    """Two things of which one is thrown into the other, and both end on the floor."""
    return run_audit(**{"parts": PARTS, "outcome": HAPPENED} | what)


def composed(scene):
    """What a planned scene consists of, had it been composed."""
    objects = tuple(
        ComposedObject(a, c, a, "somewhere", "", "CC-BY-4.0", f"<b>{a}'s maker</b>", 0.1, "", "", 1)
        for a, c in zip(scene.assets, scene.classes, strict=True)
    )
    return SceneComposition(scene.seed, scene.arrangement, "mujoco", scene.interaction, "it <falls>", objects)


def a_corpus(folder, audits, failed=()):
    """Write a corpus with so many runs; return its plan."""
    made = plan_corpus(pool(4), CorpusConfig(scenes=len(audits) + len(failed), seed=2))
    write_plan(folder, made)
    rows = {"assemble": {}, "run": {}}
    for scene, found in zip(made.scenes, [*audits, *failed], strict=True):
        place = folder / "scenes" / scene.name
        write_certificate(place, RestCertificate(1e-5, 1e-4, 0.5, 1, 1, 2.0, scene.count))
        write_composition(place, composed(scene))
        store.finish_result(place, "k", {}, 2.0)
        rows["assemble"][scene.name] = ManifestRow("finished", 2.0, "", 1, "k")
        if isinstance(found, str):
            rows["run"][scene.name] = ManifestRow("failed", None, found, 2, "k")
            continue
        run = folder / "runs" / scene.name
        write_audit(run, found)
        store.write_json(run / "run.json", {"inputs": [], "settings": SETTINGS})
        Image.new("RGB", (600, 80), (200, 60, 60)).save(run / "strip.png")
        store.finish_result(run, "k", {}, 61.0)
        rows["run"][scene.name] = ManifestRow("finished", 61.0, "", 1, "k")
    store.write_json(folder / "manifest.json", rows)
    return made


def silent(*words):
    """Hear nothing."""


def test_numbers_of_a_scene_are_those_of_its_audit():
    found = scene_measures(audit(), "collision")
    assert found.clean and found.seen and found.breaches == ()
    assert (found.objects, found.at_rest) == (2, 1)
    assert found.impacts == 2, "the two met, and one came down; the other stood from the start"
    assert (found.met, found.separated) == (1, 1)
    assert (found.seconds, found.particles) == (60.0, 1000)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"max_penetration_dx": 1.2}, "penetrate"),
        ({"momentum_residual": 2e-3}, "Momentum"),
        ({"mechanical_growth": 0.02}, "elastic energy grew"),
        ({"nan_count": 1}, "not finite"),
    ],
)
def test_a_broken_bound_is_no_clean_audit(wrong, words):
    found = scene_measures(audit(**wrong), "fall")
    assert not found.clean and len(found.breaches) == 1 and words in found.breaches[0]


def test_what_an_interaction_promises_must_have_happened():
    stood = {"a_0|floor": pair_outcome(first_contact_s=0.0)}
    quiet = audit(outcome=replace(HAPPENED, order=(), pairs=stood))
    for kind in ("fall", "fall-onto", "collision", "chain", "wind"):
        assert not scene_measures(quiet, kind, ["a_0"]).seen, kind
    for kind, seen in (("fall", True), ("fall-onto", True), ("collision", True), ("chain", False)):
        assert scene_measures(audit(), kind, ["a_0"]).seen is seen, kind
    swayed = HAPPENED.objects | {"b_0": object_outcome(deepest_squeeze_m=2e-3)}
    assert scene_measures(audit(outcome=replace(HAPPENED, objects=swayed)), "wind").seen
    assert not scene_measures(audit(), "wind").seen


def test_a_chain_is_one_only_when_what_was_struck_strikes_a_third():
    assert impact_hops([("a", "b"), ("b", "c")], ["a"]) == {"a": 0, "b": 1, "c": 2}
    assert impact_hops([("b", "a"), ("c", "b"), ("d", "c")], ["a"])["d"] == 3
    assert impact_hops([("a", "b"), ("c", "a")], ["a"])["c"] == 1, "the first one struck both"
    assert "c" not in impact_hops([("b", "c"), ("a", "b")], ["a"]), "they met before they were reached"
    assert impact_hops([], ["a"]) == {"a": 0} and impact_hops([("a", "b")], []) == {}


def test_the_showcase_is_judged_by_its_own_expectations():
    wanted = tuple(Expectation("It falls", "", "", met) for met in (True, False))
    found = scene_measures(audit(expectations=wanted), "collision")
    assert not found.seen and (found.expected_met, found.expected) == (1, 2)


def test_groups_count_scenes_and_objects_and_give_median_and_worst(tmp_path):
    deep = [0.1, 0.2, 0.9, 1.5]
    a_corpus(tmp_path, [audit(max_penetration_dx=d) for d in deep])
    corpus = collect_results(tmp_path)
    whole, groups = total_line(corpus), breakdowns(corpus)
    assert whole is not None
    assert (whole.scenes, whole.objects, whole.clean, whole.at_rest) == (4, 8, 3, 4)
    assert whole.penetration_median == pytest.approx(0.55) and whole.penetration_worst == 1.5
    assert sum(line.scenes for line in groups["interaction"]) == 4
    assert sum(line.scenes for line in groups["objects"]) == 4
    law = {line.group: line for line in groups["law"]}
    assert set(law) == {RIGID_BODY_LAW, "Neo-Hookean"}, "no law acts in what is rigid"
    assert (law[RIGID_BODY_LAW].objects, law[RIGID_BODY_LAW].at_rest, law["Neo-Hookean"].at_rest) == (4, 4, 0)
    group = {line.group: line for line in groups["material class"]}
    assert {name: line.objects for name, line in group.items()} == {"metal": 4, "elastomer": 4}
    assert group["metal"].materials == ("steel",), "only of the parts that are metal"
    assert whole.materials[0] == "steel", "the heaviest first"
    peaks = [s.numbers.peak_memory_mb for s in corpus.run if s.numbers]
    assert group["metal"].memory_worst_mb == max(peaks)


def test_the_page_the_table_and_the_data_tell_of_every_scene(tmp_path):
    bad = audit(max_penetration_dx=1.7)
    made = a_corpus(tmp_path, [audit(), bad, audit()], failed=["the <grid> is too wide"])
    written = report_corpus(tmp_path, silent)
    assert [p.name for p in written] == ["report.html", "report.csv", "report.json"]
    page = written[0].read_text()
    assert all(s.name in page for s in made.scenes)
    assert "the &lt;grid&gt; is too wide" in page and "<grid>" not in page
    assert "it &lt;falls&gt;" in page and "&#x27;s maker&lt;/b&gt;" in page
    assert "by up to 1.7 grid cells" in page
    assert "4 assembled, 3 run, 1 failed." in page
    assert len(re.findall(r'src="data:image/jpeg', page)) == 3
    assert len(re.findall(r'src="data:image/svg', page)) == 4
    assert not re.findall(r'(?:src|href)="(?!data:)', page), "it must hold all that it shows"
    assert not re.findall(r"\$\w", page), "something was left out of the template"
    table = list(csv.DictReader(written[1].open()))
    assert [row["scene"] for row in table] == [s.name for s in made.scenes]
    assert [row["run"] for row in table] == ["finished"] * 3 + ["failed"]
    assert [row["clean"] for row in table] == ["True", "False", "True", ""]
    data = json.loads(written[2].read_text())
    assert data["total"]["scenes"] == 3 and data["total"]["clean"] == 2
    assert data["scenes"][3]["error"] == "run: the <grid> is too wide"


def test_the_page_for_the_documentation_names_what_went_wrong_and_what_was_not_run(tmp_path):
    made = a_corpus(tmp_path, [audit(), audit(max_penetration_dx=1.7), audit()], failed=["the grid is too wide"])
    (tmp_path / "runs" / made.scenes[2].name / store.META_FILE).unlink()
    page = tmp_path / "page.md"
    write_corpus_page(collect_results(tmp_path), page)
    text = page.read_text()
    assert "4 scenes, 4 assembled, 2 run at detail draft. 1 of 2 have a clean audit" in text
    wrong = text.split("## Failures")[1].split("##")[0]
    assert f"{made.scenes[1].name}: Objects penetrate" in wrong
    assert f"{made.scenes[3].name}: failed: run: the grid is too wide" in wrong
    assert f"Not run yet: {made.scenes[2].name}." in wrong
    tables = [line for line in text.splitlines() if line.startswith("|")]
    assert all(len(row.split("|")) in (12 + 1, 9 + 2) for row in tables)


def test_the_page_for_the_documentation_names_who_touched_before_anything_happened(tmp_path):
    together = HAPPENED.pairs | {"a_0|b_0": pair_outcome(first_contact_s=0.0)}
    expected = (Expectation("It falls", "", "", False),)
    quiet = audit(outcome=replace(HAPPENED, order=(), pairs=together), expectations=expected)
    a_corpus(tmp_path, [quiet])
    write_corpus_page(collect_results(tmp_path), tmp_path / "page.md")
    text = (tmp_path / "page.md").read_text()
    assert "what was planned did not happen: a_0 and b_0 touched from the start." in text


def test_the_page_for_the_documentation_says_where_nothing_was_run(tmp_path):
    write_plan(tmp_path, plan_corpus(pool(4), CorpusConfig(scenes=3)))
    write_corpus_page(collect_results(tmp_path), tmp_path / "page.md")
    text = (tmp_path / "page.md").read_text()
    assert "3 scenes, 0 assembled, 0 run." in text and "Every scene" not in text


def test_every_model_that_was_used_is_credited_once(tmp_path):
    made = a_corpus(tmp_path, [audit()] * 6)
    found = asset_credits(collect_results(tmp_path).scenes)
    used = [a for s in made.scenes for a in s.assets]
    assert [c.asset.asset for c in found] == sorted(set(used))
    assert sum(c.scenes for c in found) == len(used)


def test_a_report_of_what_was_not_run_yet_says_so_and_the_same_data_gives_the_same_page(tmp_path):
    write_plan(tmp_path, plan_corpus(pool(4), CorpusConfig(scenes=3)))
    report_corpus(tmp_path, silent)
    page = (tmp_path / "report.html").read_text()
    assert "Nothing was run yet" in page and "not begun" in page
    report_corpus(tmp_path, silent)
    assert (tmp_path / "report.html").read_text() == page


def test_a_run_that_was_begun_again_is_not_taken_for_finished(tmp_path):
    made = a_corpus(tmp_path, [audit(), audit()])
    (tmp_path / "runs" / made.scenes[0].name / store.META_FILE).unlink()
    assert [s.numbers is None for s in collect_results(tmp_path).scenes] == [True, False]
    (tmp_path / "runs" / made.scenes[1].name / "audit.json").unlink()
    assert collect_results(tmp_path).run == []


def test_a_library_that_is_gone_is_missed_and_one_that_is_small_leaves_the_rest_to_ours(tmp_path):
    made = a_corpus(tmp_path, [audit()])
    own = tmp_path / "own.toml"
    settings = SETTINGS | {"ground": {"library": str(own)}}
    run = tmp_path / "runs" / made.scenes[0].name
    store.write_json(run / "run.json", {"inputs": [], "settings": settings})
    with pytest.raises(UserError, match=rf"{made.scenes[0].name} was run with .*own\.toml.*Restore the library"):
        collect_results(tmp_path)
    own.write_text(
        '[steel]\ngroup = "mineral"\nlaw = "von_mises"\n'
        'young_GPa = { low = 200, typical = 207, high = 216, source = "elastic-tables" }\n'
        'poisson = { low = 0.28, typical = 0.29, high = 0.3, source = "elastic-tables" }\n'
        'density_kg_m3 = { low = 7800, typical = 7850, high = 7900, source = "elastic-tables" }\n'
        'yield_MPa = { low = 250, typical = 300, high = 400, source = "elastic-tables" }\n'
    )
    (scene,) = collect_results(tmp_path).scenes
    assert [p.group for p in scene.parts] == ["mineral", "elastomer"]


def test_what_is_no_corpus_is_reported_to_be_none(tmp_path):
    with pytest.raises(UserError, match="not a corpus"):
        report_corpus(Path(tmp_path), silent)
