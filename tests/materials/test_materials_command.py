"""`corporeal materials` as a person types it."""

import pytest
from test_library_lint import PLANTED, SOFT, SOUND  # type: ignore[import-not-found]


@pytest.fixture
def typed(monkeypatch, command, tmp_path):
    monkeypatch.chdir(tmp_path)

    def run(*words):
        code, said = command("materials", *words)
        return code, said.out, said.err

    return run


def test_a_sound_library_passes_and_is_shown(typed, tmp_path):
    (tmp_path / "mine.toml").write_text(SOUND)
    assert typed("check", "mine.toml")[:2] == (0, "mine.toml: no errors found.\n")
    code, out, _ = typed("--library", "mine.toml")
    assert code == 0
    assert "lamp_steel" in out
    assert "brass" not in out
    assert "Our tensile test" in typed("show", "lamp-steel", "--library", "mine.toml")[1]


def test_a_merged_library_holds_ours_too(typed, tmp_path):
    (tmp_path / "mine.toml").write_text('extends = "default"\n' + SOUND)
    out = typed("--library", "mine.toml")[1]
    assert "lamp_steel" in out
    assert "brass" in out


@pytest.mark.parametrize("mistake", ["swapped", "incompressible", "no source", "MPa for GPa"])
def test_a_mistake_ends_with_code_2_and_says_where_and_what_to_do(typed, tmp_path, mistake):
    (before, after), told = PLANTED[mistake]
    (tmp_path / "mine.toml").write_text(SOUND.replace(before, after, 1))
    code, _, err = typed("check", "mine.toml")
    assert code == 2
    assert told in err
    assert "line " in err
    assert typed("--library", "mine.toml")[0] == 2, "and it is not used"


def test_a_loss_factor_that_contradicts_the_restitution_ends_with_code_2(typed, tmp_path):
    (tmp_path / "mine.toml").write_text(SOFT)
    code, _, err = typed("check", "mine.toml")
    assert code == 2
    assert "[squashy] restitution: 0.1 to 0.5 contradicts the loss factor" in err
    (tmp_path / "mine.toml").write_text(SOFT.replace("high = 0.5,", "high = 0.7,"))
    assert typed("check", "mine.toml")[0] == 0


def test_what_cannot_be_read_is_reported(typed, tmp_path):
    assert "cannot be read" in typed("check", "absent.toml")[2]
    (tmp_path / "a.toml").write_bytes(b"\xff\xfe")
    assert typed("check", "a.toml")[0] == 2
    assert "corporeal materials check FILE" in typed("chekc", "a.toml")[2]


def test_a_material_is_shown_with_its_sources_and_measured_pairs(typed):
    out = typed("show", "plywood")[1]
    assert "wood-handbook (read): USDA" in out
    assert "as wood on metal: 0.2–0.5 (0.3)" in out


def test_uses_are_shown_where_the_library_allows_them(typed):
    assert "tool, spring, blade: hardened: yield stress 700–1155 MPa" in typed("show", "steel")[1]
    published = typed("show", "steel", "--library", "reference")[1]
    assert "food tin, lid: soft tinplate: yield stress 250–450 MPa" in published
    assert "hardened" not in published
