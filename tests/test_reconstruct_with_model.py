"""The whole way from a splat with a model that is asked: what there is, and what it is made of."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from corporeal.cli.validate_settings import validate_settings
from corporeal.description.describe_config import DescribeConfig
from corporeal.geometry.gaussian_transforms import transform_gaussians
from corporeal.io.splat.splat_ply import write_splat_ply
from corporeal.pipeline.run_pipeline import Settings, open_run
from corporeal.reconstruction.reconstruct_config import ReconstructConfig, ReconstructionResolution
from gaussian_boxes import DOWN, box, together
from scripted_model import decomposed, part, weighs

sys.path.insert(0, str(Path(__file__).parent / "vlm"))
from fake_server import FakeServer

RED, BLUE, YELLOW = (0.8, 0.1, 0.1), (0.1, 0.2, 0.8), (0.9, 0.8, 0.1)
SMALL = ("--width", "128", "--height", "96", "--duration", "0.05", "--fps", "20", "--view-size", "64")
THINGS = (("post", "blue below, yellow above", 0.3), ("crate", "red", 0.4))
MADE_OF = {"blue base": "steel", "yellow top": "rubber", "crate": "wood"}


def text_of(request):
    said = request.body["messages"][-1]["content"]
    return said if isinstance(said, str) else next(c["text"] for c in said if "text" in c)


def answer(text):
    """Say that there are two things, and that the blue and yellow one has two parts."""
    if "Which separate things" in text:
        return {"things": [{"class_name": n, "look": k, "metres": m} for n, k, m in THINGS]}
    if "Which thing is each region?" in text:
        return {"regions": [{"colour": "red", "thing": 2}, {"colour": "blue", "thing": 1}]}
    if "Which parts does it have?" in text:
        return decomposed(["crate"] if "crate" in text else ["blue base", "yellow top"])
    if "What may each of its parts be made of" in text:
        named = re.search(r"^Parts: (.*)$", text, flags=re.MULTILINE)[1].split("; ")
        named = [re.sub(r" \(.*\)$", "", name) for name in named]
        shares = {"volume_share": 1 / len(named), "surface_share": 1 / len(named)}
        shares = shares if "volume_share: what lies" in text else {}
        return {"parts": [part(n, MADE_OF[n], **shares) for n in named]}
    if "Then judge what the whole object weighs" in text:
        return weighs(1.0, 5.0, 100.0)
    if "How large is the real thing" in text:
        return {"classes": [{"class_name": n, "metres": m} for n, _, m in THINGS]}
    blocks = re.split(r"^Part ", text, flags=re.MULTILINE)[1:]
    place = {"fraction": 0.8, "reason": "So it looks."}
    return {
        "parts": [
            {
                "part": block.split(":\n", 1)[0],
                "values": [{"quantity": q} | place for q in re.findall(r"^- (\w+): ", block, flags=re.MULTILINE)],
            }
            for block in blocks
        ]
    }


@pytest.mark.slow
def test_a_model_counts_names_and_takes_apart_what_a_splat_shows(monkeypatch, tmp_path):
    monkeypatch.setenv("CORPOREAL_CACHE", str(tmp_path / "cache"))
    coarse = ReconstructionResolution(16, (160, 160), object_grid_cells=250_000)
    crate = box((0.4, 0.3, 0.2), (0.0, 0.0, 0.1), RED)
    base = box((0.16, 0.16, 0.15), (0.35, 0.1, 0.075), BLUE)
    top = box((0.16, 0.16, 0.15), (0.35, 0.1, 0.225), YELLOW)
    splat = tmp_path / "boxes.ply"
    write_splat_ply(splat, transform_gaussians(together(crate, base, top), DOWN, 2.0))
    with FakeServer(lambda request: {"content": json.dumps(answer(text_of(request)))}) as server:
        asking = DescribeConfig(vlm=f"openai:gpt-5.4@{server.url}", view_size=64)
        settings = Settings(describe=asking, reconstruct=ReconstructConfig(resolution=coarse))
        folder = tmp_path / "run"
        validate_settings(folder, settings)
        with open_run([splat], folder, settings, lambda verb: lambda *_: None, "ground") as done:
            scene, parts, field = done.made.scene, done.made.parts, done.made.field
    rows = zip(parts.catalogue, field.materials, field.words, strict=True)
    assert [(p.object, p.name, m.name, w.answered_by) for p, m, w in rows] == [
        (0, "crate", "wood", "model"),
        (1, "blue base", "steel", "model"),
        (1, "yellow top", "rubber", "model"),
    ]
    assert [(o.name, o.real_extent) for o in scene.objects] == [
        ("crate", pytest.approx(0.4, abs=0.02)),
        ("post", pytest.approx(0.3, abs=0.02)),
    ]
    heights = scene.surfaces[1].vertices[scene.surfaces[1].triangles].mean(axis=1)[:, 2]
    kind = parts.part_of_point[parts.object_of_point == 1]
    assert np.mean((kind == 2) == (heights > 0.15)) > 0.95
