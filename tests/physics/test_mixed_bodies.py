"""Bodies of several substances: what one part forgets, another must not remember."""

from dataclasses import replace

import numpy as np
from laws.bodies import box, problem

from corporeal.core.types import Law


def test_a_body_of_metal_and_rubber_falls_like_any_other(engine):
    """Momentum is kept although the substances differ in how they would carry velocities."""
    block = box((0.0, 0.0, 1.0), (0.2, 0.2, 0.2), 0.02)
    low = block.position[:, 2] < 1.0
    law = np.where(low, Law.VON_MISES.value, block.law)
    block = replace(
        block,
        law=law,
        yield_stress=np.full(len(law), 1e9),
        velocity=block.velocity + 0.1 * np.sin(40.0 * block.position[:, ::-1]),
    )
    run = engine(problem(block, cell=0.04))
    before = run.measure().momentum[0]
    run.advance(0.05)
    drift = np.linalg.norm(run.measure().momentum[0] - before)
    scale = float(np.sum(block.volume * block.density) * np.abs(block.velocity).max())
    assert drift < engine.round_off * scale
