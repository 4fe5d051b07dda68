"""Ledgers of made-up trajectories: zero but for what is given."""

from dataclasses import fields

import numpy as np

from corporeal.core.types import Ledger

VECTORS = ("centre", "momentum", "angular_momentum", "external_impulse")
COUNTS = ("lost", "steps", "nan")


def ledger(time, objects=1, **given):
    """Objects and a floor at one instant or, where ``time`` is an array, at several."""
    one = dict.fromkeys(("mass", "kinetic", "elastic", "potential", "flow", "rms_speed"), (objects,))
    one |= dict.fromkeys(VECTORS, (objects, 3))
    one |= dict.fromkeys(("pair_impulse", "gap", "overlap"), (objects, objects))
    one |= dict.fromkeys(("first_contact", "last_contact", "impact_of_pair"), (objects + 1, objects + 1))
    one |= {"contact_point": (objects + 1, objects + 1, 3), "plane_depth": (1, objects)}
    one |= {"plane_impulse": (1, objects, 3)}
    zero = {
        f.name: np.zeros((*np.shape(time), *one.get(f.name, ())), int if f.name in COUNTS else float)
        for f in fields(Ledger)
    }
    return Ledger(**zero | {"time": np.array(time)} | given)
