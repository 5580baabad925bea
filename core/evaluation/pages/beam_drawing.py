"""What beams see as SVG: every piece a polygon, those of mirrored beams laid over their mirrors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...printing import in_html
from ...probes.beam_picture import colours_of, in_pixels
from ...probes.beam_tree import NOBODY, BeamNode
from ...probes.polygonal import Polygonal
from ...probes.visible import MISS
from ...scene import Light
from ...scene.camera_rays import Window

DOCUMENT = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" \
width="{width}" height="{height}">
<style>polygon {{ stroke-width: 0.2; stroke-linejoin: round; }}</style>
{parts}
</svg>
"""


def drawing_of(
    scene: Polygonal,
    nodes: Sequence[BeamNode],
    lights: Sequence[Light],
    window: Window,
    width: int,
    height: int,
) -> str:
    """Return the SVG document of a beam tree, a group for each beam, in units of pixels.

    The pieces of a beam are as opaque as much of what they show comes from there.
    """
    groups = []
    for number, node in enumerate(nodes):
        above = np.ones(3) if node.parent == NOBODY else nodes[node.parent].weight
        share = float(node.weight.max() / max(above.max(), 1e-12))
        colours = colours_of(scene, node, lights)
        points = in_pixels(node.pieces.points, window, width, height)
        lines = [f'<g id="beam-{number}" class="{node.kind}" opacity="{share:.3g}">']
        for piece, item in enumerate(node.pieces.items.tolist()):
            corners = points[node.pieces.offsets[piece] : node.pieces.offsets[piece + 1]]
            text = " ".join(f"{x:.6g},{y:.6g}" for x, y in corners.tolist())
            red, green, blue = (np.clip(colours[piece], 0.0, 1.0) * 255.0).round().astype(int)
            colour = f"#{red:02x}{green:02x}{blue:02x}"
            title = "nothing" if item == MISS else "{} {}".format(*scene.scene.object_of(item))
            lines.append(
                f'<polygon points="{text}" fill="{colour}" stroke="{colour}">'
                f"<title>{in_html(title)}</title></polygon>"
            )
        groups.append("\n".join([*lines, "</g>"]))
    return DOCUMENT.format(width=width, height=height, parts="\n".join(groups))
