"""What the files say of each part: names and surface values, recorded so that no file is needed."""

import json
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corporeal.core.types import Finish, Part, Scene, SceneObject, Surface
from corporeal.lab.evaluation.material_evaluation import RecognitionRow
from corporeal.pipeline.stages.assemble import AssembleConfig, assemble
from corporeal.recognition.metadata_recognition import (
    FileEvidence,
    gather_file_evidence,
    recognise_part,
    substance_hint,
)
from corporeal.recognition.parts_by_name import PartsByName, identify_parts, name_words

HERE = Path(__file__).parent
FACTS = HERE / "facts.json"
SETS = {
    "objects": "34 public objects; their names were known while the vocabulary was written",
    "ycb": "21 scans of real things (YCB); their names were known too",
    "unseen": "names and materials in 70 files of three public collections, listed only afterwards",
    "fresh": "names of 95 files of two more collections, listed when nothing was changed any more",
}
LOOKS = ("name", "colour", "metallic", "roughness", "transmission", "alpha_mode")
DIGITS = 4
FACE = np.array([[0, 1, 2]])
ANYTHING = SceneObject("object_0", "object", real_extent=1.0)
"""What an object is called when its name is withheld."""


@dataclass(frozen=True)
class Fact:
    """One part of one file, with what may be said of it."""

    group: str
    """Which of ``SETS``."""
    file: str
    part: str
    evidence: FileEvidence
    accepted: tuple[str, ...]
    """Materials, the likeliest first."""


def facts(named: bool = True) -> list[Fact]:
    """Return every recorded part with its hand-labelled truth.

    Args:
        named: False withholds what the objects and their files are called.

    """
    truth = tomllib.loads((HERE / "truth.toml").read_text(encoding="utf-8"))
    found = []
    for row in json.loads(FACTS.read_text(encoding="utf-8")):
        scene, identity = _scene(row, named)
        for part, seen in zip(row["parts"], gather_file_evidence(scene, identity), strict=True):
            accepted = tuple(truth[row["set"]][row["file"]][part["part"]])
            found.append(Fact(row["set"], row["file"], part["part"], seen, accepted))
    return found


def judge(recorded: Sequence[Fact]) -> list[RecognitionRow]:
    """Ask the recogniser about every part."""
    rows = []
    for fact in recorded:
        said = recognise_part(fact.evidence)
        answer = (said.material, said.margin, fact.accepted, said.reason)
        rows.append(RecognitionRow(fact.file, fact.part, *answer, group=fact.group))
    return rows


def record(folder: Path) -> list[dict]:
    """Read the parts of the first two sets from their files; keep the third as it is."""
    kept = json.loads(FACTS.read_text(encoding="utf-8")) if FACTS.exists() else []
    paths = [(group, p) for group in ("objects", "ycb") for p in (folder / group).glob("*.glb")]
    rows = [read(group, path) for group, path in sorted(paths)]
    return rows + [row for row in kept if row["set"] not in ("objects", "ycb")]


def read(group: str, path: Path) -> dict:
    """Return what one file says of its parts."""
    scene = assemble([path], AssembleConfig(objects="one"))
    identity = identify_parts(scene, substance_hint)
    parts = []
    for number, part in enumerate(identity.catalogue):
        mine = [scene.surfaces[k] for k in identity.surfaces(number)]
        worn = list(dict.fromkeys(s.finish for s in mine))
        pairs = sorted({(s.name, worn.index(s.finish)) for s in mine})
        finishes = [_look(scene.finishes[f]) for f in worn]
        parts.append({"part": part.name, "surfaces": pairs, "finishes": finishes})
    thing = scene.objects[0]
    names = {"name": thing.name, "class": thing.class_name}
    return {"set": group, "file": path.stem, **names, "parts": parts}


def _look(finish: Finish) -> dict:
    said = {key: getattr(finish, key) for key in LOOKS}
    rounded = {k: round(v, DIGITS) for k, v in said.items() if isinstance(v, float)}
    colour = [round(c, DIGITS) for c in finish.colour]
    return said | rounded | {"colour": colour, "textured": finish.texture is not None}


def _scene(row: dict, named: bool) -> tuple[Scene, PartsByName]:
    """Make a scene that has the names and looks, and no shapes."""
    stem = row["file"]
    name, kind = row.get("name", stem), row.get("class", " ".join(name_words(stem)))
    thing = SceneObject(name, kind, real_extent=1.0, source=f"{stem}.glb") if named else ANYTHING
    surfaces, finishes, owner = [], [], []
    for number, part in enumerate(row["parts"]):
        for surface, look in part["surfaces"]:
            surfaces.append(Surface(surface, 0, len(finishes) + look, np.eye(3), FACE))
            owner.append(number)
        finishes += [_finish(said) for said in part["finishes"]]
    catalogue = tuple(Part(part["part"], 0, "recorded") for part in row["parts"])
    scene = Scene(stem, stem, (thing,), tuple(surfaces), tuple(finishes))
    return scene, PartsByName(catalogue, np.array(owner))


def _finish(said: dict) -> Finish:
    texture = np.zeros((1, 1, 3), dtype=np.uint8) if said["textured"] else None
    values = {key: said[key] for key in LOOKS} | {"colour": tuple(map(float, said["colour"]))}
    return Finish(texture=texture, **values)
