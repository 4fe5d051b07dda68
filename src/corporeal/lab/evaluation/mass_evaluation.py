"""Evaluation of predicted masses against measured ones.

The ladder of what is known, each step in the same run: the scan's volume as water; everything
solid and usual; how objects are built and filled, with usual values; values placed in their
ranges; all ways they may be; and these reweighted by direct estimates of the mass. Beside it
stand a constant, a fit on the size, and that number itself.

Baselines of mass prediction without materials.

The fits leave the object out that they predict.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.progress import Progress, no_progress
from corporeal.core.types import Inventory, PartDescription, Scene
from corporeal.description.describe_config import DescribeConfig
from corporeal.geometry.scene_transforms import scale_to_life_size
from corporeal.lab.evaluation.measured_masses import WeighedObject
from corporeal.pipeline.mass_posterior import (
    INTERVAL_HIGH_QUANTILE,
    INTERVAL_LOW_QUANTILE,
    SAMPLES_PER_SCENE,
    MassSampler,
    sample_masses,
    total_mass_posterior,
)
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.ground import GroundConfig
from corporeal.pipeline.stages.segment import segment
from corporeal.vlm import LIVE_CLIENTS
from corporeal.vlm.human_client import is_not_pending, refuse_pending
from corporeal.vlm.interpret_answers import leaf_parts
from corporeal.vlm.thread_map import thread_map


@dataclass(frozen=True)
class MassErrors:
    """Means over objects."""

    count: int
    ade: float
    """Absolute difference |m̂ - m| [kg]."""
    alde: float
    """Absolute difference of natural logarithms |ln m̂ - ln m| [-]."""
    ape: float
    """Absolute relative error |m̂ - m|/m [-]."""
    mnre: float
    """Ratio min(m̂/m, m/m̂) [-]: 1 is perfect."""
    within_2: float
    """Share of the objects whose mass is right within a factor of two [-]."""


def mass_errors(predicted: Sequence[float], measured: Sequence[float]) -> MassErrors:
    """Compare masses [kg], all above zero.

    Definitions as in Zhai et al. 2024, *Physical property understanding from language-embedded feature fields*, after
    Standley et al. 2017, *image2mass*.
    """
    m, true = np.asarray(predicted, dtype=float), np.asarray(measured, dtype=float)
    apart = np.abs(np.log(m) - np.log(true))
    return MassErrors(
        count=len(true),
        ade=float(np.mean(np.abs(m - true))),
        alde=float(np.mean(apart)),
        ape=float(np.mean(np.abs(m - true) / true)),
        mnre=float(np.mean(np.exp(-apart))),
        within_2=float(np.mean(apart <= np.log(2.0))),
    )


def interval_coverage(low: Sequence[float], high: Sequence[float], measured: Sequence[float]) -> float:
    """Share of the measured masses that lie in their predicted intervals [-]."""
    true = np.asarray(measured, dtype=float)
    return float(np.mean((np.asarray(low) <= true) & (true <= np.asarray(high))))


WATER_DENSITY_KG_M3 = 1000.0
"""[kg/m³]"""


def solid_water_mass(volume: Sequence[float]) -> list[float]:
    """Mass of each object if it were water through and through [kg]."""
    return [WATER_DENSITY_KG_M3 * v for v in volume]


def mean_mass(measured: Sequence[float]) -> list[float | None]:
    """Geometric mean of the other objects' measured masses [kg]; None: there is no other."""
    logs = np.log(np.asarray(measured, dtype=float))
    if len(logs) < 2:
        return [None] * len(logs)
    return [float(np.exp(np.delete(logs, k).mean())) for k in range(len(logs))]


def hull_volume_mass(hull: Sequence[float], measured: Sequence[float]) -> list[float | None]:
    """Mass [kg] by a straight line through the others, ln m = a + b ln V_hull.

    None: fewer than two others, or others of one size.

    Args:
        hull: Volume of each object's convex hull [m³].
        measured: [kg]
    """
    x, y = np.log(np.asarray(hull, dtype=float)), np.log(np.asarray(measured, dtype=float))
    return [_without(k, x, y) for k in range(len(x))]


def _without(k: int, x: Float[np.ndarray, " N"], y: Float[np.ndarray, " N"]) -> float | None:
    others, known = np.delete(x, k), np.delete(y, k)
    if len(others) < 2 or np.ptp(others) == 0:
        return None
    slope, offset = np.polyfit(others, known, 1)
    return float(np.exp(offset + slope * x[k]))


MASS_METHODS = {
    "solid_water": "solid water",
    "constant": "mean of the others",
    "hull_fit": "fit on the hull",
    "solid_usual": "solid, typical values",
    "built_usual": "as built, typical values",
    "placed": "as built, placed values",
    "mixture": "all ways it may be",
    "mass": "all ways, with outside evidence",
    "direct": "asked directly",
}
"""From knowing least to knowing most; ``mass`` is the prediction, ``direct`` is for comparison."""


@dataclass(frozen=True)
class MassConfig:
    """Prediction of masses."""

    anonymous: bool = False
    """Hide the names of files, classes, nodes and materials: a model sees pictures and a neutral name only."""
    samples: int = SAMPLES_PER_SCENE
    """Number of sets of ways and values drawn for prediction and interval."""
    seed: int = 0


@dataclass(frozen=True)
class MassPrediction:
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
    placed: float
    """The likeliest way, with its values where they were placed."""
    mixture: float
    """Median over all ways, without outside evidence."""
    mixture_low: float
    mixture_high: float
    direct: float | None
    """Direct estimate of a model; None: not asked."""
    warning: str
    """Where that contradicts all the rest; "": nowhere."""
    volume_m3: float
    hull_m3: float
    described: str
    """What it was taken for."""
    asked_as: str
    """The name it was recognised under."""
    constant: float | None = None
    """None, as ``hull_volume_mass``: it was not measured, so that it takes no part in the comparison."""
    hull_fit: float | None = None


@dataclass(frozen=True)
class MassComparison:
    """Predictions against the scales."""

    rows: tuple[MassPrediction, ...]
    """One per object."""
    metrics: Mapping[str, Mapping[str, MassErrors]]
    """Group of objects → method → errors; empty without measured masses."""
    coverage: Mapping[str, float]
    """Group → share of the measured masses inside the intervals; empty without these."""
    width: Mapping[str, float]
    """Group → median of high over low."""
    coverage_without: Mapping[str, float]
    """As ``interval_coverage``, without outside evidence."""
    width_without: Mapping[str, float]
    interval: tuple[float, float] = (INTERVAL_LOW_QUANTILE, INTERVAL_HIGH_QUANTILE)
    """Quantiles that bound the intervals."""
    methods: Mapping[str, str] = field(default_factory=lambda: MASS_METHODS)
    """Method → in words."""


def predict_masses(
    objects: Sequence[WeighedObject],
    describing: DescribeConfig,
    grounding: GroundConfig,
    config: MassConfig,
    progress: Progress = no_progress,
) -> list[MassPrediction]:
    """Predict every object's mass; a model that answers over a network is asked in parallel.

    Raises:
        UserError: What the first object that failed says, or how many questions about all of them wait for a person's
            answers.
    """
    live = describing.vlm.partition(":")[0] in LIVE_CLIENTS
    jobs = [partial(predict_mass, obj, describing, grounding, config) for obj in objects]
    results = thread_map(
        jobs,
        describing.parallel if live else 1,
        lambda done: progress(done / len(jobs), f"{done} of {len(jobs)} objects"),
    )
    failed = [r for r in results if isinstance(r, Exception) and is_not_pending(r)]
    if not failed:
        refuse_pending(results, describing.vlm)
    if failed and isinstance(failed[0], UserError) and len(failed) > 1:
        raise UserError(f"{len(failed)} of {len(jobs)} objects could not be judged. {failed[0]}")
    for error in failed:
        raise error
    return [r for r in results if isinstance(r, MassPrediction)]


def predict_mass(
    obj: WeighedObject, describing: DescribeConfig, grounding: GroundConfig, config: MassConfig
) -> MassPrediction:
    """Predict one object's mass at its real size by every method that needs no other object."""
    scene = scale_to_life_size(assemble([obj.file]))
    if config.anonymous:
        scene = anonymise(scene, obj.file)
    inventory = describe(scene, describing, grounding.library)
    parts = segment(scene, inventory)
    scale = MassSampler(scene, parts, grounding, config.seed)
    mixture = total_mass_posterior(sample_masses(scale, inventory, config.samples).mixtures)
    everything = np.concatenate([a.vertices for a in scale.anatomies])
    return MassPrediction(
        object=obj.name,
        fill=obj.fill,
        mass_true=obj.mass,
        mass=mixture.mass,
        low=mixture.low,
        high=mixture.high,
        solid_water=solid_water_mass([scale.volume])[0],
        solid_usual=scale.mass(_map_parts(inventory, _as_solid)),
        built_usual=scale.mass(_map_parts(inventory, _typical_only)),
        placed=scale.mass(inventory),
        mixture=mixture.mass_without,
        mixture_low=mixture.low_without,
        mixture_high=mixture.high_without,
        direct=mixture.evidence.likely if mixture.evidence else None,
        warning=mixture.warning,
        volume_m3=scale.volume,
        hull_m3=float(ConvexHull(everything).volume),
        described=_describe_inventory(inventory),
        asked_as=scene.name,
    )


def anonymise(scene: Scene, file: Path) -> Scene:
    """Replace every name that could tell what an object is by a neutral one, made from its content.

    Pictures stay as they are: what is printed on an object can still be read.
    """
    name = f"object-{store.path_digest(file)[:6]}"
    objects = tuple(
        replace(o, name=_numbered(name, k), class_name="object", source=f"{name}.glb", credit="")
        for k, o in enumerate(scene.objects)
    )
    surfaces = tuple(replace(s, name=f"surface {k}", extras={}) for k, s in enumerate(scene.surfaces))
    finishes = tuple(replace(f, name=f"finish {k}") for k, f in enumerate(scene.finishes))
    return replace(
        scene, name=name, source=f"{name}.glb", objects=objects, surfaces=surfaces, finishes=finishes, warnings=()
    )


def _numbered(name: str, k: int) -> str:
    return name if k == 0 else f"{name}-{k}"


def _map_parts(inventory: Inventory, change: Callable[[PartDescription], PartDescription]) -> Inventory:
    objects = tuple(replace(o, parts=tuple(change(p) for p in o.parts)) for o in inventory.objects)
    return replace(inventory, objects=objects)


def _typical_only(words: PartDescription) -> PartDescription:
    """Keep materials, structure and contents; leave every value where it usually lies."""
    pieces = tuple(_typical_only(p) for p in words.pieces)
    return replace(words, placements={}, values={}, pieces=pieces)


def _as_solid(words: PartDescription) -> PartDescription:
    """Keep the materials only."""
    words = replace(
        _typical_only(words), structure="solid", thickness=None, contents=None, fill=None, solidity=None,
        swelling=None,
    )  # fmt: skip
    return replace(words, pieces=tuple(_as_solid(p) for p in words.pieces))


def _describe_inventory(inventory: Inventory) -> str:
    parts = [leaf for o in inventory.objects for leaf in leaf_parts(o.parts)]
    return "; ".join(_describe_piece(p) for p in parts)


def _describe_piece(words: PartDescription) -> str:
    described = f"{words.name}: {words.material or 'unknown'}"
    described += f", {words.structure}" if words.structure else ""
    return described + (f" of {words.contents}" if words.contents else "")


def compare_masses(predictions: Sequence[MassPrediction]) -> MassComparison:
    """Return errors over all and per fill group; objects without a measured mass are only listed.

    The methods that need other objects' masses are added here.
    """
    weighed = [p for p in predictions if p.mass_true is not None]
    truth = [_true(p) for p in weighed]
    fits = zip(mean_mass(truth), hull_volume_mass([p.hull_m3 for p in weighed], truth), strict=True)
    known = {p.object: replace(p, constant=mean, hull_fit=fit) for p, (mean, fit) in zip(weighed, fits, strict=True)}
    weighed = list(known.values())
    fills = sorted({p.fill for p in weighed})
    groups = {"all": weighed} if weighed else {}
    if len(fills) > 1:
        groups |= {fill: [p for p in weighed if p.fill == fill] for fill in fills}
    return MassComparison(
        rows=tuple(known.get(p.object, p) for p in predictions),
        metrics={name: _metrics(members) for name, members in groups.items()},
        coverage={name: _coverage(members, "low", "high") for name, members in groups.items()},
        width={name: _width(members, "low", "high") for name, members in groups.items()},
        coverage_without={name: _coverage(members, "mixture_low", "mixture_high") for name, members in groups.items()},
        width_without={name: _width(members, "mixture_low", "mixture_high") for name, members in groups.items()},
    )


def _true(prediction: MassPrediction) -> float:
    assert prediction.mass_true is not None, "objects without a measured mass were left out"
    return prediction.mass_true


def _metrics(rows: Sequence[MassPrediction]) -> dict[str, MassErrors]:
    found = {}
    for method in MASS_METHODS:
        known = [r for r in rows if (getattr(r, method) or 0.0) > 0]
        if known:
            found[method] = mass_errors([getattr(r, method) for r in known], [_true(r) for r in known])
    return found


def _coverage(rows: Sequence[MassPrediction], low: str, high: str) -> float:
    ends = [getattr(r, low) for r in rows], [getattr(r, high) for r in rows]
    return interval_coverage(*ends, [_true(r) for r in rows])


def _width(rows: Sequence[MassPrediction], low: str, high: str) -> float:
    return float(np.median([getattr(r, high) / max(getattr(r, low), 1e-300) for r in rows]))
