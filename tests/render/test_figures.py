import itertools

import numpy as np
import pytest
import trimesh
from PIL import Image

from corporeal.errors import UserError
from corporeal.render import colours, figures, video
from corporeal.render.figures import fields_figure, si, strip
from corporeal.render.glyphs import drawable
from corporeal.types import (
    Film,
    Finish,
    Law,
    Material,
    MaterialField,
    Part,
    Parts,
    PartWords,
    Scene,
    SceneObject,
    Structure,
    Surface,
)

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
    scene = Scene(
        "row", "", (SceneObject("row_0", "row", 1.0),), tuple(surfaces), (Finish("plain"),)
    )
    part = np.repeat(np.arange(count), [len(s.triangles) for s in surfaces])
    catalogue = tuple(Part(f"block_{k}", 0, "node") for k in range(count))
    parts = Parts(part * 0, part, np.ones(len(part)), catalogue)
    words = tuple(PartWords(m.name, m.name) for m in made)
    pair = np.full((count + 1, count + 1), 0.5)
    solid = (Structure("solid"),) * count
    return scene, parts, MaterialField(tuple(made), solid, words, pair, pair)


@pytest.fixture
def coarse(monkeypatch):
    """Draw small pictures into the panels: the layout of the page does not depend on them."""
    monkeypatch.setattr(figures, "PANEL", (130, 98))


@pytest.mark.parametrize("count", [1, 30])
def test_the_figure_takes_any_number_of_parts(count, tmp_path, coarse):
    scene, parts, field = row_of_blocks(count)
    fields_figure(scene, parts, field, tmp_path / "fields.png")
    picture = np.asarray(Image.open(tmp_path / "fields.png").convert("RGB"))
    assert picture.shape[0] > 800 and picture.shape[1] > 1200
    edge = np.concatenate([picture[:, 0], picture[:, -1], picture[0], picture[-1]])
    assert (edge == 255).all(), "nothing may run over the edge of the paper"


def texts(axes):
    found = [axes.title, axes._left_title, *(axes.get_xticklabels() if axes.axison else [])]
    legend = axes.get_legend()
    return [t for t in found + (legend.get_texts() if legend else []) if t.get_text()]


def test_no_label_covers_another(tmp_path, monkeypatch, coarse):
    caught = []
    monkeypatch.setattr(
        figures.Figure, "savefig", lambda self, path, **k: caught.append(self) or path.touch()
    )
    fields_figure(*row_of_blocks(30), tmp_path / "fields.png")
    figure = caught[0]
    figure.canvas.draw()
    every = [a for axes in figure.axes for a in (axes, *axes.child_axes)]
    labels = [t.get_window_extent() for a in every for t in texts(a)]
    pictures = [a.get_window_extent() for a in figure.axes]
    assert len(labels) > 20
    for a, b in itertools.combinations(labels, 2):
        assert not a.overlaps(b)
    for a, b in itertools.product(labels, pictures):
        assert not a.overlaps(b)
    page = figure.bbox
    assert all(b.x0 >= 0 and b.y0 >= 0 and b.x1 <= page.x1 and b.y1 <= page.y1 for b in labels)


def test_a_material_has_the_same_colour_in_every_scene():
    assert np.allclose(colours.of_material("steel"), STEEL, atol=2e-3)
    # Hardwood and paper are two blues by themselves; the later one gives way.
    wood, paper, again = colours.apart(["hardwood", "paper", "hardwood"])
    assert wood == again == colours.of_material("hardwood") and paper != wood
    assert np.linalg.norm(np.subtract(wood, paper)) > 0.3
    names = ("steel", "rubber", "hardwood", "glass", "mud", "ceramic")
    for a, b in itertools.combinations(names, 2):
        assert np.linalg.norm(np.subtract(colours.of_material(a), colours.of_material(b))) > 0.08


def test_turbo_runs_from_the_lowest_to_the_highest_on_a_logarithmic_scale():
    shown, low, high = colours.turbo([1e3, 1e6, 1e9], log=True)
    assert (low, high) == (1e3, 1e9)
    assert shown[0, 2] > shown[0, 0] and shown[2, 0] > shown[2, 2]
    assert shown[1, 1] > 0.9, "half the decades is the middle of the scale"
    same, _, _ = colours.turbo([7.0, 7.0], log=False)
    assert np.array_equal(same[0], same[1])


def test_numbers_are_written_as_people_read_them():
    assert si(2.07e11, "Pa") == "207 GPa"
    assert si(5e3, "Pa") == "5 kPa"
    assert si(7850, "kg/m³") == "7850 kg/m³"
    assert si(0.37, "") == "0.37"


def test_a_strip_shows_the_film_from_first_to_last_frame(tmp_path):
    path = tmp_path / "film.mp4"
    with video.reel(path, 10, (64, 48)) as reel:
        for k in range(11):
            reel.add(np.full((48, 64, 3), 20 * k, np.uint8))
    strip(Film(path, 10, 64, 48), tmp_path / "strip.png", count=6, width=64)
    picture = np.asarray(Image.open(tmp_path / "strip.png").convert("RGB")).astype(int)
    centres = picture[24, 32 :: 64 + 6].mean(axis=1)
    assert len(centres) == 6
    assert np.abs(centres - np.arange(0, 201, 40)).max() < 8
    assert (picture[24, 64:70] == 255).all(), "a white gap"


def test_a_short_film_gives_a_short_strip_and_a_broken_one_a_clear_sentence(tmp_path):
    path = tmp_path / "film.mp4"
    with video.reel(path, 10, (64, 48)) as reel:
        reel.add(np.zeros((48, 64, 3), np.uint8))
    strip(Film(path, 10, 64, 48), tmp_path / "strip.png", width=64)
    assert Image.open(tmp_path / "strip.png").size[0] == 64
    path.write_bytes(b"not a film")
    with pytest.raises(UserError, match="Make it again"):
        strip(Film(path, 10, 64, 48), tmp_path / "strip.png")


def test_a_name_that_the_font_cannot_write_is_a_number():
    assert drawable("мяч 0", "object 1") == "мяч 0"
    assert drawable("椅子 0", "object 2") == "object 2"
