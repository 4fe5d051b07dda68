"""The contact sheet of a pool: every asset alone on the floor, with what it is called."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from corporeal.core.types import Vector
from corporeal.geometry.arrangement import box_of, moved
from corporeal.io.glb import read_glb
from corporeal.pool.asset import Asset
from corporeal.render.camera import place
from corporeal.render.embree import render
from corporeal.render.sheet import Tile, sheet
from corporeal.render.stage import Stage

VIEW: Vector = (0.6, -1.0, 0.45)
"""From the front, which is -Y here and +Z in the file, a little from the right and from above."""
FILL = 0.9
"""Share of a picture that an asset takes up."""


def contact_sheet(
    assets: Sequence[Asset], path: Path, size: int, progress: Callable[[float, str], None]
) -> None:
    """Write a PNG of all assets, ``size`` pixels each.

    Raises:
        BadFileError: An asset's file is gone or was changed.

    """
    tiles = []
    for k, asset in enumerate(assets):
        progress(k / len(assets), asset.name)
        tiles.append(_tile(asset, size))
    sheet(tiles, path)


def _tile(asset: Asset, size: int) -> Tile:
    scene = read_glb(asset.file, "one")
    low, high = box_of(scene.surfaces)
    foot = np.array([*(low + high)[:2] / 2, low[2]])
    camera = place(np.stack([low, high])[None, None] - foot, (size, size), VIEW, FILL)
    picture = render(Stage(moved(scene, -foot)), camera, "draft")
    facts = f"{asset.size} · {asset.triangles:,} triangles"
    return Tile(picture, asset.name, (asset.class_name, facts, asset.licence))
