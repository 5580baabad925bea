"""The beam tree: the beam of a picture, and the beams that go on from what it sees.

As a ray that hits a mirror is followed by a reflected one, a beam is followed by one for each
mirror that it sees, whose cross section is the pieces in which it sees that; and where a polygon
lets light through, by a refracted one (:mod:`.beam`). All beams of a tree have the cross section
of the first one as their picture: the pieces of a mirrored beam lie where its mirror is seen.

What each adds to the picture is Whitted's: the colour of what it sees, times all shares of mirrors
and glass on its way.

P. Heckbert, P. Hanrahan: Beam Tracing Polygonal Objects, SIGGRAPH 1984.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..progress import SILENT, Progress
from ..scene.whitted.shading import Surfacing
from ..settings import setting
from .beam import EYE, MIRRORED, REFRACTED, Beam, mirrored_beam, refracted_beam
from .polygonal import Polygonal
from .visible import MISS, Pieces, visible

NOBODY = -1
"""Parent of the first beam."""

SMALLEST = 1e-12
"""Share of the first cross section below which a beam is not followed: it is a sliver."""


def depth_setting() -> int:
    """Declare how deep a beam tree may be."""
    depth: int = setting(
        3, "Depth", "Beams one after the other at most: 1 follows no mirror", unit="beams",
        minimum=1, maximum=12,
    )  # fmt: skip
    return depth


@dataclass(frozen=True)
class BeamNode:
    """One beam of a tree.

    Attributes
    ----------
    beam : Beam
    pieces : Pieces
        What it sees.
    kind : {"eye", "mirrored", "refracted"}
    parent : int
        Number of the beam it goes on from, NOBODY for the first.
    item : int
        The mirror, as the scene numbers it, MISS for the first.
    depth : int
        1 for the first.
    weight : (3,) float64
        Share of red, green and blue that comes to the eye from what it sees.
    """

    beam: Beam
    pieces: Pieces
    kind: str
    parent: int
    item: int
    depth: int
    weight: np.ndarray


class Onward(NamedTuple):
    """A beam that is to be followed."""

    beam: Beam
    kind: str
    weight: np.ndarray


def beam_tree(
    scene: Polygonal, beam: Beam, depth: int = 3, progress: Progress = SILENT
) -> list[BeamNode]:
    """Return a beam and all that go on from it, parents before children, level after level.

    Parameters
    ----------
    depth : int
        Beams one after the other at most.

    Raises
    ------
    InputError
        If there are more pieces than fit into memory.
    Cancelled
        From `progress`.
    """
    surfacing = Surfacing.of(scene.scene)
    nodes = [BeamNode(beam, visible(scene, beam), EYE, NOBODY, MISS, 1, np.ones(3))]
    least, done = SMALLEST * beam.area, 0
    while done < len(nodes):
        progress.report(done, len(nodes), "Following beams")
        node = nodes[done]
        if node.depth < depth:
            for item in np.unique(node.pieces.items[node.pieces.items != MISS]).tolist():
                for each in onward(scene, surfacing, node, item):
                    if each.beam.area > least:
                        nodes.append(
                            BeamNode(
                                each.beam, visible(scene, each.beam), each.kind, done, item,
                                node.depth + 1, each.weight,
                            )
                        )  # fmt: skip
        done += 1
    return nodes


def onward(scene: Polygonal, surfacing: Surfacing, node: BeamNode, item: int) -> list[Onward]:
    """Return the beams that go on from one of the polygons that a beam sees."""
    made_of = surfacing.at(scene.scene.materials_of(np.array([item])))
    specular, transmission = made_of.specular[0], made_of.transmission[0]
    if not (specular.any() or transmission.any()):
        return []
    beam, those = node.beam, node.pieces.of(item)
    windows = tuple(node.pieces.corners(piece) for piece in those.tolist())
    plane = scene.convex.planes[node.pieces.polygons[those[0]]]
    found = []
    if transmission.any():
        is_before = plane[:3] @ beam.apex > plane[3]
        is_outside = is_before != bool(scene.scene.is_turned(np.array([item]))[0])
        index = float(made_of.index_of_refraction[0])
        through = refracted_beam(beam, plane, windows, 1.0 / index if is_outside else index)
        if through is None:  # what cannot get out is reflected as well
            specular = np.minimum(specular + transmission, 1.0)
        else:
            found.append(Onward(through, REFRACTED, node.weight * transmission))
    if specular.any():
        again = mirrored_beam(beam, plane, windows)
        found.insert(0, Onward(again, MIRRORED, node.weight * specular))
    return found
