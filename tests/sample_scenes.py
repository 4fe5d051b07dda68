"""Scenes made by hand: names and looks matter here, shapes do not."""

import numpy as np

from corporeal.core.types import Finish, Scene, SceneObject, Surface

CORNER = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def scene(*objects, name="hand-made"):
    """Each object: (name, [(surface name, Finish, extras), ...])."""
    things, surfaces, finishes = [], [], []
    for number, (thing, parts) in enumerate(objects):
        words = " ".join(w for w in thing.split("_") if not w.isdigit())
        things.append(SceneObject(thing, words, real_extent=1.0))
        for surface, finish, extras in parts:
            finishes.append(finish)
            surfaces.append(Surface(surface, number, len(finishes) - 1, CORNER, FACES, extras=extras))
    return Scene(name, "by hand", tuple(things), tuple(surfaces), tuple(finishes))


def plain(name="Material.001", **look):
    return Finish(name, **look)
