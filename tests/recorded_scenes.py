"""Scenes that are described from recorded answers, and what must hold of every number then."""

import json
from pathlib import Path

import pytest

from corporeal import materials
from corporeal.description.describe_config import DescribeConfig
from corporeal.materials.library_entry import citation
from corporeal.materials.quantities import QUANTITIES, question_name
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.ground import UNFIT_PREFIX, ground
from corporeal.pipeline.stages.segment import segment

FOLDER = Path(__file__).parent / "recordings"
KINDS = {"sheet": "shell", "hollow": "shell", "filled": "filled", "solid": "solid", None: "solid"}
KINDS["packed"] = "solid"

FIELD_OF_QUESTION = {question_name(field): field for field in QUANTITIES}


def rows(folder):
    """Every recording of a folder as it lies there."""
    return [json.loads(p.read_text(encoding="utf-8")) for p in sorted(FOLDER.glob(f"{folder}/*"))]


def said(folder, task, about):
    """Part → what was answered about it, as it lies in the file."""
    found = [r["answer"] for r in rows(folder) if (r["task"], r["scene"]) == (task, about)]
    return {p["part"]: p for answer in found for p in answer["parts"]}


def grounded(scene, folder):
    """Describe from recordings, segment and ground: (inventory, field)."""
    inventory = describe(scene, DescribeConfig(vlm=f"replay:{FOLDER / folder}"))
    parts = segment(scene, inventory)
    return inventory, ground(scene, parts, inventory)


def check_answered(scene, inventory):
    """Nothing was asked of anybody, and nothing that matters stayed open."""
    assert {(r["by"], r["model"]) for r in inventory.transcript} == {("recording", "by hand, from the sheets")}
    asked = {(r["task"], r["scene"]) for r in inventory.transcript}
    assert {("materials", f"{scene.name}/{o.name}") for o in scene.objects} <= asked
    assert {("mass", f"{scene.name}/{o.name}") for o in scene.objects} <= asked
    assert all(o.evidence is not None for o in inventory.objects)
    assert ("extents", scene.name) in asked
    assert inventory.usage.calls == 0
    assert not [w for w in inventory.warnings if "no usable answer" in w]


def check_chosen(scene, field, parts, folder):
    """What was answered is what stands in the field, and every number says why."""
    thing = [scene.objects[p.object].name for p in parts]
    for k, words in enumerate(field.words):
        about = f"{scene.name}/{thing[k]}"
        made, placed = said(folder, "materials", about), said(folder, "placement", about)
        leaves = [(p.words, p.material, p.structure) for p in field.pieces[k]]
        for leaf in leaves or [(words, field.materials[k], field.structures[k])]:
            _check_part(leaf, made[leaf[0].name], placed.get(leaf[0].name))
        if leaves:
            outside = [w for w, _, _ in leaves if not (w.inside or w.missing)]
            assert sum(w.volume_share for w in outside) == pytest.approx(1.0, abs=1e-12)
            assert {w.name for w, _, _ in leaves} == set(made)


def _check_part(leaf, said, placed):
    words, material, structure = leaf
    made = max(said["ways"], key=lambda way: way["probability"])
    if made["material"] is None:
        assert words.answered_by in ("metadata", "unknown")
        by = "typical" if words.material else "fallback"
        # What the file names, and no list offers, has its values placed all the same.
        spoken = {"recording"} if placed is not None and words.material else set()
        assert {g.chosen_by for g in material.grounds.values()} == {by} | spoken
    else:
        assert (words.material, material.name) == (made["material"], made["material"])
        assert (words.answered_by, words.margin) == ("recording", made["probability"])
        assert words.reason == made["reason"]
        assert structure.kind == KINDS[made["built"]]
        assert structure.solidity == (made["solidity"] or 1.0)
        assert {h.probability for h in words.hypotheses} == {way["probability"] for way in said["ways"]}
        assert placed is not None
        places = {v["quantity"]: v for v in placed["values"]}
        inside = places.pop("contents_density", None)
        if inside is not None:
            _check_placed(structure.contents.grounds["density"], inside)
            assert structure.contents.name == made["contents"]
        for quantity, place in places.items():
            _check_placed(material.grounds[FIELD_OF_QUESTION[quantity]], place)
        placed_fields = {f for f, g in material.grounds.items() if g.chosen_by == "recording"}
        assert placed_fields == {FIELD_OF_QUESTION[quantity] for quantity in places}
    for thing in (material, structure.contents):
        if thing is not None:
            _check_provenance(thing)


def _check_placed(grounds, place):
    r, f = grounds.range, place["fraction"]
    wide = r.low > 0 and r.high > 10 * r.low
    value = r.low * (r.high / r.low) ** f if wide else r.low + f * (r.high - r.low)
    assert grounds.value == pytest.approx(value, rel=1e-12)
    assert grounds.chosen_by == "recording"
    assert grounds.reason.partition(f" {UNFIT_PREFIX}")[0] == place["reason"]


def _check_provenance(material):
    measured = materials.find_material(material.name).ranges
    assert set(material.grounds) == set(measured)
    for name, grounds in material.grounds.items():
        assert getattr(material, name) == grounds.value
        assert grounds.range == measured[name]
        assert grounds.range.low <= grounds.value <= grounds.range.high
        assert citation(grounds.range.source) != grounds.range.source
        assert grounds.chosen_by in ("recording", "typical", "fallback")
        assert grounds.reason.strip()
        assert 0 <= grounds.margin <= 1
