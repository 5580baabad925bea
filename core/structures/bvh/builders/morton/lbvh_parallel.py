"""LBVH, all inner nodes at once: each finds its own interval from the sorted codes alone.

There is one inner node less than there are references. Inner node i has an interval that begins or
ends with reference i, which no other has in the same direction, and knows no other node:

1. the interval goes from i towards the neighbour whose code has more leading bits in common with
   that of i;
2. it ends before the first reference that has as little in common with i as the neighbour on the
   other side, found by doubling steps, then halving them;
3. it is cut where the leading bits that all have in common end, found by halving, too;
4. a child that begins or ends at the cut k is inner node k or k + 1, or reference k or k + 1.

The boxes then grow from the leaves up, and a node is fitted by whoever comes second. The tree is
that of :mod:`.lbvh`, node by node.

T. Karras: Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees, HPG 2012.
"""

from __future__ import annotations

import numpy as np

from .....kernels import call, inner, kernel
from .....parallel import BLOCK, Team
from .....progress import Progress
from ...topology.collapse import LeafRule, collapse
from ...topology.tree import Builder, Grouping, Primitives, leaves_only
from .codes import MortonSettings, sort_by_code
from .lbvh import log_of_codes


@inner
def common_bits(codes, i, j):
    """Return how many leading bits codes i and j have in common, -1 if there is no j.

    Behind a code come the bits of its index, so that no two are the same: 64 bits each.
    """
    if j < 0 or j >= len(codes):
        return -1
    difference, bits = codes[i] ^ codes[j], 64
    if difference == 0:
        difference, bits = i ^ j, 128
    for shift in (32, 16, 8, 4, 2, 1):
        if difference >> shift > 0:
            difference >>= shift
            bits -= shift
    return bits - 1


@kernel
def link_nodes(tree, codes, first, last):
    """Find the children of the inner nodes ``first <= i < last``; the root is inner node 0."""
    count = len(codes)
    for i in range(first, last):
        # Which way? At least what is behind lies outside.
        before, after = common_bits(codes, i, i - 1), common_bits(codes, i, i + 1)
        way, outside = (1, before) if after > before else (-1, after)
        # How far? A length that is too large, then the largest that is not.
        step = 2
        while common_bits(codes, i, i + step * way) > outside:
            step *= 2
        length = 0
        while step > 1:
            step >>= 1
            if common_bits(codes, i, i + (length + step) * way) > outside:
                length += step
        other = i + length * way
        # The farthest reference that has more in common with i than the other end has.
        inside = common_bits(codes, i, other)
        near, far = 0, length  # `near` steps still have more in common, `far` do not
        while near + 1 < far:
            middle = (near + far) >> 1
            if common_bits(codes, i, i + middle * way) > inside:
                near = middle
            else:
                far = middle
        cut = i + near * way + min(way, 0)
        left = cut if min(i, other) == cut else count + cut
        right = cut + 1 if max(i, other) == cut + 1 else count + cut + 1
        node = count + i
        tree.left[node], tree.right[node] = left, right
        tree.parent[left] = tree.parent[right] = node


@kernel
def fit_upwards(tree, arrived, first, last):
    """Fit the boxes above the leaves ``first <= i < last``, each where the second child arrives.

    Parameters
    ----------
    arrived : (2n - 1,) uint8
        How many children of each node have arrived so far.
    """
    for leaf in range(first, last):
        node = tree.parent[leaf]
        while node >= 0:
            arrived[node] += 1
            if arrived[node] == 1:
                break
            left, right = tree.boxes[tree.left[node]], tree.boxes[tree.right[node]]
            for side in range(3):
                a, b = left[side], right[side]
                tree.boxes[node, side] = b if b < a else a
                a, b = left[3 + side], right[3 + side]
                tree.boxes[node, 3 + side] = b if b > a else a
            node = tree.parent[node]


def build_lbvh_parallel(
    primitives: Primitives, settings: MortonSettings, progress: Progress, log: bool = False
) -> Grouping:
    """Sort, link all nodes, fit them, choose leaves.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    with Team(progress, "Building bvh") as team:
        codes, order = sort_by_code(primitives.boxes, settings, team)
        tree = leaves_only(primitives.boxes[order])
        team.run(lambda *block: call(link_nodes, tree, codes, *block), len(codes) - 1)
    # Counting who has arrived takes an operation that no other thread can interrupt. Compiled
    # Python has none, so here one thread does it all.
    arrived = np.zeros(len(tree.left), np.uint8)
    for first in range(0, len(codes), BLOCK):
        progress.report(first, len(codes), "Building bvh")
        call(fit_upwards, tree, arrived, first, min(first + BLOCK, len(codes)))
    rule = LeafRule.of(settings)
    collapsed, references = collapse(tree, rule)
    if not log:
        return Grouping(collapsed, order[references])
    boxes, codes_there = primitives.boxes, codes[references]
    return Grouping(
        collapsed,
        order[references],
        log=lambda: log_of_codes(collapsed, codes_there, boxes, settings),
    )


BUILDER = Builder(
    "The tree of LBVH, all nodes at once (Karras 2012)",
    MortonSettings,
    build_lbvh_parallel,
    bytes_per_triangle=470,
)
