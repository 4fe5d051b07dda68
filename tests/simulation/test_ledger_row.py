"""What a row of the ledger takes from particles."""

import numpy as np

from corporeal.mpm.problem import Snapshot
from corporeal.simulation.ledger_row import volume_shares


def test_only_what_is_squeezed_counts_for_less():
    """At rest, turned, squeezed, stretched, turned inside out, lost."""
    turned = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    motion = np.stack([np.diag(d) for d in ([1.0, 1, 1], [0.4, 1, 1], [2, 1, 1], [-0.4, 1, 1])])
    motion = np.stack([motion[0], turned, *motion[1:], np.full((3, 3), np.nan)])
    still = np.zeros((len(motion), 3))
    now = Snapshot(0.0, still, still, motion, motion, np.zeros(len(motion)))
    np.testing.assert_allclose(volume_shares(now), [1, 1, 0.4, 1, 1, 1])
