"""Posterior of objects' masses over hypotheses, ranges and the uncertainty of their meshes.

Importance sampling: samples of the whole scene are weighted by an estimate of each object's mass made without the
library (``MassEvidence``). The estimate sets no value: the chosen values were sampled together inside measured ranges.
"""

from collections import Counter
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from math import exp, log

import numpy as np
from jaxtyping import Float

from corporeal.core.types import (
    AnsweredMass,
    Inventory,
    MassEvidence,
    MassPosterior,
    Material,
    MaterialField,
    ObjectDescription,
    PartDescription,
    Parts,
    RangePlacement,
    Scene,
    Structure,
    WeighedHypothesis,
)
from corporeal.discretization.cavity import is_vessel, measure_cavity
from corporeal.discretization.drawn_thickness import scan_edge_length, scan_volume_log_deviation
from corporeal.discretization.granular_bed_objects import fill_all_beds, loose_matter_parts
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart, measure_objects
from corporeal.discretization.missing_walls import MissingWall, find_missing_walls, with_missing_walls
from corporeal.discretization.part_model import NO_VOLUME_LEEWAY, VolumeLeeway, part_mass
from corporeal.geometry.scene_transforms import scale_to_life_size
from corporeal.materials.material_candidates import fraction_of
from corporeal.materials.range_placement import CONTENTS_DENSITY_FIELD, MASS_FIELDS
from corporeal.materials.value_sampling import draw_hypotheses, sample_material_field, take_answer
from corporeal.pipeline.stages.ground import GroundConfig, ground
from corporeal.recognition.construction_from_mass import best_mass_fit, construction_hypotheses
from corporeal.recognition.lexicon import head_terms, name_tokens
from corporeal.vlm.interpret_answers import leaf_parts
from corporeal.vlm.mass_evidence import mass_contradiction, mass_likelihood

SAMPLES_PER_SCENE = 400
"""Default number of samples of the whole scene."""
INTERVAL_LOW_QUANTILE, INTERVAL_HIGH_QUANTILE = 0.05, 0.95
"""Quantiles of the samples that bound an interval."""
MAX_VOLUME_LOG_STD = log(2.0)
MAX_DRAWS_PER_OBJECT = 200
"""Maximum samples of an object when rejection sampling by its mass evidence."""
OPEN_MESH_VOLUME_LOG_STD = 0.3
"""Standard deviation of the logarithm of the volume of a mesh that is not closed [-]."""
MODELLED_SHAPE_VOLUME_LOG_STD = 0.12
"""Standard deviation of the logarithm of what a modelled shape encloses, over what objects of its name do [-], of a
part that only its name describes: the distance that half of 18 solid objects of published mass and known material
exceed, in deviations, beside what their densities have (decision 110).
"""
NAME_ONLY_SOURCES = ("metadata", "unknown")
"""Sources of a part that was not seen in pictures."""
NESTED_SHARE_FIELDS = ("volume_share", "surface_share", "inside", "inner_share", "missing")
"""What pieces of one mesh take up of it: it fits only what the same answer says of the others."""
FITTED_DRAW_REASON = "This draw from the range fits the estimate of the object's mass best."


@dataclass(frozen=True)
class WeighedInventory:
    """Description of a scene, updated by the posterior of its masses."""

    inventory: Inventory
    """With the chosen hypothesis of each part."""
    mixtures: tuple[MassPosterior, ...]
    """One per object."""


@dataclass(frozen=True)
class SceneSample:
    """One consistent set of hypotheses and values."""

    inventory: Inventory
    field: MaterialField
    masses: Float[np.ndarray, " B"]
    """Of each object, at its real size [kg]."""


class MassSampler:
    """Computes masses of a described scene; measures its meshes once."""

    def __init__(self, scene: Scene, parts: Parts, grounding: GroundConfig, seed: int) -> None:
        self.scene, self.parts, self.grounding, self.seed = scene, parts, grounding, seed
        self.anatomies: list[MeasuredObject] = measure_objects(scene, parts, seed)
        members = [(a, m) for a in self.anatomies for m in a.members]
        self.members = [m for _, m in members]
        self.rooms = [
            measure_cavity(a, m, 0.0, np.random.default_rng([seed, m.part, 5])).volume if is_vessel(m) else 0.0
            for a, m in members
        ]
        self.owner = [p.object for p in parts.catalogue]
        self.doubts = [volume_log_std(m) for m in self.members]
        # no scatter among objects of its name if no name is known
        called = [bool(head_terms(name_tokens(o.class_name))) for o in scene.objects]
        self.forms = [shape_log_std(m) if called[self.owner[m.part]] else 0.0 for m in self.members]
        self.volume = sum(m.volume for m in self.members)
        """Of everything that is enclosed [m³]."""
        self._beds: dict[frozenset[int], list[MeasuredObject]] = {}
        self._borders: dict[frozenset[int], list[dict[int, tuple[MissingWall, ...]]]] = {}
        self._built: dict[Hashable, dict[int, MeasuredPart]] = {}

    def mass(self, inventory: Inventory) -> float:
        """Return the mass of the described scene [kg]."""
        return float(self.of(ground(self.scene, self.parts, inventory, self.grounding)).sum())

    def of(self, field: MaterialField, leeways: Sequence[VolumeLeeway] | None = None) -> Float[np.ndarray, " B"]:
        """Return the mass of each object [kg].

        Args:
            field: What it is made of.
            leeways: Of what each member's surface encloses; None: as its mesh says.
        """
        found = np.zeros(len(self.scene.objects))
        built = self._as_built(field)
        for k, (drawn, room) in enumerate(zip(self.members, self.rooms, strict=True)):
            member = built.get(drawn.part, drawn)
            leeway = NO_VOLUME_LEEWAY if leeways is None else leeways[k]
            found[self.owner[member.part]] += part_mass(member, field, room, leeway)
        return found

    def _as_built(self, field: MaterialField) -> dict[int, MeasuredPart]:
        """Return the parts that differ from their meshes, for each set of hypotheses.

        What is loose fills what holds it; walls are as thick then as in the first field in which just these parts are
        loose. What is hollow is closed below what is soft.
        """
        loose = frozenset(loose_matter_parts(field))
        if loose not in self._beds:
            self._beds[loose] = fill_all_beds(self.anatomies, field)
            self._borders[loose] = [{} for _ in self.anatomies]
        pairs = zip(self._beds[loose], self._borders[loose], strict=True)
        found = [(anatomy, find_missing_walls(anatomy, field, known)) for anatomy, known in pairs]
        closed = frozenset((k, b.upper) for _, lids in found for k in lids for b in lids[k])
        if (loose, closed) not in self._built:
            members = [m for anatomy, lids in found for m in with_missing_walls(anatomy, lids).members]
            unlike = [m for m in members if m.drawn is not None or m.lid is not None]
            self._built[loose, closed] = {m.part: m for m in unlike}
        return self._built[loose, closed]

    def draw(self, inventory: Inventory, number: int) -> SceneSample:
        """Sample a hypothesis for each part, values from their ranges, and the errors of the meshes.

        Where several answers were given, samples cycle through them.
        """
        rng = np.random.default_rng([self.seed, number])
        library, floor = self.grounding.library, self.grounding.floor
        words = draw_hypotheses(take_answer(inventory, number), rng, library)
        field = ground(self.scene, self.parts, words, self.grounding)
        field = sample_material_field(field, self.owner, rng, library, floor)
        away = [float(rng.normal(-d / 2, d)) if d else 0.0 for d in self.doubts]
        judged = rng.normal(size=len(away))  # the error of thickness is common to all parts
        hands = rng.normal(size=len(self.scene.objects))  # the error of shape is common to all parts
        shaped = [
            float(f * hands[self.owner[m.part]]) if field.words[m.part].answered_by in NAME_ONLY_SOURCES else 0.0
            for f, m in zip(self.forms, self.members, strict=True)
        ]
        leeways = [
            VolumeLeeway(exp(a + f), exp(a + f + d / 2), float(j))
            for a, f, d, j in zip(away, shaped, self.doubts, judged, strict=True)
        ]
        return SceneSample(words, field, self.of(field, leeways))


def volume_log_std(member: MeasuredPart) -> float:
    """Return how far the mesh leaves the enclosed volume open: deviation of its logarithm [-].

    Of a scan h / (√3 τ) (``scan_volume_log_deviation``). It is more often too large than too small, by half of that,
    .29 h / τ: fusing views thickens what is thin (boards of 16 mm that were reconstructed on cells of 12 and 7 mm
    weighed a quarter and a seventh too much, .30 h / τ both). A stated ratio of thickness replaces this mean.
    """
    found = 0.0 if member.closed else OPEN_MESH_VOLUME_LOG_STD
    edge = scan_edge_length(member.body)
    if edge > 0 and member.volume > 0:
        found = float(np.hypot(found, scan_volume_log_deviation(edge, member.volume, member.body_area)))
    return min(found, MAX_VOLUME_LOG_STD)


def shape_log_std(member: MeasuredPart) -> float:
    """Return how far a modelled shape is from the object's: deviation of its logarithm [-].

    A scan's shape is the object's; what its edges leave open is its ``volume_log_std``.
    """
    return 0.0 if scan_edge_length(member.body) > 0 else MODELLED_SHAPE_VOLUME_LOG_STD


def ground_with_mass_posterior(
    scene: Scene, parts: Parts, inventory: Inventory, grounding: GroundConfig
) -> MaterialField:
    """Choose every value as ``ground`` does; where a model was asked, update by its mass estimates first.

    Otherwise the mass in the name of a weight chooses its construction.

    Raises:
        UserError: As ``ground``.
    """
    if not inventory.transcript:  # only ranges are uncertain
        return ground(scene, parts, _with_named_mass(scene, parts, inventory, grounding), grounding)
    ours = replace(grounding, field="")  # samples use the library's ranges, whoever chooses the values
    believed = sample_masses(MassSampler(scale_to_life_size(scene), parts, ours, 0), inventory, SAMPLES_PER_SCENE)
    found = ground(scene, parts, believed.inventory, grounding)
    return replace(found, mixtures=believed.mixtures)


def _with_named_mass(scene: Scene, parts: Parts, inventory: Inventory, grounding: GroundConfig) -> Inventory:
    """Choose the construction of weights that fits the mass in their name best."""
    found = [construction_hypotheses(scene, k, words) for k, words in enumerate(inventory.objects)]
    if not any(found):
        return inventory
    scale = MassSampler(scale_to_life_size(scene), parts, replace(grounding, field=""), 0)
    for number, ways in enumerate(found):
        if ways is None:
            continue
        made = [_with_description(inventory, number, words) for words in ways.words]
        masses = [float(scale.of(ground(scale.scene, parts, one, scale.grounding))[number]) for one in made]
        inventory = made[best_mass_fit(masses, ways.mass)]
    return inventory


def _with_description(inventory: Inventory, number: int, words: PartDescription) -> Inventory:
    objects = list(inventory.objects)
    objects[number] = replace(objects[number], parts=(words,))
    return replace(inventory, objects=tuple(objects))


def sample_masses(scale: MassSampler, inventory: Inventory, samples: int) -> WeighedInventory:
    """Sample hypotheses and masses of each object, and choose among them by mass evidence."""
    draws = [scale.draw(inventory, number) for number in range(samples)]
    placed = scale.of(ground(scale.scene, scale.parts, inventory, scale.grounding))
    objects, mixtures = [], []
    for k, words in enumerate(inventory.objects):
        doubted = bool(words.answers)
        doubted |= any(len(p.hypotheses) > 1 or p.material is None for p in leaf_parts(words.parts))
        doubted |= any(d for m, d in zip(scale.members, scale.doubts, strict=True) if scale.owner[m.part] == k)
        known = None if doubted else float(placed[k])
        own = _ObjectSamples(words, k, draws)
        mixture = own.mixture(known)
        objects.append(own.chosen(mixture, scale) if words.evidence else words)
        mixtures.append(mixture)
    return WeighedInventory(replace(inventory, objects=tuple(objects)), tuple(mixtures))


def total_mass_posterior(mixtures: Sequence[MassPosterior]) -> MassPosterior:
    """Return the total mass of one or more objects.

    The interval of a sum is at most the sum of the intervals. The sum has mass evidence if every object has.
    """
    if len(mixtures) == 1:
        return mixtures[0]

    def total(name: str) -> float:
        return sum(getattr(m, name) for m in mixtures)

    return MassPosterior(
        object=", ".join(m.object for m in mixtures),
        mass=total("mass"),
        low=total("low"),
        high=total("high"),
        mass_without=total("mass_without"),
        low_without=total("low_without"),
        high_without=total("high_without"),
        evidence=_total([m.evidence for m in mixtures if m.evidence], len(mixtures)),
        warning=" ".join(m.warning for m in mixtures if m.warning),
    )


def _total(said: Sequence[MassEvidence], count: int) -> MassEvidence | None:
    """Add up the evidence of ``count`` objects, if there is some of each."""
    if not said or len(said) < count:
        return None
    low, likely, high = (sum(row) for row in zip(*((e.low, e.likely, e.high) for e in said), strict=True))
    return MassEvidence(low, likely, high, " ".join(e.reason for e in said))


def sample_hypotheses(
    inventory: Inventory, mixtures: Sequence[MassPosterior], rng: np.random.Generator, library: str
) -> Inventory:
    """Sample a hypothesis for every part from the posterior.

    Args:
        inventory: What was described.
        mixtures: Masses of its objects, in their order; empty: no evidence.
        rng: Source of the draw.
        library: Where materials are looked up.
    """
    words = draw_hypotheses(inventory, rng, library)
    if not mixtures:
        return words
    found = []
    for described, drawn, mixture in zip(inventory.objects, words.objects, mixtures, strict=True):
        favour = {h.words: h.probability / h.prior for h in mixture.hypotheses if h.prior > 0}
        most = max(favour.values())
        alone = replace(inventory, objects=(described,))
        for _ in range(MAX_DRAWS_PER_OBJECT):
            if rng.uniform() * most < favour.get(hypothesis_label(described, drawn), 0.0):
                break
            (drawn,) = draw_hypotheses(alone, rng, library).objects
        found.append(drawn)
    return replace(inventory, objects=tuple(found))


class _ObjectSamples:
    """The samples of one object."""

    def __init__(self, words: ObjectDescription, number: int, draws: Sequence[SceneSample]) -> None:
        self.words, self.number, self.draws = words, number, draws
        self.masses = np.array([d.masses[number] for d in draws])
        self.labels = [hypothesis_label(words, d.inventory.objects[number]) for d in draws]
        even = np.full(len(draws), 1 / len(draws))
        self.even = even
        self.weights = even * mass_likelihood(self.masses, words.evidence)
        self.weights /= self.weights.sum()

    def mixture(self, known: float | None) -> MassPosterior:
        """Sum up; ``known`` is the mass where only ranges are open, and stays as it is [kg]."""
        low0, mass0, high0 = weighted_quantiles(self.masses, self.even)
        low, mass, high = weighted_quantiles(self.masses, self.weights)
        if known is not None:
            mass0 = known
            mass = mass if self.words.evidence else known
        return MassPosterior(
            object=self.words.name,
            mass=mass,
            low=min(low, mass),
            high=max(high, mass),
            mass_without=mass0,
            low_without=min(low0, mass0),
            high_without=max(high0, mass0),
            hypotheses=self._hypotheses(),
            evidence=self.words.evidence,
            warning=mass_contradiction(self.words, self.masses),
            answers=self._answers(),
        )

    def _answers(self) -> tuple[AnsweredMass, ...]:
        """Return the mass by each of N answers; its samples are every N-th."""
        found, count = [], len(self.words.answers)
        for k, answer in enumerate(self.words.answers):
            masses = self.masses[k::count]
            low, mass, high = weighted_quantiles(masses, np.full(len(masses), 1 / len(masses)))
            ((words, often),) = Counter(self.labels[k::count]).most_common(1)
            judged = answer.evidence.likely if answer.evidence else None
            found.append(AnsweredMass(mass, judged, low, high, words, often / len(masses)))
        return tuple(found)

    def _hypotheses(self) -> tuple[WeighedHypothesis, ...]:
        labels = np.array(self.labels)
        rows = []
        for name in dict.fromkeys(self.labels):
            own = labels == name
            weights = self.weights[own] / max(float(self.weights[own].sum()), 1e-300)
            rows.append(
                WeighedHypothesis(
                    words=name,
                    probability=float(self.weights[own].sum()),
                    prior=float(self.even[own].sum()),
                    mass=weighted_quantiles(self.masses[own], weights)[1],
                )
            )
        return tuple(sorted(rows, key=lambda row: -row.probability))

    def chosen(self, mixture: MassPosterior, scale: MassSampler) -> ObjectDescription:
        """Choose the likeliest hypothesis, and its sample nearest to the median mass."""
        best = mixture.hypotheses[0].words
        far = np.abs(np.log(self.masses / mixture.mass))
        far[[name != best for name in self.labels]] = np.inf
        draw = self.draws[int(np.argmin(far))]
        names = {(p.object, p.name): k for k, p in enumerate(scale.parts.catalogue)}
        parts = []
        for words, drawn in zip(self.words.parts, draw.inventory.objects[self.number].parts, strict=True):
            k = names.get((self.number, words.name))
            if k is None:
                parts.append(words)
            elif words.pieces:
                rows = zip(words.pieces, drawn.pieces, draw.field.pieces[k], strict=True)
                pieces = [_fix_draw(p, q, r.material, r.structure) for p, q, r in rows]
                main = max(pieces, key=lambda p: p.volume_share - p.inner_share)
                kept = {name: getattr(words, name) for name in ("name", "volume_share", "surface_share")}
                parts.append(
                    replace(
                        main, **kept, inside="", inner_share=0.0, missing=False,
                        reason=words.reason, pieces=tuple(pieces),
                    )
                )  # fmt: skip
            else:
                parts.append(_fix_draw(words, drawn, draw.field.materials[k], draw.field.structures[k]))
        return replace(self.words, parts=tuple(parts))


def _fix_draw(words: PartDescription, drawn: PartDescription, made: Material, built: Structure) -> PartDescription:
    """Fix a part to a sample; values that determine its mass are placed as sampled."""
    if not words.hypotheses or drawn.material is None or words.material is None:
        return replace(words, **{name: getattr(drawn, name) for name in NESTED_SHARE_FIELDS})
    places = dict(drawn.placements)
    for name in MASS_FIELDS:
        if name in made.grounds and (name == "density" or built.kind != "solid"):
            ground = made.grounds[name]
            places[name] = RangePlacement(fraction_of(ground.range, ground.value), "evidence", FITTED_DRAW_REASON)
    if built.contents is not None:
        ground = built.contents.grounds["density"]
        places[CONTENTS_DENSITY_FIELD] = RangePlacement(
            fraction_of(ground.range, ground.value), "evidence", FITTED_DRAW_REASON
        )
    probability = {(h.material, h.structure, h.contents): h.probability for h in words.hypotheses}
    return replace(
        drawn,
        placements=places,
        margin=probability.get((drawn.material, drawn.structure, drawn.contents), words.margin),
        fill=built.fill if built.contents is not None else drawn.fill,
        solidity=built.solidity if drawn.structure == "packed" else drawn.solidity,
    )


def hypothesis_label(words: ObjectDescription, drawn: ObjectDescription) -> str:
    """Describe the sampled hypothesis of each uncertain part."""
    in_doubt = [
        f"{p.name}: {q.material}, {q.structure}{f' of {q.contents}' if q.contents else ''}"
        for p, q in zip(leaf_parts(words.parts), leaf_parts(drawn.parts), strict=True)
        if len(p.hypotheses) > 1
    ]
    return "; ".join(in_doubt) or "as described"


def weighted_quantiles(values: Float[np.ndarray, " N"], weights: Float[np.ndarray, " N"]) -> tuple[float, float, float]:
    """Return the 5 %, 50 % and 95 % points of weighted values; weights add up to 1."""
    order = np.argsort(values)
    at = np.cumsum(weights[order]) - 0.5 * weights[order]
    low, middle, high = np.interp([INTERVAL_LOW_QUANTILE, 0.5, INTERVAL_HIGH_QUANTILE], at, values[order])
    return float(low), float(middle), float(high)
