"""Caverns with narrow mouths are not believed; hollows and corners are."""

import numpy as np
import pytest

from corporeal.reconstruction.surface.ball_opening import open_by_ball

SIZE, TOP, RADIUS = 48, 40, 4.0


def block():
    """Distance to a block that fills the grid below a face."""
    z = np.broadcast_to(np.arange(SIZE) - TOP + 0.5, (SIZE, SIZE, SIZE))
    return z.astype(float)


def emptied(*holes):
    out = block()
    for hole in holes:
        out[hole] = 0.5
    return out


def cells(*bounds):
    return tuple(slice(low, high) for low, high in bounds)


CAVERN = cells((16, 32), (16, 32), (15, 31))


def test_a_cavern_behind_a_narrow_mouth_is_filled_again():
    after = emptied(CAVERN, cells((22, 26), (22, 26), (31, TOP)))
    found = open_by_ball(block(), after, RADIUS)
    assert (found[..., : TOP - 2] < 0).all()
    assert np.array_equal(found[..., TOP:], after[..., TOP:])


def test_a_cavern_without_a_mouth_is_filled_again():
    assert np.array_equal(open_by_ball(block(), emptied(CAVERN), RADIUS), block())


@pytest.mark.parametrize("radius", [2.0, RADIUS])
def test_a_hollow_keeps_its_corners(radius):
    after = emptied(cells((12, 36), (12, 36), (15, TOP)))
    assert np.array_equal(open_by_ball(block(), after, radius), after)


def test_a_thin_layer_is_taken_off_whole():
    after = emptied(cells((0, SIZE), (0, SIZE), (TOP - 2, TOP)))
    assert np.array_equal(open_by_ball(block(), after, RADIUS), after)


def test_a_hollow_stays_where_a_cavern_beside_it_goes():
    hollow = cells((4, 24), (4, 44), (15, TOP))
    cavern, mouth = cells((27, 43), (16, 32), (15, 31)), cells((24, 27), (22, 26), (21, 25))
    found = open_by_ball(block(), emptied(hollow, cavern, mouth), RADIUS)
    assert (found[hollow] > 0).all()
    assert (found[cavern] < 0).all()


def test_nothing_deeper_is_the_same():
    assert np.array_equal(open_by_ball(block(), block() - 1.0, RADIUS), block() - 1.0)
