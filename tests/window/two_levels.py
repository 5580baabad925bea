# SPDX-License-Identifier: GPL-3.0-or-later
"""Two levels and the structures that rays make, built in a real Blender window.

    .venv/bin/python .ci/build_extension.py --platform linux-x64 --output build/window/extension
    .ci/blender_window.sh tests/window/two_levels.py build/window/two-levels [-- ZIP]

The crowd: top level, boxes of one mesh in all its places, figures of both levels in the panel. A
mask at an object takes it out of the rays' way, and the panel says that what was built is out of
date. Then cells of ray space, and the starts of shafts, after rays have made some.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from guide import (
    build,
    install,
    open_wide_tab,
    over_viewport,
    results,
    sample,
    session,
    settings,
    station,
    status,
    trace,
)
from session import Steps


@session.step
def the_crowd() -> Steps:
    """The top level over the boxes of instances."""
    install()
    yield from open_wide_tab()
    sample("crowd")
    settings().structure = "two_level"
    settings().display.depth_min, settings().display.depth_max = 0, 4
    yield from build()
    over_viewport()
    yield 1.0
    station("top_level")
    settings().display.depth_max = 100
    yield 2.0
    station("both_levels")
    figures = results().record["statistics"]
    assert figures["bottom_levels"] >= 2


@session.step
def rays_through_both() -> Steps:
    """Figures of both levels stand in the panel."""
    settings().workload = "random_lines"
    yield from trace()
    traced = results().record["trace"]
    assert traced["instances_entered"] > 0.0
    yield 1.0
    station("traced")


@session.step
def a_mask_takes_an_instance_out_of_the_way() -> Steps:
    """The mask is a property of the object; what was built is out of date, and anew it is not."""
    before = results().record["trace"]["hits"]
    figures = [obj for obj in bpy.context.scene.objects if obj.type == "MESH"]
    for obj in figures[: len(figures) // 2]:
        obj.accelscope_instance.mask = 0
    yield 1.0
    assert status().startswith("Out of date"), status()
    station("out_of_date")
    yield from build()
    yield from trace()
    assert results().record["trace"]["hits"] < before
    station("masked")


@session.step
def re_braided() -> Steps:
    """Instances that overlap: nodes of bottom levels are opened before the top level is built."""
    sample("overlapping")
    settings().structures.two_level.rebraid = "partial"
    settings().display.depth_max = 6
    yield from build()
    yield 1.0
    station("re_braided")


@session.step
def cells_of_ray_space() -> Steps:
    """Cells that rays have come to, where their rays begin."""
    sample("suzanne")
    settings().structure = "ray_classification"
    settings().display.depth_max = 100
    yield from build()
    station("ray_classification_built")
    yield from trace()
    yield 1.0
    station("ray_classification_traced")


@session.step
def starts_of_shafts() -> Steps:
    """The hierarchy whose nodes shafts start at."""
    settings().structure = "shafts"
    settings().display.depth_max = 5
    yield from build()
    yield from trace()
    yield 1.0
    station("shafts")


session.run()
