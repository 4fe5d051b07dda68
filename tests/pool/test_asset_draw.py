"""Drawing by deficit keeps a corpus balanced."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from corporeal.pool.asset_pool import draw_least_used

NAMES = tuple("abcdefghijklmno")


@given(st.lists(st.integers(1, 4), min_size=1, max_size=60), st.integers(0, 99))
def test_uses_differ_by_one_at_most_whatever_is_drawn(counts, seed):
    used, rng = Counter(), np.random.default_rng(seed)
    for count in counts:
        drawn = draw_least_used(NAMES, used, count, rng)
        assert len(set(drawn)) == count
        used.update(drawn)
        assert max(used.values()) - min(used[n] for n in NAMES) <= 1


def test_chance_decides_between_equals_and_the_seed_decides_chance():
    first = [draw_least_used(NAMES, {}, 3, np.random.default_rng(k)) for k in range(20)]
    assert first == [draw_least_used(NAMES, {}, 3, np.random.default_rng(k)) for k in range(20)]
    assert len({tuple(f) for f in first}) > 10


def test_a_name_comes_again_only_where_it_may():
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="3 of 2"):
        draw_least_used("ab", {}, 3, rng)
    assert sorted(draw_least_used("ab", {}, 3, rng, repeat=True)) in (["a", "a", "b"], ["a", "b", "b"])
