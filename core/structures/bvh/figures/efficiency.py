"""Hierarchy efficiency: does a node pay? The lecture's inequality, node by node.

    K B + sum p_i I_i  <  sum I_i

On the left, the volumes of K children are tested and each child that is hit is gone through; on the
right, everything in all of them is gone through at once. p_i = SA_i / SA is the chance that a line
that hits the node hits child i. The gain of a node is the right side less the left; a node whose
gain is not positive does not pay: its children would better be merged into it.

B is the time of one volume test. C_trav is the time of one step at an inner node, in which all its
children are tested: K B = C_trav, whatever K is.

I_i, the time for what is inside of child i, is taken in two ways:

- as on the slide, the objects: C_isect times the triangles below. The inequality then says whether
  the children's volumes are better than one list of all triangles, just as the SAH of a split does.
- as expected in this tree, with everything below as it is: E(leaf) = C_isect N,
  E(node) = K B + sum p_i E(i). It then says whether this level of volumes is worth having.

E(root) is the SAH cost of the tree.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....kernels import call, kernel


class Efficiency(NamedTuple):
    """Figures of every node of a hierarchy, (n_nodes,) each, times in units of C_isect.

    Attributes
    ----------
    references : int64
        Triangles below, one that stands in several leaves as often.
    expected : float64
        E: the time for a line that hits the node.
    gain : float64
        With I_i of the triangles below; 0 for leaves.
    expected_gain : float64
        With I_i = E(i); 0 for leaves.
    """

    references: np.ndarray
    expected: np.ndarray
    gain: np.ndarray
    expected_gain: np.ndarray


def hierarchy_efficiency(
    areas: np.ndarray,
    first: np.ndarray,
    size: np.ndarray,
    width: np.ndarray,
    C_trav: float,
    C_isect: float,
) -> Efficiency:
    """Evaluate the inequality at every node.

    Parameters
    ----------
    areas : (n_nodes,) float64
        Surface areas of the volumes.
    first, size, width : (n_nodes,) int
        First child or first reference, references of a leaf or 0, number of children.
    """
    count = len(size)
    found = Efficiency(np.empty(count, np.int64), np.empty(count), np.empty(count), np.empty(count))
    call(evaluate_nodes, areas, first, size, width, C_trav, C_isect, found)
    return found


@kernel
def evaluate_nodes(areas, first, size, width, c_trav, c_isect, found):
    """Evaluate all nodes from the leaves up; children come behind their parents."""
    for node in range(len(size) - 1, -1, -1):
        if size[node] > 0:
            found.references[node] = size[node]
            found.expected[node] = c_isect * size[node]
            found.gain[node] = found.expected_gain[node] = 0.0
            continue
        references, objects, inside = 0, 0.0, 0.0
        objects_hit, inside_hit = 0.0, 0.0
        for child in range(first[node], first[node] + width[node]):
            # In a node without a surface volumes tell nothing apart.
            p = areas[child] / areas[node] if areas[node] > 0.0 else 1.0
            references += found.references[child]
            objects += c_isect * found.references[child]
            objects_hit += p * c_isect * found.references[child]
            inside += found.expected[child]
            inside_hit += p * found.expected[child]
        found.references[node] = references
        found.expected[node] = c_trav + inside_hit
        found.gain[node] = objects - (c_trav + objects_hit)
        found.expected_gain[node] = inside - (c_trav + inside_hit)
