"""How a walk sees a re-braided top level: references into instances, and boxes around them.

Hits are to be the same as without, bit for bit. What is hit within an instance is found with the
numbers of its mesh's space, and its t is moved into the interval of the instance's own box at most.
Boxes of references are enlarged by more than moving a ray rounds, so what is hit lies in its box,
and in that of the instance, and is not moved at all. Only of rays that begin so far away that
rounding may be more (:attr:`BraidedBoxes.room`) that is not certain. Their slack is larger, and for
them a box begins where the ray does: then nothing is left out for what was found nearer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...contract.instances import Instances, enter_instance
from ...contract.leaf import test_items, test_leaf
from ...geometry.box import span_box
from ...geometry.geometry import intersect
from ...geometry.volume import prepare, slack_of, span
from ...kernels import implements, inner, whole


class Braided(NamedTuple):
    """References to instances or to nodes within them, in the order of the leaves.

    Attributes
    ----------
    ids : (n_references,) int32
        The instance of each.
    reach : (3,) float64
    nodes : (n_references,) int32
        Where in the forest a walk begins.
    instances : Instances
        In their own order.
    """

    ids: np.ndarray
    reach: np.ndarray
    nodes: np.ndarray
    instances: Instances


@implements(intersect, Braided)
def intersect_reference(geometry, index, ray, limit, number, workspace, log):
    """Enter the instance at a node."""
    instance, node = whole(geometry.ids[index]), whole(geometry.nodes[index])
    return enter_instance(geometry.instances, instance, node, ray, limit, workspace, log)


implements(test_leaf, Braided)(test_items)


class BraidedBoxes(NamedTuple):
    """Boxes around references, for walks; pictures take them as :class:`Boxes`.

    Attributes
    ----------
    rows : (n, 6) float32 or float64
    slack : float
        By what the slack of volumes is multiplied.
    room : float
        How far at least the boxes of references reach beyond what is in them. A ray of more slack
        than that comes from far away.
    """

    rows: np.ndarray
    slack: float
    room: float


@implements(prepare, BraidedBoxes)
def prepare_braided(volumes, ray, strips):
    """Note whether the ray comes from far away, and its slack then, which is 0 otherwise."""
    slack = volumes.slack * slack_of(ray)
    strips[0, 0] = slack if slack > volumes.room else 0.0


@implements(span, BraidedBoxes, inline=True)
def span_braided(volumes, index, ray, strips, limit):
    """Test the three slabs."""
    if strips[0, 0] > 0.0:
        return span_from_afar(volumes.rows, index, ray, strips[0, 0], limit)
    return span_box(volumes.rows, index, ray, limit)


@inner
def span_from_afar(rows, index, ray, slack, limit):
    """Return where a ray is in a box that is wider by a slack: from its very beginning, if it is.

    What is found in there may be moved to another t, that of the border of an instance's box.
    """
    enter, leave = ray.t_min, limit
    for axis in range(3):
        o = ray.ox if axis == 0 else (ray.oy if axis == 1 else ray.oz)
        inverse = ray.ix if axis == 0 else (ray.iy if axis == 1 else ray.iz)
        low = (rows[index, axis] - (o + slack)) * inverse
        high = (rows[index, 3 + axis] - (o - slack)) * inverse
        near = high if high < low else low
        far = low if high < low else high
        enter = near if near > enter else enter
        leave = far if far < leave else leave
    return (ray.t_min if enter <= leave else enter), leave
