"""Statistics of a corpus by interaction, number of objects, material class and constitutive law."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import median
from typing import Any

from corporeal.lab.corpus.collect_results import CorpusResults, PartRecord, SceneRecord
from corporeal.scene.interactions import INTERACTION_KINDS
from corporeal.scene.scene_composition import ComposedObject


@dataclass(frozen=True)
class BreakdownLine:
    """One group of scenes or of objects."""

    group: str
    scenes: int
    """Scenes of it; of a material or a law: scenes in which it occurs."""
    objects: int
    """Objects in these scenes; of a material or a law: objects that have such a part."""
    clean: int
    """Scenes whose audit found nothing to warn about."""
    seen: int
    """Scenes in which what the interaction promises happened."""
    at_rest: int
    """Objects at rest at the end."""
    impacts: int
    """First contacts: of objects that were apart at the start, and with the floor later on."""
    met: int
    """Pairs of objects that touched."""
    separated: int
    """Of those, pairs that parted again."""
    momentum_median: float
    momentum_worst: float
    energy_median: float
    """Growth of kinetic and elastic energy that nothing accounts for, relative."""
    energy_worst: float
    penetration_median: float
    """In grid cells."""
    penetration_worst: float
    seconds_median: float
    """Of computing, one scene."""
    memory_worst_mb: float
    """Largest of a process."""
    materials: tuple[str, ...]
    """Of its parts, the heaviest in all first."""


def breakdowns(corpus: CorpusResults) -> dict[str, list[BreakdownLine]]:
    """Return lines for every way to group a corpus, groups without a scene left out."""
    run = corpus.run
    parts = [p for s in run for p in s.parts]
    return {
        "interaction": _by_scene(run, lambda s: s.planned.interaction, INTERACTION_KINDS),
        "objects": _by_scene(run, lambda s: str(s.planned.count)),
        "material class": _by_part(run, parts, lambda p: p.group),
        "law": _by_part(run, parts, lambda p: p.law),
    }


def total_line(corpus: CorpusResults) -> BreakdownLine | None:
    """Return one line for all scenes that were run; None: none was."""
    return _line("all", corpus.run) if corpus.run else None


def _by_scene(
    scenes: Sequence[SceneRecord], key: Callable[[SceneRecord], str], order: Sequence[str] = ()
) -> list[BreakdownLine]:
    names = order or sorted({key(s) for s in scenes})
    groups = {name: [s for s in scenes if key(s) == name] for name in names}
    return [_line(name, mine) for name, mine in groups.items() if mine]


def _by_part(
    scenes: Sequence[SceneRecord], parts: Sequence[PartRecord], key: Callable[[PartRecord], str]
) -> list[BreakdownLine]:
    """Group scenes by what occurs in them, the most frequent first."""
    lines = []
    for name in {key(p) for p in parts}:
        mine = [p for p in parts if key(p) == name]
        within = {p.scene for p in mine}
        objects = {(p.scene, p.object): p.at_rest for p in mine}
        lines.append(_line(name, [s for s in scenes if s.name in within], mine, objects))
    return sorted(lines, key=lambda line: (-line.objects, line.group))


def _line(
    group: str,
    scenes: Sequence[SceneRecord],
    parts: Sequence[PartRecord] | None = None,
    objects: Mapping[tuple[str, str], bool] | None = None,
) -> BreakdownLine:
    own = [p for s in scenes for p in s.parts] if parts is None else parts
    numbers = [s.numbers for s in scenes if s.numbers is not None]

    def add(name: str) -> int:
        return sum(int(getattr(n, name)) for n in numbers)

    def middle(name: str) -> float:
        return float(median(getattr(n, name) for n in numbers))

    def worst(name: str) -> float:
        return float(max(getattr(n, name) for n in numbers))

    return BreakdownLine(
        group=group,
        scenes=len(numbers),
        objects=add("objects") if objects is None else len(objects),
        clean=add("clean"),
        seen=add("seen"),
        at_rest=add("at_rest") if objects is None else sum(objects.values()),
        impacts=add("impacts"),
        met=add("met"),
        separated=add("separated"),
        momentum_median=middle("momentum_residual"),
        momentum_worst=worst("momentum_residual"),
        energy_median=middle("mechanical_growth"),
        energy_worst=worst("mechanical_growth"),
        penetration_median=middle("max_penetration_dx"),
        penetration_worst=worst("max_penetration_dx"),
        seconds_median=middle("seconds"),
        memory_worst_mb=worst("peak_memory_mb"),
        materials=tuple(_by_mass(own)),
    )


def scene_rows(corpus: CorpusResults) -> list[dict[str, Any]]:
    """Return one flat row per planned scene, for a table of numbers."""
    return [_row(s) for s in corpus.scenes]


def _row(scene: SceneRecord) -> dict[str, Any]:
    planned, proof = scene.planned, scene.certificate
    numbers = asdict(scene.numbers) if scene.numbers else {}
    lists = ("breaches", "warnings", "touched_before", "met_in_order")
    words = {name: " | ".join(numbers.pop(name, ())) for name in lists}
    return {
        "scene": planned.name,
        "interaction": planned.interaction,
        "arrangement": planned.arrangement,
        "seed": planned.seed,
        "planned_objects": planned.count,
        "classes": " | ".join(planned.classes),
        "assets": " | ".join(planned.assets),
        "materials": " | ".join(scene_materials(scene)),
        "assembled": scene.assembled.status if scene.assembled else "not yet",
        "assemble_seconds": scene.assembled.seconds if scene.assembled else None,
        "run": scene.ran.status if scene.ran else "not yet",
        "attempts": scene.ran.attempts if scene.ran else None,
        "error": scene.error,
        "certificate_drift_m": None if proof is None else proof.drift_m,
        "certificate_penetration_m": None if proof is None else proof.penetration_m,
        "certificate_extent_m": None if proof is None else proof.extent_m,
        **numbers,
        **words,
    }


def scene_materials(scene: SceneRecord) -> list[str]:
    """Name the materials of a scene, the heaviest first."""
    return _by_mass(scene.parts)


def _by_mass(parts: Iterable[PartRecord]) -> list[str]:
    mass: dict[str, float] = {}
    for part in parts:
        mass[part.material] = mass.get(part.material, 0.0) + part.mass
    return [name.replace("_", " ") for name in sorted(mass, key=lambda m: -mass[m])]


@dataclass(frozen=True)
class UsedAsset:
    """An asset that occurs in a corpus."""

    asset: ComposedObject
    """As in the first scene that it occurs in."""
    scenes: int
    """How often it occurs."""


def asset_credits(scenes: Iterable[SceneRecord]) -> list[UsedAsset]:
    """Return every asset that was used, by class and name."""
    objects = [o for s in scenes if s.composition is not None for o in s.composition.objects]
    first = {o.asset: o for o in reversed(objects)}
    count = Counter(o.asset for o in objects)
    used = [UsedAsset(asset, count[name]) for name, asset in first.items()]
    return sorted(used, key=lambda u: (u.asset.class_name, u.asset.asset))


def _credit_row(used: UsedAsset) -> dict[str, Any]:
    asset = used.asset
    return {
        "asset": asset.asset,
        "class": asset.class_name,
        "licence": asset.licence,
        "attribution": asset.attribution,
        "source": asset.source,
        "scenes": used.scenes,
    }


def corpus_as_data(corpus: CorpusResults) -> dict[str, Any]:
    """Return everything as plain data."""
    whole = total_line(corpus)
    return {
        "corpus": corpus.name,
        "config": asdict(corpus.plan.config),
        "messages": list(corpus.plan.messages),
        "total": None if whole is None else asdict(whole),
        "breakdowns": {k: [asdict(x) for x in v] for k, v in breakdowns(corpus).items()},
        "scenes": scene_rows(corpus),
        "credits": [_credit_row(used) for used in asset_credits(corpus.scenes)],
    }
