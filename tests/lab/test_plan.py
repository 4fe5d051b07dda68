"""A plan is balanced in everything it draws, and follows from the pool and the seed alone."""

import os
import subprocess
import sys
from collections import Counter
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import corporeal
from corporeal.core.errors import BadFileError, UserError
from corporeal.lab.corpus.corpus_plan import (
    CorpusConfig,
    choose_classes,
    interactions_and_counts,
    plan_corpus,
    read_plan,
    with_wind,
    write_plan,
)
from corporeal.pool.asset_pool import PoolAsset
from corporeal.scene.interactions import ARRANGEMENTS_OF_KIND, INTERACTION_KINDS, MIN_OBJECTS_OF_KIND

PRINT = """
import sys, test_plan as t
from corporeal.lab.corpus.corpus_plan import CorpusConfig, plan_corpus
print(repr(plan_corpus(t.pool(20), CorpusConfig(seed=int(sys.argv[1]))).scenes))
"""


def asset(name, class_name):
    return PoolAsset(name, class_name, Path(f"{name}.glb"), "", name, "CC0", "", 1.0, True, 500, 0, 0)


def pool(classes, models=(1, 2, 3)):
    return [asset(f"c{k:02d}_{m}", f"c{k:02d}") for k in range(classes) for m in range(models[k % len(models)])]


def spread(counts):
    return max(counts) - min(counts)


def test_the_preset_has_42_scenes_of_15_classes_and_covers_everything_evenly():
    made = plan_corpus(pool(20), CorpusConfig())
    assert len(made.scenes) == 42 and not made.messages
    classes = Counter(c for s in made.scenes for c in s.classes)
    assert len(classes) == 15 and spread(classes.values()) <= 1
    assert spread(Counter(s.interaction for s in made.scenes).values()) <= 1
    assert {s.interaction for s in made.scenes} == set(INTERACTION_KINDS)
    numbers = Counter(s.count for s in made.scenes)
    assert set(numbers) == {1, 2, 3, 4} and spread(numbers.values()) <= 1
    ways = Counter(s.arrangement for s in made.scenes)
    assert set(ways) == {"scatter", "stack", "onto", "row"}
    assert abs(ways["stack"] - ways["onto"]) <= 1
    assert len({s.name for s in made.scenes}) == len({s.seed for s in made.scenes}) == 42


@given(
    st.integers(1, 80),
    st.integers(1, 25),
    st.sampled_from(["1-4", "2-3", "3-6", "2", "1"]),
    st.integers(0, 2**32),
    st.booleans(),
)
def test_every_plan_is_even_and_possible(scenes, classes, count, seed, repeat):
    config = CorpusConfig(scenes=scenes, count=count, seed=seed, repeat=repeat)
    made = plan_corpus(pool(classes), config)
    used = Counter(c for s in made.scenes for c in s.classes)
    every = [used[c] for c in choose_classes({a.class_name: [a.name] for a in pool(classes)}, 99,
                                             np.random.default_rng(0))]  # fmt: skip
    taken = sorted(every, reverse=True)[: min(classes, 15)]
    assert len(made.scenes) == scenes and spread(taken) <= 1 and sum(taken) == sum(every)
    kinds = Counter(s.interaction for s in made.scenes)
    possible = [k for k in INTERACTION_KINDS if MIN_OBJECTS_OF_KIND[k] <= max(s.count for s in made.scenes)]
    assert set(kinds) <= set(INTERACTION_KINDS)
    assert scenes < len(INTERACTION_KINDS) or (
        set(possible) <= set(kinds) and spread([kinds[k] for k in possible]) <= 1
    )
    for scene in made.scenes:
        assert len(scene.assets) == scene.count >= MIN_OBJECTS_OF_KIND[scene.interaction]
        assert repeat or len(set(scene.classes)) == scene.count
        assert [a.rpartition("_")[0] for a in scene.assets] == list(scene.classes)
        allowed = ARRANGEMENTS_OF_KIND[scene.interaction] if scene.count > 1 else ("scatter",)
        assert scene.arrangement in allowed


def test_wind_blows_where_it_moves_something_and_nothing_else_changes():
    """Every second class is too heavy."""

    def windy(names):
        return any(int(name[1:3]) % 2 for name in names)

    calm, blown = (plan_corpus(pool(20), CorpusConfig(seed=3), w) for w in (None, windy))
    assert not all(windy(s.assets) for s in calm.scenes if s.interaction == "wind")
    assert all(windy(s.assets) for s in blown.scenes if s.interaction == "wind")
    assert [s.assets for s in blown.scenes] == [s.assets for s in calm.scenes]
    for made in (calm, blown):
        assert spread(Counter(s.interaction for s in made.scenes).values()) <= 1
    assert all(s.count >= MIN_OBJECTS_OF_KIND[s.interaction] for s in blown.scenes) and not blown.messages


def test_where_no_wind_moves_anything_objects_fall_and_it_is_reported():
    kinds, said = with_wind(["wind", "fall"], [["anvil"], ["safe"]], lambda names: False)
    assert kinds == ["fall", "fall"] and "No wind moves anvil" in said[0]


def test_the_models_of_a_class_come_evenly():
    made = plan_corpus(pool(6, models=(4,)), CorpusConfig(scenes=30))
    used = Counter(a for s in made.scenes for a in s.assets)
    for k in range(6):
        assert spread([used[f"c{k:02d}_{m}"] for m in range(4)]) <= 1


def test_numbers_of_objects_are_even_whatever_the_interactions_need():
    for seed in range(30):
        rng = np.random.default_rng(seed)
        pairs = interactions_and_counts(42, INTERACTION_KINDS, (1, 4), rng)
        assert spread(Counter(n for _, n in pairs).values()) <= 1
        assert all(n >= MIN_OBJECTS_OF_KIND[k] for k, n in pairs)
        single = Counter(k for k, n in pairs if n == 1)
        assert spread(single.values()) <= 1, "things alone fall as often as they stand in the wind"


def test_classes_with_more_models_are_chosen_first_and_chance_decides_the_rest():
    by_class = {"many": ["1", "2", "3"], "two": ["1", "2"]} | {c: ["1"] for c in "abcdef"}
    drawn = [choose_classes(by_class, 4, np.random.default_rng(k)) for k in range(30)]
    assert all({"many", "two"} < set(d) and len(d) == 4 for d in drawn)
    assert len({tuple(d) for d in drawn}) > 5
    assert drawn == [choose_classes(by_class, 4, np.random.default_rng(k)) for k in range(30)]


def test_another_process_plans_the_same_and_the_order_of_the_pool_is_no_matter():
    made = plan_corpus(pool(20), CorpusConfig(seed=5))
    assert plan_corpus(pool(20)[::-1], CorpusConfig(seed=5)) == made
    assert plan_corpus(pool(20), CorpusConfig(seed=6)).scenes != made.scenes
    paths = [Path(__file__).parent, Path(corporeal.__file__).parents[1]]
    told = subprocess.run(
        [sys.executable, "-c", PRINT, "5"],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parent,
        env={"PYTHONHASHSEED": "77", "PYTHONPATH": os.pathsep.join(map(str, paths))},
    )
    assert told.stdout.strip() == repr(made.scenes)


def test_a_small_pool_gives_what_it_can_and_says_so():
    one = plan_corpus(pool(1), CorpusConfig(scenes=8))
    assert {s.count for s in one.scenes} == {1}
    assert {s.interaction for s in one.scenes} == {"fall", "wind"}
    told = " ".join(one.messages)
    assert "1 class, 15 were asked for" in told and "--repeat" in told and "chain" in told
    again = plan_corpus(pool(1), CorpusConfig(scenes=8, repeat=True))
    assert {s.interaction for s in again.scenes} == set(INTERACTION_KINDS)
    assert plan_corpus(pool(3), CorpusConfig()).messages[1].startswith("Scenes have at most 3 objects")


def test_an_empty_pool_and_senseless_numbers_are_reported_to_be():
    with pytest.raises(UserError, match="no usable asset"):
        plan_corpus([], CorpusConfig())
    for wrong in ({"scenes": 0}, {"classes": 0}, {"seed": -1}):
        with pytest.raises(UserError, match="Give a number from"):
            plan_corpus(pool(3), CorpusConfig(**wrong))
    for count in ("4-1", "0-3", "many"):
        with pytest.raises(UserError, match="--count"):
            plan_corpus(pool(3), CorpusConfig(count=count))


def test_the_showcase_needs_no_pool():
    made = plan_corpus([], CorpusConfig(preset="seven"))
    assert [s.name for s in made.scenes][:2] == ["duck-on-mud", "duck-on-can"]
    assert len(made.scenes) == 7 and {s.interaction for s in made.scenes} <= set(INTERACTION_KINDS)
    assert made.scenes[2].classes == ("vase", "ball", "armchair")
    assert made.messages == ()
    fewer = plan_corpus([], CorpusConfig(preset="seven", scenes=2))
    assert fewer.scenes == made.scenes
    assert fewer.messages == ("The showcase has scenes of its own: --scenes 2 changes nothing.",)


def test_a_corpus_is_called_a_preset_with_all_that_differs_from_it():
    assert CorpusConfig().words == "--preset fortytwo --seed 0"
    asked = CorpusConfig(scenes=2, count="1-2", repeat=True, seed=5)
    assert asked.words == "--preset fortytwo --scenes 2 --count 1-2 --repeat --seed 5"


def test_a_plan_comes_back_as_it_was(tmp_path):
    made = plan_corpus(pool(4), CorpusConfig(scenes=9))
    write_plan(tmp_path, made)
    assert read_plan(tmp_path) == made
    (tmp_path / "corpus.json").write_text('{"config": {}, "scenes": [{"nme": 1}]}')
    with pytest.raises(BadFileError, match="not the plan of a corpus"):
        read_plan(tmp_path)
    with pytest.raises(UserError, match="not a corpus"):
        read_plan(tmp_path / "nowhere")
    assert asdict(made)["config"]["seed"] == 0
