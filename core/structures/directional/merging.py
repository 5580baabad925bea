"""Cells with equal or similar lists share one (lecture, "5D ray space"; here for all cells).

Many cells see the same items: those that one covers, those of the sky between two. Of equal lists
one is kept. Of similar ones, of cells that follow each other, what all of them have is kept once: a
list becomes longer, and never lacks an item.
"""

from __future__ import annotations

import numpy as np

from ...kernels import call, inner, kernel, whole
from .lists import Lists

KEEP, EQUAL, SIMILAR = "none", "equal", "similar"

LONGER = 1.25
"""Similar lists share one that is at most so many times as long as the shortest of them."""


def merged(lists: Lists, how: str) -> Lists:
    """Return lists of which cells share those that are equal, or similar."""
    if how == KEEP:
        return lists
    leaves = np.flatnonzero((lists.children < 0) & (lists.last > lists.first))
    if how == SIMILAR:
        lists = joined_alike(lists, leaves)
    codes = np.empty(len(leaves), np.int64)
    call(hash_lists, lists, leaves, codes)
    order = leaves[np.argsort(codes, kind="stable")]
    first, last = lists.first.copy(), lists.last.copy()
    call(find_equal, lists, order, np.sort(codes), first, last)
    return compact(lists._replace(first=first, last=last))


def joined_alike(lists: Lists, leaves: np.ndarray) -> Lists:
    """Return lists of which similar ones that follow each other are what all of them have."""
    first, last = lists.first.copy(), lists.last.copy()
    room = int((lists.last - lists.first)[leaves].sum())
    longest = int((LONGER + 1.0) * (lists.last - lists.first).max(initial=0)) + 1
    references, nearest = np.empty(room, np.int32), np.empty(room)
    held = np.empty((2, longest), np.int32)
    at = np.empty((2, longest))
    size = call(join_similar, lists, leaves, first, last, references, nearest, held, at)
    return lists._replace(
        first=first, last=last, references=references[:size], nearest=nearest[:size]
    )


def compact(lists: Lists) -> Lists:
    """Return lists without what no cell lists any more."""
    is_listed = np.zeros(len(lists.references) + 1, np.int64)
    filled = lists.last > lists.first
    np.add.at(is_listed, lists.first[filled], 1)
    np.add.at(is_listed, lists.last[filled], -1)
    kept = np.cumsum(is_listed[:-1]) > 0
    place = np.concatenate([[0], np.cumsum(kept)])
    return lists._replace(
        first=place[np.where(filled, lists.first, 0)],
        last=place[np.where(filled, lists.last, 0)],
        references=lists.references[kept],
        nearest=lists.nearest[kept],
    )


@kernel
def hash_lists(lists, leaves, codes):
    """Write a number for every list: the same for equal ones, and hardly ever for others."""
    for n in range(len(leaves)):
        code = whole(lists.last[leaves[n]] - lists.first[leaves[n]])
        for slot in range(lists.first[leaves[n]], lists.last[leaves[n]]):
            code = (code ^ lists.references[slot]) * whole(1_099_511_628_211)
        codes[n] = code


@kernel
def find_equal(lists, order, codes, first, last):
    """Let each list be the first one that is equal, among lists sorted by their codes."""
    for n in range(1, len(order)):
        # Behind those of the same code, from the one before on: nearly always that is equal.
        k = n - 1
        while k >= 0 and codes[k] == codes[n]:
            if are_equal(lists, whole(order[k]), whole(order[n])):
                first[order[n]], last[order[n]] = first[order[k]], last[order[k]]
                break
            k -= 1


@kernel
def join_similar(lists, leaves, first, last, references, nearest, held, at):
    """Put the lists of cells that follow each other together, as long as they are alike.

    Parameters
    ----------
    first, last : (n_cells,) int64
        In the end, where each list begins and ends among the new ones.
    references, nearest : (m,)
        Room for the new lists.
    held, at : (2, k)
        Room for what the cells so far have, and for that and one list more.

    Returns
    -------
    int
        Length of the new lists together.
    """
    place, begin = whole(0), whole(0)
    count, shortest = whole(0), whole(0)
    for n in range(len(leaves) + 1):
        size = whole(0)
        if n < len(leaves):
            size = whole(lists.last[leaves[n]] - lists.first[leaves[n]])
        together = whole(-1)
        if n > begin and n < len(leaves):
            least = size if size < shortest else shortest
            together = union(lists, whole(leaves[n]), count, held, at, whole(LONGER * least))
        if together >= 0:
            for k in range(together):
                held[0, k], at[0, k] = held[1, k], at[1, k]
            count, shortest = together, least
            continue
        for cell in range(begin, n):
            first[leaves[cell]], last[leaves[cell]] = place, place + count
        for k in range(count):
            references[place + k], nearest[place + k] = held[0, k], at[0, k]
        place += count
        if n < len(leaves):
            begin, count, shortest = whole(n), size, size
            for k in range(size):
                slot = lists.first[leaves[n]] + k
                held[0, k], at[0, k] = lists.references[slot], lists.nearest[slot]
    return place


@inner
def union(lists, cell, count, held, at, most):
    """Write what a cell lists and what is held, in order; return how much, -1 if it is too much."""
    slot, last, k, size = lists.first[cell], lists.last[cell], whole(0), whole(0)
    while slot < last or k < count:
        if size >= most:
            return whole(-1)
        has_listed, has_held = slot < last, k < count
        takes_listed = has_listed
        if has_listed and has_held:
            near, item = lists.nearest[slot], lists.references[slot]
            takes_listed = near < at[0, k] or (near == at[0, k] and item <= held[0, k])
        if takes_listed:
            held[1, size], at[1, size] = lists.references[slot], lists.nearest[slot]
            # The same item, at the same distance: in both.
            if has_held and held[0, k] == held[1, size] and at[0, k] == at[1, size]:
                k += 1
            slot += 1
        else:
            held[1, size], at[1, size] = held[0, k], at[0, k]
            k += 1
        size += 1
    return size


@inner
def are_equal(lists, a, b):
    """Say whether two cells list the same items, as far away."""
    size = lists.last[a] - lists.first[a]
    if lists.last[b] - lists.first[b] != size:
        return False
    for k in range(size):
        i, j = lists.first[a] + k, lists.first[b] + k
        if lists.references[i] != lists.references[j] or lists.nearest[i] != lists.nearest[j]:
            return False
    return True
