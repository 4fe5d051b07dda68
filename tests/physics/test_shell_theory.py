"""Shells against theory: the cases of the validation, coarse."""

import pytest
from laws import shells


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        shells.bending_strip,
        shells.stretched_strip,
        shells.twisted_tubes,
        shells.buckling_strip,
        shells.inflated_sphere,
        shells.own_weight,
        shells.pressed_plate,
        shells.shells_on_grid,
    ],
)
def test_a_shell_by_itself_is_as_stiff_as_theory_says(case):
    outcome = case(True)
    assert outcome.met, [f"{c.quantity}: {c.value:.4g} of {c.reference:.4g}" for c in outcome.checks if not c.met]


def test_a_thickened_wall_misses_torsion():
    """The control: E r³ keeps bending, and makes a closed tube a hundred times too soft in torsion."""
    closed, _, ratio = shells.twisted_tubes(True).checks
    assert closed.control is not None and closed.control < 0.02 * closed.reference
    assert ratio.control is not None and ratio.control < 0.02 * ratio.reference
