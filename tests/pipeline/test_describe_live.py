"""Real objects described by a model behind a server on this machine."""

import json
import re
import sys
from pathlib import Path

import pytest

from corporeal import materials
from corporeal.description.describe_config import DescribeConfig
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.ground import ground
from corporeal.pipeline.stages.segment import segment
from corporeal.showcase.showcase_scenes import build_showcase_scene
from scripted_model import decomposed, part, weighs

sys.path.insert(0, str(Path(__file__).parents[1] / "vlm"))
from fake_server import FakeServer

NAMES = ("armchair_kaolin", "plant_potted_market", "lamp_barn_khronos", "flight_helmet_khronos")
ONE_PIECE = "duck_khronos"


def answers(request):
    """Answer each of the questions as its text asks."""
    text = json.loads(json.dumps(request.body["messages"][-1]["content"]))
    text = text if isinstance(text, str) else next(c["text"] for c in text if "text" in c)
    return {"content": json.dumps(_answer(text))}


def _answer(text):
    if "Which parts does it have?" in text:
        return decomposed(["body", "beak"], ["duck"])
    if "Rank all" in text:
        return {"ranking": [{"number": n, "reason": "So it looks."} for n in (1, 2)]}
    if "What may each of its parts be made of" in text:
        named = re.search(r"^Parts: (.*)$", text, flags=re.MULTILINE)[1].split("; ")
        shares = {"volume_share": 1 / len(named), "surface_share": 1 / len(named)}
        shares = shares if "volume_share: what lies" in text else {}
        return {"parts": [part(re.sub(r" \(.*\)$", "", name), "leather", **shares) for name in named]}
    if "Then judge what the whole object weighs" in text:
        a, b, c, unit = re.search(r"are ([\d.]+) × ([\d.]+) × ([\d.]+) (c?m)", text).groups()
        box = float(a) * float(b) * float(c) * (1e-6 if unit == "cm" else 1.0)
        return weighs(50 * box, 100 * box, 200 * box)  # as furniture is, for its box
    if "How large is the real thing" in text:
        classes = re.findall(r"^- (.+)$", text, flags=re.MULTILINE)
        return {"classes": [{"class_name": c, "metres": 0.4} for c in classes]}
    blocks = re.split(r"^Part ", text, flags=re.MULTILINE)[1:]
    return {
        "parts": [
            {
                "part": block.split(":\n", 1)[0],
                "values": [
                    {"quantity": q, "fraction": 0.8, "reason": "Worn leather."}
                    for q in re.findall(r"^- (\w+): ", block, flags=re.MULTILINE)
                ],
            }
            for block in blocks
        ]
    }


@pytest.fixture(scope="module")
def described(shared_assets, tmp_path_factory):
    """Five real objects, described twice: (scene, inventory, requests, folder of recordings)."""
    folder = tmp_path_factory.mktemp("described")
    scene = assemble([shared_assets / "objects" / f"{n}.glb" for n in (*NAMES, ONE_PIECE)])
    with pytest.MonkeyPatch.context() as patched, FakeServer(answers) as server:
        patched.setenv("CORPOREAL_CACHE", str(folder / "cache"))
        spec = f"openai:gpt-5.4@{server.url}"
        inventory = describe(scene, DescribeConfig(vlm=spec, record=folder, view_size=64))
        sent = list(server.requests)
        again = describe(scene, DescribeConfig(vlm=spec, view_size=64))
        assert again.objects == inventory.objects
        assert len(server.requests) == len(sent)  # the second time everything is in the cache
    return scene, inventory, sent, folder


@pytest.mark.slow
def test_real_objects_of_many_parts_are_described_placed_and_grounded(described):
    scene, inventory, sent, _ = described
    tasks = [row["task"] for row in inventory.transcript]
    assert {t: tasks.count(t) for t in set(tasks)} == {
        "parts": 1,
        "ranking": 1,
        "materials": 5,
        "placement": 5,
        "mass": 5,
        "extents": 1,
    }
    assert [len(o.parts) for o in inventory.objects[:4]] == [2, 3, 3, 6]
    assert inventory.usage.calls == len(sent) == len(tasks)
    assert inventory.usage.input_tokens == 1200 * len(tasks)
    parts = segment(scene, inventory)
    field = ground(scene, parts, inventory)
    for material, words in zip(field.materials, field.words, strict=True):
        assert (material.name, words.answered_by) == ("leather", "model")
        for name, why in material.grounds.items():
            assert why.value in why.range
            assert materials.citation(why.range.source) != why.range.source
            assert why.margin == 0.7
            chosen = name in ("young_pa", "density", "poisson")
            assert why.chosen_by == ("model" if chosen else "typical")
            assert why.reason == ("Worn leather." if chosen else why.reason)
        density = material.grounds["density"]
        low, high = density.range.low, density.range.high
        assert density.value == pytest.approx(low + 0.8 * (high - low))
    said = materials.materials_json(field, parts)["parts"][0]["values"]["young_pa"]
    assert (said["place"], said["chosen_by"], said["margin"]) == (0.8, "model", 0.7)
    assert any("--extent" in w for w in inventory.warnings)


@pytest.mark.slow
def test_what_was_recorded_of_real_objects_replays_without_a_server(described):
    scene, inventory, _, folder = described
    again = describe(scene, DescribeConfig(vlm=f"replay:{folder}", view_size=64))
    assert {p.answered_by for o in again.objects for p in o.parts} == {"recording"}
    assert [(p.material, p.name) for o in again.objects for p in o.parts] == [
        (p.material, p.name) for o in inventory.objects for p in o.parts
    ]


@pytest.mark.slow
def test_pictures_go_out_only_with_the_questions_that_need_them(described):
    _, inventory, sent, _ = described
    pictures = sorted(request.pictures for request in sent)
    tasks = [row["task"] for row in inventory.transcript]
    assert pictures.count(0) == tasks.count("extents")
    assert pictures.count(5) == 12  # objects of several parts: four views, and parts in colours
    assert pictures.count(4) == 5  # the duck: parts, ranking, materials, placement, mass
    for request in sent:
        assert "/objects/" not in request.text
        assert str(Path.home()) not in request.text


def test_our_own_armchair_is_described_by_a_model_too(tmp_path, monkeypatch):
    monkeypatch.setenv("CORPOREAL_CACHE", str(tmp_path))
    scene = build_showcase_scene("vase-ball-armchair")
    with FakeServer(answers) as server:
        config = DescribeConfig(vlm=f"openai:gpt-5.4@{server.url}", view_size=32)
        inventory = describe(scene, config)
    field = ground(scene, segment(scene, inventory), inventory)
    assert {m.name for m in field.materials} == {"leather"}
    assert {w.answered_by for w in field.words} == {"model"}
    assert all(g.value in g.range for m in field.materials for g in m.grounds.values())
