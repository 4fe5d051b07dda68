"""What a person types to make a pool and to look at it."""

from functools import partial

import numpy as np
import pytest
from PIL import Image

from corporeal.pool.pool_index import read_pool
from corporeal.render.contact_sheet import SheetTile, write_contact_sheet
from pool_models import plain_ball


@pytest.fixture
def typed(monkeypatch, tmp_path, command):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    (tmp_path / "in" / "ball").mkdir(parents=True)
    for k in range(3):
        data = plain_ball(0.1 + 0.01 * k, copyright="CC0, by Ada" if k else "")
        (tmp_path / "in" / "ball" / f"ball{k}.glb").write_bytes(data)
    (tmp_path / "in" / "ball" / "broken.glb").write_bytes(b"glTF")
    return partial(command, "assets")


def test_a_pool_is_made_listed_and_drawn(typed, tmp_path):
    code, text = typed("index", "in")
    assert code == 0, text.err
    assert text.out.splitlines() == [
        "pool: 3 assets of 1 class, 1 rejected.",
        "Of 1 asset neither licence nor author is known.",
        "The reason: corporeal assets list --pool pool --rejected",
    ]
    assert len(read_pool(tmp_path / "pool").assets) == 3

    code, text = typed("list", "--class", "ball")
    assert code == 0
    assert all(word in text.out for word in ("3 assets of 1 class", "ball2", "24 cm", "CC0"))
    assert "unknown" in text.out

    code, text = typed("list", "--rejected")
    assert "1 rejected" in text.out and "broken.glb" in text.out and "header" in text.out

    code, text = typed("show", "ball1", "ball0", "--size", "64")
    assert code == 0 and text.out.strip() == "pool/assets.png"
    page = np.asarray(Image.open(tmp_path / "pool" / "assets.png").convert("RGB"))
    assert page.shape[1] == 2 * (64 + 14) + 14
    first = page[14:78, 14:78].astype(int)
    assert np.ptp(first) > 40, "there is something to be seen"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("shwo",), "Choose one of: index, list, "),
        (("index",), "Name at least one folder"),
        (("index", "nowhere"), "no such folder"),
        (("list", "--pool", "nowhere"), "there is no asset pool"),
        (("show", "--pool", "nowhere"), "there is no asset pool"),
        (("index", "in", "--from", "abo"), "abo-3dmodels.tar"),
        (("index", "in", "--from", "objaverse"), "object-paths.json.gz is not there"),
        (("index", "in", "--csv", "in/ball/broken.glb"), "no column 'file'"),
    ],
)
def test_a_slip_is_one_line_that_helps(typed, words, said):
    code, text = typed(*words)
    assert code == 2
    assert said in text.err and "Traceback" not in text.err


def test_unknown_names_and_classes_show_the_menu(typed):
    typed("index", "in")
    assert "Choose one of: ball0, ball1, ball2" in typed("show", "duck")[1].err
    assert "Choose one of: ball." in typed("list", "--class", "duck")[1].err


def test_an_empty_pool_says_where_the_reasons_are(typed, tmp_path):
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / "x.glb").write_bytes(b"")
    code, text = typed("index", "bad")
    assert code == 0 and "0 assets of 0 classes, 1 rejected" in text.out
    code, text = typed("show")
    assert code == 2 and "assets list" in text.err


@pytest.mark.parametrize("count", [1, 2, 7])
def test_a_sheet_has_a_place_for_every_tile(tmp_path, count):
    shades = np.linspace(10, 200, count).astype(np.uint8)
    tiles = [SheetTile(np.full((40, 40, 3), c, np.uint8), "x" * 99, ("a",)) for c in shades]
    write_contact_sheet(tiles, tmp_path / "sheet.png", columns=3)
    page = np.asarray(Image.open(tmp_path / "sheet.png"))
    down = 40 + 2 * 17 + 14 + 4
    middles = [page[14 + k // 3 * down + 20, 14 + k % 3 * 54 + 20, 0] for k in range(count)]
    assert middles == shades.tolist()
    beside = page[14 : 14 + down, 14 + 40 : 14 + 52]
    assert (beside == 255).all(), "a caption that is too long is cut"
