"""How a ball of a lossy material rebounds: its loss factor and its restitution are one thing.

A ball that meets a rigid plane loses in its bulk what its loss factor says. Hereditary Hertz
contact (Lee and Radok 1960, "The contact problem for viscoelastic bodies"; Ting 1966 for the way
back) with a loss factor that hardly depends on the frequency gives a restitution that depends on
that factor alone, whatever the ball's size, speed and stiffness.
"""

from math import exp, log, sqrt

LINEAR, QUADRATIC = -1.385, 0.133
"""Fit of ln e to the loss factor and its square, from 0 to 1.5; within 0.02 of the integral."""


def rebound(loss: float) -> float:
    """Restitution e [-] of a ball against a rigid plane: ln e = -1.385 η + 0.133 η².

    Args:
        loss: Loss factor η = tan δ [-], from 0 to 2.

    """
    return exp(LINEAR * loss + QUADRATIC * loss * loss)


def rebound_range(low: float, high: float) -> tuple[float, float]:
    """Return the least and the greatest restitution [-] of a range of loss factors."""
    return rebound(high), rebound(low)


def loss_of(restitution: float) -> float:
    """Loss factor [-] at which a ball rebounds so: the inverse of ``rebound``.

    Args:
        restitution: e [-], from 0.11 (loss 2) to 1.

    """
    inside = LINEAR**2 + 4.0 * QUADRATIC * log(restitution)
    return (-LINEAR - sqrt(inside)) / (2.0 * QUADRATIC)
