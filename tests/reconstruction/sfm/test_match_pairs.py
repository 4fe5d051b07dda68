"""Which pictures are matched: as many of each, however many there are."""

import numpy as np
import pytest

from corporeal.reconstruction.sfm.prepare_images import PreparedImages
from corporeal.reconstruction.sfm.sfm_run import (
    ALWAYS_MATCHED_DISTANCE,
    FEW_PARTNERS,
    MAX_PARTNERS,
    NAME_DISTANCES,
    match_pairs,
    match_partners,
    pairs_to_match,
)


def walk(total, reach):
    """Points shared by pictures of a walk around a thing, the more the nearer; 0 beyond reach."""
    apart = np.abs(np.arange(total)[:, None] - np.arange(total))
    apart = np.minimum(apart, total - apart)
    shared = np.where(apart <= reach, 400 // np.maximum(apart, 1), 0)
    np.fill_diagonal(shared, 0)
    return shared


def matched_of(total, shared):
    names = tuple(f"{k:03d}.jpg" for k in range(total))
    pairs = None if shared is None else tuple(match_partners(shared))
    return pairs_to_match(PreparedImages(names, ((640, 480),) * total, (), pairs=pairs), "plain")


def test_twice_as_many_photographs_take_twice_as_many_pairs():
    counts = [len(matched_of(n, walk(n, n // 4))) for n in (40, 80, 120)]
    assert counts[1] <= 2.1 * counts[0] and counts[2] <= 3.1 * counts[0]
    everything = [len(matched_of(n, None)) for n in (40, 80)]
    assert everything[1] > 4 * everything[0]  # what it cost before
    assert counts[1] < 0.3 * everything[1]


def test_a_walk_around_stays_closed_and_its_best_partners_are_kept():
    total = 60
    pairs = set(match_partners(walk(total, 20)))
    nearest = {tuple(sorted((k, (k + d) % total))) for k in range(total) for d in range(1, 9)}
    assert nearest <= pairs and (0, total - 1) in pairs


def test_what_hardly_anything_joined_when_small_is_matched_with_all():
    total, lost = 60, 25
    shared = walk(total, 20)
    shared[lost], shared[:, lost] = 0, 0
    shared[lost, lost + 1 : lost + FEW_PARTNERS] = shared[lost + 1 : lost + FEW_PARTNERS, lost] = 20
    pairs = set(match_partners(shared))
    assert {(k, lost) for k in range(lost)} | {(lost, k) for k in range(lost + 1, total)} <= pairs
    assert match_partners(np.zeros((16, 16), int)) == match_pairs(16)


def test_of_very_many_it_is_matched_with_its_neighbours_by_name():
    total, lost = 110, 50
    shared = walk(total, 20)
    shared[lost], shared[:, lost] = 0, 0
    partners = {b for a, b in match_partners(shared) if a == lost}
    assert partners == {lost + d for d in NAME_DISTANCES if lost + d < total}


@pytest.mark.parametrize("total", [20, 90])
def test_neighbours_by_name_are_matched_whatever_small_copies_say(total):
    shared = np.full((total, total), 20)
    shared[:, : FEW_PARTNERS + MAX_PARTNERS] = shared[: FEW_PARTNERS + MAX_PARTNERS] = 200
    pairs = set(match_partners(shared))
    assert {
        (k, k + d) for k in range(total - ALWAYS_MATCHED_DISTANCE) for d in range(1, ALWAYS_MATCHED_DISTANCE + 1)
    } <= pairs


def test_the_thorough_attempt_finds_pairs_that_small_copies_did_not():
    names = tuple("abcdefgh")
    gathered = PreparedImages(names, ((640, 480),) * 8, (), pairs=((0, 1), (1, 2)))
    assert pairs_to_match(gathered, "plain") == [(0, 1), (1, 2)]
    assert pairs_to_match(gathered, "thorough") == match_pairs(8)
