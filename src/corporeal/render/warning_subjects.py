"""Parts and objects named in warnings."""

import re

from corporeal.core.types import Parts, Scene


def parts_named_in(sentence: str, scene: Scene, parts: Parts) -> list[int]:
    """Return the parts that a sentence is about.

    Those that it names as "object: part"; or else all parts of the objects that it names, also as "Object 2 of the
    scene". A name counts where no letter, digit or underscore stands beside it.
    """
    owners = [scene.objects[part.object].name for part in parts.catalogue]
    named = [
        k
        for k, (owner, part) in enumerate(zip(owners, parts.catalogue, strict=True))
        if _mentions(sentence, f"{owner}: {part.name}")
    ]
    counted = {int(number) - 1 for number in re.findall(r"Object (\d+) of the scene", sentence)}
    return named or [
        k
        for k, (owner, part) in enumerate(zip(owners, parts.catalogue, strict=True))
        if _mentions(sentence, owner) or part.object in counted
    ]


def _mentions(sentence: str, name: str) -> bool:
    return bool(name) and re.search(rf"(?<!\w){re.escape(name)}(?!\w)", sentence) is not None
