"""Mass properties of the objects of a pool, for settling.

Pieces of uniform density would do for a stone. A pot is heavier than its plant, a can is a wall
around its contents, and a cup on its side rolls to where its handle is lowest.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from corporeal.core import store
from corporeal.pipeline.stages.assemble import AssembleConfig, assemble
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.fill import FillConfig, fill
from corporeal.pipeline.stages.ground import ground
from corporeal.pipeline.stages.segment import segment
from corporeal.pool.asset_pool import PoolAsset
from corporeal.scene.mass_properties import MassProperties, cubes_mass_properties

MASS_CACHE_FOLDER = "matter"
"""Of a pool: what its objects weigh."""
MASS_CACHE_VERSION = 6
"""Of the way objects are weighed: kept results of another version are made anew."""


def asset_mass_properties(
    asset: PoolAsset, extent: float, folder: Path | None = None
) -> MassProperties:
    """Fill an object of the pool with the materials that its names suggest, and weigh it.

    Args:
        asset: What.
        extent: Its largest real extent [m].
        folder: The pool's, where the result is kept; None: nowhere.

    Returns:
        Of the object at its real size, about the middle of its box, +Z up.

    Raises:
        UserError: It cannot be filled.

    """
    config = FillConfig()
    asked = {"extent": round(extent, 6), "class": asset.class_name, "version": MASS_CACHE_VERSION}
    name = store.result_key("weigh", asked | {"detail": config.detail}, [asset.sha256])
    kept = folder / MASS_CACHE_FOLDER / f"{name}.json" if folder else None
    if kept and kept.exists():
        found = store.read_json(kept)
        centre, inertia = np.array(found["centre"]), np.array(found["inertia"])
        surface = found["friction"], found["grip"], tuple(found["materials"])
        return MassProperties(found["mass"], centre, inertia, *surface)
    inertial = _compute_mass_properties(asset, extent, config)
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        store.write_json(kept, store.to_plain(inertial))
    return inertial


def _compute_mass_properties(asset: PoolAsset, extent: float, config: FillConfig) -> MassProperties:
    scene = assemble([asset.file], AssembleConfig(objects="one", extent=(f"{extent:.9g}",)))
    obj = replace(scene.objects[0], class_name=asset.class_name)
    scene = replace(scene, objects=(obj,))
    inventory = describe(scene)
    parts = segment(scene, inventory)
    field = ground(scene, parts, inventory)
    particles = fill(scene, parts, field, config)
    corners = np.concatenate([s.vertices for s in scene.surfaces])
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    sides = np.cbrt(particles.volume)
    inertial = cubes_mass_properties(particles.position - middle, particles.mass, sides)
    # Which part it will stand on is not known yet.
    on_floor = field.friction[:-1, -1]
    return replace(
        inertial,
        friction=float(on_floor.max()),
        grip=float(on_floor.min()),
        materials=tuple(dict.fromkeys(m.name for m in field.materials)),
    )
