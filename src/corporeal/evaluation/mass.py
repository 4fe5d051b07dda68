"""Mass: how well what was recognised predicts what the scales said.

The ladder of what is known, each step in the same run: the scan's volume as water; everything
solid and usual; how things are built and filled, with usual values; and values placed in their
ranges. Beside it stand a constant, a fit on the size, and a model that is asked for the number.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, Field
from scipy.spatial import ConvexHull

from corporeal import store
from corporeal.errors import UserError
from corporeal.evaluation.baselines import constant, hull_fit, solid_water
from corporeal.evaluation.metrics import coverage, errors
from corporeal.evaluation.truth import Weighed
from corporeal.geometry.arrangement import life_sized
from corporeal.geometry.make import weight
from corporeal.geometry.room import is_vessel, room_of
from corporeal.geometry.survey import Anatomy
from corporeal.materials.ensemble import otherwise, sample
from corporeal.render.portrait import Portrait, portraits
from corporeal.stages.assemble import assemble
from corporeal.stages.describe import DescribeConfig, describe
from corporeal.stages.fill import examine
from corporeal.stages.ground import GroundConfig, ground
from corporeal.stages.segment import segment
from corporeal.types import Inventory, MaterialField, Parts, PartWords, Scene
from corporeal.vlm import LIVE, Question, connect
from corporeal.vlm.by_hand import all_answered, is_more
from corporeal.vlm.together import together

LOW, HIGH = 0.05, 0.95
"""Quantiles of the samples that bound the interval."""
METHODS = {
    "solid_water": "solid water",
    "constant": "mean of the others",
    "hull_fit": "fit on the hull",
    "direct": "asked for the number",
    "solid_usual": "solid, usual values",
    "built_usual": "as built, usual values",
    "mass": "as built, placed values",
}
"""From knowing least to knowing most; the last is the prediction."""
PROMPT = """How heavy is this object?

Object: {name}, longest side {extent}.

The pictures show it from several sides. Say its mass as it is, with whatever is in it."""


class MassAnswer(BaseModel):
    """A model's answer when it is asked for the number itself."""

    mass_kg: float = Field(gt=0, lt=1e5, allow_inf_nan=False)
    reason: str = ""


@dataclass(frozen=True)
class MassConfig:
    """How masses are predicted."""

    anonymous: bool = False
    """Hide file names, class names and the names inside the files: whoever is asked sees pictures
    and a neutral name."""
    direct: bool = False
    """Also ask the model for the number itself."""
    samples: int = 200
    """Sets of values that are drawn for the interval."""
    seed: int = 0


@dataclass(frozen=True)
class Prediction:
    """One object's mass by every method, all [kg]."""

    object: str
    fill: str
    mass_true: float | None
    mass: float
    low: float
    high: float
    solid_water: float
    solid_usual: float
    built_usual: float
    direct: float | None
    volume_m3: float
    hull_m3: float
    described: str
    """What it was taken for."""
    asked_as: str
    """The name it was recognised under."""


Progress = Callable[[float, str], None]


def predict_all(
    objects: Sequence[Weighed],
    describing: DescribeConfig,
    grounding: GroundConfig,
    config: MassConfig,
    progress: Progress = lambda fraction, words: None,
) -> list[Prediction]:
    """Predict every object's mass; a model that answers over a network is asked in parallel.

    Raises:
        UserError: What the first object that failed says, or how many questions about all of them
            wait for a person's answers.

    """
    live = describing.vlm.partition(":")[0] in LIVE
    jobs = [partial(predict, thing, describing, grounding, config) for thing in objects]
    results = together(
        jobs,
        describing.parallel if live else 1,
        lambda done: progress(done / len(jobs), f"{done} of {len(jobs)} objects"),
    )
    failed = [r for r in results if isinstance(r, Exception) and is_more(r)]
    if not failed:
        all_answered(results, describing.vlm)
    if failed and isinstance(failed[0], UserError) and len(failed) > 1:
        raise UserError(f"{len(failed)} of {len(jobs)} objects could not be judged. {failed[0]}")
    for error in failed:
        raise error
    return [r for r in results if isinstance(r, Prediction)]


def predict(
    thing: Weighed, describing: DescribeConfig, grounding: GroundConfig, config: MassConfig
) -> Prediction:
    """Predict one object's mass at its real size by every method that needs no other object."""
    scene = life_sized(assemble([thing.file]))
    if config.anonymous:
        scene = anonymous(scene, thing.file)
    inventory = describe(scene, describing, grounding.library)
    direct = _ask(scene, describing) if config.direct else None
    parts = segment(scene, inventory)
    scale = Scale(scene, parts, grounding, config.seed)
    masses = scale.samples(inventory, config.samples)
    low, high = np.quantile(masses, [LOW, HIGH])
    everything = np.concatenate([a.vertices for a in scale.anatomies])
    return Prediction(
        object=thing.name,
        fill=thing.fill,
        mass_true=thing.mass,
        mass=scale.mass(inventory),
        low=float(low),
        high=float(high),
        solid_water=solid_water([scale.volume])[0],
        solid_usual=scale.mass(_every(inventory, _solid)),
        built_usual=scale.mass(_every(inventory, _usual)),
        direct=direct,
        volume_m3=scale.volume,
        hull_m3=float(ConvexHull(everything).volume),
        described=_told(inventory),
        asked_as=scene.name,
    )


class Scale:
    """Weighs one scene as it is described; measures its meshes once."""

    def __init__(self, scene: Scene, parts: Parts, grounding: GroundConfig, seed: int) -> None:
        self.scene, self.parts, self.grounding, self.seed = scene, parts, grounding, seed
        self.anatomies: list[Anatomy] = examine(scene, parts, seed)
        members = [(a, m) for a in self.anatomies for m in a.members]
        self.members = [m for _, m in members]
        self.rooms = [
            room_of(a, m, 0.0, np.random.default_rng([seed, m.part, 5])).volume
            if is_vessel(m)
            else 0.0
            for a, m in members
        ]
        self.volume = sum(m.volume for m in self.members)
        """Of everything that is enclosed [m³]."""

    def mass(self, inventory: Inventory) -> float:
        """Return the mass of the whole scene [kg]."""
        return self.of(ground(self.scene, self.parts, inventory, self.grounding))

    def of(self, field: MaterialField) -> float:
        """Return the mass of the whole scene made of given materials [kg]."""
        rows = zip(self.members, self.rooms, strict=True)
        return sum(weight(member, field, room) for member, room in rows)

    def samples(self, inventory: Inventory, count: int) -> list[float]:
        """Draw masses over the ranges and the alternatives [kg]."""
        library, floor = self.grounding.library, self.grounding.floor
        owner = [p.object for p in self.parts.catalogue]
        found = []
        for number in range(count):
            rng = np.random.default_rng([self.seed, number])
            words = otherwise(inventory, rng, library)
            field = ground(self.scene, self.parts, words, self.grounding)
            found.append(self.of(sample(field, owner, rng, library, floor)))
        return found


# ---------------------------------------------------------------- what is left out


def anonymous(scene: Scene, file: Path) -> Scene:
    """Replace every name that could tell what a thing is by a neutral one, made from its content.

    Pictures stay as they are: what is printed on a thing can still be read.
    """
    name = f"object-{store.digest(file)[:6]}"
    things = tuple(
        replace(o, name=_numbered(name, k), class_name="object", source=f"{name}.glb", credit="")
        for k, o in enumerate(scene.objects)
    )
    surfaces = tuple(
        replace(s, name=f"surface {k}", extras={}) for k, s in enumerate(scene.surfaces)
    )
    finishes = tuple(replace(f, name=f"finish {k}") for k, f in enumerate(scene.finishes))
    return replace(
        scene,
        name=name,
        source=f"{name}.glb",
        objects=things,
        surfaces=surfaces,
        finishes=finishes,
        warnings=(),
    )


def _numbered(name: str, k: int) -> str:
    return name if k == 0 else f"{name}-{k}"


def _every(inventory: Inventory, change: Callable[[PartWords], PartWords]) -> Inventory:
    objects = tuple(replace(o, parts=tuple(change(p) for p in o.parts)) for o in inventory.objects)
    return replace(inventory, objects=objects)


def _usual(words: PartWords) -> PartWords:
    """Keep materials, structure and contents; leave every value where it usually lies."""
    pieces = tuple(_usual(p) for p in words.pieces)
    return replace(words, placements={}, values={}, pieces=pieces)


def _solid(words: PartWords) -> PartWords:
    """Keep the materials only."""
    words = replace(_usual(words), structure="solid", thickness=None, contents=None, fill=None)
    return replace(words, pieces=tuple(_solid(p) for p in words.pieces))


def _told(inventory: Inventory) -> str:
    parts = [leaf for o in inventory.objects for p in o.parts for leaf in (p.pieces or (p,))]
    return "; ".join(_piece_told(p) for p in parts)


def _piece_told(words: PartWords) -> str:
    said = f"{words.name}: {words.material or 'unknown'}"
    said += f", {words.structure}" if words.structure else ""
    return said + (f" of {words.contents}" if words.contents else "")


# ---------------------------------------------------------------- the number itself


def _ask(scene: Scene, describing: DescribeConfig) -> float:
    model = connect(describing.vlm)
    if model is None:
        raise UserError("Nobody is there to be asked for a mass. Name a model with --vlm.")
    portrait = Portrait(describing.views, describing.view_size, describing.view_seed)
    shown: list[int | None] = [0] * len(scene.surfaces)
    extent = max(o.real_extent for o in scene.objects)
    question = Question(
        task="mass",
        prompt=PROMPT.format(name=scene.name, extent=f"{100 * extent:.3g} cm"),
        scene=scene.name,
        views=portrait.words,
        pictures=portraits(scene, shown, portrait) if model.looks else (),
    )
    return model.ask(question, MassAnswer).answer.mass_kg


# ---------------------------------------------------------------- against the scales


def compare(predictions: Sequence[Prediction]) -> dict:
    """Return rows and errors, over all and per fill group, as plain data.

    Returns:
        ``rows``: one per object, with every method's mass. ``metrics[group][method]``: ``count``,
        ``ade`` [kg], ``alde``, ``ape``, ``mnre``, ``within_2``. ``coverage[group]``: share of the
        measured masses inside the intervals. Without measured masses the last two are empty.

    """
    empty = {"constant": None, "hull_fit": None}
    rows: list[dict[str, Any]] = [asdict(p) | empty for p in predictions]
    weighed = [r for r in rows if r["mass_true"] is not None]
    truth = [r["mass_true"] for r in weighed]
    fits = {
        "constant": constant(truth),
        "hull_fit": hull_fit([r["hull_m3"] for r in weighed], truth),
    }
    for name, values in fits.items():
        for row, value in zip(weighed, values, strict=True):
            row[name] = value
    fills = sorted({r["fill"] for r in weighed})
    groups = {"all": weighed} | {
        fill: [r for r in weighed if r["fill"] == fill]
        for fill in (fills if len(fills) > 1 else ())
    }
    return {
        "rows": rows,
        "metrics": {name: _metrics(members) for name, members in groups.items() if members},
        "coverage": {name: _covered(members) for name, members in groups.items() if members},
        "interval": [LOW, HIGH],
        "methods": METHODS,
    }


def _metrics(rows: Sequence[dict]) -> dict:
    found = {}
    for method in METHODS:
        known = [r for r in rows if r.get(method) is not None and r[method] > 0]
        if known:
            found[method] = asdict(
                errors([r[method] for r in known], [r["mass_true"] for r in known])
            )
    return found


def _covered(rows: Sequence[dict]) -> float:
    return coverage(
        [r["low"] for r in rows], [r["high"] for r in rows], [r["mass_true"] for r in rows]
    )
