"""From where nobody looked is said, and of half of the circle plainly."""

import numpy as np
import pytest

from corporeal.multiview.view_coverage import depth_doubt_text, unseen_half_text, unseen_side_text
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.render.camera_placement import CameraAim, camera_from_aim
from patterned_scene import on_its_side, ring

NAMES = tuple(f"{k:02d}.jpg" for k in range(25))


def along(degrees):
    return tuple(camera_from_aim(a) for a in ring(np.linspace(0, degrees, 25)))


def test_an_unphotographed_side_is_named_by_its_neighbours():
    most = along(240)
    said = unseen_side_text(most, NAMES)
    assert said is not None and "Between 24.jpg and 00.jpg lie 120°" in said
    upside_down = tuple(on_its_side(on_its_side(c)) for c in most)
    assert "lie 120°" in (unseen_side_text(upside_down, NAMES) or "")
    assert unseen_half_text(most, NAMES) is None
    assert unseen_side_text(along(345.6), NAMES) is None


@pytest.mark.parametrize(("seen", "gap"), [(90, 269), (170, 190)])
def test_what_is_known_from_one_side_only_is_reported_to_be(seen, gap):
    """A helmet before a wall ended in a video of its front, and the fifth warning said so."""
    said = unseen_half_text(along(seen), NAMES)
    assert said is not None and "from one side only" in said
    assert f"between 24.jpg and 00.jpg lie {gap}°" in said
    assert unseen_side_text(along(seen), NAMES) is None, "nothing is said twice"


@pytest.mark.parametrize("seen", [40, 72])
def test_from_less_than_a_quarter_of_the_circle_nothing_says_how_deep_it_is(seen):
    """A television seen from a fifth of it became a block of 34 cm, and was rendered."""
    why = depth_doubt_text(along(seen))
    assert why is not None and f"from {seen + 1}° of the circle" in why, "eyes go round the middle"


def test_half_of_the_circle_or_a_look_from_above_says_how_deep_it_is():
    assert depth_doubt_text(along(170)) is None
    few = along(40)
    middle = np.array(find_viewed_region(few).centre)
    eye = few[0].world_from_camera[:3, 3] - middle
    above = middle + np.linalg.norm(eye) * np.array([0.25, 0.0, 0.97])
    steep = camera_from_aim(CameraAim(tuple(above), tuple(middle), 48.0, few[0].width, few[0].height))
    assert depth_doubt_text((*few, steep)) is None
