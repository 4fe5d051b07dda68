"""What docs/how-to/add-a-law-material-provider-or-format.md says can be done as it says."""

import re
import sys
from pathlib import Path

import pydantic
import pytest

import corporeal as co
from corporeal import vlm

ROOT = Path(__file__).resolve().parents[1]
HOW_TO = ROOT / "docs" / "how-to"
PAGE = (HOW_TO / "add-a-law-material-provider-or-format.md").read_text(encoding="utf-8")


def blocks(kind):
    """Return the page's blocks of one kind, in order."""
    return re.findall(rf"^```{kind}\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)


def test_every_file_that_it_names_is_there():
    named = re.findall(r"`((?:examples|tests|src)/[\w/.]+)", PAGE)
    named += re.findall(r"(?:tests|examples)/[\w/.]+", "".join(blocks("")))
    rooms = re.findall(r"`((?:mpm|materials|vlm|io)/[\w/]+\.\w+)`", PAGE)
    assert len(named) > 8 and len(rooms) > 8
    for name in named:
        assert (ROOT / name).exists(), name
    for name in rooms:
        assert "NAME" in name or (ROOT / "src" / "corporeal" / name).exists(), name


def test_the_material_passes_the_check(tmp_path, command):
    (toml,) = blocks("toml")
    (tmp_path / "mine.toml").write_text(toml)
    code, said = command("materials", "check", tmp_path / "mine.toml")
    assert code == 0, said.err
    (tmp_path / "mine.toml").write_text(toml.replace("typical = 1.0", "typical = 100.0"))
    assert command("materials", "check", tmp_path / "mine.toml")[0] != 0


def test_the_provider_answers_and_is_held_to_its_answers(tmp_path, monkeypatch):
    provider, connect, _ = blocks("python")
    (tmp_path / "my_provider.py").write_text(provider)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(vlm, "VLM_CLIENTS", dict(vlm.VLM_CLIENTS))
    made = {}
    exec(connect, made)
    assert isinstance(made["model"], vlm.VlmClient)
    shape = pydantic.create_model("Size", __base__=vlm.AnswerSchema, largest_m=(float, ...))
    question = vlm.Question("size", "How large is it?", "a crate")
    reply = made["model"].ask(question, shape)
    assert (reply.answer.largest_m, reply.model) == (0.2, "mine:small")
    with pytest.raises(vlm.UnansweredError, match="too small"):
        made["model"].ask(question, shape, lambda _: ["too small"])
    del sys.modules["my_provider"]


def test_the_model_becomes_a_glb(tmp_path, monkeypatch):
    *_, model = blocks("python")
    monkeypatch.chdir(tmp_path)
    exec(model, {})
    assert [thing.name for thing in co.load_scene(tmp_path / "wedge.glb").objects] == ["wedge"]
