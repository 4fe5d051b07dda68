"""What is loose lies over no air: it fills what holds it below the surface that is drawn of it."""

from itertools import pairwise

import numpy as np
import pytest
import trimesh
from test_fill import CLAY, SOIL, inputs, thing  # type: ignore[import-not-found]

from corporeal.core.types import Law, Material, Structure
from corporeal.pipeline.mass_posterior import MassSampler
from corporeal.pipeline.stages.fill import fill
from corporeal.pipeline.stages.ground import GroundConfig

COFFEE = Material("coffee", Law.FLUID, 1e6, 0.49, 1000.0, viscosity=1e-3)
WALL = Structure("shell", 0.008)
R, T, HIGH, LEVEL = 0.1, 0.008, 0.2, 0.16
"""Inside of the pot, its wall, its height, and that of its soil [m]."""
POT = [(0, 0), (R + T, 0), (R + T, HIGH), (R, HIGH), (R, T), (0, T)]
OUTSIDE = [(0, 0), (R + T, 0), (R + T, HIGH), (0, HIGH)]
UNTIL_SOIL = [*POT[:4], (R, LEVEL)]
WITH_LINE = [*POT[:4], (R, LEVEL), *POT[4:]]
"""With a line on its inside where the soil's rim is."""
ONE_FACE = [(0, T), (R, T), (R, HIGH)]
SHEET = [(R, LEVEL), (0, LEVEL)]
NARROW = [(0.92 * R, LEVEL), (0, LEVEL)]
DISC = [(0, LEVEL - 0.005), (R, LEVEL - 0.005), *SHEET]
HALF = [(0, LEVEL / 2), (R, LEVEL / 2), *SHEET]
PLUG = [(0, T), (R, T), *SHEET]
LID = [(R, HIGH), (0, HIGH)]


def turned(profile):
    return trimesh.creation.revolve(profile, sections=64)


def filled(*parts):
    scene, parts, field = inputs(thing(*parts))
    return fill(scene, parts, field)


def soil_of(pot, soil, matter=SOIL):
    particles = filled((turned(pot), CLAY, WALL), (turned(soil), matter))
    return particles.mass_real[1], particles


def cone(*rings):
    """Volume between rings (r, z)."""
    return sum(np.pi * (z - y) * (a * a + a * b + b * b) / 3 for (a, y), (b, z) in pairwise(rings))


INSIDE = cone((R, T), (R, LEVEL))
WAYS = {
    "an open sheet": (POT, SHEET, INSIDE),
    "a sheet that leaves a gap": (POT, NARROW, INSIDE),
    "a sheet whose rim is one with the pot's inside": (WITH_LINE, SHEET, INSIDE),
    "a thin disc": (POT, DISC, INSIDE),
    "half of it": (POT, HALF, INSIDE),
    "all of it": (POT, PLUG, INSIDE),
    "a pot of one face": (ONE_FACE, SHEET, cone((R - T / 2, T * 1.5), (R - T / 2, LEVEL))),
    "one surface with its pot": (UNTIL_SOIL, SHEET, INSIDE),
    "a disc on a pot drawn by its outside": (OUTSIDE, LID, cone((R, T), (R, HIGH))),
}


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_soil_weighs_the_same_however_it_is_drawn(way):
    pot, soil, volume = WAYS[way]
    mass, particles = soil_of(pot, soil)
    assert mass == pytest.approx(600.0 * volume, rel=0.02)
    assert particles.mass[particles.part == 1].sum() == pytest.approx(mass)
    lies = particles.position[particles.part == 1]
    assert lies[:, 2].max() < HIGH and np.hypot(*lies[:, :2].T).max() < R + T
    assert ("fills terracotta below its surface" in particles.fills[1]) is (soil is not PLUG)


@pytest.mark.slow
def test_the_pot_around_it_weighs_what_it_did():
    alone = filled((turned(POT), CLAY, WALL))
    for pot in (POT, WITH_LINE):
        _, particles = soil_of(pot, SHEET)
        assert particles.mass_real[0] == pytest.approx(alone.mass_real[0], rel=1e-9)


@pytest.mark.slow
def test_coffee_fills_its_cup():
    mass, _ = soil_of(POT, SHEET, COFFEE)
    assert mass == pytest.approx(1000.0 * INSIDE, rel=0.02)


def test_a_bulging_jar_is_filled_beside_what_is_seen_through_its_neck():
    inside = [(0.099, 0.003), (0.147, 0.053), (0.147, 0.118), (0.047, 0.18)]
    outside = [(0, 0), (0.1, 0), (0.15, 0.05), (0.15, 0.12), (0.05, 0.18), (0.05, 0.2)]
    jar = [*outside, (0.047, 0.2), *inside[::-1], (0, 0.003)]
    mass, _ = soil_of(jar, [(0.047, 0.19), (0, 0.19)])
    assert mass == pytest.approx(600.0 * cone(*inside, (0.047, 0.19)), rel=0.04)


def test_nothing_gets_between_a_pot_and_the_one_that_it_stands_in():
    outer = [(0, 0), (0.16, 0), (0.16, 0.2), (0.157, 0.2), (0.157, 0.003), (0, 0.003)]
    inner = [(r - 0.004 * (r > R), z + 0.005) for r, z in POT]
    made = [(turned(inner), CLAY, WALL), (turned(SHEET), SOIL), (turned(outer), CLAY, WALL)]
    assert filled(*made).mass_real[1] == pytest.approx(600.0 * cone((R, T + 0.005), (R, LEVEL)), rel=0.02)


def test_a_heap_on_a_plate_stays_as_it_is_drawn():
    plate = [(0, 0), (0.12, 0), (0.14, 0.015), (0.138, 0.018), (0.118, 0.004), (0, 0.004)]
    heap = turned([(0, 0.004), (0.08, 0.004), (0.06, 0.03), (0, 0.06)])
    particles = filled((turned(plate), CLAY, WALL), (heap, SOIL))
    assert particles.mass_real[1] == pytest.approx(600.0 * heap.volume, rel=1e-6)
    assert "fills" not in particles.fills[1]


@pytest.mark.slow
def test_a_sheet_of_sand_on_a_table_stays_one_and_is_reported_of():
    table = trimesh.creation.box((1.0, 1.0, 0.03))
    table.apply_translation((0, 0, 0.7))
    sand = turned([(0.3, 0.72), (0, 0.72)])
    particles = filled((table, CLAY), (sand, SOIL))
    assert "an open sheet" in particles.fills[1]
    assert any("nothing of the same object holds it" in w for w in particles.warnings)


@pytest.mark.slow
def test_a_scene_is_weighed_with_what_fills_its_pots():
    scene, parts, field = inputs(thing((turned(POT), CLAY, WALL), (turned(SHEET), SOIL)))
    heavy = MassSampler(scene, parts, GroundConfig(), 0).of(field)
    assert heavy[0] == pytest.approx(sum(fill(scene, parts, field).mass_real), rel=1e-6)
