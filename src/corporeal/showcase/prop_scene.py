"""The showcase's models one by one: a pool of objects that comes with the package."""

from corporeal.core.errors import UnknownChoiceError
from corporeal.core.types import Scene
from corporeal.showcase.prop_models import PROP_BUILDERS
from corporeal.showcase.showcase_scenes import PlacedModel, scene_of_models


def prop_scene(name: str) -> Scene:
    """Build one model as a scene of its own, standing on the floor.

    Raises:
        UnknownChoiceError: There is no model of this name.

    """
    if name not in PROP_BUILDERS:
        raise UnknownChoiceError("showcase model", name, list(PROP_BUILDERS))
    return scene_of_models(name, [PROP_BUILDERS[name]()], [PlacedModel(name)], duration=1.0)
