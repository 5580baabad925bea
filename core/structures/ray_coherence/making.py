"""Making lists: the items that a cell of a cube sees, the nearest first.

Parts of the tree of spheres that the cell sees are taken from a heap, that first which may be
nearest. So items come in the order of their least distance ``d - R1 - R2``, and are written down as
they come. What a part has is not nearer than the part itself.

With the lecture's bound, a part has to be asked for more than its own sphere says: that bound is no
angle at which a sphere is seen, and grows where the distance becomes less.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import call, inner, kernel, whole
from ...memory import refuse_if_too_large
from ...progress import Progress
from ...ranges import longer
from .condition import meets_window, sees, window_of
from .cubes import NO_LIST, NONE, Cubes
from .spheres import Tree

AT_ONCE = 1 << 8
"""Lists that are made between two looks at the cancel button."""


class Known(NamedTuple):
    """What is known of lists beside what walks see of them.

    Attributes
    ----------
    sphere, cell : (n_lists,) int32
        Whose each is.
    used : (1,) int64
        References that there are.
    """

    sphere: np.ndarray
    cell: np.ndarray
    used: np.ndarray


class Scratch(NamedTuple):
    """The heap: nodes of the tree, and how near what they have may be.

    Attributes
    ----------
    nodes : (k,) int32
    keys : (k,) float64
    """

    nodes: np.ndarray
    keys: np.ndarray


def scratch_for(tree: Tree) -> Scratch:
    """Return scratch memory for lists out of a tree: no node and its parent are in it together."""
    return Scratch(np.empty(len(tree.items) + 1, np.int32), np.empty(len(tree.items) + 1))


@inner
def put_in(heap, size, node, key):
    """Put a node into the heap of `size` nodes."""
    nodes, keys, i = heap.nodes, heap.keys, size
    while i > 0 and key < keys[(i - 1) // 2]:
        above = (i - 1) // 2
        nodes[i], keys[i] = nodes[above], keys[above]
        i = above
    nodes[i], keys[i] = node, key


@inner
def take_out(heap, size):
    """Take the first node out of the heap, of which `size` nodes stay."""
    nodes, keys = heap.nodes, heap.keys
    node, key = nodes[size], keys[size]
    i, below = 0, 1
    while below < size:
        if below + 1 < size and keys[below + 1] < keys[below]:
            below += 1
        if not keys[below] < key:
            break
        nodes[i], keys[i] = nodes[below], keys[below]
        i, below = below, 2 * below + 1
    nodes[i], keys[i] = node, key


@inner
def may_see(tree, node, window, is_exact, x, y, z, distance, own, slack):
    """Say whether a cell may see something of a part of the tree.

    A part has centres within r of its own, and radii up to R. So the centre of one is seen at most
    asin(r / d) beside that of the part, and is not nearer than d - r.

    Parameters
    ----------
    own : float
        Radius of the cube's sphere.
    """
    radius = tree.balls[node, 3]
    if is_exact or node >= len(tree.items):
        return sees(window, is_exact, x, y, z, distance, own + radius + slack)
    radii = own + tree.largest[node] + slack
    if not distance - radius > radii:
        return True
    aside, share = (radius + slack) / distance, radii / (distance - radius)
    # The sine and the cosine of the sum of both angles.
    sine = aside * (1.0 - share) ** 0.5 + share**0.5 * (1.0 - aside * aside) ** 0.5
    if not (1.0 - share) * (1.0 - aside * aside) > share * aside * aside:
        return True
    return meets_window(window, x, y, z, sine * sine * (1.0 + 1e-12))


@inner
def queue(tree, node, ball, window, is_exact, slack, heap, size, least):
    """Put a node into the heap if the cell may see something of it; return the heap's size.

    Parameters
    ----------
    least : float
        How near the part is of which the node is one.
    """
    radius = tree.balls[node, 3]
    if not radius >= 0.0:  # there is nothing
        return size
    x, y = tree.balls[node, 0] - ball[0], tree.balls[node, 1] - ball[1]
    z = tree.balls[node, 2] - ball[2]
    distance = (x * x + y * y + z * z) ** 0.5
    if not may_see(tree, node, window, is_exact, x, y, z, distance, ball[3], slack):
        return size
    key = distance - ball[3] - radius - slack
    put_in(heap, size, node, least if key < least else key)
    return size + 1


@inner
def list_cell(tree, ball, window, is_exact, slack, heap, references, nearest, place):
    """Write the list of a cell from `place` on; return where it ends."""
    size = queue(tree, whole(1), ball, window, is_exact, slack, heap, whole(0), -np.inf)
    while size > 0:
        node, key = whole(heap.nodes[0]), heap.keys[0]
        size -= 1
        take_out(heap, size)
        if node >= len(tree.items):
            references[place] = tree.items[node - len(tree.items)]
            nearest[place] = key
            place += 1
            continue
        for side in range(2):
            size = queue(
                tree, 2 * node + side, ball, window, is_exact, slack, heap, size, key
            )  # fmt: skip
    return place


@kernel
def list_some(cubes, tree, is_exact, heap, wanted, begin, end, most, used):
    """Make the lists ``begin <= k < end`` of some; return how many until room ran out.

    Parameters
    ----------
    cubes : Cubes
    wanted : (k, 3) int64
        The number of each list, its sphere, and the cell of that sphere's cube.
    most : int
        References that there may be; a list that is begun is ended.
    used : (1,) int64
        References that there are.
    """
    for k in range(begin, end):
        if used[0] >= most or used[0] + len(tree.items) > len(cubes.references):
            return k
        number, sphere, cell = whole(wanted[k, 0]), whole(wanted[k, 1]), whole(wanted[k, 2])
        window = window_of(whole(cubes.size[sphere]), cell)
        cubes.first[number] = used[0]
        used[0] = list_cell(
            tree, cubes.balls[sphere], window, is_exact, cubes.slack, heap,
            cubes.references, cubes.nearest, used[0],
        )  # fmt: skip
        cubes.last[number] = used[0]
    return end


@inner
def is_seen(cubes, sphere, window, item, is_exact):
    """Say whether a cell of a sphere's cube sees an item."""
    one, other = cubes.balls[sphere], cubes.balls[item]
    x, y, z = other[0] - one[0], other[1] - one[1], other[2] - one[2]
    distance = (x * x + y * y + z * z) ** 0.5
    return sees(window, is_exact, x, y, z, distance, one[3] + other[3] + cubes.slack)


@kernel
def mark_cells(cubes, sphere, item, is_exact, found):
    """Mark the cells of a sphere's cube, (6 size^2,), that see an item."""
    for cell in range(len(found)):
        window = window_of(whole(cubes.size[sphere]), whole(cell))
        found[cell] = is_seen(cubes, sphere, window, item, is_exact)


@kernel
def mark_items(cubes, sphere, cell, is_exact, found):
    """Mark the items, (n,), that a cell of a sphere's cube sees."""
    window = window_of(whole(cubes.size[sphere]), whole(cell))
    for item in range(len(found)):
        found[item] = is_seen(cubes, sphere, window, item, is_exact)


@kernel
def count_exact(cubes, spheres, cells, begin, end):
    """Count the references of lists that the exact bound has as well.

    Parameters
    ----------
    spheres, cells : (n_lists,) int32
        Of every list.
    begin, end : int
        Which lists.
    """
    total = whole(0)
    for number in range(begin, end):
        sphere = whole(spheres[number])
        window = window_of(whole(cubes.size[sphere]), whole(cells[number]))
        for slot in range(cubes.first[number], cubes.last[number]):
            total += is_seen(cubes, sphere, window, whole(cubes.references[slot]), True)
    return total


def with_cubes(cubes: Cubes, spheres: np.ndarray) -> Cubes:
    """Return cubes of which some spheres, (n,), have one; arrays that others see are not changed.

    Raises
    ------
    InputError
        When they do not fit into memory.
    """
    new = spheres[cubes.cube[spheres] < 0]
    begin, n_cells = len(cubes.number), 6 * cubes.size[new].astype(np.int64) ** 2
    count = begin + int(n_cells.sum())
    refuse_if_too_large(8 * count, f"{count} cells of ray_coherence", "lower cells, or light_cells")
    cube, number = cubes.cube.copy(), longer(cubes.number, count)
    cube[new] = begin + np.cumsum(n_cells) - n_cells
    number[begin:] = NONE
    return cubes._replace(cube=cube, number=number)


def with_lists(
    cubes: Cubes, known: Known, tree: Tree, spheres: np.ndarray, cells: np.ndarray, is_exact: bool,
    most: int, progress: Progress,
) -> tuple[Cubes, Known, int]:  # fmt: skip
    """Make lists, as many of those asked for as may be kept.

    If more references are kept than may be, all lists are thrown away before.

    Parameters
    ----------
    spheres, cells : (n,) int
        Whose; each once.
    most : int
        References that may be kept.

    Returns
    -------
    cubes, known
        All there are then; arrays that others see are not changed.
    count : int
        Lists that were made.

    Raises
    ------
    InputError
        When they do not fit into memory.
    Cancelled
        From `progress`.
    """
    cubes = with_cubes(cubes, np.unique(spheres))
    places = cubes.cube[spheres] + cells
    numbers = cubes.number[places]
    is_new, before = numbers < 0, len(cubes.first)
    n_lists = before + int(is_new.sum())
    numbers[is_new] = np.arange(before, n_lists)
    cubes.number[places] = numbers
    first, last, used = longer(cubes.first, n_lists), longer(cubes.last, n_lists), known.used.copy()
    first[before:] = last[before:] = NO_LIST
    cubes = cubes._replace(first=first, last=last)
    if used[0] >= most:
        first[:], last[:], used[0] = NO_LIST, NO_LIST, 0
        cubes = cubes._replace(references=np.zeros(0, np.int32), nearest=np.zeros(0))
    known = Known(
        np.concatenate([known.sphere, spheres[is_new].astype(np.int32)]),
        np.concatenate([known.cell, cells[is_new].astype(np.int32)]), used,
    )  # fmt: skip
    wanted = np.stack([numbers, spheres, cells], axis=1)[first[numbers] < 0].astype(np.int64)
    heap, count = scratch_for(tree), 0
    while count < len(wanted):
        progress.report(count, len(wanted), "Making lists of ray_coherence")
        end = min(count + AT_ONCE, len(wanted))
        count = int(call(list_some, cubes, tree, is_exact, heap, wanted, count, end, most, used))
        if count == end:
            continue
        if used[0] >= most:
            break
        # Room for twice as much, but for no more than may be kept and one list.
        size = min(2 * int(used[0]), most) + len(tree.items)
        refuse_if_too_large(
            12 * size, f"{size} references of ray_coherence", "lower most_references"
        )
        cubes = cubes._replace(
            references=longer(cubes.references, size), nearest=longer(cubes.nearest, size)
        )
    return cubes, known, count
