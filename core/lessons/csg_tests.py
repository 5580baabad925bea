"""Lesson "csg_tests": how often each solid of a CSG tree is tested, with bounds and without.

The same random lines go through the trees three times: without bounds, with bounds from below only,
and with bounds that were cut. Every line is recorded with the kernel that traces it, and the events
of each node are counted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..colours import ramp
from ..contract.csg import OF_TREE
from ..contract.events import VISIT_LEAF, VOLUME_TEST
from ..contract.structure import Structure
from ..geometry.csg.settings import CUT, NONE, UPWARD, VOLUMES, CuttingSettings
from ..geometry.csg.trees import UNION, nodes_below
from ..geometry.geometry import lines_of
from ..geometry.rays import Rays
from ..progress import Progress
from ..sah.line_sample import random_lines
from ..sah.timing import affordable
from ..settings import setting
from .csg_tree import geometry_of, name_of
from .drawing import BLUE, GREEN, ORANGE, Chart, Faces, Lines, extent_of, opaque, picture_of
from .lesson import Lesson, Play, Subject, only_its_own
from .picture import Picture, Row

LINES = 400, 40
"""Random lines that are recorded, and where kernels run as plain Python."""

MOST_BARS = 150
"""Solids that have bars: the first."""

COLOURS = {NONE: ORANGE, UPWARD: BLUE, CUT: GREEN}

WORDS = {NONE: "without bounds", UPWARD: "bounds from below only", CUT: "bounds that were cut"}


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    bounds: str = setting(
        CUT, "Bounds", "Which of the three is shown over the model",
        choices={NONE: "No bounds", UPWARD: "From the leaves up only", CUT: "Cut"},
    )  # fmt: skip
    volume: str = setting("aabb", "Volume", "What is put around nodes", choices=VOLUMES)


class CsgTests(Play):
    """What lines ask of every solid, three times."""

    def __init__(self, subject: Subject, volume: str, progress: Progress) -> None:
        self.scene = subject.scene
        geometry = geometry_of(self.scene)
        self.geometry = geometry
        kind = type(subject.structures[0])
        count = affordable(*LINES)
        rays = Rays.from_arrays(*random_lines(self.scene.lower, self.scene.upper, count, 1))
        self.count = count
        self.tests: dict[str, np.ndarray] = {}
        self.n_volume_tests: dict[str, int] = {}
        for number, bounds in enumerate(COLOURS):
            scene = self.scene.with_cutting(CuttingSettings(bounds, volume))
            structure = kind.build(scene, kind.Settings(), progress)
            self._count_tests(bounds, structure, rays, number, progress)
        trees = geometry.roots[geometry.is_tree].tolist()
        nodes = np.concatenate([nodes_below(geometry.nodes, root) for root in trees])
        self.leaves = nodes[geometry.nodes.kind[nodes] < UNION]
        segments, owners = lines_of(geometry, np.arange(geometry.n_primitives))
        leaf = np.searchsorted(geometry.nodes.first[self.leaves], owners, side="right") - 1
        self.segments, self.owners = segments, leaf

    def _count_tests(
        self, bounds: str, structure: Structure, rays: Rays, number: int, progress: Progress
    ) -> None:
        """Record all lines, and count what each leaf was asked."""
        tests, n_volume_tests = np.zeros(len(self.geometry.nodes.kind), np.int64), 0
        for index in range(len(rays)):
            progress.report(number * len(rays) + index, 3 * len(rays), "Recording lines")
            steps = structure.record(rays, index)
            of_tree = steps.level == OF_TREE
            np.add.at(tests, steps.cell[of_tree & (steps.kind == VISIT_LEAF)], 1)
            n_volume_tests += int((of_tree & (steps.kind == VOLUME_TEST)).sum())
        self.tests[bounds], self.n_volume_tests[bounds] = tests, n_volume_tests

    def picture(self, settings: Settings) -> Picture:
        """Return the solids, coloured by how many lines ask them, and bars of all three."""
        shares = {name: tests[self.leaves] / self.count for name, tests in self.tests.items()}
        chosen = shares[settings.bounds]
        most = max(float(each.max(initial=0.0)) for each in shares.values()) or 1.0
        colours = opaque(ramp(np.clip(chosen / most, 0.0, 1.0)))[self.owners]
        parts: list[Lines | Faces] = [Lines(self.segments, colours)]
        n_bars = min(len(self.leaves), MOST_BARS)
        # Below all that is drawn, which may reach farther than what is left of it.
        size, lowest = extent_of(self.scene), self.segments.reshape(-1, 3).min(axis=0)
        corner = np.array([*self.scene.lower[:2], lowest[2] - 0.55 * size])
        across, upwards = np.array([size, 0.0, 0.0]), np.array([0.0, 0.0, 0.4 * size])
        chart = Chart(corner, across, upwards, 0.0, float(n_bars), most)
        left = np.arange(n_bars, dtype=np.float64)
        for number, (name, each) in enumerate(shares.items()):
            low = left + 0.1 + 0.27 * number
            is_chosen = name == settings.bounds
            parts += chart.blocks(
                low, low + 0.25, np.zeros(n_bars), each[:n_bars], COLOURS[name],
                0.9 if is_chosen else 0.3,
            )  # fmt: skip
        parts.append(chart.axes())
        marks = chart.named("solids, from the first operand to the last", "tests per line")
        means = {name: float(each.sum()) for name, each in shares.items()}
        rows = [
            Row(
                WORDS[name].capitalize(),
                f"{means[name]:.2f} solids, {self.n_volume_tests[name] / self.count:.2f} bounds",
                "Tests for each random line",
            )
            for name in shares
        ]
        rows.append(
            Row("Saved", f"{100.0 * (1.0 - means[CUT] / max(means[UPWARD], 1e-300)):.0f}%",
                "Tests of solids that cutting saves beside bounds from below")
        )  # fmt: skip
        for leaf, before, after in sorted(
            zip(self.leaves.tolist(), shares[UPWARD], shares[CUT], strict=True),
            key=lambda each: each[2] - each[1],
        )[:5]:
            rows.append(
                Row(f"{name_of(self.geometry, leaf)} {leaf}", f"{before:.3f}, cut {after:.3f}",
                    "Tests for each line of one of the solids of which cutting saves most")
            )  # fmt: skip
        caption = (
            f"{WORDS[settings.bounds].capitalize()}: a random line tests "
            f"{means[settings.bounds]:.2f} of {len(self.leaves)} solids"
        )
        if len(self.leaves) > n_bars:
            caption += f"; the first {n_bars} have bars"
        return picture_of(parts, caption, marks=marks, rows=rows)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Record lines with all three."""
    return CsgTests(subject, settings.volume, progress)


LESSONS = (
    Lesson(
        name="csg_tests",
        label="What Cutting Saves",
        slide='CSG tree "cutting"',
        begin="Of a plate with holes each random line asks few solids, if bounds say where they "
        "matter",
        look_for="Without bounds every line asks all of them. From below, a cylinder is asked "
        "wherever it is; cut with the plate, only where it is within the plate",
        question="How many tests of a hole does a line make on average, by areas?",
        answer="As many as the area of its bound is of that of the plate: a bound that is a tenth "
        "as high has a share of the tests that is smaller in the ratio of their surfaces",
        source="geometry.csg.cutting",
        sample="csg_plate:holes=4",
        structures=("bvh",),
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="bounds",
        replays=("volume",),
    ),
)
