"""From where nobody looked is said, and of half of the circle plainly."""

import numpy as np
import pytest

from corporeal.geometry.unseen_side import unseen_half, unseen_side
from corporeal.render.camera import camera_of
from patterned_scene import on_its_side, ring

NAMES = tuple(f"{k:02d}.jpg" for k in range(25))


def along(degrees):
    return tuple(camera_of(a) for a in ring(np.linspace(0, degrees, 25)))


def test_a_side_that_nobody_photographed_is_named_by_its_neighbours():
    most = along(240)
    said = unseen_side(most, NAMES)
    assert said is not None and "Between 24.jpg and 00.jpg lie 120°" in said
    upside_down = tuple(on_its_side(on_its_side(c)) for c in most)
    assert "lie 120°" in (unseen_side(upside_down, NAMES) or "")
    assert unseen_half(most, NAMES) is None
    assert unseen_side(along(345.6), NAMES) is None


@pytest.mark.parametrize(("seen", "gap"), [(90, 269), (170, 190)])
def test_what_is_known_from_one_side_only_is_said_to_be(seen, gap):
    """A helmet before a wall ended in a film of its front, and the fifth warning said so."""
    said = unseen_half(along(seen), NAMES)
    assert said is not None and "from one side only" in said
    assert f"between 24.jpg and 00.jpg lie {gap}°" in said
    assert unseen_side(along(seen), NAMES) is None, "nothing is said twice"
