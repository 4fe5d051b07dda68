import numpy as np
import pytest

from corporeal.reconstruction.segment.cut_proposals import MergeTreeProposals, PatchGraph, SweepProposals
from corporeal.reconstruction.segment.graph_cuts import best_graph_cut
from corporeal.reconstruction.segment.object_segmentation import count_stacked_objects
from corporeal.reconstruction.segment.patch_graph import SurfacePatches


def clique(sizes, bridges, appearance=None):
    """Groups of nodes that hold fully, and weak bridges between groups (group, group, weight)."""
    start = np.cumsum([0, *sizes])
    pairs = [(start[k] + a, start[k] + b, 1.0) for k, n in enumerate(sizes) for a in range(n) for b in range(a + 1, n)]
    pairs += [(start[a], start[b], w) for a, b, w in bridges]
    i, j, w = (np.array(part) for part in zip(*pairs, strict=True))
    count = int(start[-1])
    owner = np.repeat(np.arange(len(sizes)), sizes)
    looks = np.zeros((count, 1)) if appearance is None else np.array(appearance, float)[owner, None]
    return PatchGraph(i, j, w, np.ones(len(w)), np.ones(count), looks), owner


def halves(side, owner):
    return {tuple(np.unique(owner[side])), tuple(np.unique(owner[~side]))}


def test_the_cut_goes_where_the_graph_is_narrow():
    graph, owner = clique([12, 9], [(0, 1, 0.5)])
    found = best_graph_cut(graph, 0.003)
    assert halves(found.side, owner) == {(0,), (1,)}
    share = 12 / 21
    expected = (0.5 / graph.whole.sum() + 0.003) * (1 / share + 1 / (1 - share))
    np.testing.assert_allclose(found.score, expected, rtol=1e-9)


def test_a_crumb_that_hangs_by_nothing_is_not_an_object():
    graph, owner = clique([30, 30, 1], [(0, 1, 0.5), (1, 2, 1e-9)])
    assert halves(best_graph_cut(graph, 0.003).side, owner) in [{(0,), (1, 2)}]
    assert halves(best_graph_cut(graph, 0.0).side, owner) == {(0, 1), (2,)}


def test_of_two_necks_the_one_between_looks_is_cut():
    graph, owner = clique([10, 10, 10], [(0, 1, 0.4), (1, 2, 0.4)], [0, 0, 1])
    assert halves(best_graph_cut(graph, 0.003).side, owner) == {(0, 1), (2,)}


def test_a_cut_that_has_a_rival_says_so():
    chain, _ = clique([20, 20, 20], [(0, 1, 0.3), (1, 2, 0.3)])
    found = best_graph_cut(chain, 0.003)
    assert found.other / found.score < 1.01
    plain, _ = clique([20, 20], [(0, 1, 0.1)])
    found = best_graph_cut(plain, 0.003)
    assert found.other / found.score > 5


def test_many_chains_that_hang_by_next_to_nothing_are_cut_where_they_look_unlike():
    weak = np.arange(1, 200) % 20 == 0
    weight = np.where(weak, 1e-9, np.random.default_rng(0).uniform(0.5, 1.5, 199))
    appearance = (np.arange(200) >= 120).astype(float)[:, None]
    first = np.arange(199)
    graph = PatchGraph(first, first + 1, weight, np.ones(199), np.ones(200), appearance)
    side = best_graph_cut(graph, 0.003).side
    assert (side == (appearance[:, 0] == side[-1])).all()


def test_what_is_in_pieces_falls_into_them():
    graph, owner = clique([8, 5], [])
    assert halves(best_graph_cut(graph, 0.003).side, owner) == {(0,), (1,)}
    assert best_graph_cut(graph.only(np.array([3])), 0.003) is None


@pytest.mark.parametrize("kind", ["sweep", "tree"])
def test_candidates_know_their_sums_and_what_they_are_held_by(kind):
    rng = np.random.default_rng(0)
    i, j = np.triu_indices(17, 1)
    kept = rng.random(len(i)) < 0.3
    i, j = i[kept], j[kept]
    weight = rng.random(len(i))
    graph = PatchGraph(i, j, weight, np.ones(len(i)), rng.random(17), rng.random((17, 2)))
    proposals = MergeTreeProposals(graph) if kind == "tree" else SweepProposals(graph, rng.permutation(17))
    sums, across = proposals.sums(graph.appearance), proposals.across()
    assert len(across) >= 15
    for k in range(len(across)):
        side = proposals.side(k)
        np.testing.assert_allclose(sums[k], graph.appearance[side].sum(0), rtol=1e-9)
        np.testing.assert_allclose(across[k], weight[side[i] != side[j]].sum(), atol=1e-9)


def blocks(*boxes, step=0.05):
    """Patches on a grid that fills boxes: lowest and highest corner of each."""
    rows = []
    for low, high in boxes:
        axes = [np.arange(a, b + 1e-9, step) for a, b in zip(low, high, strict=True)]
        rows.append(np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3))
    owner = np.repeat(np.arange(len(rows)), [len(r) for r in rows])
    centre = np.concatenate(rows)
    one = np.ones(len(centre), int)
    return SurfacePatches(one, one, centre, centre, centre), owner


def test_only_thin_objects_on_each_other_are_a_stack():
    book, lifted = ((0, 0, 0), (1, 0.6, 0.15)), ((0.1, 0, 0.15), (1, 0.6, 0.3))
    assert count_stacked_objects(*blocks(book, lifted)) == 2
    crate = ((0.1, 0, 0.15), (0.9, 0.6, 0.9))
    assert count_stacked_objects(*blocks(book, crate)) == 1
    assert count_stacked_objects(*blocks(((0, 0, 0), (0.6, 0.6, 0.6)), ((0, 0, 0.6), (0.6, 0.6, 1.2)))) == 0
    beside = ((1.1, 0, 0), (2, 0.6, 0.15))
    assert count_stacked_objects(*blocks(book, beside)) == 0
    above = ((0, 0, 0.6), (1, 0.6, 0.75))
    assert count_stacked_objects(*blocks(book, above)) == 0
