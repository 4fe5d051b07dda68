import json
import shutil

import numpy as np
import pytest
from tiny_models import PATCH, SIDE, STATISTICS, needs_models, save_clip, save_dinov2

from corporeal.core.errors import BadFileError, UserError
from corporeal.reconstruction.features import connect_encoder
from corporeal.reconstruction.features.vit_pictures import cosine_similarity

pytestmark = needs_models()


@pytest.fixture(scope="module", autouse=True)
def torch():
    """Imported when a test of this file runs: it takes seconds, in every process."""
    if pytestmark.args[0]:
        return None
    import torch

    torch.set_num_threads(1)
    return torch


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return save_clip(tmp_path_factory.mktemp("clip"))


@pytest.fixture(scope="module")
def dinov2(tmp_path_factory):
    return save_dinov2(tmp_path_factory.mktemp("dinov2"))


def photograph(high=56, wide=56, seed=0):
    coarse = np.random.default_rng(seed).integers(0, 256, (high // 7, wide // 7, 3), np.uint8)
    return np.repeat(np.repeat(coarse, 7, 0), 7, 1)


def length(rows):
    return np.linalg.norm(rows.astype(np.float64), axis=-1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("high", "wide", "rows", "columns"), [(56, 56, 4, 4), (28, 42, 4, 6), (112, 70, 6, 4), (56, 105, 4, 8)]
)
def test_a_map_covers_the_picture_in_whole_patches(clip, dinov2, high, wide, rows, columns):
    picture = photograph(high, wide)
    for spec, channels in ((f"clip:{clip}", 24), (f"dinov2:{dinov2}", 48)):
        encoder = connect_encoder(spec)
        made = encoder.map(picture)
        assert made.shape == (rows, columns, channels) and made.dtype == np.float16
        np.testing.assert_allclose(length(made), 1, atol=2e-3)


def test_dense_clip_is_the_last_layer_where_patches_attend_to_themselves_alone(clip, torch):
    """The library's own attention, its mask a diagonal, gives each patch its value."""
    from corporeal.reconstruction.features.clip import dense_features

    model = connect_encoder(f"clip:{clip}").model
    vision, last = model.vision_model, model.vision_model.encoder.layers[-1]
    pixels = torch.randn(2, 3, 70, 98, generator=torch.Generator().manual_seed(1))
    caught = {}
    hook = last.self_attn.register_forward_hook(lambda m, i, out: caught.update(out=out[0]))
    whole = last.forward

    def alone(hidden, attention_mask=None, **options):
        count = hidden.shape[1]
        mask = torch.full((1, 1, count, count), torch.finfo(hidden.dtype).min)
        mask[0, 0].fill_diagonal_(0)
        return whole(hidden, attention_mask=mask, **options)

    last.forward = alone
    try:
        with torch.inference_mode():
            model.get_image_features(pixel_values=pixels, interpolate_pos_encoding=True)
            expected = model.visual_projection(vision.post_layernorm(caught["out"][:, 1:]))
    finally:
        hook.remove()
        del last.forward
    torch.testing.assert_close(dense_features(model, pixels), expected, atol=1e-5, rtol=1e-5)


def test_dense_clip_is_the_pooled_feature_where_all_patches_are_one(clip, torch):
    """Without residual and MLP, the class token of one patch that it attends to alone is it."""
    from corporeal.reconstruction.features.clip import dense_features

    model = connect_encoder(f"clip:{clip}").model
    last = model.vision_model.encoder.layers[-1]
    pixels = torch.randn(1, 3, PATCH, PATCH, generator=torch.Generator().manual_seed(2))
    whole = last.forward

    def value(hidden, attention_mask=None, **options):
        mask = torch.tensor([[[[torch.finfo(hidden.dtype).min, 0.0]] * 2]])
        attended = last.self_attn(hidden_states=last.layer_norm1(hidden), attention_mask=mask)
        return attended[0]

    last.forward = value
    try:
        with torch.inference_mode():
            pooled = model.get_image_features(pixel_values=pixels, interpolate_pos_encoding=True)
    finally:
        last.forward = whole
    torch.testing.assert_close(dense_features(model, pixels)[0], pooled.pooler_output, atol=1e-5, rtol=1e-5)


def test_positions_are_interpolated_not_cut(clip, torch):
    """At the trained size nothing is interpolated; a wider picture keeps its ends' positions."""
    vision = connect_encoder(f"clip:{clip}").model.vision_model.embeddings
    pixels = torch.zeros(1, 3, SIDE, SIDE)
    torch.testing.assert_close(vision(pixels, interpolate_pos_encoding=True), vision(pixels))
    wide = connect_encoder(f"clip:{clip}").map(np.full((56, 112, 3), 128, np.uint8)).astype(np.float32)
    square = connect_encoder(f"clip:{clip}").map(np.full((56, 56, 3), 128, np.uint8)).astype(np.float32)
    near = (wide[:, 0] * square[:, 0]).sum(-1)
    far = (wide[:, -1] * square[:, 0]).sum(-1)
    assert (near > far).all()


def test_a_patch_sees_what_is_in_its_place(dinov2, clip):
    """A picture with one changed corner changes most in that corner's patch."""
    before = np.full((56, 56, 3), 120, np.uint8)
    after = before.copy()
    after[:14, 42:] = [250, 20, 20]
    for spec in (f"clip:{clip}", f"dinov2:{dinov2}"):
        encoder = connect_encoder(spec)
        a, b = (encoder.map(p).astype(np.float32) for p in (before, after))
        assert np.unravel_index(np.argmin((a * b).sum(-1)), (4, 4)) == (0, 3)


def test_dinov2_is_its_own_patch_tokens(dinov2, torch):
    from corporeal.reconstruction.features.vit_pictures import prepare_picture

    encoder = connect_encoder(f"dinov2:{dinov2}")
    picture = photograph(56, 84)
    pixels = prepare_picture(picture, (56, 84), STATISTICS)
    with torch.inference_mode():
        tokens = encoder.model(pixel_values=pixels).last_hidden_state[0, 1:].numpy()
    tokens /= length(tokens)[:, None]
    np.testing.assert_allclose(encoder.map(picture).reshape(24, 48), tokens, atol=1e-3)


def test_pictures_are_normalised_as_the_model_was_trained():
    from corporeal.reconstruction.features.vit_pictures import patch_grid, prepare_picture

    picture = np.full((20, 20, 3), [255, 0, 51], np.uint8)
    pixels = prepare_picture(picture, (14, 28), STATISTICS)
    assert pixels.shape == (1, 3, 14, 28)
    expected = (np.array([1, 0, 0.2]) - STATISTICS["image_mean"]) / STATISTICS["image_std"]
    np.testing.assert_allclose(pixels.numpy(), np.tile(expected[:, None, None], (1, 14, 28))[None],
                               rtol=1e-5)  # fmt: skip
    assert patch_grid(picture, 336, 14) == (24, 24)


def test_a_name_is_the_mean_over_its_prompts(clip, torch):
    from corporeal.reconstruction.features.clip import PROMPT_TEMPLATES

    encoder = connect_encoder(f"clip:{clip}")
    words = encoder.words(["soda can", "red box", "soda can"])
    assert words.shape == (3, 24)
    np.testing.assert_allclose(length(words), 1, atol=1e-6)
    np.testing.assert_array_equal(words[0], words[2])
    assert words[0] @ words[1] < 0.9999
    one = []
    for template in PROMPT_TEMPLATES:
        tokens = encoder._tokenizer([template.format("red box")], return_tensors="pt")
        with torch.inference_mode():
            said = encoder.model.get_text_features(**tokens).pooler_output[0].numpy()
        one.append(said / np.linalg.norm(said))
    mean = np.mean(one, axis=0)
    np.testing.assert_allclose(words[1], mean / np.linalg.norm(mean), atol=1e-5)
    assert encoder.words([]).shape == (0, 24)
    encoder.words(["a thing of many words " * 30])


def test_pictures_and_words_are_compared_in_one_space(clip):
    """The cosines are those of the library's own logits, for what both can say."""
    encoder = connect_encoder(f"clip:{clip}")
    words = encoder.words(["soda can", "red box"])
    features = encoder.map(photograph()).reshape(-1, 24)
    cosines = cosine_similarity(features, words)
    expected = features.astype(np.float64) @ words.astype(np.float64).T
    np.testing.assert_allclose(cosines, expected, atol=1e-6)
    assert (np.abs(cosines) <= 1 + 1e-3).all() and np.ptp(cosines) > 0


def test_the_same_picture_gives_the_same_map(clip, dinov2, tmp_path):
    picture = photograph(56, 84, seed=5)
    for kind, folder in (("clip", clip), ("dinov2", dinov2)):
        copy = shutil.copytree(folder, tmp_path / "elsewhere" / kind)
        here, there = connect_encoder(f"{kind}:{folder}"), connect_encoder(f"{kind}:{copy}")
        assert here.name() == there.name()
        np.testing.assert_array_equal(here.map(picture), there.map(picture))


def test_other_weights_have_another_name_and_so_other_files(tmp_path, dinov2):
    other = save_dinov2(tmp_path / "other", seed=1)
    here, there = (connect_encoder(f"dinov2:{f}", tmp_path / "maps") for f in (dinov2, other))
    assert here.name() != there.name()
    assert here.path(photograph()) != there.path(photograph())
    assert (here.map(photograph()) != there.map(photograph())).any()


def test_a_folder_of_another_kind_or_without_weights_is_refused(clip, dinov2, tmp_path):
    with pytest.raises(BadFileError, match="holds a model of kind 'dinov2', not 'clip'"):
        connect_encoder(f"clip:{dinov2}")
    bare = shutil.copytree(dinov2, tmp_path / "bare")
    (bare / "model.safetensors").unlink()
    with pytest.raises(UserError, match="cannot be loaded"):
        connect_encoder(f"dinov2:{bare}").map(photograph())
    cut = shutil.copytree(dinov2, tmp_path / "cut")
    raw = (cut / "model.safetensors").read_bytes()
    (cut / "model.safetensors").write_bytes(raw[: len(raw) // 2])
    with pytest.raises(UserError, match="cannot be loaded"):
        connect_encoder(f"dinov2:{cut}").map(photograph())
    silent = shutil.copytree(dinov2, tmp_path / "silent")
    (silent / "preprocessor_config.json").unlink()
    with pytest.raises(UserError, match="there is no preprocessor_config"):
        connect_encoder(f"dinov2:{silent}")
    mute = shutil.copytree(clip, tmp_path / "mute")
    (mute / "tokenizer.json").unlink()
    with pytest.raises(UserError, match=r"there is no tokenizer\.json or vocab\.json"):
        connect_encoder(f"clip:{mute}")


def test_weights_that_do_not_fill_the_model_are_refused(dinov2, tmp_path):
    """Or a deeper model's upper layers would be random numbers, silently."""
    deeper = shutil.copytree(dinov2, tmp_path / "deeper")
    config = json.loads((deeper / "config.json").read_text())
    config["num_hidden_layers"] = 3
    (deeper / "config.json").write_text(json.dumps(config))
    with pytest.raises(BadFileError, match="of the model's arrays"):
        connect_encoder(f"dinov2:{deeper}").map(photograph())


def test_without_a_network_it_says_how_to_bring_the_weights(monkeypatch, tmp_path):
    import huggingface_hub.constants as constants

    monkeypatch.setattr(constants, "HF_HUB_OFFLINE", True)
    monkeypatch.setattr(constants, "HF_HUB_CACHE", str(tmp_path))
    with pytest.raises(UserError) as error:
        connect_encoder("clip").map(photograph())
    assert "hf download openai/clip-vit-large-patch14-336 --local-dir" in str(error.value)
    assert "clip:FOLDER" in str(error.value)


def test_a_folder_that_is_not_there_is_refused():
    for spec in ("clip:/no/such/folder", "clip:folder", "dinov2:~/nowhere"):
        with pytest.raises(UserError, match="There is no folder"):
            connect_encoder(spec)
