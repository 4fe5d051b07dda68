"""The menu: name → function that builds the model."""

from collections.abc import Callable

from corporeal.showcase import furniture, heaps, plants, snowman, tableware, toys, vessels
from corporeal.showcase.mesh import Model

MODELS: dict[str, Callable[[], Model]] = {
    "rubber_duck": toys.duck,
    "soda_can": vessels.soda_can,
    "mud_pile": heaps.mud_pile,
    "vase": vessels.vase,
    "ball": toys.ball,
    "armchair": furniture.armchair,
    "floor_lamp": vessels.floor_lamp,
    "couch": furniture.couch,
    "potted_ficus": plants.potted_ficus,
    "small_tree": plants.small_tree,
    "sand_pile": heaps.sand_pile,
    "snow_heap": heaps.snow_heap,
    "steel_ball": toys.steel_ball,
    "rubber_ball": toys.rubber_ball,
    "snowman": snowman.snowman,
    "book": toys.book,
    "mug": vessels.mug,
    "cushion": toys.cushion,
    "tumbler": tableware.tumbler,
    "honey": tableware.honey,
    "ketchup": tableware.ketchup,
    "wooden_ball": tableware.wooden_ball,
}
POURED = ("honey", "ketchup")
"""Models of what has no shape of its own: they are no props of a pool."""
PROPS = {name: build for name, build in MODELS.items() if name not in POURED}
