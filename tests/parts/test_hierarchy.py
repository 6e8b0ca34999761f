"""Trees of merges: cuts, what they refuse, and the cheapest one against all."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.parts.hierarchy import Hierarchy


def tree(count: int, seed: int = 0, volumes: bool = True) -> Hierarchy:
    """A random tree over `count` pieces of two tets each."""
    rng = np.random.default_rng(seed)
    alive, merges = list(range(count)), []
    volume = list(rng.uniform(1, 2, count))
    hull = list(volume)
    for k in range(count - 1):
        a, b = sorted(alive.pop(rng.integers(len(alive))) for _ in range(2))
        merges.append((a, b))
        alive.append(count + k)
        volume.append(volume[a] + volume[b])
        hull.append(hull[a] + hull[b] + rng.uniform(0, 2))
    cost = np.arange(count - 1, dtype=float)
    node = (np.array(volume), np.array(hull)) if volumes else (None, None)
    return Hierarchy(np.tile(np.arange(count), 2), np.array(merges).reshape(-1, 2), cost, *node)


def test_every_cut_has_its_parts_and_refines_the_one_before() -> None:
    one = tree(30)
    before = one.cut(1)
    assert before.tolist() == [0] * 60
    for count in range(2, 31):
        labels = one.cut(count)
        assert np.unique(labels).tolist() == list(range(count))
        assert len(np.unique(np.stack([labels, before]), axis=1).T) == count
        sizes = [one.volume[n] for n in one.nodes(count)]
        parts = [one.volume[:30][np.unique(one.piece[labels == k])].sum() for k in range(count)]
        np.testing.assert_allclose(parts, sorted(sizes, reverse=True))
        before = labels


def test_parts_without_volumes_are_numbered_by_first_appearance() -> None:
    labels = tree(9, volumes=False).cut(5)
    first = [int(np.argmax(labels == k)) for k in range(5)]
    assert first == sorted(first)


def test_leaves_children_and_depth() -> None:
    one = tree(8, 3)
    assert one.leaves(one.root).tolist() == list(range(8))
    left, right = one.children(one.root)
    assert sorted([*one.leaves(left), *one.leaves(right)]) == list(range(8))
    assert one.children(0) is None
    assert one.nodes_at_depth(0) == [one.root]
    assert one.nodes_at_depth(1) == sorted([left, right])
    assert one.nodes_at_depth(9) == list(range(8))
    assert one.cut_at(one.nodes_at_depth(2)).max() + 1 == len(one.nodes_at_depth(2)) <= 4


def test_one_piece_is_a_tree() -> None:
    one = Hierarchy(np.zeros(4, int), np.zeros((0, 2), int), np.zeros(0), np.ones(1), np.ones(1))
    assert len(one) == 1
    assert one.cut(1).tolist() == [0, 0, 0, 0]
    assert one.nodes_at_depth(2) == [0]
    with pytest.raises(BadValue, match="can be cut into 1 to 1 parts, not 2"):
        one.cut(2)


def test_a_deep_tree_is_cut_quickly() -> None:
    count = 20_000
    chain = np.stack([np.r_[0, count + np.arange(count - 2)], np.arange(1, count)], 1)
    one = Hierarchy(np.arange(count), np.sort(chain, 1), np.ones(count - 1))
    assert np.unique(one.cut(100)).tolist() == list(range(100))


def test_cuts_that_are_none_are_refused() -> None:
    one = tree(5)
    with pytest.raises(BadValue, match="must hold every piece exactly once; 4 of 5 pieces are in none"):
        one.cut_at([0])
    with pytest.raises(BadValue, match="some nodes lie in or equal others"):
        one.cut_at([0, one.root])
    with pytest.raises(BadValue, match="some nodes lie in or equal others"):
        one.cut_at([one.root, one.root])
    with pytest.raises(BadValue, match=r"nodes of this tree are 0\.\.8; got 9"):
        one.cut_at([9])


@pytest.mark.parametrize(
    ("piece", "merges", "message"),
    [
        ([0, 1, 1], [[0, 1], [2, 3]], r"needs one of the pieces 0\.\.2 per tet"),
        ([0, 1, 2], [[0, 1], [1, 2]], "these merges are no tree"),
        ([0, 1, 2], [[0, 3], [1, 2]], "these merges are no tree"),
    ],
)
def test_trees_that_are_none_are_refused(piece: list[int], merges: list[list[int]], message: str) -> None:
    with pytest.raises(BadValue, match=message):
        Hierarchy(np.array(piece), np.array(merges), np.zeros(2))
