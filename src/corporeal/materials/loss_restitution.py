"""Relation of loss factor and restitution of balls.

A ball that meets a rigid plane loses in its bulk what its loss factor says. Hereditary Hertz contact (Lee and Radok
1960, "The contact problem for viscoelastic bodies"; Ting 1966 for the way back) with a loss factor that hardly depends
on the frequency gives a restitution that depends on that factor alone, whatever the ball's size, speed and stiffness.
"""

from math import exp, log, sqrt

LOG_RESTITUTION_LINEAR, LOG_RESTITUTION_QUADRATIC = -1.385, 0.133
"""Fit of ln e to the loss factor and its square, from 0 to 1.5; within 0.02 of the integral."""


def restitution_of_loss(loss: float) -> float:
    """Restitution e [-] of a ball against a rigid plane: ln e = -1.385 η + 0.133 η².

    Args:
        loss: Loss factor η = tan δ [-], from 0 to 2.
    """
    return exp(LOG_RESTITUTION_LINEAR * loss + LOG_RESTITUTION_QUADRATIC * loss * loss)


def restitution_range_of_loss(low: float, high: float) -> tuple[float, float]:
    """Return the least and the greatest restitution [-] of a range of loss factors."""
    return restitution_of_loss(high), restitution_of_loss(low)


def loss_of_restitution(restitution: float) -> float:
    """Loss factor [-] at which a ball rebounds so: the inverse of ``restitution_of_loss``.

    Args:
        restitution: e [-], from 0.11 (loss 2) to 1.
    """
    inside = LOG_RESTITUTION_LINEAR**2 + 4.0 * LOG_RESTITUTION_QUADRATIC * log(restitution)
    return (-LOG_RESTITUTION_LINEAR - sqrt(inside)) / (2.0 * LOG_RESTITUTION_QUADRATIC)
