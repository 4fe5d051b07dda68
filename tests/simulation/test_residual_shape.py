"""Shape is what remains when motion is taken away."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from corporeal.simulation.residual_shape import (
    box_diagonal,
    fit_rigid_motion,
    mean_of_largest,
    place_at_start,
    residual_dent,
    upper_percentile,
)

RNG = np.random.default_rng(3)
CUBE = RNG.uniform(-0.05, 0.05, (8000, 3))
TURN = Rotation.from_rotvec([0.4, 1.9, -0.7]).as_matrix()


def shape_error(start, now):
    """RMS distance after the best rigid fit over the bounding box's diagonal [-]."""
    fit = fit_rigid_motion(start, now, np.ones(len(start)))
    return float(np.sqrt(np.mean(np.sum((fit.undo(now) - start) ** 2, axis=1)))) / box_diagonal(start)


def pressed(points):
    """Press a hollow of 1 cm into the top, around (0.02, 0.01)."""
    distance = np.hypot(points[:, 0] - 0.02, points[:, 1] - 0.01)
    near_top = np.clip((points[:, 2] - 0.01) / 0.04, 0, 1)
    return points - np.outer(0.01 * np.exp(-((distance / 0.025) ** 2)) * near_top, [0, 0, 1])


def test_moving_and_turning_is_no_change_of_shape():
    assert shape_error(CUBE, CUBE @ TURN.T + [1, 2, 3]) < 1e-12


def test_a_mirror_image_is_another_shape():
    assert shape_error(CUBE, CUBE * [1, 1, -1]) > 0.1


def test_stretching_by_a_tenth_is_found():
    exact = np.sqrt(np.mean((0.1 * CUBE[:, 0] - 0.1 * CUBE[:, 0].mean()) ** 2))
    exact /= np.linalg.norm(np.ptp(CUBE, axis=0))
    assert shape_error(CUBE, CUBE * [1.1, 1, 1]) == pytest.approx(exact, rel=1e-3)


def test_the_turn_is_measured():
    fit = fit_rigid_motion(CUBE, CUBE @ TURN.T, np.ones(len(CUBE)))
    assert fit.angle == pytest.approx(np.linalg.norm([0.4, 1.9, -0.7]))


def test_a_dent_has_its_depth_and_place_however_the_body_lies():
    now = pressed(CUBE) @ TURN.T + [0.3, 0, 0]
    mark = residual_dent(CUBE, [now], 0.002)
    assert mark.depth == pytest.approx(0.01, rel=0.2)
    np.testing.assert_allclose(mark.place[:2], [0.02, 0.01], atol=0.004)
    assert mark.share < 0.3


def test_what_gives_on_the_other_side_is_another_dent():
    squashed = pressed(CUBE)
    below = np.clip((-0.02 - squashed[:, 2]) / 0.03, 0, 1)
    squashed = squashed + np.outer(0.006 * below, [0, 0, 1])
    mark = residual_dent(CUBE, [squashed @ TURN.T], 0.002)
    assert mark.depth == pytest.approx(0.01, rel=0.25)
    np.testing.assert_allclose(mark.place[:2], [0.02, 0.01], atol=0.006)
    assert mark.place[2] > 0.01


def test_grains_that_flew_off_make_no_deeper_dent():
    thrown = pressed(CUBE)
    thrown[::97] += [0.0, 0.0, 0.5]
    mark = residual_dent(CUBE, [thrown], 0.002)
    assert mark.depth == pytest.approx(0.01, rel=0.2)


def test_a_lump_that_flew_off_does_not_say_where_the_dent_goes():
    thrown, below = pressed(CUBE), np.argsort(np.linalg.norm(CUBE - [0.0, 0.0, -0.04], axis=1))
    thrown[below[:6]] += [0.0, 0.0, 0.5]
    mark = residual_dent(CUBE, [thrown], 0.002)
    assert mark.depth == pytest.approx(0.01, rel=0.2)
    np.testing.assert_allclose(mark.place[:2], [0.02, 0.01], atol=0.004)


def test_a_vibration_is_no_dent():
    swing = [CUBE * (1 + 0.05 * np.sin(t) * np.array([1, -1, 0])) for t in np.arange(8) / 8 * 6.28]
    assert residual_dent(CUBE, swing, 0.001).share == 0
    assert np.isnan(residual_dent(CUBE, swing, 0.001).place).all()


def test_a_place_on_a_body_is_found_again_after_it_moved():
    place = np.array([0.02, 0.01, 0.04])
    then = place_at_start(TURN @ place + [1, 0, 0], CUBE @ TURN.T + [1, 0, 0], CUBE)
    np.testing.assert_allclose(then, place, atol=1e-9)


def test_how_far_a_share_of_a_body_goes_does_not_grow_with_the_number_of_its_points():
    """Leaves swing the farther the farther out they are: few swing far."""
    few, many = (RNG.exponential(0.01, size=n) for n in (1250, 40_000))
    assert upper_percentile(many) == pytest.approx(upper_percentile(few), rel=0.15)
    assert mean_of_largest(many) > 1.3 * mean_of_largest(few), "the control: a fixed number of the largest"
