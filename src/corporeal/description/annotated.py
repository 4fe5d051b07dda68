"""A person's annotations, before which every other answer gives way."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

from corporeal import materials
from corporeal.core.types import (
    PartWords,
    Scene,
)
from corporeal.description.describe_config import DescribeConfig
from corporeal.description.file_words import OPEN
from corporeal.discretization.ware import Called, with_usual_wall
from corporeal.recognition.identity import Identity
from corporeal.recognition.lexicon import tokens_of
from corporeal.vlm.annotation import Annotation, built, named_pieces, read_annotations
from corporeal.vlm.words import (
    gathered,
)

SHARES = ("volume_share", "surface_share")
BUILT = ("structure", "built_by", "wall_unseen")
"""Kept of open ware, which is no solid whatever it is made of."""


def annotations_of(
    scene: Scene,
    identity: Identity,
    config: DescribeConfig,
    library: str,
    from_pictures: Collection[int],
) -> dict[tuple[str, str], Annotation]:
    """Return what the annotation file says, by object and part; names as the library spells them.

    Raises:
        UserError: The file cannot be read, or names what the scene or the library has not.

    """
    if config.annotations is None:
        return {}
    names = {
        obj.name: [p.name for p in identity.catalogue if p.object == number]
        for number, obj in enumerate(scene.objects)
    }
    whole = [obj.name for number, obj in enumerate(scene.objects) if number in from_pictures]
    read = read_annotations(Path(config.annotations), names, whole)
    return {key: _spelt(one, library) for key, one in read.items()}


def _spelt(one: Annotation, library: str) -> Annotation:
    """Write the names of materials as the library spells them."""
    named = [n and materials.named(n, library).name for n in (one.material, one.contents)]
    return replace(one, material=named[0], contents=named[1])


def with_annotations(
    words: list[PartWords],
    annotations: Mapping[tuple[str, str], Annotation],
    obj: str,
    config: DescribeConfig,
    extent: float,
) -> list[PartWords]:
    """Return one object's parts as a person says they are; pieces of one mesh are gathered."""
    path, called = config.annotations, Called([tokens_of(obj)], extent)
    own = [_annotated(annotations.get((obj, w.name)), w, path, called) for w in words]
    pieces = named_pieces(annotations, obj, [w.name for w in own])
    if not pieces:
        return own
    known = [_annotated(annotations[obj, p.name], p, path, called) for p in pieces]
    return [gathered(own[0].name, known)]


def _annotated(
    annotation: Annotation | None,
    words: PartWords,
    path: Path | None,
    called: Called,
) -> PartWords:
    """Let an annotation replace what was found; what it leaves open stays.

    Args:
        annotation: None: nobody says anything.
        words: What was found.
        path: Of the file that says it.
        called: The object.

    """
    if annotation is None:
        return words
    where = f"Stated in {Path(str(path)).name}."
    if annotation.material is not None:
        found = PartWords(words.name, annotation.material, None, None, "annotation", 1.0, where)
        is_open = (words.structure, words.built_by) == OPEN
        kept = SHARES + BUILT if is_open else SHARES
        words = replace(found, **{s: getattr(words, s) for s in kept})
        if is_open:
            words = with_usual_wall(words, called)
    if (
        annotation.material is not None
        or annotation.structure is not None
        or annotation.contents is not None
    ):
        words = replace(words, hypotheses=())  # a person is certain
    known = ((*materials.si(key), value) for key, value in annotation.values.items())
    values = {field: value * factor for field, factor, value in known}
    return replace(built(annotation, words), values=values)
