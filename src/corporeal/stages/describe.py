"""Describe: say in words what is in the scene and what each part is made of."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, Field

from corporeal import materials
from corporeal.errors import UnknownChoiceError, UserError
from corporeal.geometry.identity import Identity, identify
from corporeal.types import Inventory, ObjectWords, PartWords, Scene, Surface
from corporeal.vlm import Question, Vlm, connect
from corporeal.vlm.annotation import Annotation, read_annotations
from corporeal.vlm.metadata import (
    Evidence,
    matter_hint,
    recognise,
    stated_substance,
    stated_thickness,
)

RECORDED_MARGIN = 0.7
PROMPT = """What are the parts of this object made of?

Object: {name} ({class_name}).
Parts: {parts}.

Answer for every part, with exactly these part names:
- material: one name from the list below, or null when you cannot tell;
- structure: "solid" when the material fills the part's shape, "shell" when it is only a wall \
along its surface, or null when you cannot tell;
- thickness_mm: the wall's thickness for a shell, else null;
- reason: one sentence.

Materials: {materials}."""


@dataclass(frozen=True)
class DescribeConfig:
    """Who is asked what things are made of."""

    annotations: Path | None = None
    """YAML file that says what parts are made of; believed before anybody else."""
    vlm: str = "metadata"
    """"metadata": names and materials in the file; "replay:FOLDER": recorded answers of a model."""


class PartAnswer(BaseModel):
    """A model's answer about one part."""

    part: str
    material: str | None
    structure: Literal["solid", "shell"] | None = None
    thickness_mm: float | None = Field(default=None, gt=0, lt=1e4, allow_inf_nan=False)
    reason: str = ""


class MaterialsAnswer(BaseModel):
    """A model's answer about one object."""

    parts: list[PartAnswer]


DEFAULT = DescribeConfig()


def describe(scene: Scene, config: DescribeConfig = DEFAULT) -> Inventory:
    """Name every object's parts and their materials; the first that knows answers.

    Annotation file, then recorded answers, then the file's own names, then unknown.

    Raises:
        UserError: An annotation or a recording does not fit the scene, or nobody can be asked.

    """
    identity = identify(scene, matter_hint)
    told = _annotations(scene, identity, config)
    model = connect(config.vlm)
    objects: list[ObjectWords] = []
    transcript: list[dict] = []
    for number, thing in enumerate(scene.objects):
        parts = [k for k, p in enumerate(identity.catalogue) if p.object == number]
        recorded = _ask(model, scene, number, identity, transcript) if model else {}
        words = []
        for part in parts:
            name = identity.catalogue[part].name
            from_file = _from_file(scene, identity, part)
            answer = recorded.get(name, from_file)
            words.append(_annotated(told.get((thing.name, name)), answer, config.annotations))
        objects.append(ObjectWords(thing.name, thing.class_name, tuple(words)))
    return Inventory(tuple(objects), tuple(transcript))


# ---------------------------------------------------------------- the file's own names


def _from_file(scene: Scene, identity: Identity, part: int) -> PartWords:
    entry = identity.catalogue[part]
    surfaces = [scene.surfaces[s] for s in identity.surfaces(part)]
    thickness = stated_thickness(surfaces)
    words = _stated(surfaces) or recognise(_evidence(scene, identity, part, surfaces))
    by = "metadata" if words.material else "unknown"
    words = replace(words, name=entry.name, answered_by=by)
    if thickness is None:
        return words
    return replace(
        words, structure="shell" if thickness > 0 else "solid", thickness=thickness or None
    )


def _stated(surfaces: list[Surface]) -> PartWords | None:
    substance = stated_substance(surfaces)
    if substance is None:
        return None
    try:
        entry = materials.find(substance)
    except UnknownChoiceError:
        return None  # a foreign file's word: names may still tell
    return PartWords("", entry.name, margin=1.0, reason=f"The file states it: {substance!r}.")


def _evidence(scene: Scene, identity: Identity, part: int, surfaces: list[Surface]) -> Evidence:
    number = identity.catalogue[part].object
    worn = [scene.finishes[s.finish] for s in scene.surfaces if s.object == number]
    own = dict.fromkeys(s.finish for s in surfaces)
    return Evidence(
        surfaces=surfaces,
        finishes=[scene.finishes[f] for f in own],
        thing=scene.objects[number],
        alone=sum(p.object == number for p in identity.catalogue) == 1,
        metallic_means_something=any(f.metallic < 1.0 for f in worn),
    )


# ---------------------------------------------------------------- a model's recorded answers


def question(scene: Scene, number: int, identity: Identity) -> Question:
    """Put the question about one object's parts; its list of materials comes from the library."""
    thing = scene.objects[number]
    parts = [p.name for p in identity.catalogue if p.object == number]
    prompt = PROMPT.format(
        name=thing.name,
        class_name=thing.class_name,
        parts="; ".join(parts),
        materials=", ".join(materials.library()),
    )
    return Question("materials", prompt, f"{scene.name}/{thing.name}")


def _ask(
    model: Vlm, scene: Scene, number: int, identity: Identity, transcript: list[dict]
) -> dict[str, PartWords]:
    asked = question(scene, number, identity)
    answer = model.ask(asked, MaterialsAnswer)
    transcript.append(
        {"task": asked.task, "scene": asked.scene, "prompt": asked.prompt}
        | {"answer": answer.model_dump()}
    )
    known = {p.name for p in identity.catalogue if p.object == number}
    strange = [p.part for p in answer.parts if p.part not in known]
    if strange:
        raise UserError(
            f"The recorded answer about {asked.scene!r} speaks of a part {strange[0]!r}. Its parts "
            f"are: {', '.join(sorted(known))}. Record it again."
        )
    return {p.part: _recorded(p) for p in answer.parts if p.material is not None}


def _recorded(answer: PartAnswer) -> PartWords:
    return PartWords(
        name=answer.part,
        material=materials.find(str(answer.material)).name,
        structure=answer.structure,
        thickness=None if answer.thickness_mm is None else answer.thickness_mm * 1e-3,
        answered_by="recording",
        margin=RECORDED_MARGIN,
        reason=answer.reason or "A model said so; the answer was recorded without a reason.",
    )


# ---------------------------------------------------------------- what a person says


def _annotations(
    scene: Scene, identity: Identity, config: DescribeConfig
) -> dict[tuple[str, str], Annotation]:
    if config.annotations is None:
        return {}
    names = {
        thing.name: [p.name for p in identity.catalogue if p.object == number]
        for number, thing in enumerate(scene.objects)
    }
    return read_annotations(Path(config.annotations), names)


def _annotated(said: Annotation | None, words: PartWords, path: Path | None) -> PartWords:
    """Let what a person said replace what was found; what they left open stays."""
    if said is None:
        return words
    where = f"Stated in {Path(str(path)).name}."
    if said.material is not None:
        entry = materials.find(said.material)
        words = PartWords(words.name, entry.name, None, None, "annotation", 1.0, where)
    structure = said.structure or ("shell" if said.thickness is not None else None)
    if structure == "shell":
        words = replace(words, structure="shell", thickness=said.thickness or words.thickness)
    elif structure == "solid":
        words = replace(words, structure="solid", thickness=None)
    values = {}
    for key, value in said.values.items():
        field, factor = materials.si(key)
        values[field] = value * factor
    return replace(words, values=values)
