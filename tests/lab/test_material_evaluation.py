"""`corporeal evaluate materials`: any files, any truth, any model."""

import json
import sys

import pytest

from corporeal import cli
from corporeal.core.errors import BadFileError, UserError
from corporeal.description.describe_config import DescribeConfig
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.lab.evaluation.material_evaluation import evaluate_materials, read_material_truth, recognition_record
from sample_scenes import plain, scene

TRUTH = """
[oak_table]
"oak table" = ["oak", "wood"]

[set.vase]
vase = ["glass"]

[set.thing]
thing = ["steel"]
"""


@pytest.fixture
def folder(tmp_path):
    for name in ("oak_table", "vase", "thing", "unjudged"):
        made = scene((f"{name}_0", [("mesh", plain(), {})]), name=name)
        write_glb(tmp_path / f"{name}.glb", made)
    (tmp_path / "truth.toml").write_text(TRUTH)
    return tmp_path


def quiet(fraction, words):
    pass


def test_parts_are_right_wrong_or_unknown(folder):
    truth = read_material_truth(folder / "truth.toml")
    assert truth["oak_table"] == {"oak table": ("hardwood", "wood")}
    rows = evaluate_materials(folder, truth, DescribeConfig(), "default", quiet)
    assert {r.file: r.verdict for r in rows} == {"oak_table": "right", "vase": "wrong", "thing": "unknown"}
    scores = recognition_record(rows)["scores"]
    assert scores["right"] == scores["wrong"] == scores["unknown"] == pytest.approx(1 / 3)
    assert scores["ordering"] == 1.0


def test_a_person_types_it_and_gets_a_table_and_data(folder, monkeypatch, capsys):
    words = ["materials", str(folder), "--truth", str(folder / "truth.toml")]
    monkeypatch.setattr(sys, "argv", ["corporeal", "evaluate", *words, "--json", str(folder / "out.json")])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 0
    shown = capsys.readouterr().out
    assert "33%" in shown
    assert "ceramic" in shown
    said = json.loads((folder / "out.json").read_text())
    assert [r["verdict"] for r in said["rows"]] == ["right", "unknown", "wrong"]


@pytest.mark.parametrize(
    ("said", "told"),
    [
        ("[oak_table]\n'oak table' = 'wood'", "not a list of materials"),
        ("oak_table = 3", "must map part names"),
        ("[a]\nb = ['unobtainium']", "Unknown material 'unobtainium'"),
        ("[a", "cannot be read"),
    ],
)
def test_a_truth_that_says_something_else_is_refused(folder, said, told):
    (folder / "truth.toml").write_text(said)
    with pytest.raises(UserError, match=told):
        read_material_truth(folder / "truth.toml")


def test_a_part_or_a_folder_that_does_not_fit_is_refused(folder):
    wrong = {"vase": {"lid": ("glass",)}}
    with pytest.raises(UserError, match=r"vase has no part 'lid'. Its parts: vase"):
        evaluate_materials(folder, wrong, DescribeConfig(), "default", quiet)
    with pytest.raises(UserError, match="None of the models"):
        evaluate_materials(folder, {"other": {"a": ("glass",)}}, DescribeConfig(), "default", quiet)
    with pytest.raises(BadFileError):
        read_material_truth(folder / "absent.toml")
