"""Parts of models: photographed models, any names, with and without models that look."""

import importlib.util
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import parts_of_models
import pytest
from segmentation.parts_evaluation import (
    SHOWCASE_MODELS,
    PartsEvaluationConfig,
    PartsMethod,
    evaluate_parts,
    feature_models,
    parts_tables,
    read_names,
)
from segmentation.segmentation_scores import iou_matrix, majority_names, matched_iou, named_iou

from corporeal.core.errors import BadFileError, UserError
from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.lab.evaluation.material_evaluation import roc_area
from corporeal.showcase.showcase_scenes import prop_scene
from glb_maker import CUBE, CUBE_TRIANGLES

ROOT = Path(__file__).parents[1]
FEW = ["--points", "2500", "--photographs", "6", "--photograph-size", "64"]
CHEAP = PartsMethod(PartsEvaluationConfig(points=2500, photographs=6, photograph_size=64))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A box on a box, whose parts have names, and a ball, which is one part."""
    made = tmp_path_factory.mktemp("models")
    write_glb(made / "boxes.glb", boxes())
    write_glb(made / "steel_ball.glb", prop_scene("steel_ball"))
    return made


def boxes():
    brown, green = (Finish(n, (*c, 1.0)) for n, c in (("a", (0.2, 0.08, 0.03)), ("b", (0.0, 0.3, 0.0))))
    upper = CUBE * np.array([0.6, 0.6, 1]) + np.array([0.2, 0.2, 1])
    surfaces = tuple(
        Surface(name, 0, k, at.astype(float), CUBE_TRIANGLES.astype(np.int64))
        for k, (name, at) in enumerate((("base", CUBE), ("top", upper)))
    )
    return Scene("boxes", "", (SceneObject("boxes", "boxes", 2.0),), surfaces, (brown, green))


@pytest.fixture(scope="module")
def judged_boxes(folder):
    (judged,) = evaluate_parts(folder, {}, CHEAP)
    return judged


def test_iou_is_shared_points_over_all_points_of_either():
    truth, found = np.array([0, 0, 0, 1, 1, -1]), np.array([0, 0, 1, 1, -1, 1])
    np.testing.assert_allclose(iou_matrix(truth, found, 2, 3), [[2 / 3, 1 / 5, 0], [0, 1 / 4, 0]])


def test_clusters_are_paired_one_to_one_and_a_part_without_one_counts_nothing():
    truth = np.repeat([0, 1], 50)
    assert matched_iou(truth, 1 - truth) == 1
    assert matched_iou(truth, 0 * truth) == 0.25
    assert matched_iou(truth, np.repeat(np.arange(4), 25)) == 0.5


def test_named_parts_are_compared_with_their_own_only():
    truth = np.repeat([0, 2], 50)
    assert named_iou(truth, truth) == 1
    assert named_iou(truth, 2 - truth) == 0
    assert named_iou(truth, np.repeat([0, 1], 50)) == 0.5


def test_the_best_names_are_what_most_of_a_cluster_is():
    truth, found = np.array([0, 0, 1, 1, 1]), np.array([0, 0, 0, 1, 1])
    np.testing.assert_array_equal(majority_names(truth, found), [0, 0, 0, 1, 1])


def test_the_roc_area_counts_pairs_and_halves_ties():
    assert roc_area(np.array([0.9, 0.8]), np.array([0.1])) == 1
    assert roc_area(np.array([0.1]), np.array([0.9, 0.8])) == 0
    assert roc_area(np.array([0.5, 0.9]), np.array([0.5])) == pytest.approx(0.75)
    assert roc_area(np.array([0.5]), np.zeros(0)) is None


def test_a_person_types_it_and_gets_a_table_data_and_a_picture(folder, capsys):
    names = folder / "names.toml"
    names.write_text("[boxes]\nbase = 'wooden base'\ntop = 'green top'\n")
    out, picture = folder / "out.json", folder / "out.png"
    where = ["--names", str(names), "--json", str(out), "--figure", str(picture)]
    parts_of_models.main([str(folder), *FEW, *where])
    shown = capsys.readouterr().out
    assert "boxes" in shown and "steel_ball" not in shown
    (row,) = json.loads(out.read_text())["rows"]
    assert row["parts"] == ["wooden base", "green top"]
    assert picture.stat().st_size > 10_000
    assert row["chance_iou"] < 0.5 and 0.9 < row["best_iou"] <= 1
    assert 0.9 < row["named_iou"] <= row["found_iou"] <= row["best_iou"]
    assert row["ratio"] == row["clusters"] / len(row["parts"])
    assert row["points"] < 2500


def test_the_same_seed_gives_the_same_numbers(folder, judged_boxes):
    first, second = judged_boxes, evaluate_parts(folder, {}, CHEAP)[0]
    assert first.row.named_iou == second.row.named_iou
    assert first.row.clusters == second.row.clusters
    np.testing.assert_array_equal(first.part_of_point, second.part_of_point)


def test_what_is_called_the_same_is_one_part(folder, tmp_path):
    lower = Surface("foot", 0, 0, 0.5 * CUBE.astype(float), CUBE_TRIANGLES.astype(np.int64))
    red = Finish("c", (0.4, 0.0, 0.0, 1.0))
    made = boxes()
    feet = replace(lower, vertices=lower.vertices + np.array([0.25, 0.25, -0.5]), finish=2)
    three = replace(made, surfaces=(*made.surfaces, feet), finishes=(*made.finishes, red))
    write_glb(tmp_path / "three.glb", three)
    names = {"three": {"base": "wooden thing", "foot": "wooden thing"}}
    (apart,) = evaluate_parts(tmp_path, {}, CHEAP)
    (together,) = evaluate_parts(tmp_path, names, CHEAP)
    assert apart.row.parts == ("base", "top", "foot")
    assert together.row.parts == ("wooden thing", "top")
    assert set(np.unique(together.truth)) == {0, 1}
    with pytest.raises(UserError, match="two parts"):
        evaluate_parts(tmp_path, {"three": dict.fromkeys(apart.row.parts, "thing")}, CHEAP)


def test_models_are_laid_on_their_side(folder, judged_boxes):
    look = replace(CHEAP.look, lying=True)
    (judged,) = evaluate_parts(folder, {}, replace(CHEAP, look=look))
    place = judged.taken.cloud.position
    middle = [place[judged.truth == k].mean(axis=0) for k in range(2)]
    assert place[:, 2].min() > -1e-6 and abs(middle[1][2] - middle[0][2]) < 0.1
    assert middle[1][0] - middle[0][0] > 0.4
    assert judged.row.points != judged_boxes.row.points


def test_only_what_pictures_show_is_asked_for(judged_boxes):
    judged = judged_boxes
    assert (judged.taken.cloud.seen > 0).all()
    assert set(np.unique(judged.truth)) == set(range(len(judged.row.parts)))


def test_a_folder_without_models_or_without_parts_is_reported(tmp_path, folder):
    with pytest.raises(UserError, match="no models"):
        evaluate_parts(tmp_path, {}, CHEAP)
    one = tmp_path / "one"
    one.mkdir()
    (one / "ball.glb").write_bytes((folder / "steel_ball.glb").read_bytes())
    with pytest.raises(UserError, match="two parts"):
        evaluate_parts(one, {}, CHEAP)


def test_who_does_not_know_words_cannot_name():
    with pytest.raises(UserError, match="does not compare points with words"):
        feature_models(PartsEvaluationConfig(semantic="descriptor"))


@pytest.mark.parametrize("text", ["[duck", "duck = 3", "[duck]\nbody = 7", "[duck]\nbody = ''"])
def test_names_that_are_no_names_are_reported(tmp_path, text):
    path = tmp_path / "names.toml"
    path.write_text(text)
    with pytest.raises(BadFileError):
        read_names(path)


@pytest.mark.slow
def test_the_names_of_the_documentation_are_those_of_the_showcase():
    tables = [read_names(ROOT / "benchmarks" / f"parts_{k}.toml") for k in ("each", "asked")]
    for name in SHOWCASE_MODELS:
        own = {surface.name for surface in prop_scene(name).surfaces}
        assert all(set(names[name]) == own for names in tables)


def test_models_that_look_are_asked_for_pixels_and_words(folder, tmp_path):
    """Random weights: what is shown is that everything fits together."""
    if not all(importlib.util.find_spec(name) for name in ("torch", "transformers")):
        pytest.skip("torch or transformers not installed: pip install 'corporeal[learned]'")
    sys.path.insert(0, str(ROOT / "tests" / "reconstruction" / "features"))
    from tiny_models import save_clip, save_dinov2

    clip, dinov2 = save_clip(tmp_path / "clip"), save_dinov2(tmp_path / "dinov2")
    look = PartsEvaluationConfig(
        points=1500, photographs=4, photograph_size=56, structural=f"dinov2:{dinov2}", semantic=f"clip:{clip}"
    )
    (judged,) = evaluate_parts(folder, {}, PartsMethod(look))
    cloud = judged.taken.cloud
    assert cloud.semantic.shape == (cloud.count, 24) and cloud.structural.shape[1] == 48
    np.testing.assert_allclose(np.linalg.norm(cloud.semantic.astype(float), axis=1), 1, atol=2e-3)
    assert 0 <= judged.row.named_iou <= judged.row.found_iou + 1e-9 <= 1 + 1e-9


def test_the_table_ends_with_the_mean(judged_boxes):
    (table,) = parts_tables([judged_boxes.row, judged_boxes.row])
    heads, cells = table.heads, table.rows
    assert len(cells) == 3 and cells[-1][0] == "mean" and len(cells[-1]) == len(heads)
    assert cells[-1][3:] == cells[0][3:]
