"""Describe: say in words what is in the scene and what each part is made of."""

from collections.abc import Callable, Collection
from dataclasses import replace

from corporeal.core.types import (
    Inventory,
    ObjectWords,
    PartWords,
    Scene,
)
from corporeal.description.annotated import annotations_of, with_annotations
from corporeal.description.asking import Asking
from corporeal.description.describe_config import DEFAULT, DescribeConfig, validate
from corporeal.description.file_words import open_ware, words_of_file
from corporeal.recognition.identity import identify
from corporeal.recognition.metadata import (
    matter_hint,
)
from corporeal.recognition.said_contents import not_filled
from corporeal.vlm import connect, critic_of

Progress = Callable[[float, str], None]


def describe(
    scene: Scene,
    config: DescribeConfig = DEFAULT,
    library: str = "default",
    progress: Progress = lambda fraction, words: None,
    from_pictures: Collection[int] = (),
) -> Inventory:
    """Name every object's parts and their materials.

    Answers are taken, in this order, from the annotation file, a model (or its recorded answers)
    and the names in the file; what none of them knows is unknown. A model is also asked where in
    the measured ranges each value lies, and how large such objects usually are.

    Args:
        scene: What was assembled.
        config: Whom to ask.
        library: The library whose names and ranges a model is offered.
        progress: Told the fraction done and what is being done.
        from_pictures: Which objects are, by number: one surface each. An annotation may name the
            pieces of one, and how thick the surface draws a wall tells nothing, whoever says that
            there is one. Models beside them show their walls.

    Raises:
        UserError: An annotation or a recording does not fit the scene, nobody can be asked, or
            questions wait for a person's answers.

    """
    made = _described(scene, config, library, progress, from_pictures)
    told = (_pictured(o) if k in from_pictures else o for k, o in enumerate(made.objects))
    return replace(made, objects=tuple(told))


def _pictured(thing: ObjectWords) -> ObjectWords:
    """Say of all parts, in each answer, that pictures need not show the inside of their walls."""
    answers = (replace(one, parts=tuple(map(_unseen, one.parts))) for one in thing.answers)
    return replace(thing, parts=tuple(map(_unseen, thing.parts)), answers=tuple(answers))


def _unseen(words: PartWords) -> PartWords:
    return replace(words, wall_unseen=True, pieces=tuple(map(_unseen, words.pieces)))


def _described(
    scene: Scene,
    config: DescribeConfig,
    library: str,
    progress: Progress,
    from_pictures: Collection[int],
) -> Inventory:
    validate(config)
    identity = identify(scene, matter_hint)
    annotations = annotations_of(scene, identity, config, library, from_pictures)
    model = connect(config.vlm, config.record)
    file = words_of_file(scene, identity, library, from_pictures, unasked=model is None)
    if model is None:
        objects = [
            ObjectWords(
                obj.name,
                obj.class_name,
                tuple(with_annotations(words, annotations, obj.name, config, obj.real_extent)),
            )
            for obj, words in zip(scene.objects, file, strict=True)
        ]
        open_made = open_ware([o for k, o in enumerate(objects) if k in from_pictures])
        return Inventory(tuple(objects), warnings=(*open_made, *not_filled(scene, objects)))
    critic = connect(critic_of(config.vlm, config.critic), config.record) or model
    asking = Asking(scene, identity, config, library, model, critic)
    return asking.inventory(file, annotations, progress)
