"""What is in doubt about the parts that shape and colour chose: their number, and which of them it hangs on."""

from __future__ import annotations

import numpy as np

from steelyard.check import Integers
from steelyard.findings import Finding
from steelyard.parts.description import Cuts
from steelyard.parts.hierarchy import Hierarchy

SURE = 0.4  # share of the chosen number below which it is the true one in a seventh of the cases
_NAMED = 3  # numbers of parts in the message


def doubts(cuts: Cuts, colour: Integers) -> tuple[Finding, ...]:
    """Return the finding `parts-unsure` where the chosen number of parts has rivals.

    colour  (N,) of the pieces that the tree is made of
    """
    share, chosen = cuts.sureness, cuts.count
    if share[chosen - 1] >= SURE:
        return ()
    order = np.argsort(-share, kind="stable")
    said = ", ".join(f"{k + 1} ({100 * share[k]:.0f} %)" for k in order[:_NAMED])
    other = int(order[1]) + 1
    fewer, more = sorted((chosen, other))
    coarse, fine = cuts.nodes(fewer), cuts.nodes(more)
    split = [node for node in coarse if node not in fine]
    ways = {_told_apart(cuts.hierarchy, node, set(fine), colour) for node in split}
    how = "Colour and shape tell" if len(ways) > 1 else f"Only {ways.pop()} tells"
    text = f"The number of parts is in doubt; by shape and colour: {said}. {how} {more} parts from {fewer}."
    return (Finding.of("parts-unsure", text),)


def _told_apart(tree: Hierarchy, node: int, parts: set[int], colour: Integers) -> str:
    """Return what tells the parts inside a node apart: colour where two of them have no colour in common."""
    inside, open_nodes = [], [node]
    while open_nodes:
        here = open_nodes.pop()
        below = tree.children(here)
        if here in parts or below is None:
            inside.append(set(colour[tree.leaves(here)].tolist()))
        else:
            open_nodes += below
    return "colour" if any(a.isdisjoint(b) for k, a in enumerate(inside) for b in inside[:k]) else "shape"
