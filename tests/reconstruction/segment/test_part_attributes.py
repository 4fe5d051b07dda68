import numpy as np
import pytest
from skimage.color import rgb2lab

from corporeal.core.types import FeatureCloud, PartDescription
from corporeal.reconstruction.segment.part_attributes import (
    MAX_SIGMAS,
    UNSAID_SIGMAS,
    ObservedAttributes,
    _attribute_table,
    described_attributes,
    log_likelihood,
    observed_attributes,
    top_direction,
)


def seen(rgb, height=0.5, thin=0.0):
    lab = rgb2lab(np.array([[rgb]], float))[0]
    return ObservedAttributes(lab, np.array([height]), np.array([thin]))


def likely(what, *names, material=None):
    told = [described_attributes(PartDescription(name, material)) for name in names]
    return log_likelihood(what, told)[0]


@pytest.mark.parametrize(
    ("name", "rgb"),
    [
        ("green leaves", (0.25, 0.5, 0.18)),
        ("terracotta pot", (0.7, 0.38, 0.24)),
        ("dark brown soil", (0.15, 0.1, 0.07)),
        ("white shade", (0.93, 0.93, 0.9)),
        ("navy upholstery", (0.1, 0.13, 0.36)),
        ("wooden frame", (0.5, 0.34, 0.2)),
    ],
)
def test_a_colour_is_most_likely_what_it_is_called(name, rgb):
    names = ["green thing", "terracotta thing", "dark brown", "white thing", "navy thing", "wood"]
    own = {"green": 0, "terracotta": 1, "dark": 2, "white": 3, "navy": 4, "wooden": 5}
    assert likely(seen(rgb), *names).argmax() == own[name.split()[0]]


def test_shadow_does_not_change_what_a_colour_is():
    """A quarter of the light falls on it."""
    for name, rgb in (("orange", (0.9, 0.5, 0.1)), ("teal", (0.17, 0.48, 0.49))):
        linear = np.array(rgb) ** 2.2
        shaded = seen((0.25 * linear) ** (1 / 2.2))
        others = [n for n in ("orange", "teal", "white", "purple") if n != name]
        assert likely(shaded, name, *others).argmax() == 0


def test_the_named_colour_counts_more_than_the_substance():
    told = described_attributes(PartDescription("blue wooden box", "hardwood"))
    only = described_attributes(PartDescription("blue", None))
    np.testing.assert_array_equal(told.colours, only.colours)


def test_the_material_counts_where_the_name_is_silent():
    assert len(described_attributes(PartDescription("frame", "hardwood")).colours)
    assert not len(described_attributes(PartDescription("frame", "ABS")).colours)
    assert not len(described_attributes(PartDescription("frame", None)).colours)


def test_heights_are_shares_of_the_object():
    high, low = seen((0.5,) * 3, 0.95), seen((0.5,) * 3, 0.05)
    names = ("legs", "lid")
    assert likely(high, *names).argmax() == 1 and likely(low, *names).argmax() == 0


def test_a_part_of_two_names_is_where_either_is():
    told = described_attributes(PartDescription("grey seat and back", None))
    assert told.heights == (0.25, 0.95)


def test_what_is_long_and_thin_is_a_pole_and_not_a_lid():
    assert likely(seen((0.5,) * 3, 0.7, 0.95), "pole", "shade").argmax() == 0
    assert likely(seen((0.5,) * 3, 0.7, 0.05), "pole", "shade").argmax() == 1


def test_a_small_object_is_the_less_likely_of_two_that_fit():
    large, small = likely(seen((0.95,) * 3), "white wall", "white knob")
    assert large - small == pytest.approx(1.5)


def test_words_that_say_nothing_neither_win_nor_lose():
    silent = likely(seen((0.2, 0.5, 0.2)), "thing")[0]
    assert silent == pytest.approx(-0.5 * (UNSAID_SIGMAS**2 + UNSAID_SIGMAS**2 + (UNSAID_SIGMAS / 2) ** 2))
    green, purple = likely(seen((0.2, 0.5, 0.2)), "green thing", "purple thing")
    assert green > silent > purple


def test_no_word_can_be_infinitely_wrong():
    assert likely(seen((1.0, 0, 0), 1.0, 1.0), "blue base")[0] >= -1.5 * MAX_SIGMAS**2


@pytest.mark.parametrize("name", ["leg", "legs", "Legs.001", "table_legs", "TableLegs"])
def test_words_are_found_however_they_are_written(name):
    told = described_attributes(PartDescription(name, None))
    assert told.heights == (0.0, 0.3) and told.thin == 1.0


def test_a_wire_is_thin_and_a_plate_is_not():
    rng = np.random.default_rng(0)
    wire = np.column_stack([np.zeros((1000, 2)), rng.random(1000)])
    plate = np.column_stack([rng.random((3000, 2)) + 1, np.zeros(3000)])
    points = np.concatenate([wire, plate])
    nothing = np.zeros((4000, 0), np.float16)
    colour = np.repeat([[1.0, 0, 0], [0, 0, 1.0]], (1000, 3000), axis=0)
    cloud = FeatureCloud(points, colour, nothing, nothing, np.ones(4000, int))
    found = observed_attributes(cloud, np.repeat([0, 1], (1000, 3000)), 2)
    assert found.thin[0] > 0.95 > 0.35 > found.thin[1]
    np.testing.assert_allclose(found.colour, rgb2lab(np.array([[[1.0, 0, 0], [0, 0, 1]]]))[0])
    np.testing.assert_allclose(found.height, [0.5, 0.0], atol=0.02)


NAMES = ("grey pedestal", "grey column", "white lampshade")
TOLD = [described_attributes(PartDescription(name, None)) for name in NAMES]
FALLEN = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])


def lamp(turn, across):
    """Points of a lamp: a plate, a pole and a shade; and which of these each is of."""
    bit = np.repeat([0, 1, 2], 2000)
    points = np.random.default_rng(0).random((6000, 3)) - [0.5, 0.5, 0.0]
    points *= (np.array([[0.2, 0.2, 0], [0, 0, 0.8], [0.2, 0.2, 0.2]]) * [across, across, 1])[bit]
    points[bit == 2] += [0, 0, 0.8]
    nothing = np.zeros((6000, 0), np.float16)
    colour = np.array([0.5, 0.5, 0.95])[bit, None] * np.ones(3)
    return FeatureCloud(points @ turn.T, colour, nothing, nothing, np.ones(6000, int)), bit


@pytest.mark.parametrize("turn", [np.eye(3), FALLEN, FALLEN.T, FALLEN @ FALLEN.T[[1, 2, 0]]])
def test_the_top_of_a_lamp_that_has_fallen_over_is_found(turn):
    cloud, bit = lamp(turn, across=1.0)
    up = top_direction(cloud, bit, 3, TOLD)
    assert up @ turn[:, 2] > 0.99
    assert log_likelihood(observed_attributes(cloud, bit, 3, up), TOLD).argmax(axis=1).tolist() == [0, 1, 2]


def test_a_wide_object_has_not_fallen_over():
    cloud, bit = lamp(np.eye(3), across=20.0)
    assert top_direction(cloud, bit, 3, TOLD).tolist() == [0, 0, 1]


def test_the_table_of_words_is_sound():
    table = _attribute_table()
    for row in table["place"]:
        assert 0 <= row["low"] < row["high"] <= 1
    colours = [c for row in table["substance"] for c in row["colours"]]
    colours += [c for each in table["colour"].values() for c in each]
    assert all(len(c) == 7 and int(c[1:], 16) >= 0 for c in colours)
    rows = [*table["substance"], *table["place"], *table["form"], table["small"]]
    for word in [w for row in rows for w in row["words"]]:
        assert described_attributes(PartDescription(word, None)) is not None
    for kind in ("substance", "place", "form"):
        words = [w for row in table[kind] for w in row["words"]]
        assert len(words) == len(set(words)), kind
