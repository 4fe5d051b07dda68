"""The showcase's models one by one: a pool of objects that comes with the package."""

from corporeal.core.errors import UnknownChoiceError
from corporeal.core.types import Scene
from corporeal.showcase.models import MODELS
from corporeal.showcase.scenes import Placed, scene_of


def prop(name: str) -> Scene:
    """Build one model as a scene of its own, standing on the floor.

    Raises:
        UnknownChoiceError: There is no model of this name.

    """
    if name not in MODELS:
        raise UnknownChoiceError("showcase model", name, list(MODELS))
    return scene_of(name, [MODELS[name]()], [Placed(name)], duration=1.0)
