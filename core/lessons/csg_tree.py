"""The tree of a CSG scene as it is drawn: set operations above, solids below, beside the model."""

from __future__ import annotations

import numpy as np

from ..colours import ramp
from ..errors import InputError
from ..geometry.csg.trees import (
    HALF_SPACE,
    MESH,
    OPERATION_NAMES,
    SOLID,
    UNION,
    Csg,
    nodes_below,
)
from ..geometry.instances import lines_of_items
from ..geometry.solids.mixed import BOX, CONE, SHAPE, SPHERE
from ..scene import Scene
from .drawing import GREY, Colour, Lines, coloured, faint, outlines
from .picture import Mark

MOST_NODES = 80
"""Nodes of a tree that are drawn; of more, those nearest to the root."""

SQUARE = np.array([[-1.0, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]])


def geometry_of(scene: Scene) -> Csg:
    """Return the trees of a scene.

    Raises
    ------
    InputError
        If there are none.
    """
    geometry = scene.geometry
    if not isinstance(geometry, Csg) or not geometry.is_tree.any():
        raise InputError(
            "the scene has no CSG trees; choose a sample such as csg_classic, or give an object a "
            "Boolean modifier",
            scene.name,
        )
    return geometry


class DrawnTree:
    """One tree of a scene, beside the model.

    Parameters
    ----------
    scene : Scene
    item : int, optional
        Which tree; the first by default.

    Attributes
    ----------
    nodes : (k,) int64
        Those drawn, each before those below it.
    places : (k, 3) float64
    colours : (k, 4) float64
        A colour for each; operations are grey.
    side : float
        Half the width of a node.
    frame : (4, 3) float64
        Corners of a rectangle around it.
    """

    def __init__(self, scene: Scene, item: int | None = None) -> None:
        self.geometry = geometry_of(scene)
        self.item = int(self.geometry.is_tree.argmax()) if item is None else item
        nodes = self.geometry.nodes
        every = nodes_below(nodes, int(self.geometry.roots[self.item]))
        depth = {int(every[0]): 0}
        for node in every.tolist():
            if nodes.kind[node] >= UNION:
                for child in (int(nodes.left[node]), int(nodes.right[node])):
                    depth[child] = depth[node] + 1
        depths = np.array([depth[node] for node in every.tolist()])
        deepest = int(depths.max())
        while deepest > 1 and (depths <= deepest).sum() > MOST_NODES:
            deepest -= 1
        self.n_left_out = int((depths > deepest).sum())
        self.nodes, self.depths = every[depths <= deepest], depths[depths <= deepest]
        self.is_leaf = nodes.kind[self.nodes] < UNION
        self._place(scene, deepest)
        self.colours = np.tile((*GREY[:3], 1.0), (len(self.nodes), 1))
        leaves = np.flatnonzero(self.is_leaf)
        self.colours[leaves, :3] = ramp(np.arange(len(leaves)) / max(len(leaves) - 1, 1))

    def _place(self, scene: Scene, deepest: int) -> None:
        """Put the ends of branches side by side, and what is above them over their middle."""
        nodes = self.geometry.nodes
        number = {node: place for place, node in enumerate(self.nodes.tolist())}
        self.number = number
        across = np.full(len(self.nodes), np.nan)
        ends = 0
        for place, node in enumerate(self.nodes.tolist()):
            if int(nodes.left[node]) not in number:
                across[place] = ends
                ends += 1
        for place in range(len(self.nodes) - 1, -1, -1):
            node = int(self.nodes[place])
            if np.isnan(across[place]):
                both = number[int(nodes.left[node])], number[int(nodes.right[node])]
                across[place] = across[list(both)].mean()
        # Beside all that is drawn of the solids, which may be much longer than what is left.
        drawn = lines_of_items(self.geometry, np.array([self.item])).reshape(-1, 3)
        low = np.minimum(drawn.min(axis=0), scene.lower)
        high = np.maximum(drawn.max(axis=0), scene.upper)
        size = float((high - low).max())
        width = size * min(max(0.22 * ends, 0.7), 1.6)
        step = width / max(ends - 1, 1)
        fall = min(0.2 * size, 0.9 * size / max(deepest, 1))
        self.side = min(0.03 * size, 0.3 * step, 0.3 * fall)
        corner = 0.5 * (low + high)
        corner[0] = high[0] + 0.25 * size
        self.origin = corner + np.array([0.1 * size, 0.0, 0.5 * deepest * fall])
        self.places = self.origin + np.column_stack(
            [across * step, np.zeros(len(across)), -self.depths * fall]
        )
        # Names stand to the right of nodes.
        tall, wide = 0.5 * deepest * fall + 0.1 * size, width + 0.4 * size
        self.frame = corner + frame_between(wide, -tall, tall)

    def names(self) -> list[str]:
        """Return what each node is called."""
        return [name_of(self.geometry, int(node)) for node in self.nodes]

    def border(self) -> Lines:
        """Return the frame around the tree and its names."""
        return coloured(outlines(self.frame[None]), faint(GREY, 0.25))

    def branches(self) -> np.ndarray:
        """Return the lines from nodes to those below, (k, 2, 3), and the lower node of each."""
        return self._ends()[0]

    def below_branches(self) -> np.ndarray:
        """Return the place of the node at the lower end of each branch, (k,)."""
        return self._ends()[1]

    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        nodes, segments, lower = self.geometry.nodes, [np.empty((0, 2, 3))], []
        for place, node in enumerate(self.nodes.tolist()):
            for child in (int(nodes.left[node]), int(nodes.right[node])):
                if child in self.number:
                    below = self.number[child]
                    segments.append(self.places[None, [place, below]])
                    lower.append(below)
        return np.concatenate(segments), np.array(lower, dtype=np.int64)

    def squares(self, which: np.ndarray, colours: np.ndarray, larger: float = 1.0) -> Lines:
        """Return the outlines of some nodes, each in a colour."""
        corners = self.places[which, None] + larger * self.side * SQUARE
        return Lines(outlines(corners), np.repeat(colours, 4, axis=0))

    def crosses(self, which: np.ndarray, colour: Colour) -> Lines:
        """Return crosses over some nodes."""
        ends = self.places[which, None, None] + 1.6 * self.side * SQUARE[[[0, 2], [1, 3]]]
        return coloured(ends.reshape(-1, 2, 3), colour)

    def marks(self, texts: dict[int, str] | None = None) -> list[Mark]:
        """Return the names of nodes beside them, or other texts, by their places."""
        names = self.names()
        chosen = texts if texts is not None else dict(enumerate(names))
        if texts is None and len(names) > 24:  # they would lie over each other
            chosen = {0: names[0]}
        shift = np.array([1.5 * self.side, 0.0, 0.0])
        return [
            Mark(self.places[place] + shift, text, tuple(self.colours[place, :3]))
            for place, text in chosen.items()
        ]


def frame_between(wide: float, low: float, high: float) -> np.ndarray:
    """Return the corners of an upright rectangle that begins at x = 0, (4, 3)."""
    return np.array([[0.0, 0.0, low], [wide, 0.0, low], [wide, 0.0, high], [0.0, 0.0, high]])


def name_of(geometry: Csg, node: int) -> str:
    """Return what a node is called."""
    kind, leaf = int(geometry.nodes.kind[node]), int(geometry.nodes.leaf[node])
    if kind in OPERATION_NAMES:
        return OPERATION_NAMES[kind]
    if kind == HALF_SPACE:
        return "half-space"
    if kind == MESH:
        return "mesh"
    assert kind == SOLID
    of_solid = int(geometry.solids.kinds[leaf])
    if of_solid == CONE:
        base, apex = geometry.solids.rows[leaf, SHAPE, :2]
        return "cylinder" if base == apex else "cone"
    return {SPHERE: "sphere", BOX: "box"}.get(of_solid, "surface")
