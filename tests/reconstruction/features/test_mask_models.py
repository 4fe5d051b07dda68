"""Masks by models with random weights: what is loaded, what is refused, what is written."""

import json
import shutil

import numpy as np
import pytest
from PIL import Image
from tiny_maskers import save_sam2, save_sam3
from tiny_models import needs_models, save_dinov2

from corporeal.core.errors import BadFileError, UnknownChoiceError, UserError
from corporeal.core.types import Views
from corporeal.io.photos.posed_photos import read_posed_photos
from corporeal.io.photos.transforms_json import write_views
from corporeal.reconstruction.features.learned_masks import learned_masks, number_instances
from corporeal.reconstruction.features.mask_models import MaskInstance, connect_mask_model, split_model_spec
from corporeal.render.camera_placement import CameraAim, camera_from_aim

WIDE, HIGH = 48, 36


def photograph(seed=0):
    coarse = np.random.default_rng(seed).integers(0, 256, (HIGH // 6, WIDE // 6, 3), np.uint8)
    return np.repeat(np.repeat(coarse, 6, 0), 6, 1)


@pytest.fixture
def photographs(tmp_path):
    turns = np.linspace(0, 5, 5)
    eyes = [(2 * np.cos(t), 2 * np.sin(t), 1.0) for t in turns]
    cameras = tuple(camera_from_aim(CameraAim(e, (0.0, 0.0, 0.0), 40.0, WIDE, HIGH)) for e in eyes)
    rgb = np.stack([photograph(k) for k in range(5)])
    write_views(tmp_path / "photos", Views(rgb, cameras))
    return tmp_path / "photos"


@pytest.fixture(scope="module")
def sam2(tmp_path_factory):
    return save_sam2(tmp_path_factory.mktemp("sam2"))


@pytest.fixture(scope="module")
def sam3(tmp_path_factory):
    return save_sam3(tmp_path_factory.mktemp("sam3"))


class Found:
    """Stands for a model: two rectangles, one of them in front of the other."""

    needs_words = True

    def __init__(self):
        self.asked = []

    def name(self):
        return "found@0"

    def instances(self, picture, words, at):
        self.asked.append((tuple(words), at))
        made = []
        for k, (left, right) in enumerate([(5, 25), (20, 40)]):
            mask = np.zeros(picture.shape[:2], bool)
            mask[8:30, left:right] = True
            made.append(MaskInstance(mask, 0.9 - 0.2 * k, words[k]))
        return made


@needs_models()
def test_sam2_says_what_is_at_a_place(sam2):
    masker = connect_mask_model(f"sam2:{sam2}")
    (one,) = masker.instances(photograph(), (), (24.0, 18.0))
    assert one.mask.shape == (HIGH, WIDE) and one.mask.dtype == bool
    assert 0 <= one.score <= 1
    again = connect_mask_model(f"sam2:{sam2}").instances(photograph(), (), (24.0, 18.0))[0]
    np.testing.assert_array_equal(one.mask, again.mask)
    assert masker.name().startswith("sam2@")


@needs_models()
def test_sam2_is_asked_at_the_place_that_was_meant(sam2, monkeypatch):
    """In pixels of the square that the model sees, not of the photograph."""
    masker, given = connect_mask_model(f"sam2:{sam2}"), {}
    forward = masker.model.prompt_encoder.forward

    def caught(**prompts):
        given.update(prompts)
        return forward(**prompts)

    monkeypatch.setattr(masker.model.prompt_encoder, "forward", caught)
    masker.instances(photograph(), (), (12.0, 27.0))
    np.testing.assert_allclose(given["input_points"].numpy(), [[[[16.0, 48.0]]]])


@needs_models()
def test_sam3_finds_what_words_name(sam3):
    from corporeal.reconstruction.features.sam3 import Sam3

    assert isinstance(connect_mask_model(f"sam3:{sam3}"), Sam3)
    masker = Sam3(sam3, min_score=0.0)
    found = masker.instances(photograph(), ("duck", "can"), (0.0, 0.0))
    assert {one.word for one in found} == {"duck", "can"} and len(found) == 10
    assert all(one.mask.shape == (HIGH, WIDE) for one in found)
    assert [one.score for one in found] == sorted((one.score for one in found), reverse=True)
    strict = Sam3(sam3, min_score=1.1)
    assert not strict.instances(photograph(), ("duck",), (0.0, 0.0)), "none is that sure"


@needs_models()
def test_checkpoints_for_videos_hold_the_same_model(sam2, tmp_path):
    place = shutil.copytree(sam2, tmp_path / "video")
    config = json.loads((place / "config.json").read_text()) | {"model_type": "sam2_video"}
    (place / "config.json").write_text(json.dumps(config))
    made = connect_mask_model(f"sam2:{place}").instances(photograph(), (), (24.0, 18.0))[0]
    own = connect_mask_model(f"sam2:{sam2}").instances(photograph(), (), (24.0, 18.0))[0]
    np.testing.assert_array_equal(made.mask, own.mask)


@needs_models()
def test_weights_of_another_kind_are_refused(sam2, sam3, tmp_path):
    with pytest.raises(BadFileError, match="'sam2', not 'sam3'"):
        connect_mask_model(f"sam3:{sam2}")
    with pytest.raises(BadFileError, match="'sam3', not 'sam2'"):
        connect_mask_model(f"sam2:{sam3}")
    with pytest.raises(BadFileError, match="'dinov2', not 'sam2'"):
        connect_mask_model(f"sam2:{save_dinov2(tmp_path)}")


@needs_models()
def test_weights_that_do_not_fill_the_model_are_refused(sam2, tmp_path):
    from safetensors.torch import load_file, save_file

    place = shutil.copytree(sam2, tmp_path / "half")
    arrays = load_file(place / "model.safetensors")
    kept = {name: array for name, array in arrays.items() if "mask_decoder" not in name}
    save_file(kept, place / "model.safetensors", {"format": "pt"})
    with pytest.raises(BadFileError, match="lacks"):
        connect_mask_model(f"sam2:{place}").instances(photograph(), (), (1.0, 1.0))


def test_a_folder_that_is_not_there_is_named_and_nothing_is_fetched(monkeypatch):
    monkeypatch.setattr("corporeal.reconstruction.features.mask_models.find_spec", lambda package: True)
    for spec in ("sam2:", "sam3:nowhere", "birefnet:facebook/sam2"):
        with pytest.raises(UserError, match="none are downloaded"):
            connect_mask_model(spec)
    with pytest.raises(UnknownChoiceError, match="sam3"):
        split_model_spec("sam9:folder")


def test_missing_packages_are_named(monkeypatch):
    monkeypatch.setattr("corporeal.reconstruction.features.mask_models.find_spec", lambda package: None)
    with pytest.raises(UserError, match=r"needs torch and transformers.*corporeal\[learned\]"):
        connect_mask_model("sam2:folder")
    with pytest.raises(UserError, match=r"needs onnxruntime.*corporeal\[birefnet\]"):
        connect_mask_model("birefnet:folder")


def test_a_folder_of_masks_is_no_model(tmp_path):
    assert (
        split_model_spec(str(tmp_path)) is None
        and split_model_spec("masks") is None
        and split_model_spec("C:\\masks") is None
    )


def test_what_is_surer_is_in_front():
    picture = np.zeros((HIGH, WIDE, 3), np.uint8)
    number = number_instances(Found().instances(picture, ("a", "b"), (0, 0)), (HIGH, WIDE))
    assert number[10, 10] == 1 and number[10, 22] == 1 and number[10, 30] == 2
    assert number[0, 0] == 0


def test_masks_and_instances_are_written_and_read_back(photographs, tmp_path):
    masker = Found()
    made = learned_masks(photographs, tmp_path / "made", masker, ("duck", "can"))
    assert len(masker.asked) == 5
    for words, at in masker.asked:
        assert words == ("duck", "can")
        np.testing.assert_allclose(at, (WIDE / 2, HIGH / 2), atol=0.1)
    read = read_posed_photos(photographs, WIDE, made.folder)
    assert read.masks is not None and read.views.object_of_pixel is not None
    assert (read.masks[:, 8:30, 5:40] == 255).all() and read.masks[:, :8].max() == 0
    assert (read.views.object_of_pixel[:, 10, 30] == 1).all()


def test_corrected_masks_are_kept_and_not_asked_for_again(photographs, tmp_path):
    masker = Found()
    made = learned_masks(photographs, tmp_path / "made", masker, ("duck", "can"))
    mask = made.folder / "masks" / "0002.png"
    Image.fromarray(np.full((HIGH, WIDE), 255, np.uint8)).save(mask)
    again = learned_masks(photographs, tmp_path / "made", masker, ("duck", "can"))
    assert len(masker.asked) == 5
    assert "1 of the masks were corrected manually." in again.said
    assert np.asarray(Image.open(mask)).min() == 255
    learned_masks(photographs, tmp_path / "made", masker, ("duck", "other"))
    assert len(masker.asked) == 10, "other words are another question"


def test_words_are_asked_for(photographs, tmp_path):
    with pytest.raises(UserError, match="--object-names"):
        learned_masks(photographs, tmp_path / "made", Found(), ())


def test_nothing_found_is_refused(photographs, tmp_path):
    masker = Found()
    masker.instances = lambda picture, words, at: []
    with pytest.raises(BadFileError, match="found nothing in 5 of 5"):
        learned_masks(photographs, tmp_path / "made", masker, ("duck",))
