import numpy as np
import pytest
from PIL import Image
from segmentation import objects_evaluation, objects_figure

from corporeal.core.errors import UserError
from corporeal.core.types import Finish, Scene, SceneObject, Surface

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
FACES = np.array([int(digit) for digit in "013032467475045051237276026064157173"]).reshape(-1, 3)


def box(name, number, low, size):
    return (
        SceneObject(name, name, max(size)),
        Surface(name, number, number, np.array(low) + CORNERS * size, FACES),
        Finish(name, (0.8, 0.1, 0.1, 1.0) if number else (0.1, 0.1, 0.8, 1.0)),
    )


@pytest.fixture(scope="module")
def scene():
    parts = (box("tall", 0, (0, 0, 0), (0.2, 0.2, 0.5)), box("low", 1, (0.4, 0, 0), (0.4, 0.3, 0.2)))
    things, surfaces, finishes = zip(*parts, strict=True)
    return Scene("two", "", things, surfaces, finishes)


def test_objects_that_stand_apart_are_pushed_until_they_touch(scene):
    near = objects_evaluation.bring_together(scene)
    low, tall = near.surfaces[1].vertices, near.surfaces[0].vertices
    gap = low[:, 0].min() - tall[:, 0].max()
    assert 0 <= gap < 0.003
    np.testing.assert_array_equal(tall, scene.surfaces[0].vertices)
    np.testing.assert_allclose(low[:, 2], scene.surfaces[1].vertices[:, 2])
    again = objects_evaluation.bring_together(near)
    np.testing.assert_array_equal(again.surfaces[1].vertices, low)


def test_a_scene_is_judged_by_what_its_pictures_show(scene, tmp_path):
    how = objects_evaluation.ObjectsEvaluationConfig(surface_points=3000, pictures=8, picture_size=64)
    taken = objects_evaluation.touching_from_photographs("two", scene, how)
    assert taken.cloud.count == 3000 and taken.masks.shape == (8, 3000)
    truth = taken.object_of_point
    assert (taken.cloud.colour[truth == 1, 0] > taken.cloud.colour[truth == 1, 2]).mean() > 0.95
    under = taken.cloud.position[:, 2] < 1e-9
    for k, own in enumerate(objects_evaluation.bring_together(scene).surfaces):
        bottom = taken.cloud.position[under & (truth == k), :2]
        corners = own.vertices[:, :2].min(0), own.vertices[:, :2].max(0)
        inward = np.minimum(bottom - corners[0], corners[1] - bottom).min(axis=1)
        assert (inward < 0.03).all()  # two pixels
    judged = objects_evaluation.evaluate_scene("two", taken)
    row = judged.row
    assert row.identity == 1 and row.ours > 0.95 and row.with_masks > 0.95
    assert row.components < 0.6 and row.objects == ("tall", "low")
    objects_figure.draw_objects([judged], tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    with Image.open(tmp_path / "figure.png") as drawn:
        assert drawn.mode == "P", "a byte for each pixel: the page's picture was 1.1 MB"
    objects_figure.draw_objects([judged], tmp_path / "figure.svg")
    assert "<svg" in (tmp_path / "figure.svg").read_text(encoding="utf-8")
    table = objects_evaluation.objects_tables([row])[0]
    assert (
        len(table.heads) == len(table.rows[0]) and objects_evaluation.objects_record([row])["rows"][0]["identity"] == 1
    )


def test_a_folder_without_scenes_is_refused(tmp_path):
    with pytest.raises(UserError, match="no scene of several objects"):
        objects_evaluation.evaluate_objects(tmp_path)
