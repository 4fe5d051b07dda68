"""SAM 2 and SAM 3 with few random weights, saved as their authors publish them."""

import json

from tiny_models import LETTERS

MEAN, DEVIATION = [0.485, 0.456, 0.406], [0.229, 0.224, 0.225]


def save_sam2(folder, seed=0):
    import torch
    from transformers import Sam2Config, Sam2Model

    torch.manual_seed(seed)
    backbone = dict(
        hidden_size=8,
        num_attention_heads=1,
        image_size=[64, 64],
        blocks_per_stage=[1, 1, 2, 1],
        embed_dim_per_stage=[8, 16, 32, 64],
        num_attention_heads_per_stage=[1, 1, 2, 2],
        window_size_per_stage=[4, 4, 2, 2],
        global_attention_blocks=[3],
        window_positional_embedding_background_size=[4, 4],
    )
    vision = dict(
        backbone_config=backbone | {"model_type": "sam2_hiera_det_model"},
        backbone_channel_list=[64, 32, 16, 8],
        backbone_feature_sizes=[[16, 16], [8, 8], [4, 4]],
        fpn_hidden_size=32,
    )
    config = Sam2Config(
        vision_config=vision,
        prompt_encoder_config=dict(hidden_size=32, image_size=64, patch_size=16),
        mask_decoder_config=dict(
            hidden_size=32,
            mlp_dim=32,
            num_hidden_layers=1,
            num_attention_heads=2,
            iou_head_depth=2,
            iou_head_hidden_dim=16,
        ),
    )
    Sam2Model(config).save_pretrained(folder)
    (folder / "preprocessor_config.json").write_text(json.dumps({"image_mean": MEAN, "image_std": DEVIATION}))
    return folder


def save_sam3(folder, seed=0):
    import torch
    from transformers import CLIPTokenizer, Sam3Config, Sam3Model
    from transformers.convert_slow_tokenizer import bytes_to_unicode

    torch.manual_seed(seed)
    letters = list(bytes_to_unicode().values())
    assert len(letters) == LETTERS
    vocabulary = {c: i for i, c in enumerate(letters + [f"{c}</w>" for c in letters])}
    start, end = len(vocabulary), len(vocabulary) + 1
    vocabulary |= {"<|startoftext|>": start, "<|endoftext|>": end}
    CLIPTokenizer(vocab=vocabulary, merges=[]).save_pretrained(folder)
    small = dict(hidden_size=32, num_attention_heads=2, intermediate_size=32, dropout=0.0)
    backbone = dict(
        model_type="sam3_vit_model",
        hidden_size=32,
        intermediate_size=64,
        num_hidden_layers=2,
        num_attention_heads=2,
        image_size=56,
        patch_size=14,
        window_size=2,
        global_attn_indexes=[1],
        pretrain_image_size=56,
    )
    text = dict(
        model_type="clip_text_model",
        hidden_size=32,
        intermediate_size=64,
        projection_dim=16,
        num_hidden_layers=1,
        num_attention_heads=2,
        vocab_size=end + 1,
        max_position_embeddings=32,
        bos_token_id=start,
        eos_token_id=end,
    )
    config = Sam3Config(
        vision_config=dict(
            backbone_config=backbone, fpn_hidden_size=32, backbone_feature_sizes=[[16, 16], [8, 8], [4, 4]]
        ),
        text_config=text,
        geometry_encoder_config=small | {"num_layers": 1, "roi_size": 3},
        detr_encoder_config=small | {"num_layers": 1},
        detr_decoder_config=small | {"num_layers": 1, "num_queries": 5},
        mask_decoder_config=dict(hidden_size=32, num_attention_heads=2),
    )
    Sam3Model(config).save_pretrained(folder)
    (folder / "processor_config.json").write_text(
        json.dumps({"image_processor": {"image_mean": [0.5] * 3, "image_std": [0.5] * 3}})
    )
    return folder
