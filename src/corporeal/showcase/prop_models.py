"""Registry of props: name → function that builds the model."""

from collections.abc import Callable

from corporeal.showcase import furniture, granular_heaps, plants, snowman, toys, vessels
from corporeal.showcase.prop_mesh import PropModel

PROP_BUILDERS: dict[str, Callable[[], PropModel]] = {
    "rubber_duck": toys.rubber_duck,
    "soda_can": vessels.soda_can,
    "mud_pile": granular_heaps.mud_pile,
    "vase": vessels.vase,
    "ball": toys.play_ball,
    "armchair": furniture.armchair,
    "floor_lamp": vessels.floor_lamp,
    "couch": furniture.couch,
    "potted_ficus": plants.potted_ficus,
    "small_tree": plants.small_tree,
    "sand_pile": granular_heaps.sand_pile,
    "snow_heap": granular_heaps.snow_heap,
    "steel_ball": toys.steel_ball,
    "rubber_ball": toys.rubber_ball,
    "snowman": snowman.snowman,
    "book": toys.cloth_bound_book,
    "mug": vessels.mug,
    "cushion": toys.throw_pillow,
    "tumbler": vessels.tumbler,
    "honey": vessels.honey,
    "ketchup": vessels.ketchup,
    "wooden_ball": vessels.wooden_ball,
}
POURED_MODELS = ("honey", "ketchup")
"""Models of what has no shape of its own: they are no props of a pool."""
POOL_PROP_BUILDERS = {name: build for name, build in PROP_BUILDERS.items() if name not in POURED_MODELS}
