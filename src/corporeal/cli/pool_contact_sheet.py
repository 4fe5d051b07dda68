"""The contact sheet of a pool: every asset on the floor, with its name."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from corporeal.core.types import Vector
from corporeal.geometry.scene_transforms import move_scene, surfaces_bounding_box
from corporeal.io.gltf.gltf_reader import read_glb
from corporeal.pool.asset_pool import PoolAsset
from corporeal.render.camera_placement import fit_camera
from corporeal.render.contact_sheet import SheetTile, write_contact_sheet
from corporeal.render.embree import render_image
from corporeal.render.ray_scene import RayScene

VIEW_DIRECTION: Vector = (0.6, -1.0, 0.45)
"""Front view (-Y here, +Z in the file), slightly from the right and from above."""
PICTURE_FILL_FRACTION = 0.9
"""Share of a picture that an asset takes up."""


def write_pool_contact_sheet(
    assets: Sequence[PoolAsset], path: Path, size: int, progress: Callable[[float, str], None]
) -> None:
    """Write a PNG of all assets, ``size`` pixels each.

    Raises:
        BadFileError: An asset's file is missing or was changed.
    """
    tiles = []
    for k, asset in enumerate(assets):
        progress(k / len(assets), asset.name)
        tiles.append(_tile(asset, size))
    write_contact_sheet(tiles, path)


def _tile(asset: PoolAsset, size: int) -> SheetTile:
    scene = read_glb(asset.file, "one")
    low, high = surfaces_bounding_box(scene.surfaces)
    foot = np.array([*(low + high)[:2] / 2, low[2]])
    camera = fit_camera(
        np.stack([low, high])[None, None] - foot,
        (size, size),
        VIEW_DIRECTION,
        PICTURE_FILL_FRACTION,
    )
    picture = render_image(RayScene(move_scene(scene, -foot)), camera, "draft")
    facts = f"{asset.size} · {asset.triangles:,} triangles"
    return SheetTile(picture, asset.name, (asset.class_name, facts, asset.licence))
