"""Nodes and cells have numbers of 32 bits: more of them are refused before anything is built."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.structures import structures
from accelscope.core.structures.kdtree.builder import MOST_LINKS, meter_of


class Vast:
    """A scene that says it has very many triangles."""

    lower, upper = np.zeros(3), np.ones(3)

    def __len__(self):
        return 2**30 + 1


def test_a_tree_of_over_two_billion_nodes():
    bvh = structures()["bvh"]
    with pytest.raises(InputError, match="nodes of the bvh"):
        bvh.refuse_too_large(Vast(), bvh.Settings())


def test_a_grid_of_over_two_billion_cells(lab):
    grid = structures()["grid"]
    settings = lab.settings_of(grid, "resolution=1300x1300x1300")
    with pytest.raises(InputError) as refused:
        grid.refuse_too_large(lab.small_scene("one"), settings)
    assert str(refused.value) == (
        "2 197 000 000 cells of the grid are more than the 2 147 483 647 that can be numbered; "
        "lower the resolution"
    )


def test_a_kd_tree_has_no_more_nodes_than_its_links_can_name():
    from accelscope.core.progress import SILENT

    assert np.iinfo(np.int32).max >= 4 * MOST_LINKS + 3
    meter = meter_of(2**29, SILENT)
    meter.check(0, 1, MOST_LINKS, 1)
    with pytest.raises(InputError, match="nodes"):
        meter.check(0, 1, MOST_LINKS + 1, 1)
