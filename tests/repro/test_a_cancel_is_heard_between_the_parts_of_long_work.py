"""Work that took half a second at 250,000 triangles without a report is heard of in parts now.

Counted in reports: how long each part takes is a matter of the machine.
"""

import math

import numpy as np
import pytest
from accelscope.core.contract import cells
from accelscope.core.evaluation.rays.workloads import random_lines
from accelscope.core.geometry.rays import Rays
from accelscope.core.lessons import lesson_named
from accelscope.core.progress import Cancelled, Progress
from accelscope.core.sah.timing import REPEATS, affordable, time_of_object, time_of_volume
from accelscope.core.sah.volume_around import volume_around
from accelscope.core.structures import structure_named
from accelscope.core.structures.kdtree.builder import Builder
from accelscope.core.structures.subdivision import subtrees
from accelscope.sample_scenes import make_sample


class Heard(Progress):
    """Notes what is reported, and cancels at a report of its own choice."""

    def __init__(self, stops=lambda reports: False):
        self.reports, self.stops = [], stops

    def report(self, done, total, text):
        self.reports.append((done, total, text))
        if self.stops(self.reports):
            raise Cancelled


def test_a_kdtree_reports_while_bounds_are_sorted(monkeypatch):
    kdtree = structure_named("kdtree")
    monkeypatch.setattr(Builder, "run", lambda *_, **__: pytest.fail("cells are divided"))
    progress = Heard(lambda reports: len(reports) == 3)
    with pytest.raises(Cancelled):
        kdtree.build(make_sample("soup:count=2000"), kdtree.Settings(), progress)


def test_a_kdtree_reports_before_it_hands_a_cell_out(monkeypatch):
    kdtree, heard, hand_out = structure_named("kdtree"), [], Builder.hand_out
    progress = Heard()

    def noting(builder):
        heard.append(len(progress.reports))
        return hand_out(builder)

    monkeypatch.setattr(Builder, "hand_out", noting)
    monkeypatch.setattr(subtrees, "WAIT", 60.0)
    kdtree.build(make_sample("soup:count=70000,edge=0.01"), kdtree.Settings(), progress)
    assert len(heard) >= 2
    assert (np.diff(heard) >= 1).all()


def test_polygons_of_cells_are_sorted_in_parts(monkeypatch):
    bsp = structure_named("bsp")
    built = bsp.build(make_sample("suzanne:subdivisions=0"), bsp.Settings(planes="fixed"))
    whole = built.cells()
    monkeypatch.setattr(cells, "AT_ONCE", 100)
    progress = Heard()
    parts = built.cells(progress)
    for name in ("faces", "planes"):
        for one, other in zip(getattr(whole, name), getattr(parts, name), strict=True):
            np.testing.assert_array_equal(one, other)
    sizes = [len(whole.faces.owners), len(whole.planes.owners)]
    sorting = [total for _, total, text in progress.reports if text == "Sorting cells"]
    assert [sorting.count(size) for size in sizes] == [math.ceil(size / 100) for size in sizes]
    with pytest.raises(Cancelled):
        built.cells(Heard(lambda reports: reports[-1][2] == "Sorting cells"))


def test_timings_report_between_two_of_them():
    scene = make_sample("tetra:size=2")
    rays = Rays.from_arrays(*random_lines(scene.lower, scene.upper, 100, 1)).arrays()
    volume, repeats = volume_around(scene, "aabb"), affordable(*REPEATS)

    def timed(progress):
        time_of_object(scene.items(), rays, progress)
        time_of_volume(volume, rays, np.ones(3), progress)
        return progress.reports

    texts = [text for *numbers, text in timed(Heard()) if numbers == [repeats - 1, repeats]]
    # The volume is timed alone and in copies, and rays by themselves for either.
    assert texts == [
        "Timing the object", "Timing the rays", "Timing the volume", "Timing the volume",
        "Timing the rays",
    ]  # fmt: skip
    for text in set(texts):
        with pytest.raises(Cancelled):
            timed(Heard(lambda reports, text=text: reports[-1][2] == text))


def test_a_lesson_reports_before_a_log_is_put_together():
    lesson = lesson_named("rotations")
    subject = lesson.subject(make_sample("suzanne:subdivisions=0"))
    (bvh,) = subject.structures
    with pytest.raises(Cancelled):
        lesson.play(subject, lesson.Settings(), Heard(lambda reports: True))
    assert "build_log" not in vars(bvh)
    assert bvh.keeps_log


def test_a_lesson_reports_while_it_looks_for_its_ray():
    lesson = lesson_named("uniform_subdivision")
    scene = make_sample("suzanne:subdivisions=0")
    progress = Heard(lambda reports: reports[-1][2].startswith("Tracing"))
    with pytest.raises(Cancelled):
        lesson.play(lesson.subject(scene), lesson.Settings(resolution=1), progress)
