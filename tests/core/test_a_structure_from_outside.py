"""The README's "To add a structure", followed to the letter with a file in a folder of its own.

Its counter and its figure are found in the table, in JSON and CSV, on the page and in the panel.
"""

import json
import os
import subprocess
import sys
import textwrap

import pytest

HALVES = '''
"""Halves: two lists of triangles, the near one first.

The smallest hierarchy there is: the triangles are cut at the median of x, each half has a box.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..contract.cells import Cells
from ..contract.costs import intersection_cost, traversal_cost
from ..contract.counters import N_ETS, N_IT, N_TS, Counter
from ..contract.events import NONE, VISIT_LEAF, VOLUME_TEST, note
from ..contract.figures import COST_OF_CELLS, OF_CELLS, Figure
from ..contract.leaf import EVERYWHERE, NOTHING, test_leaf
from ..contract.statistics import Statistics
from ..contract.structure import Structure
from ..contract.walk import Found, walk
from ..geometry.box import Boxes, boxes_of
from ..geometry.box_shape import surface_area
from ..geometry.rays import ANY
from ..geometry.volume import MISS, enter, prepare
from ..kernels import implements
from ..settings import setting


@dataclass(frozen=True)
class HalvesSettings:
    """Where the cut is."""

    share: float = setting(0.5, "Share", "Share of the triangles in the first half", minimum=0.1)
    C_trav: float = traversal_cost(is_flat=True)
    C_isect: float = intersection_cost()


class HalvesArrays(NamedTuple):
    """Both boxes, and where the second half begins."""

    volumes: Boxes
    offsets: np.ndarray


@implements(walk, HalvesArrays)
def walk_halves(structure, geometry, ray, number, workspace, log):
    """Test both boxes, then the halves that are hit."""
    best, entered = NOTHING, 0
    prepare(structure.volumes, ray, workspace.frame)
    for half in range(2):
        t = enter(structure.volumes, half, ray, workspace.frame, ray.t_max)
        note(log, VOLUME_TEST, half, NONE, t, t)
        if t != MISS and not (ray.query == ANY and best.primitive >= 0):
            entered += 1
            note(log, VISIT_LEAF, half, NONE, t, t)
            first, last = structure.offsets[half], structure.offsets[half + 1]
            best = test_leaf(
                geometry, None, False, first, last, ray, number, workspace, log, half, t,
                EVERYWHERE, False, best,
            )
    return Found(best.t, best.primitive, (entered, entered, best.tests, 2))


BOXES_ASKED = Counter("boxes_asked", "Boxes asked", "both boxes", (VOLUME_TEST,), column="asked")


class Halves(Structure):
    """Two lists."""

    name = "halves"
    label = "Halves"
    summary = "Two lists of triangles with a box each"
    Settings = HalvesSettings
    COUNTERS = N_TS, N_ETS, N_IT, BOXES_ASKED
    FIGURES = *OF_CELLS, Figure("gap", "distance of the boxes", "Gap", column="gap"), *COST_OF_CELLS

    @classmethod
    def build(cls, scene, settings, progress=None, *, log=False):
        """Sort by x and cut."""
        order = np.argsort(scene.triangles[:, :, 0].mean(axis=1), kind="stable")
        cut = min(max(int(settings.share * len(order)), 1), len(order) - 1)
        boxes = boxes_of(scene.triangles)[order]
        rows = [
            np.concatenate([part[:, :3].min(axis=0), part[:, 3:].max(axis=0)])
            for part in (boxes[:cut], boxes[cut:])
        ]
        arrays = HalvesArrays(Boxes(np.array(rows)), np.array([0, cut, len(order)]))
        return cls(scene, settings, arrays, scene.items(order))

    def cells(self, progress=None):
        """Return both boxes."""
        zero = np.zeros(2, dtype=np.int32)
        count = np.diff(self.arrays.offsets).astype(np.int32)
        return Cells(
            self.arrays.volumes.rows, np.arange(2, dtype=np.int32), zero, np.ones(2, bool), count
        )

    def statistics(self, progress=None):
        """Return the figures of two leaves."""
        cells = self.cells()
        rows = self.arrays.volumes.rows
        whole = np.concatenate([self.scene.lower, self.scene.upper])
        return Statistics.of_cells(
            surface_area(rows), cells.is_leaf, cells.count, cells.depth, surface_area(whole),
            self.settings.C_trav, self.settings.C_isect, {"gap": float(rows[1, 0] - rows[0, 3])},
        )

    def validate(self):
        """Check that the halves are all."""
        return [] if self.arrays.offsets[-1] == len(self.scene) else ["a triangle is lost"]


STRUCTURE = Halves
'''

START = """
import sys
import accelscope.core.structures as there
there.__path__.append(sys.argv[1])
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("outside")
    (path / "halves.py").write_text(HALVES.lstrip(), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def start(folder):
    """Run Python in a process that knows the structure; return what it prints."""
    # A cache of its own: other processes could not load kernels that name this structure.
    environment = os.environ | {"XDG_CACHE_HOME": str(folder / "cache")}

    def run(code, *arguments):
        program = START + textwrap.dedent(code)
        done = subprocess.run(
            [sys.executable, "-c", program, folder, *map(str, arguments)],
            capture_output=True, text=True, check=False, env=environment,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="module")
def results(start, folder):
    """What the command line makes of it: the table, and the files in the folder."""
    code = """
        from accelscope.addon.command.main import main
        out = sys.argv[2]
        sys.exit(main(["evaluate", "sample:soup:count=200", "--structure", "naive", "bvh", "halves",
                       "--rays", "random_lines:count=500", "--json", out + "/a.json",
                       "--csv", out + "/a.csv", "--pictures", out + "/page"]))
    """
    return start(code, folder), folder


def test_it_finds_the_same_hits_and_is_recorded(start):
    code = """
        import numpy as np
        from accelscope.core.evaluation.rays.workloads import random_lines
        from accelscope.core.geometry.rays import ALL, ANY, CLOSEST, Rays
        from accelscope.core.structures import structures
        from accelscope.sample_scenes import make_sample
        scene = make_sample("soup:count=200")
        origins, directions = random_lines(scene.lower, scene.upper, 500, 1)
        rays = Rays.from_arrays(origins, directions)
        built = {n: structures()[n].build(scene, structures()[n].Settings())
                 for n in ("naive", "halves")}
        for query in (CLOSEST, ALL):
            want, _ = built["naive"].trace(rays, query)
            hits, counters = built["halves"].trace(rays, query)
            assert hits.t.tobytes() == want.t.tobytes()
            assert hits.primitive.tobytes() == want.primitive.tobytes()
            for i in range(50):
                tally = built["halves"].record(rays, i, query).tally()
                assert tally == {name: int(counters[name][i]) for name in tally}, tally
        print(sorted(tally), (want.primitive >= 0).sum())
    """
    names, hits = start(code).rsplit(" ", 1)
    assert names == str(sorted(["N_TS", "N_ETS", "N_IT", "boxes_asked"]))
    assert int(hits) > 0


def test_the_table_has_a_column_for_both(results):
    table, _ = results
    titles, _, *rows = (line.split() for line in table.splitlines())
    assert titles[-2] == "asked"
    assert "gap" in titles
    asked = {row[1]: row[-2] for row in rows}
    assert asked == {"naive": "-", "bvh": "-", "halves": "2.00"}
    # Neither has a gap or was asked for boxes.
    assert [row.count("-") for row in rows] == [2, 2, 0]


def test_records_have_both(results):
    _, folder = results
    records = json.loads((folder / "a.json").read_text())["records"]
    naive, bvh, halves = records
    assert halves["trace"]["boxes_asked"] == 2.0
    assert halves["statistics"]["gap"] < 0.0
    assert halves["trace"]["hits"] == naive["trace"]["hits"] == bvh["trace"]["hits"]
    assert "boxes_asked" not in bvh["trace"]
    assert "volume_tests" not in halves["trace"]
    header = (folder / "a.csv").read_text().splitlines()[0].split(",")
    assert {"trace.boxes_asked", "statistics.gap"} <= set(header)


def test_the_page_has_both(results):
    _, folder = results
    page = (folder / "page" / "index.html").read_text()
    assert page.count("Boxes asked") == page.count(">Gap<") == 1


def test_it_is_listed_with_them(start):
    code = """
        from accelscope.addon.command.main import main
        sys.exit(main(["list", "--json"]))
    """
    (halves,) = (s for s in json.loads(start(code))["structures"] if s["name"] == "halves")
    assert halves["counters"][-1] == {
        "name": "boxes_asked", "label": "Boxes asked", "meaning": "both boxes"
    }  # fmt: skip
    assert "gap" in {figure["key"] for figure in halves["figures"]}
    assert [row["key"] for row in halves["settings"]] == ["share", "C_trav", "C_isect"]


def test_the_panel_has_both(start):
    pytest.importorskip("bpy")
    code = """
        import bpy
        import accelscope
        from accelscope.addon.settings import properties
        from accelscope.addon.results import session
        from accelscope.core.evaluation.records.report import figures
        accelscope.register()
        properties.load()
        root = bpy.context.scene.accelscope
        root.structure, root.workload = "halves", "random_lines"
        root.structures.halves.share = 0.25
        root.workloads.random_lines.count = 100
        bpy.ops.mesh.primitive_ico_sphere_add()
        assert bpy.ops.accelscope.build() == {"FINISHED"}
        assert bpy.ops.accelscope.trace() == {"FINISHED"}
        print(figures(session.current.record))
    """
    rows = start(code)
    assert "('Per ray', 'Boxes asked', '2.00')" in rows
    assert "('Structure', 'Gap', " in rows
