"""How many cells and references structures over the Standard Procedural Databases have.

Published: V. Havran, F. Sixta: Comparison of hierarchical grids, and V. Havran: Comparison of
octree traversal algorithms, 1999; the statistics that go with their articles in Ray Tracing News
12(1) and 12(2), in resources/SPD of the repository erich666/RealTimeRendering. Cells hold whose box
touches them; an octree's leaves have one item or the greatest depth; every sphere, cone and polygon
is one item.

The text does not say by how much the scene's box is enlarged, nor how the box of a slanting cone is
found. With 0.1% on each side, and boxes that just hold their cones, so many counts agree to the
last cell that no other padding comes near. Of gears and teapot, boxes and counts of the text are
not those of the databases' programs; they are left out.
"""

import functools

import pytest
from accelscope.sample_scenes import make_sample

RULES = "padding=0.001,assignment=box,overlap=closed"

GRIDS = {
    ("balls", "46x46x3"): (2, (6348, 4208, 10240)),
    ("balls", "103x103x7"): (1, (74263, 63393, 19966)),
    ("balls", "152x152x9"): (1, (207936, 184204, 33909)),
    ("lattice", "20x20x20"): (2, (8000, 0, 32152)),
    ("lattice", "44x44x44"): (3, (85184, 38016, 90368)),
    ("lattice", "59x59x59"): (1, (205379, 102640, 160819)),
    ("mount", "20x20x20"): (1, (8000, 6502, 21746)),
    ("mount", "44x44x42"): (1, (81312, 71924, 51144)),
    ("mount", "35x35x35"): (1, (42875, 37246, 38922)),
    ("rings", "21x20x21"): (1, (8820, 6264, 27666)),
    ("rings", "44x43x44"): (1, (83248, 66753, 71303)),
    ("rings", "60x60x60"): (1, (216000, 178930, 127217)),
    ("tetra", "40x40x40"): (3, (64000, 56696, 44696)),
    ("tree", "52x52x3"): (2, (8112, 5400, 11102)),
    ("tree", "117x118x5"): (2, (69030, 55191, 22407)),
    ("tree", "60x60x60"): (2, (216000, 212179, 14322)),
}
"""By scene and resolution: how many of N_V, N_EV and N_OIV are reached exactly, and all three."""

OCTREES = {
    ("balls", 4): (3, (57, 400, 300, 9171)),
    ("balls", 5): (2, (117, 820, 570, 10946)),
    ("balls", 6): (0, (304, 2129, 1038, 15611)),
    ("balls", 7): (0, (1108, 7757, 2905, 27288)),
    ("lattice", 4): (4, (585, 4096, 0, 22112)),
    ("lattice", 5): (4, (4681, 32768, 7744, 49600)),
    ("mount", 4): (2, (232, 1625, 777, 18107)),
    ("mount", 5): (0, (1019, 7134, 3060, 34351)),
    ("mount", 6): (0, (4716, 33013, 11720, 90456)),
    ("mount", 7): (0, (22630, 158411, 45049, 324918)),
    ("rings", 4): (3, (231, 1618, 416, 22505)),
    ("rings", 5): (2, (1216, 8513, 2127, 44555)),
    ("rings", 6): (0, (6925, 48476, 10281, 133929)),
    ("rings", 7): (0, (38648, 270537, 49888, 565631)),
    ("tetra", 6): (4, (6189, 43324, 21100, 110592)),
    ("tetra", 7): (4, (28413, 198892, 80444, 512000)),
    ("tree", 4): (3, (53, 372, 278, 9029)),
    ("tree", 5): (3, (101, 708, 556, 9670)),
    ("tree", 6): (3, (186, 1303, 1054, 10915)),
    ("tree", 7): (0, (352, 2465, 1801, 13725)),
}
"""By scene and depth: how many of N_IN, N_V, N_EV and N_OIV are reached exactly, and all four.

Those of lattice at depths 6 and 7 are left out: of the first, N_V is reached exactly but N_EV is
13% less there; of the second, N_V is 19% more. Why is not known.
"""

CELLS_WITHIN = {"balls": 0.034, "lattice": 0.021, "mount": 0.018, "rings": 0.038, "tree": 0.003}
REFERENCES_WITHIN = {
    "balls": 0.021, "lattice": 0.048, "mount": 0.041, "rings": 0.048, "tree": 0.067, "tetra": 0.0,
}  # fmt: skip
"""How near what is not reached exactly comes; most of it has a little more there.

Boxes of cones seem to be larger there at their ends, or less exact: grids over lattice and tree
come nearer with such ones, octrees less near. The mountain's heights come of random numbers.
"""

scene_of = functools.cache(make_sample)


def compare(figures, row, scene, cells):
    """Compare figures with published ones, of which the first `cells` count cells."""
    exact, published = row
    assert figures[:exact] == published[:exact]
    for figure, other in zip(figures[exact:cells], published[exact:cells], strict=True):
        assert figure == pytest.approx(other, rel=CELLS_WITHIN[scene])
    assert figures[-1] == pytest.approx(published[-1], rel=REFERENCES_WITHIN[scene])


@pytest.mark.parametrize(("scene", "resolution"), GRIDS)
def test_grids(build, scene, resolution):
    found = build("grid", scene_of(scene), f"resolution={resolution},{RULES}").statistics()
    compare((found.N_V, found.N_EV, found.N_OIV), GRIDS[scene, resolution], scene, 2)


@pytest.mark.parametrize(("scene", "depth"), OCTREES)
def test_octrees(build, scene, depth):
    text = f"max_depth={depth},max_leaf_size=1,duplication=0,{RULES}"
    found = build("octree", scene_of(scene), text).statistics()
    figures = found.N_IN, found.N_V, found.N_EV, found.N_OIV
    compare(figures, OCTREES[scene, depth], scene, 3)
    assert found.N_V == 7 * found.N_IN + 1
