"""Models of the real kinds with few random weights, saved as the hub would hold them."""

import json
from importlib.util import find_spec

import pytest

LETTERS = 256
SIDE, PATCH = 56, 14
STATISTICS = {"image_mean": [0.48, 0.46, 0.41], "image_std": [0.27, 0.26, 0.28]}


def needs_models():
    """Mark what needs the extra."""
    missing = [name for name in ("torch", "transformers") if find_spec(name) is None]
    reason = f"{' and '.join(missing)} not installed: pip install 'corporeal[learned]'"
    return pytest.mark.skipif(bool(missing), reason=reason)


def save_clip(folder, seed=0):
    import torch
    from transformers import CLIPConfig, CLIPModel, CLIPTokenizer
    from transformers.convert_slow_tokenizer import bytes_to_unicode

    torch.manual_seed(seed)
    letters = list(bytes_to_unicode().values())
    vocabulary = {c: i for i, c in enumerate(letters + [f"{c}</w>" for c in letters])}
    start, end = len(vocabulary), len(vocabulary) + 1
    vocabulary |= {"<|startoftext|>": start, "<|endoftext|>": end}
    CLIPTokenizer(vocab=vocabulary, merges=[]).save_pretrained(folder)
    text = dict(
        hidden_size=32,
        intermediate_size=64,
        num_hidden_layers=2,
        num_attention_heads=2,
        vocab_size=end + 1,
        max_position_embeddings=40,
        bos_token_id=start,
        eos_token_id=end,
    )
    vision = dict(
        hidden_size=48,
        intermediate_size=96,
        num_hidden_layers=3,
        num_attention_heads=4,
        image_size=SIDE,
        patch_size=PATCH,
    )
    model = CLIPModel(CLIPConfig(text_config=text, vision_config=vision, projection_dim=24))
    for weights in model.parameters():
        weights.data += 0.05 * torch.randn_like(weights)
    model.save_pretrained(folder)
    (folder / "preprocessor_config.json").write_text(json.dumps(STATISTICS))
    return folder


def save_dinov2(folder, seed=0):
    import torch
    from transformers import Dinov2Config, Dinov2Model

    torch.manual_seed(seed)
    config = Dinov2Config(hidden_size=48, num_hidden_layers=2, num_attention_heads=4, image_size=SIDE, patch_size=PATCH)
    Dinov2Model(config).save_pretrained(folder)
    (folder / "preprocessor_config.json").write_text(json.dumps(STATISTICS))
    return folder
