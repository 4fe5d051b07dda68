"""Twelve further things of our own weigh what their analytic volumes say, and tell nobody."""

import csv

import numpy as np
import pytest
from own_props import SECOND, names, write
from weighed import built_things, goods, household

from test_own_props import FACETS, of

WITHIN = {"skins of the box", "skin of the lid", "band", "buckle and dial", "pads", "straps"}
"""Pieces that the drawn surface leaves out or counts with their neighbours."""


@pytest.mark.parametrize("build", SECOND, ids=lambda build: build.__name__)
def test_what_is_drawn_is_closed_and_encloses_no_less_than_was_built(build):
    prop = build()
    for part in prop.seen:
        assert goods.enclosed(part.mesh) > 0
    drawn = sum(goods.enclosed(p.mesh) for p in prop.seen)
    built = sum(p.volume for p in prop.built if p.name not in WITHIN | {"core"})
    assert built < drawn * (1 + FACETS)


def test_an_imitation_pear_weighs_as_much_for_its_surface_as_those_that_were_weighed():
    lemon = 0.029 / (np.pi * 0.0587**2)  # a ball as large as 54 × 54 × 68 mm
    plum = 0.025 / (np.pi * 0.052**2)
    prop = household.pear()
    area = of(prop)["wall"] / 2.8
    assert area == pytest.approx(np.pi * 0.08**2, rel=0.15)  # 76 mm wide, 99 mm high
    assert min(lemon, plum) - 0.1 < 2.8 < max(lemon, plum)


def test_a_flask_weighs_two_walls_of_steel_and_its_cup():
    mass = of(household.vacuum_flask())
    outer = 2 * np.pi * 0.0375 * 0.225 + np.pi * 0.0375**2
    inner = 2 * np.pi * 0.0338 * 0.208 + np.pi * 0.0338**2
    assert mass["outer wall"] == pytest.approx(7930 * 0.0005 * outer, rel=0.05)
    assert mass["inner wall"] == pytest.approx(7930 * 0.0004 * inner)
    assert np.pi * 0.0338**2 * 0.208 == pytest.approx(0.75e-3, rel=0.01)  # what it holds


def test_a_roll_weighs_its_length_and_a_bottle_holds_what_is_printed_on_it():
    assert of(household.tissue_roll())["tissue"] == pytest.approx(25 * 0.1 * 0.0465)
    bottle = household.wine_bottle()
    room = goods.enclosed(bottle.seen[0].mesh) - bottle.built[0].volume
    assert 0.00075 < room < 0.00080  # wine, its cork and some air


def test_a_bucket_and_its_handle_weigh_no_less_than_the_specification_asks():
    mass = of(household.sand_bucket())
    assert 0.6 < mass["bucket"] < 0.7
    assert mass["handle"] == pytest.approx(0.03, rel=0.15)
    assert mass["sand"] == pytest.approx(1550 * np.pi * 0.126**2 * 0.143, rel=0.02)


def test_a_table_of_hollow_board_weighs_a_third_of_a_solid_one():
    table = built_things.side_table()
    top, legs = 0.5 * 0.5 * 0.05, 4 * 0.05 * 0.05 * 0.4
    assert goods.enclosed(table.seen[0].mesh) == pytest.approx(top + legs, rel=0.01)
    assert table.mass == pytest.approx(0.37 * 700 * (top + legs), rel=0.1)


def test_a_hammer_weighs_its_head_and_what_of_its_handle_is_wood():
    mass = of(built_things.hammer())
    peen = 0.027 * 0.039**2 * np.tan(np.radians(15))
    eye = np.pi * 0.0098**2 * 0.027
    assert mass["head"] == pytest.approx(7850 * (0.118 * 0.027**2 - peen - eye), rel=0.02)
    assert mass["handle"] == pytest.approx(670 * np.pi * 0.0133**2 * 0.327, rel=0.05)


def test_a_cool_box_weighs_its_skins_and_the_foam_between_them():
    mass = of(built_things.cool_box())
    shell, lining = 2 * 0.74 * 0.3 + 0.44 * 0.3, 2 * 0.6 * 0.255 + 0.37 * 0.23
    assert mass["skins of the box"] == pytest.approx(950 * (shell * 0.002 + lining * 0.0015))
    between = 0.44 * 0.3 * 0.3 - 0.37 * 0.23 * 0.255
    assert mass["foam of the box"] == pytest.approx(40 * between, rel=0.12)


def test_a_helmet_is_foam_between_two_half_ellipsoids_less_its_openings():
    helmet = built_things.helmet()
    outer, inner = built_things.OUTER, built_things.INNER
    rim = 0.008 * np.pi * (outer[:2].prod() - inner[:2].prod())
    whole = 2 / 3 * np.pi * (outer.prod() - inner.prod()) + rim
    assert 0.8 * whole < of(helmet)["liner"] / 74 < 0.92 * whole
    half = 2 * np.pi * np.mean(outer[[0, 0, 1]] * outer[[1, 2, 2]]) + 0.008 * 2 * np.pi * 0.122
    assert 0.8 * half < of(helmet)["shell"] / 1200 / 5e-4 < 0.95 * half


def test_a_loaf_and_a_candle_are_one_substance_all_through():
    loaf = built_things.loaf()
    assert loaf.mass / goods.enclosed(loaf.seen[0].mesh) == pytest.approx(256, rel=0.01)
    assert household.candle().mass == pytest.approx(900 * np.pi * 0.035**2 * 0.1365, rel=0.01)


@pytest.mark.slow
def test_files_go_on_from_the_batch_before_and_say_nothing_of_matter(tmp_path):
    write(tmp_path, 2)
    rows = list(csv.DictReader((tmp_path / "truth" / "masses.csv").open()))
    assert [r["object"] for r in rows] == names(2)
    assert names(2)[0] == "thing_11"
    for row in rows:
        data = (tmp_path / "models" / f"{row['object']}.glb").read_bytes()
        text = data.split(b"BIN\0")[0].decode("latin-1")
        assert not [w for w in row["what"].split() if len(w) > 3 and w in text]
        assert "substance" not in text
