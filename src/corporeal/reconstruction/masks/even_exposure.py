"""Pictures as if all had been taken with one exposure and one white balance.

A telephone chooses both anew for every picture, so that a brown floor has as many browns as there
are pictures, and what is told by colours borders on all of them. What the floor's places look like
in each picture says by how much they differ.
"""

from dataclasses import replace

import numpy as np

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import Plane
from corporeal.multiview.region import Region
from corporeal.reconstruction.masks.floor_colour import DARK, PATCH, colours_on, gains
from corporeal.reconstruction.masks.floor_square import WITNESSES, square
from corporeal.reconstruction.masks.reduced import reduced


def evenly_exposed(views: Views, floor: Plane | None, around: Region, longest: int) -> Views:
    """Return the pictures, each channel of each times one number; as they are: nobody knows these.

    Args:
        views: The pictures.
        floor: The plane that objects stand on; None: nobody knows it.
        around: The ball that all look at.
        longest: Longer side of the pictures that exposures are read from [px].

    """
    if floor is None or len(views.cameras) <= WITNESSES:
        return views
    rough = reduced(views, longest)
    ground = square(rough.cameras, floor, around)
    pairs = zip(rough.rgb, rough.cameras, strict=True)
    gain = gains(np.stack([colours_on(ground, rgb, c, PATCH, DARK) for rgb, c in pairs]))
    rgb = np.empty_like(views.rgb)
    for one, picture, g in zip(rgb, views.rgb, gain, strict=True):
        one[:] = np.clip(np.round(picture * np.exp(-g)), 0, 255)
    return replace(views, rgb=rgb)
