import itertools

import matplotlib
import numpy as np
import pytest
import trimesh
from matplotlib import font_manager
from matplotlib.ft2font import FT2Font
from PIL import Image

from corporeal.core.errors import UserError
from corporeal.core.types import (
    Finish,
    Law,
    Material,
    MaterialField,
    Part,
    PartDescription,
    Parts,
    Scene,
    SceneObject,
    Structure,
    Surface,
    Video,
)
from corporeal.render import colours, figures, video_file
from corporeal.render.figure_legends import drawable_name
from corporeal.render.figures import fields_figure, si_prefix_text, write_filmstrip

STEEL = (0.4409, 0.8171, 0.681)
"""Its colour in every figure ever printed."""


def row_of_blocks(count, names=None):
    surfaces, made = [], []
    for k in range(count):
        m = trimesh.creation.box(bounds=[[0, k, 0], [0.7, k + 0.7, 0.7]])
        surfaces.append(Surface(f"block_{k}", 0, 0, np.asarray(m.vertices), np.asarray(m.faces)))
        name = names[k] if names else f"material_number_{k}_of_a_long_name"
        law = list(Law)[k % len(Law)]
        made.append(Material(name, law, 10.0 ** (4 + k % 8), 0.1 + 0.01 * k, 100.0 + 300 * k))
    scene = Scene("row", "", (SceneObject("row_0", "row", 1.0),), tuple(surfaces), (Finish("plain"),))
    part = np.repeat(np.arange(count), [len(s.triangles) for s in surfaces])
    catalogue = tuple(Part(f"block_{k}", 0, "node") for k in range(count))
    parts = Parts(part * 0, part, np.ones(len(part)), catalogue)
    words = tuple(PartDescription(m.name, m.name) for m in made)
    pair = np.full((count + 1, count + 1), 0.5)
    solid = (Structure("solid"),) * count
    return scene, parts, MaterialField(tuple(made), solid, words, pair, pair)


COARSE = (130, 98)
"""Small pictures: the layout of the page does not depend on them [px]."""


@pytest.mark.parametrize("count", [1, 30])
def test_the_figure_takes_any_number_of_parts(count, tmp_path):
    scene, parts, field = row_of_blocks(count)
    fields_figure(scene, parts, field, tmp_path / "fields.png", COARSE)
    picture = np.asarray(Image.open(tmp_path / "fields.png").convert("RGB"))
    assert picture.shape[0] > 800 and picture.shape[1] > 1200
    edge = np.concatenate([picture[:, 0], picture[:, -1], picture[0], picture[-1]])
    assert (edge == 255).all(), "nothing may run over the edge of the paper"


def apart(one, other):
    return one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]


@pytest.mark.parametrize("count", [1, 2, 30])
def test_no_label_covers_another(tmp_path, monkeypatch, count):
    drawn, place = [], figures.panel_legend
    monkeypatch.setattr(figures, "panel_legend", lambda *asked: drawn.append((asked[2], place(*asked))) or drawn[-1][1])
    fields_figure(*row_of_blocks(count), tmp_path / "fields.png", COARSE)
    wide, high = figures.SHEET_PANEL_SIZE_PX
    pictures = [(x, y, x + wide, y + high) for (x, y), _ in drawn]
    labels = [line.box() for _, key in drawn for line in key.lines]
    swatches = [(*s.corner, *np.add(s.corner, s.size)) for _, key in drawn for s in key.swatches]
    assert len(pictures) == 6 and len(labels) > {1: 0, 2: 12, 30: 20}[count]
    for a, b in itertools.combinations(labels, 2):
        assert apart(a, b)
    for a, b in itertools.product(labels, [*pictures, *swatches]):
        assert apart(a, b)
    for left, top, right, bottom in labels + swatches + pictures:
        assert 0 <= left and 0 <= top
        assert right <= figures.SHEET_SIZE_PX[0] and bottom <= figures.SHEET_SIZE_PX[1]


def test_what_is_seen_most_leads_its_legend_beside_its_colour():
    panel = figures.CategoryPanel("Material", ["a", "b", "c"], [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
    key = figures.panel_legend(panel, np.array([1, 9, 4]), (0, 0))
    title, *names = key.lines
    assert title.text == "Material" and [line.text for line in names] == ["b", "c", "a"]
    assert [s.colour.argmax() for s in key.swatches] == [1, 2, 0]
    for line, swatch in zip(names, key.swatches, strict=True):
        assert 0 < line.place[0] - swatch.corner[0] < 30
        assert swatch.corner[1] < line.place[1] < swatch.corner[1] + swatch.size[1]


def test_a_scale_says_its_ends_and_on_a_logarithmic_one_the_middle_of_the_decades():
    panel = figures.NumericPanel("E", "Pa", [1e3, 1e9], log=True)
    key = figures.panel_legend(panel, np.zeros(2), (0, 0))
    assert [line.text for line in key.lines[1:]] == ["1 kPa", "1 MPa", "1 GPa"]
    bar = key.swatches[0]
    assert key.lines[2].place[0] == bar.corner[0] + bar.size[0] / 2
    assert bar.colour[0, 2] > bar.colour[0, 0] and bar.colour[-1, 0] > bar.colour[-1, 2]
    one = figures.panel_legend(figures.NumericPanel("ν", "", [0.3, 0.3]), np.zeros(2), (0, 0))
    assert [line.text for line in one.lines] == ["ν", "0.3"]


def test_colours_of_a_scale_are_those_of_matplotlib():
    share = np.linspace(0, 1, 1001)
    theirs = matplotlib.colormaps["turbo"](0.04 + 0.92 * share)[:, :3]
    assert np.array_equal(colours.ramp_colours(share), theirs)


def test_a_material_has_the_same_colour_in_every_scene():
    assert np.allclose(colours.distinct_colours(["steel"])[0], STEEL, atol=2e-3)
    # Hardwood and paper are two blues by themselves; the later one gives way.
    wood, paper, again = colours.distinct_colours(["hardwood", "paper", "hardwood"])
    assert wood == again == colours.distinct_colours(["hardwood"])[0] and paper != wood
    assert np.linalg.norm(np.subtract(wood, paper)) > 0.3
    names = ("steel", "rubber", "hardwood", "glass", "mud", "ceramic")
    for a, b in itertools.combinations(names, 2):
        assert np.linalg.norm(np.subtract(*(colours.distinct_colours([n])[0] for n in (a, b)))) > 0.08


def test_turbo_runs_from_the_lowest_to_the_highest_on_a_logarithmic_scale():
    shown, low, high = colours.turbo([1e3, 1e6, 1e9], log=True)
    assert (low, high) == (1e3, 1e9)
    assert shown[0, 2] > shown[0, 0] and shown[2, 0] > shown[2, 2]
    assert shown[1, 1] > 0.9, "half the decades is the middle of the scale"
    same, _, _ = colours.turbo([7.0, 7.0], log=False)
    assert np.array_equal(same[0], same[1])


def test_numbers_are_written_as_people_read_them():
    assert si_prefix_text(2.07e11, "Pa") == "207 GPa"
    assert si_prefix_text(5e3, "Pa") == "5 kPa"
    assert si_prefix_text(7850, "kg/m³") == "7850 kg/m³"
    assert si_prefix_text(0.37, "") == "0.37"


def test_a_strip_shows_the_video_from_first_to_last_frame(tmp_path):
    path = tmp_path / "video.mp4"
    with video_file.open_video(path, 10, (64, 48)) as reel:
        for k in range(11):
            reel.add(np.full((48, 64, 3), 20 * k, np.uint8))
    write_filmstrip(Video(path, 10, 64, 48), tmp_path / "strip.png", count=6, width=64)
    picture = np.asarray(Image.open(tmp_path / "strip.png").convert("RGB")).astype(int)
    centres = picture[24, 32 :: 64 + 6].mean(axis=1)
    assert len(centres) == 6
    assert np.abs(centres - np.arange(0, 201, 40)).max() < 8
    assert (picture[24, 64:70] == 255).all(), "a white gap"


def test_a_short_video_gives_a_short_strip_and_a_broken_one_a_clear_sentence(tmp_path):
    path = tmp_path / "video.mp4"
    with video_file.open_video(path, 10, (64, 48)) as reel:
        reel.add(np.zeros((48, 64, 3), np.uint8))
    write_filmstrip(Video(path, 10, 64, 48), tmp_path / "strip.png", width=64)
    assert Image.open(tmp_path / "strip.png").size[0] == 64
    path.write_bytes(b"not a video")
    with pytest.raises(UserError, match="Make it again"):
        write_filmstrip(Video(path, 10, 64, 48), tmp_path / "strip.png")


def test_a_name_that_the_font_cannot_write_is_a_number():
    assert drawable_name("мяч 0", "object 1") == "мяч 0"
    assert drawable_name("椅子 0", "object 2") == "object 2"


def test_letters_that_are_drawn_are_those_of_the_font():
    here = FT2Font(font_manager.findfont(font_manager.FontProperties())).get_charmap()
    letters = [chr(code) for code in (*range(0xA1, 0x5F5, 3), *range(0x4E00, 0x4E40))]
    told = [drawable_name(letter, "") == letter for letter in letters]
    assert told == [ord(letter) in here for letter in letters]
    assert any(told) and not all(told)
