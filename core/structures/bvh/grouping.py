"""How the triangles of a hierarchy are grouped: by a builder, by an optimiser, and into leaves."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ...contract.build_log import BuildLog
from ...geometry.geometry import boxes_around
from ...progress import Progress
from ...settings import part_of
from .builders import BUILDERS
from .optimisers import OPTIMISERS
from .optimisers.rearranging import Rearrangement
from .topology.build_log import LogSoFar
from .topology.collapse import LeafRule, collapse, total_cost
from .topology.tree import Grouping, Primitives, Tree, linked


class Collapsed(NamedTuple):
    """A tree whose leaves are chosen, the references in its order, and what makes its log."""

    tree: Tree
    order: np.ndarray
    log: Callable[[], BuildLog] | None = None


def group(
    geometry: Any, settings: Any, progress: Progress, log: bool
) -> tuple[Grouping, Rearrangement | None]:
    """Group the items of a geometry as the settings say.

    An optimiser works on single triangles, and leaves are chosen by cost afterwards. Where these
    leaves make the tree dearer than the one that was rearranged, that one stays.

    Returns
    -------
    grouping : Grouping
    rearrangement : Rearrangement or None
        What the optimiser did.
    """
    builder, optimiser = BUILDERS[settings.builder], OPTIMISERS[settings.optimise]
    primitives = Primitives(geometry, boxes_around(geometry))
    own: Any = part_of(settings, builder.Settings)
    if optimiser.optimise is None:
        return builder.build(primitives, own, progress, log), None
    grouping = builder.build(primitives, dataclasses.replace(own, max_leaf_size=1), progress, log)
    progress.report(0, 2, "Choosing leaves")
    tree = linked(grouping.tree)
    progress.report(1, 2, "Choosing leaves")
    rule = LeafRule.of(settings)
    so_far = LogSoFar(grouping, tree) if log else None
    as_built = Collapsed(*collapse(tree, rule))
    if so_far:
        as_built = as_built._replace(log=so_far.until(tree, *as_built[:2]))
    progress.report(2, 2, "Choosing leaves")
    rearrangement = optimiser.optimise(tree, part_of(settings, optimiser.Settings), progress, log)
    if so_far:
        so_far.go_on(tree, rearrangement.log)
        rearrangement = dataclasses.replace(rearrangement, log=None)  # the log of the tree has it
    rearranged = Collapsed(*collapse(tree, rule))
    if so_far:
        rearranged = rearranged._replace(log=so_far.until(tree, *rearranged[:2]))
    pays = total_cost(rearranged.tree, rule) <= total_cost(as_built.tree, rule)
    best = rearranged if pays else as_built
    figures = grouping.figures | rearrangement.figures() | {"optimise_pays": pays}
    # A reference that a leaf holds now was number order[i] for the builder.
    parts = None if grouping.parts is None else grouping.parts[best.order]
    return Grouping(best.tree, grouping.order[best.order], parts, figures, best.log), rearrangement
