"""Describe: name the objects of the scene and the materials of their parts."""

from collections.abc import Collection
from dataclasses import replace

from corporeal.core.progress import Progress, no_progress
from corporeal.core.types import Inventory, ObjectDescription, PartDescription, Scene
from corporeal.description.apply_annotations import apply_annotations, load_annotations
from corporeal.description.describe_config import DEFAULT_DESCRIBE_CONFIG, DescribeConfig, validate
from corporeal.description.describe_from_file import open_ware_notes, parts_from_file
from corporeal.description.query_scene import SceneQuery
from corporeal.recognition.contents_from_name import unused_contents_notes
from corporeal.recognition.metadata_recognition import substance_hint
from corporeal.recognition.parts_by_name import identify_parts
from corporeal.vlm import choose_critic, connect_vlm


def describe(
    scene: Scene,
    config: DescribeConfig = DEFAULT_DESCRIBE_CONFIG,
    library: str = "default",
    progress: Progress = no_progress,
    from_pictures: Collection[int] = (),
) -> Inventory:
    """Name every object's parts and their materials.

    Answers are taken, in this order, from the annotation file, a model (or its recorded answers) and the names in the
    file; the rest is unknown. A model is also asked where in the measured ranges each value lies, and how large such
    objects usually are.

    Args:
        scene: What was assembled.
        config: Sources of answers.
        library: The library whose names and ranges a model is offered.
        progress: Called with the fraction done and a description.
        from_pictures: Objects from pictures, by number: one surface each. An annotation may name their pieces; their
            surface does not show the thickness of walls, as those of models do.

    Raises:
        UserError: An annotation or a recording does not fit the scene, a model is unavailable, or questions wait for a
            person's answers.
    """
    made = _describe_scene(scene, config, library, progress, from_pictures)
    with_walls = (_with_unseen_walls(o) if k in from_pictures else o for k, o in enumerate(made.objects))
    return replace(made, objects=tuple(with_walls))


def _with_unseen_walls(thing: ObjectDescription) -> ObjectDescription:
    """Mark the walls of all parts, in each answer, as not visible from inside."""
    answers = (replace(one, parts=tuple(map(_wall_unseen, one.parts))) for one in thing.answers)
    return replace(thing, parts=tuple(map(_wall_unseen, thing.parts)), answers=tuple(answers))


def _wall_unseen(words: PartDescription) -> PartDescription:
    return replace(words, wall_unseen=True, pieces=tuple(map(_wall_unseen, words.pieces)))


def _describe_scene(
    scene: Scene, config: DescribeConfig, library: str, progress: Progress, from_pictures: Collection[int]
) -> Inventory:
    validate(config)
    identity = identify_parts(scene, substance_hint)
    annotations = load_annotations(scene, identity, config, library, from_pictures)
    model = connect_vlm(config.vlm, config.record)
    file = parts_from_file(scene, identity, library, from_pictures, unasked=model is None)
    if model is None:
        objects = [
            ObjectDescription(
                obj.name,
                obj.class_name,
                tuple(apply_annotations(words, annotations, obj.name, config, obj.real_extent)),
            )
            for obj, words in zip(scene.objects, file, strict=True)
        ]
        open_made = open_ware_notes([o for k, o in enumerate(objects) if k in from_pictures])
        return Inventory(tuple(objects), warnings=(*open_made, *unused_contents_notes(scene, objects)))
    critic = connect_vlm(choose_critic(config.vlm, config.critic), config.record) or model
    asking = SceneQuery(scene, identity, config, library, model, critic)
    return asking.inventory(file, annotations, progress)
