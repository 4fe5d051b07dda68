"""Ten things of our own weigh what their analytic volumes say, and their files tell nobody."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from own_props import PROPS, names, write
from weighed import goods, vessels
from weighed.piece import Prop, below, inset, swept, turned

from corporeal.showcase import parametric_surfaces

FACETS = 2e-3
"""How far a turned mesh of 96 sides may enclose less than the round body."""


def of(prop: Prop) -> dict[str, float]:
    """Return the mass of each piece [kg]."""
    return {p.name: p.mass for p in prop.built}


def test_a_turned_profile_encloses_what_a_cone_and_a_ball_do():
    assert turned(np.array([[2.0, 0.0], [0.0, 3.0]])) == pytest.approx(4 * np.pi)
    t = np.linspace(-np.pi / 2, np.pi / 2, 400)
    half = np.stack([np.cos(t), np.sin(t)], 1)
    assert turned(half) == pytest.approx(4 / 3 * np.pi, rel=1e-4)
    assert swept(half) == pytest.approx(4 * np.pi, rel=1e-4)


def test_an_inset_profile_is_as_far_inside_as_the_wall_is_thick():
    can = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]])
    assert inset(can, 0.1) == pytest.approx(np.array([[0, 0.1], [0.9, 0.1], [0.9, 1.9], [0, 1.9]]))
    cone = np.array([[0.0, 0.0], [1.0, 1.0]])
    assert inset(cone, 0.1)[0] == pytest.approx([0.0, 0.1 * np.sqrt(2)])


def test_a_profile_cut_off_at_a_level_holds_what_lies_below():
    cylinder = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]])
    assert turned(below(cylinder, 0.5)) == pytest.approx(0.5 * np.pi)


@pytest.mark.parametrize("build", PROPS, ids=lambda build: build.__name__)
def test_what_is_drawn_is_closed_and_encloses_no_less_than_was_built(build):
    prop = build()
    for part in prop.seen:
        assert goods.enclosed(part.mesh) > 0
    drawn = sum(goods.enclosed(p.mesh) for p in prop.seen)
    wall = {"cover", "cloth", "label", "lid", "ends"}
    built = sum(p.volume for p in prop.built if p.name not in wall)
    assert built < drawn * (1 + FACETS)


def test_a_pot_and_a_ball_weigh_what_their_meshes_enclose():
    pot = vessels.flower_pot()
    assert goods.enclosed(pot.seen[0].mesh) == pytest.approx(pot.built[0].volume, rel=FACETS)
    ball = goods.play_ball()
    thin = 4 * np.pi * 0.108**2 * 0.0021 * vessels.RUBBER
    assert ball.mass == pytest.approx(thin, rel=0.03)


def test_a_brick_weighs_its_box_less_its_holes():
    box = 0.240 * 0.115 * 0.071 - 15 * np.pi * 0.013**2 * 0.071
    assert goods.brick().mass == pytest.approx(1950 * box, rel=0.01)


def test_a_stool_weighs_its_seat_its_legs_and_its_rungs():
    seat = np.pi * 0.165**2 * 0.034
    leg = np.pi / 3 * (0.021**2 + 0.021 * 0.014 + 0.014**2) * 0.43
    rung = np.pi * 0.009**2 * 0.17  # between the legs
    assert goods.stool().mass == pytest.approx(690 * (seat + 4 * leg + 4 * rung), rel=0.03)


def test_a_can_and_a_bottle_hold_what_their_cylinders_do():
    can = of(vessels.tomato_can())
    assert can["tomatoes"] == pytest.approx(1035 * 0.92 * np.pi * 0.0363**2 * 0.102, rel=0.01)
    assert can["body"] + can["ends"] == pytest.approx(0.055, rel=0.05)
    bottle = of(vessels.cola_bottle())
    assert bottle["cola"] == pytest.approx(1042 * np.pi * 0.0445**2 * 0.128, rel=0.05)


def test_a_jar_and_a_pan_weigh_their_walls():
    jar = of(vessels.jam_jar())
    side = 2 * np.pi * 0.035 * 0.103 * 0.0026
    assert jar["jar"] == pytest.approx(2500 * (side + np.pi * 0.033**2 * 0.0026), rel=0.15)
    pan = of(vessels.frying_pan())
    slant = np.pi * (0.088 + 0.121) * np.hypot(0.033, 0.047)
    straight = 7930 * 0.0008 * (np.pi * 0.088**2 + slant)
    assert straight < pan["bowl"] < 1.1 * straight  # its side is bent outwards


def test_a_thicker_wall_weighs_more():
    ball = goods.play_ball()
    (wall,) = ball.built
    thicker = replace(ball, built=(replace(wall, volume=2 * wall.volume),))
    assert thicker.mass == pytest.approx(2 * ball.mass)


@pytest.mark.slow
def test_files_have_neutral_names_and_say_nothing_of_matter(tmp_path):
    write(tmp_path)
    rows = list(csv.DictReader((tmp_path / "truth" / "masses.csv").open()))
    assert [r["object"] for r in rows] == names()
    assert all(0.1 < float(r["mass_kg"]) < 5 for r in rows)
    for name, row in zip(names(), rows, strict=True):
        data = (tmp_path / "models" / f"{name}.glb").read_bytes()
        text = data.split(b"BIN\0")[0].decode("latin-1")
        assert "accessors" in text
        assert not [w for w in row["what"].split() if len(w) > 3 and w in text]
        assert "substance" not in text


def test_a_turned_mesh_encloses_what_its_profile_says():
    profile = np.array([[0.0, 0.0], [0.05, 0.0], [0.04, 0.1], [0.0, 0.1]])
    mesh = parametric_surfaces.lathe_surface(profile, 96)
    assert goods.enclosed(mesh) == pytest.approx(turned(profile), rel=FACETS)
