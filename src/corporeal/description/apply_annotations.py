"""Annotations by the user, which override every other answer."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

from corporeal import materials
from corporeal.core.types import PartDescription, Scene
from corporeal.description.describe_config import DescribeConfig
from corporeal.description.describe_from_file import OPEN_WARE_MARK
from corporeal.discretization.open_vessel_walls import NamedObject, with_usual_vessel_wall
from corporeal.recognition.lexicon import name_tokens
from corporeal.recognition.parts_by_name import PartsByName
from corporeal.vlm.annotation_file import PartAnnotation, annotated_pieces, apply_structure_annotation, read_annotations
from corporeal.vlm.interpret_answers import merge_pieces

GEOMETRIC_SHARE_FIELDS = ("volume_share", "surface_share")
OPEN_WARE_FIELDS = ("structure", "built_by", "wall_unseen")
"""Fields that annotations of open ware keep: it is never solid."""


def load_annotations(
    scene: Scene, identity: PartsByName, config: DescribeConfig, library: str, from_pictures: Collection[int]
) -> dict[tuple[str, str], PartAnnotation]:
    """Read the annotation file, by object and part, with the library's spelling of names.

    Raises:
        UserError: The file cannot be read, or a name is not in the scene or the library.
    """
    if config.annotations is None:
        return {}
    names = {
        obj.name: [p.name for p in identity.catalogue if p.object == number] for number, obj in enumerate(scene.objects)
    }
    whole = [obj.name for number, obj in enumerate(scene.objects) if number in from_pictures]
    read = read_annotations(Path(config.annotations), names, whole)
    return {key: _with_library_names(one, library) for key, one in read.items()}


def _with_library_names(one: PartAnnotation, library: str) -> PartAnnotation:
    """Write the names of materials as the library spells them."""
    named = [n and materials.find_material_or_default(n, library).name for n in (one.material, one.contents)]
    return replace(one, material=named[0], contents=named[1])


def apply_annotations(
    words: list[PartDescription],
    annotations: Mapping[tuple[str, str], PartAnnotation],
    obj: str,
    config: DescribeConfig,
    extent: float,
) -> list[PartDescription]:
    """Apply the annotations of one object's parts; pieces of one mesh are gathered."""
    path, called = config.annotations, NamedObject([name_tokens(obj)], extent)
    own = [_apply_annotation(annotations.get((obj, w.name)), w, path, called) for w in words]
    pieces = annotated_pieces(annotations, obj, [w.name for w in own])
    if not pieces:
        return own
    known = [_apply_annotation(annotations[obj, p.name], p, path, called) for p in pieces]
    return [merge_pieces(own[0].name, known)]


def _apply_annotation(
    annotation: PartAnnotation | None, words: PartDescription, path: Path | None, called: NamedObject
) -> PartDescription:
    """Override a description by an annotation; fields that it leaves open stay."""
    if annotation is None:
        return words
    where = f"Stated in {Path(str(path)).name}."
    if annotation.material is not None:
        found = PartDescription(words.name, annotation.material, None, None, "annotation", 1.0, where)
        is_open = (words.structure, words.built_by) == OPEN_WARE_MARK
        kept = GEOMETRIC_SHARE_FIELDS + OPEN_WARE_FIELDS if is_open else GEOMETRIC_SHARE_FIELDS
        words = replace(found, **{s: getattr(words, s) for s in kept})
        if is_open:
            words = with_usual_vessel_wall(words, called)
    if annotation.material is not None or annotation.structure is not None or annotation.contents is not None:
        words = replace(words, hypotheses=())  # a person is certain
    known = ((*materials.parse_quantity_key(key), value) for key, value in annotation.values.items())
    values = {field: value * factor for field, factor, value in known}
    return replace(apply_structure_annotation(annotation, words), values=values)
