"""Loss factor and restitution: one formula, held against the contact that it sums up."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from corporeal.materials.loss_restitution import loss_of_restitution, restitution_of_loss, restitution_range_of_loss
from corporeal.mpm.physics.maxwell_branches import fit_branches


def integrated(loss, pace=1.0):
    """Restitution of a ball on a rigid plane, by hereditary Hertz contact with two branches.

    Force F = x + Σ g q with x = δ^(3/2) and dq/dt = dx/dt - q/T; unit mass, unit relaxed stiffness.
    The ball is gone when the force is. ``pace``: by how much the band of the branches is shifted.
    """
    share = fit_branches(loss)
    speed = 1.0
    duration = 2.94 * (1.25 / share.stiffening) ** 0.4  # Hertz: 2.94 δ_max/v, δ_max^(5/2) = 5 v²/4k
    omega = 2.5 * np.pi / duration * pace  # an impact lasts 2 to 3 half periods
    time = np.array(share.time) / omega

    def force(y):
        return max(y[0], 0.0) ** 1.5 + np.dot(share.strength, y[2:])

    def slope(t, y):
        grown = 1.5 * np.sqrt(max(y[0], 0.0)) * y[1]
        return [y[1], -force(y), *(grown - y[2:] / time)]

    def gone(t, y):
        return force(y) if t > 1e-3 else 1.0

    gone.terminal = True  # pyright: ignore[reportFunctionMemberAccess]
    end = solve_ivp(slope, (0.0, 100.0), [0.0, speed, 0.0, 0.0], events=gone, rtol=1e-8, atol=1e-10)
    assert end.t_events[0].size
    return -end.y[1, -1] / speed


@pytest.mark.parametrize("loss", [0.03, 0.1, 0.3, 0.6, 1.0, 1.5])
def test_the_formula_is_what_hereditary_contact_gives(loss):
    assert restitution_of_loss(loss) == pytest.approx(integrated(loss), abs=0.025)


def test_a_loss_factor_that_is_half_as_large_would_be_seen():
    assert abs(restitution_of_loss(0.3) - integrated(0.6)) > 0.15


def test_it_hardly_depends_on_where_in_the_band_the_impact_lies():
    assert integrated(0.3, pace=0.7) == pytest.approx(integrated(0.3, pace=1.4), abs=0.03)


@pytest.mark.parametrize("loss", [0.0, 0.05, 0.5, 1.4])
def test_the_inverse_returns_the_loss_factor(loss):
    assert loss_of_restitution(restitution_of_loss(loss)) == pytest.approx(loss, abs=1e-9)


def test_more_loss_is_less_rebound():
    low, high = restitution_range_of_loss(0.1, 0.4)
    assert 0.0 < low < high < 1.0 == restitution_of_loss(0.0)
