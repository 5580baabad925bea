"""The codes that the radix-2 split shows are the builder's: of a grid around all triangles.

They were once those of a grid around the triangles that are drawn.
"""

import numpy as np
from accelscope.core.geometry.box import boxes_of
from accelscope.core.lessons.radix_sort import BitSettings, RadixSplit
from accelscope.core.parallel import Team
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVH
from accelscope.core.structures.bvh.builders.morton.codes import codes_of


def test_bits_are_those_of_the_codes_that_were_sorted():
    # The last one, which is not drawn, is far away from all others.
    corners = np.random.default_rng(3).random((98, 3, 3))
    corners[-1] += 1000.0
    scene = Scene.from_triangles(corners, "one far away")
    bvh = BVH.build(scene, BVH.Settings(builder="lbvh", morton_bits="30"), log=True)
    with Team(SILENT, "testing") as team:
        codes = codes_of(boxes_of(scene.triangles), bvh.settings, team)
    play = RadixSplit(bvh, SILENT)
    assert len(play.orders[0]) == 14
    for bit in range(30):
        ones = int((codes[::7] >> bit & 1).sum())
        assert f" {ones} one" in play.picture(BitSettings(bit)).caption
