"""Plan of a corpus: classes, arrangements and interactions of its scenes.

Everything is balanced and drawn by deficit: classes, models of a class, object counts, interaction kinds and
arrangements each come out even to within one, as far as their needs allow. Wind acts where it moves something. A plan
follows from the pool and the seed alone; it is written to ``corpus.json``.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Literal

import numpy as np

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError, UserError
from corporeal.pool.asset_pool import PoolAsset, draw_least_used, parse_count_range
from corporeal.scene.arrange_bodies import BodyArrangement
from corporeal.scene.interactions import ARRANGEMENTS_OF_KIND, INTERACTION_KINDS, MIN_OBJECTS_OF_KIND, InteractionKind
from corporeal.showcase.showcase_scenes import SHOWCASE_SCENE_BUILDERS

PLAN_FILE = "corpus.json"
MAX_CORPUS_SCENES = 10_000
"""Scenes of one corpus."""

WindTest = Callable[[Sequence[str]], bool]
"""Given the models of a scene, says whether a wind could move any of them."""

INTERACTION_OF_SHOWCASE: Mapping[str, InteractionKind] = {
    "duck-on-mud": "fall-onto",
    "duck-on-can": "fall-onto",
    "vase-ball-armchair": "chain",
    "lamp-on-couch": "fall-onto",
    "ficus-pushed": "wind",
    "tree-and-ball-in-sand": "fall-onto",
    "steel-and-rubber": "fall",
}
"""What happens in the showcase's scenes; a push on a whole plant counts as wind."""


@dataclass(frozen=True)
class CorpusConfig:
    """What a corpus consists of."""

    preset: Literal["fortytwo", "seven"] = "fortytwo"
    """Balanced scenes from a pool of assets, or the seven scenes of the showcase."""
    scenes: int = 42
    """How many; the showcase has seven."""
    classes: int = 15
    """How many classes of the pool take part: those with the most models, then by lot."""
    count: str = "1-4"
    """Fewest and most objects of a scene."""
    repeat: bool = False
    """A class may come twice in a scene."""
    seed: int = 0
    """Random seed of the plan."""

    @property
    def words(self) -> str:
        """As one would type it: the preset, the seed, and what differs from the preset."""
        typed = [f"--preset {self.preset}", *self.changes]
        return " ".join([*typed, f"--seed {self.seed}"])

    @property
    def changes(self) -> list[str]:
        """What is not as the preset has it, as one would type it."""
        given = ((f.name, getattr(self, f.name), f.default) for f in fields(self))
        return [
            f"--{name}" if value is True else f"--{name} {value}"
            for name, value, usual in given
            if value != usual and name not in ("preset", "seed")
        ]


@dataclass(frozen=True)
class PlannedScene:
    """One scene to be made."""

    name: str
    seed: int
    classes: tuple[str, ...]
    """One per object."""
    assets: tuple[str, ...]
    """Names in the pool, one per object; none for a scene of the showcase."""
    arrangement: BodyArrangement
    interaction: InteractionKind

    @property
    def count(self) -> int:
        """How many objects."""
        return len(self.classes)


@dataclass(frozen=True)
class CorpusPlan:
    """All scenes of a corpus."""

    config: CorpusConfig
    scenes: tuple[PlannedScene, ...]
    messages: tuple[str, ...] = ()
    """What could not be as asked for."""


def plan_corpus(models: Sequence[PoolAsset], config: CorpusConfig, windy: WindTest | None = None) -> CorpusPlan:
    """Plan a corpus.

    Args:
        models: The pool's assets; not looked at for the showcase.
        config: What is asked for.
        windy: Says what the wind can move; None: everything.

    Raises:
        UserError: The pool is empty, or a number makes no sense.
    """
    if config.preset == "seven":
        ignored = " ".join(config.changes)
        ignores = (f"The showcase has scenes of its own: {ignored} changes nothing.",)
        return CorpusPlan(
            config, tuple(_showcase(name) for name in INTERACTION_OF_SHOWCASE), ignores if ignored else ()
        )
    _check(config)
    if not models:
        raise UserError("The pool has no usable asset. See why: corporeal assets list --rejected.")
    rng = np.random.default_rng(config.seed)
    by_class = _by_class(models)
    classes = choose_classes(by_class, config.classes, rng)
    messages = [_fewer_classes_note(len(classes), config.classes)] if len(classes) < config.classes else []
    least, most = parse_count_range(config.count)
    if not config.repeat and most > len(classes):
        least, most = min(least, len(classes)), len(classes)
        messages.append(
            f"Scenes have at most {most} object{'s' * (most != 1)}: the pool has no more classes, "
            "and none may come twice in a scene (--repeat allows it)."
        )
    kinds: list[InteractionKind] = [k for k in INTERACTION_KINDS if MIN_OBJECTS_OF_KIND[k] <= most]
    if len(kinds) < len(INTERACTION_KINDS):
        left_out = ", ".join(k for k in INTERACTION_KINDS if k not in kinds)
        messages.append(f"No {left_out}: that takes more than {most} in a scene.")
    pairs = interactions_and_counts(config.scenes, kinds, (least, most), rng)
    sets = _draw_objects([n for _, n in pairs], classes, by_class, config.repeat, rng)
    happens: Sequence[InteractionKind] = [k for k, _ in pairs]
    if windy:
        happens, left_out = with_wind(happens, [assets for _, assets in sets], windy)
        messages += left_out
    return CorpusPlan(config, tuple(_draw_scenes(happens, sets, rng)), tuple(messages))


def write_plan(folder: Path, made: CorpusPlan) -> None:
    """Write a plan to ``corpus.json`` in a corpus's folder."""
    store.write_json(folder / PLAN_FILE, asdict(made))


def read_plan(folder: Path) -> CorpusPlan:
    """Read a corpus's plan.

    Raises:
        UserError: The folder is no corpus.
        BadFileError: ``corpus.json`` is damaged.
    """
    path = folder / PLAN_FILE
    if not path.exists():
        raise UserError(f"{folder} is not a corpus: it has no {PLAN_FILE}. Make one: corporeal corpus "
                        f"assemble {folder}.")  # fmt: skip
    data = store.read_json(path)
    try:
        return from_plain(CorpusPlan, data)
    except (ValueError, TypeError, AttributeError) as error:
        what = f"is not the plan of a corpus ({error})."
        raise BadFileError(path, what, "Assemble the corpus again.") from error


def choose_classes(by_class: Mapping[str, Sequence[str]], most: int, rng: np.random.Generator) -> list[str]:
    """Choose at most ``most`` classes: those with the most models first, by lot among equals.

    A class with more models repeats each of them less often.
    """
    names = sorted(by_class)
    order = [names[k] for k in rng.permutation(len(names))]
    order.sort(key=lambda name: -len(by_class[name]))
    return sorted(order[:most])


def interactions_and_counts(
    scenes: int, kinds: Sequence[InteractionKind], count: tuple[int, int], rng: np.random.Generator
) -> list[tuple[InteractionKind, int]]:
    """Give every scene an interaction and a number of objects, both even to within one.

    The interactions that need the most objects choose their numbers first, each the number that
    is rarest so far among those that suffice; then the scenes are shuffled.

    Args:
        scenes: How many.
        kinds: The interactions that are possible.
        count: Fewest and most objects.
        rng: Decides between equals.
    """
    used: Counter[str] = Counter()
    for _ in range(scenes):
        used.update(draw_least_used(kinds, used, 1, rng))
    numbers = [str(n) for n in range(count[0], count[1] + 1)]
    taken: Counter[str] = Counter()
    pairs: list[tuple[InteractionKind, int]] = []
    for group in _kinds_by_object_count(kinds):
        allowed = [n for n in numbers if int(n) >= MIN_OBJECTS_OF_KIND[group[0]]]
        own: list[InteractionKind] = [kind for kind in group for _ in range(used[kind])]
        mine: list[int] = []
        for _ in own:
            (number,) = draw_least_used(allowed, taken, 1, rng)
            taken[number] += 1
            mine.append(int(number))
        pairs += _deal_counts(sorted(mine), own)
    return [pairs[k] for k in rng.permutation(len(pairs))]


def _deal_counts(numbers: Sequence[int], kinds: Sequence[InteractionKind]) -> list[tuple[InteractionKind, int]]:
    """Deal numbers to interactions in turns, so that each gets its share of every number."""
    left = Counter(kinds)
    order: list[InteractionKind] = []
    while left.total():
        turn = sorted(left, key=lambda k: -left[k])
        order += turn
        left -= Counter(turn)
    return list(zip(order, numbers, strict=True))


def _kinds_by_object_count(kinds: Sequence[InteractionKind]) -> list[list[InteractionKind]]:
    """Group interactions by how many objects they need, the most first."""
    needs = sorted({MIN_OBJECTS_OF_KIND[k] for k in kinds}, reverse=True)
    return [[k for k in kinds if MIN_OBJECTS_OF_KIND[k] == n] for n in needs]


def with_wind(
    kinds: Sequence[InteractionKind], sets: Sequence[Sequence[str]], windy: WindTest
) -> tuple[list[InteractionKind], list[str]]:
    """Apply wind where it moves something.

    A scene in which it would move nothing changes its interaction with another one, of as many objects where there is
    one; where none can, its objects fall instead.

    Returns:
        What happens, and messages about what was changed.
    """
    happens, messages = list(kinds), []
    for k in [k for k, kind in enumerate(kinds) if kind == "wind" and not windy(sets[k])]:
        others = [
            n
            for n, kind in enumerate(happens)
            if kind != "wind" and MIN_OBJECTS_OF_KIND[kind] <= len(sets[k]) and windy(sets[n])
        ]
        other = min(others, key=lambda n: abs(len(sets[n]) - len(sets[k])), default=None)
        if other is None:
            happens[k] = "fall"
            messages.append(f"No wind moves {' or '.join(sets[k])}: replaced by a fall.")
        else:
            happens[k], happens[other] = happens[other], happens[k]
    return happens, messages


DrawnObjects = tuple[list[str], list[str]]
"""Classes and models of a scene."""


def _draw_objects(
    numbers: Sequence[int],
    classes: Sequence[str],
    by_class: Mapping[str, Sequence[str]],
    repeat: bool,
    rng: np.random.Generator,
) -> list[DrawnObjects]:
    """Draw classes, and a model of each, for every scene."""
    of_class: Counter[str] = Counter()
    of_asset: Counter[str] = Counter()
    drawn = []
    for count in numbers:
        mine = draw_least_used(classes, of_class, count, rng, repeat)
        of_class.update(mine)
        assets = []
        for name in mine:
            assets += draw_least_used(by_class[name], of_asset, 1, rng)
            of_asset.update(assets[-1:])
        drawn.append((mine, assets))
    return drawn


def _draw_scenes(
    kinds: Sequence[InteractionKind], sets: Sequence[DrawnObjects], rng: np.random.Generator
) -> list[PlannedScene]:
    """Draw an arrangement and a seed for every scene."""
    of_arrangement: Counter[str] = Counter()
    digits = len(str(len(kinds) - 1))
    made = []
    for number, (kind, (mine, assets)) in enumerate(zip(kinds, sets, strict=True)):
        stands = ARRANGEMENTS_OF_KIND[kind] if len(mine) > 1 else ("scatter",)
        (arrangement,) = draw_least_used(stands, of_arrangement, 1, rng)
        of_arrangement[arrangement] += len(mine) > 1
        made.append(
            PlannedScene(
                name=f"{number:0{digits}d}-{kind}",
                seed=int(rng.integers(2**31)),
                classes=tuple(mine),
                assets=tuple(assets),
                arrangement=arrangement,  # type: ignore[arg-type]
                interaction=kind,
            )
        )
    return made


def _by_class(models: Sequence[PoolAsset]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for model in sorted(models, key=lambda m: m.name):
        found.setdefault(model.class_name, []).append(model.name)
    return found


def _showcase(name: str) -> PlannedScene:
    objects = [t.model.replace("_", " ") for t in SHOWCASE_SCENE_BUILDERS[name]().models]
    kind = INTERACTION_OF_SHOWCASE[name]
    return PlannedScene(name, 0, tuple(objects), (), "scatter", kind)


def _fewer_classes_note(found: int, wanted: int) -> str:
    return f"The pool has {found} class{'es' * (found != 1)}, {wanted} were asked for: all are used."


def _check(config: CorpusConfig) -> None:
    for name, value, low, high in (
        ("--scenes", config.scenes, 1, MAX_CORPUS_SCENES),
        ("--classes", config.classes, 1, MAX_CORPUS_SCENES),
        ("--seed", config.seed, 0, 2**63),
    ):
        if not low <= value <= high:
            raise UserError(f"{name} is {value}. Give a number from {low} to {high}.")
