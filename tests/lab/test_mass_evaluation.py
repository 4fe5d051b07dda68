"""Predicted masses against measured ones, on things whose mass we made."""

import csv
import json
import math
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from corporeal.core.errors import BadFileError, UserError
from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.description.describe_config import DescribeConfig
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.lab.evaluation.mass_evaluation import (
    MassConfig,
    anonymise,
    compare_masses,
    hull_volume_mass,
    interval_coverage,
    mass_errors,
    mean_mass,
    predict_masses,
    solid_water_mass,
)
from corporeal.lab.evaluation.mass_report import mass_figure, mass_tables
from corporeal.lab.evaluation.measured_masses import models_in_folder, objects_to_weigh, read_abo, read_measured_masses
from corporeal.materials import find_material
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.ground import GroundConfig
from scripted_model import Oracle, part, weighs, whole

FEW = MassConfig(samples=40)


def test_errors_are_as_the_literature_defines_them():
    found = mass_errors([1.0, 2.0, 8.0], [2.0, 2.0, 2.0])
    assert found.count == 3
    assert found.ade == pytest.approx((1 + 0 + 6) / 3)
    assert found.alde == pytest.approx((math.log(2) + 0 + math.log(4)) / 3)
    assert found.ape == pytest.approx((0.5 + 0 + 3) / 3)
    assert found.mnre == pytest.approx((0.5 + 1 + 0.25) / 3)
    assert found.within_2 == pytest.approx(2 / 3)
    assert interval_coverage([1, 1, 3], [3, 1.5, 4], [2, 2, 2]) == pytest.approx(1 / 3)


def test_a_fit_never_sees_the_object_that_it_predicts():
    hull = [1e-4, 1e-3, 1e-2, 1e-1]
    law = [3 * v**0.8 for v in hull]
    assert hull_volume_mass(hull, law) == pytest.approx(law)
    odd = [*law[:3], 1e6]
    assert hull_volume_mass(hull, odd)[3] == pytest.approx(law[3])
    assert mean_mass([1.0, 4.0, 1e9])[2] == pytest.approx(2.0)
    assert hull_volume_mass(hull[:2], law[:2]) == [None, None]
    assert hull_volume_mass([1, 1, 1], [1, 2, 3]) == [None] * 3
    assert mean_mass([1.0]) == [None]
    assert solid_water_mass([2e-3]) == pytest.approx([2.0])


# ---------------------------------------------------------------- measured masses


def save(folder, name, mesh, substance=None, **extras):
    if substance:
        extras["substance"] = substance
    surface = Surface(name, 0, 0, np.asarray(mesh.vertices), np.asarray(mesh.faces), extras=extras)
    thing = SceneObject(name, name, float(np.ptp(mesh.vertices, axis=0).max()))
    folder.mkdir(parents=True, exist_ok=True)
    write_glb(folder / f"{name}.glb", Scene(name, "", (thing,), (surface,), (Finish("red"),)))


def write_table(path, rows):
    with path.open("w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)


def a_ball(radius=0.03):
    return trimesh.creation.icosphere(3, radius)


def test_a_table_weighs_the_models_that_it_scores(tmp_path):
    for name in ("a", "b", "c"):
        save(tmp_path / "models", name, a_ball())
    rows = [
        {"file": "models/b.glb", "mass_kg": "0.5", "fill": "solid", "scored": "yes"},
        {"file": "models/a.glb", "mass_kg": "0.25", "fill": "", "scored": "1"},
        {"file": "models/c.glb", "mass_kg": "9", "fill": "solid", "scored": "no: bent"},
        {"file": "models/not_here.glb", "mass_kg": "9", "fill": "solid", "scored": "1"},
    ]
    rows = [{"object": "in other words"} | row for row in rows]
    write_table(tmp_path / "truth.csv", rows)
    found = objects_to_weigh(tmp_path / "models", tmp_path / "truth.csv", "test")
    assert [(w.name, w.mass, w.fill) for w in found] == [("b", 0.5, "solid"), ("a", 0.25, "all")]
    assert [w.mass for w in models_in_folder(tmp_path / "models")] == [None] * 3


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([{"name": "a", "kg": "1"}], "has no column 'mass_kg'.*It has: name, kg"),
        ([{"weight_kg": "1"}], "has no column 'object'"),
        ([{"object": "a", "mass_kg": "heavy"}], "a: a mass must be a number of kilograms"),
        ([{"object": "a", "mass_kg": "-1"}], "not '-1'"),
        ([{"object": "z", "mass_kg": "1"}], "weighs none of the models"),
    ],
)
def test_a_table_that_cannot_be_used_says_why(tmp_path, rows, said):
    save(tmp_path, "a", a_ball())
    write_table(tmp_path / "truth.csv", rows)
    with pytest.raises(BadFileError, match=said):
        read_measured_masses(tmp_path, tmp_path / "truth.csv")


def test_the_layout_of_abo_500_is_read(tmp_path):
    scenes = {"train": ["B01_X"], "test": ["B02_Y", "B03_Z"]}
    (tmp_path / "splits.json").write_text(json.dumps(scenes))
    weights = {"B01": 1.5, "B02": 2.5, "B03": 3.5}
    (tmp_path / "filtered_product_weights.json").write_text(json.dumps(weights))
    for scene in ("B01_X", "B02_Y", "B03_Z"):
        save(tmp_path / "scenes" / scene, "mesh", a_ball())
    found = objects_to_weigh(tmp_path, None, "test")
    assert [(w.name, w.mass, w.file.parent.name) for w in found] == [("B02_Y", 2.5, "B02_Y"), ("B03_Z", 3.5, "B03_Z")]
    assert len(read_abo(tmp_path, "all")) == 3
    with pytest.raises(UserError, match=r"no split 'dev'. Choose one of: train, test, all"):
        read_abo(tmp_path, "dev")
    (tmp_path / "scenes" / "B03_Z" / "mesh.glb").unlink()
    with pytest.raises(UserError, match=r"B03_Z must hold the product's mesh .* it holds 0"):
        read_abo(tmp_path, "test")


# ---------------------------------------------------------------- predictions


@pytest.fixture(scope="module")
def weighed(tmp_path_factory):
    """Four things and the scales' word on them, as their usual values say."""
    folder = tmp_path_factory.mktemp("things")
    steel, brass, rubber = (find_material(n).ranges["density"].typical for n in ("steel", "brass", "soft_PVC"))
    ball, large = a_ball(), a_ball(0.05)
    save(folder, "one", ball, "steel")
    save(folder, "two", large, "brass")
    save(folder, "three", large, "soft_PVC", shell_thickness_m=0.002)
    save(folder, "four", ball)
    deep = 3 * large.volume / large.area  # the radius of a ball
    wall = large.volume * (1 - (1 - 2e-3 / deep) ** 3)
    rows = [
        {"object": "one", "mass_kg": steel * ball.volume, "fill": "solid"},
        {"object": "two", "mass_kg": brass * large.volume, "fill": "solid"},
        {"object": "three", "mass_kg": rubber * wall, "fill": "hollow"},
        {"object": "four", "mass_kg": 0.1, "fill": "solid"},
    ]
    write_table(folder / "truth.csv", rows)
    things = read_measured_masses(folder, folder / "truth.csv")
    return things, predict_masses(things, DescribeConfig(), GroundConfig(), FEW)


def test_what_is_known_is_weighed_and_a_hollow_ball_is_a_shell(weighed):
    _, found = weighed
    for prediction in found[:3]:
        assert prediction.mass == pytest.approx(prediction.mass_true, rel=1e-4)
        assert prediction.low < prediction.mass < prediction.high
    hollow = found[2]
    large = a_ball(0.05)
    share = 1 - (1 - 2e-3 * large.area / (3 * large.volume)) ** 3
    assert hollow.solid_usual == pytest.approx(hollow.mass / share, rel=1e-4)
    assert hollow.solid_water == pytest.approx(1000 * large.volume, rel=1e-6)
    assert hollow.hull_m3 == pytest.approx(large.volume, rel=1e-6)


def test_unrecognised_objects_may_weigh_anything(weighed):
    _, found = weighed
    known, unknown = found[0], found[3]
    assert unknown.high / unknown.low > 10 > 1.2 > known.high / known.low


def test_the_comparison_has_every_method_and_every_group(weighed, tmp_path):
    result = compare_masses(weighed[1])
    assert set(result.metrics) == {"all", "hollow", "solid"}
    assert result.metrics["hollow"]["mass"].alde == pytest.approx(0, abs=1e-4)
    every = result.metrics["all"]
    assert set(every) == {
        "solid_water", "constant", "hull_fit", "solid_usual", "built_usual", "placed", "mixture",
        "mass",
    }  # fmt: skip
    assert every["solid_usual"].ape > 1 > every["mass"].ape
    row = result.rows[2]
    assert row.hull_fit > 0
    assert row.constant == pytest.approx(math.prod(r.mass_true for k, r in enumerate(result.rows) if k != 2) ** (1 / 3))
    mass_figure(result.rows, tmp_path / "mass.png")
    assert (tmp_path / "mass.png").read_bytes()[:4] == b"\x89PNG"
    titles = [table.title for table in mass_tables(result)]
    assert titles[0] == "Masses"
    assert "Errors, all" in titles[1]
    unweighed = compare_masses([replace(p, mass_true=None) for p in weighed[1]])
    assert unweighed.metrics == {}
    with pytest.raises(UserError, match="no measured masses"):
        mass_figure(unweighed.rows, tmp_path / "none.png")


def test_questions_about_all_objects_that_wait_are_counted(weighed, tmp_path):
    things, _ = weighed
    asking = DescribeConfig(vlm=f"ask:{tmp_path}", view_size=16)
    with pytest.raises(UserError) as waits:
        predict_masses(things[:3], asking, GroundConfig(), FEW)
    pages = list((tmp_path / "questions").glob("*.md"))
    assert len(pages) >= 3
    assert str(waits.value).startswith(f"{len(pages)} questions wait in ")


def test_the_same_seed_draws_the_same_interval(weighed):
    things, found = weighed
    again = predict_masses(things[:1], DescribeConfig(), GroundConfig(), FEW)[0]
    assert (again.low, again.high) == (found[0].low, found[0].high)
    other = predict_masses(things[:1], DescribeConfig(), GroundConfig(), replace(FEW, seed=1))[0]
    assert other.low != again.low


def test_an_anonymous_object_betrays_nothing_but_its_pictures(weighed):
    things, _ = weighed
    scene = assemble([things[0].file])
    hidden = anonymise(scene, things[0].file)
    said = repr((hidden.name, hidden.source, hidden.objects, [s.name for s in hidden.surfaces]))
    said += repr([f.name for f in hidden.finishes]) + repr([s.extras for s in hidden.surfaces])
    for word in ("one", "steel", "red"):
        assert f"'{word}'" not in said
        assert f"{word}_" not in said
    assert hidden.objects[0].name.startswith("object-")
    assert np.array_equal(hidden.surfaces[0].vertices, scene.surfaces[0].vertices)
    assert anonymise(scene, things[1].file).name != hidden.name
    blind = predict_masses(things[:1], DescribeConfig(), GroundConfig(), replace(FEW, anonymous=True))[0]
    assert "unknown" in blind.described


SAID = weighs(0.3, 0.4, 0.5)


def asked(things, monkeypatch, said=SAID, **config):
    """Predict with an oracle in the model's place: (oracle, predictions)."""
    oracle = Oracle(parts=whole("ball"), materials=lambda q: {"parts": [part("ball", "soft_PVC", "hollow")]}, mass=said)
    monkeypatch.setattr("corporeal.pipeline.stages.describe.connect_vlm", lambda spec, record: oracle)
    describing = DescribeConfig(vlm="oracle:1", views=2, view_size=32, **config)
    return oracle, predict_masses(things, describing, GroundConfig(), replace(FEW, anonymous=True))


def test_a_model_is_asked_for_the_number_itself_too(weighed, monkeypatch):
    oracle, found = asked(weighed[0][:2], monkeypatch)
    assert [p.direct for p in found] == [0.4, 0.4]
    question = next(q for q in oracle.asked if q.task == "mass")
    assert len(question.pictures) == 2
    assert "object-" in question.text
    assert "steel" not in question.text
    assert re.search(r"[56][.\d]* × [56][.\d]* × [56][.\d]* cm", question.text)
    assert compare_masses(found).metrics["all"]["direct"].count == 2


def test_outside_evidence_is_left_out_where_it_is_not_wanted(weighed, monkeypatch):
    oracle, found = asked(weighed[0][:1], monkeypatch, direct=False)
    assert "mass" not in oracle.tasks()
    assert (found[0].direct, found[0].warning) == (None, "")
    assert found[0].mass == found[0].mixture


# ---------------------------------------------------------------- the verb


def test_the_verb_prints_tables_and_writes_data_and_figure(weighed, command, tmp_path):
    folder = weighed[0][0].file.parent
    written = ("--json", tmp_path / "m.json", "--figure", tmp_path / "m.png")
    table = ("--truth", folder / "truth.csv", "--samples", "20")
    code, said = command("evaluate", "mass", folder, *table, *written)
    assert code == 0, said.err
    for words in ("ALDE", "solid water", "as built, placed values", "measured [kg]"):
        assert words in said.out
    data = json.loads((tmp_path / "m.json").read_text())
    assert [r["object"] for r in data["rows"]] == ["one", "two", "three", "four"]
    assert data["metrics"]["all"]["mass"]["count"] == 4
    assert 0 <= data["coverage"]["all"] <= 1
    assert (tmp_path / "m.png").exists()


def test_masses_can_be_predicted_without_any_truth(weighed, command, tmp_path):
    shutil.copy(weighed[0][0].file, tmp_path / "alone.glb")
    code, said = command("evaluate", "mass", tmp_path, "--samples", "5")
    assert code == 0, said.err
    assert "alone" in said.out
    assert "ALDE" not in said.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("nowhere",), "No .glb or .gltf file in nowhere"),
        ((".", "--truth", "none.csv"), "none.csv: cannot be read as CSV"),
        ((".", "--vlm", "replay:nowhere"), "No folder of recordings at 'nowhere'"),
    ],
)
def test_the_verb_says_what_is_missing(weighed, command, tmp_path, monkeypatch, words, said):
    shutil.copy(weighed[0][0].file, tmp_path / "alone.glb")
    monkeypatch.chdir(tmp_path)
    code, told = command("evaluate", "mass", *words)
    assert code == 2
    assert said in told.err
    assert "Traceback" not in told.err
