"""The arithmetic of the benchmark: what is printed is what was measured."""

import os
import statistics
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from accelscope.core.geometry.rays import Rays

sys.path.insert(0, str(Path(__file__).parent))

import embree
import hierarchies
import speed
import timing


def test_a_spread_is_median_least_and_most():
    assert timing.spread([3.0, 1.0, 10.0, 2.0]) == (2.5, 1.0, 10.0)
    assert str(timing.spread([0.25])) == "0.25 (0.25..0.25)"
    with pytest.raises(statistics.StatisticsError):
        timing.spread([])


def test_ratios_are_taken_within_rounds():
    """Here the ratio of the medians would be 1."""
    ours, theirs = [1.0, 4.0, 10.0], [0.5, 5.0, 4.0]
    assert timing.ratios(ours, theirs) == (2.0, 0.8, 2.5)
    assert timing.ratios(ours, theirs[:1]) == (2.0, 2.0, 2.0)


def test_contestants_run_in_turn(monkeypatch):
    monkeypatch.setattr(timing, "LONG", 5.0)
    order = []

    def contestant(name, seconds):
        def run():
            order.append(name)
            return seconds

        return run

    found = timing.in_turn(
        {"a": contestant("a", 1.0), "b": contestant("b", 2.0), "long": contestant("long", 6.0)}, 3
    )
    assert order == ["a", "b", "long", "a", "b", "a", "b"]
    assert found == {"a": [1.0] * 3, "b": [2.0] * 3, "long": [6.0]}


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="only Linux holds threads so")
def test_one_core_holds_threads_too_and_lets_go():
    before, seen = os.sched_getaffinity(0), []
    with timing.one_core():
        thread = threading.Thread(target=lambda: seen.append(os.sched_getaffinity(0)))
        thread.start()
        thread.join()
    assert seen == [{min(before)}]
    assert os.sched_getaffinity(0) == before


def row_of(what, who, cores, seconds):
    return {
        "mesh": "box", "triangles": 12, "what": what, "count": 100, "who": who, "cores": cores,
        "seconds": seconds,
    }  # fmt: skip


def test_builds_are_multiples_of_time_and_rays_shares_of_rate():
    rows = [
        row_of("build", "bvh", "all", [4.0, 6.0]), row_of("build", "embreex", "all", [1.0, 2.0]),
        row_of("camera", "bvh", "one", [8.0, 4.0]), row_of("camera", "embreex", "one", [2.0, 2.0]),
        row_of("camera", "bvh", "all", [4.0, 2.0]),
    ]  # fmt: skip
    assert speed.compared(rows, "box", "build", "all", "embreex") == (3.5, 3.0, 4.0)
    assert speed.compared(rows, "box", "camera", "one", "embreex") == (0.375, 0.25, 0.5)
    assert speed.compared(rows, "box", "camera", "all", "open3d") is None
    table = speed.markdown_speed(rows)
    assert table[-2:] == [
        "| box (12) | 3.50 | - | 0.38 | - | - | - |",
        "| geometric mean | 3.50 | - | 0.38 | - | - | - |",
    ]


def test_means_over_meshes_are_geometric_and_relative_to_the_first():
    first, other = hierarchies.SECTIONS["builders"][:2]

    def row(mesh, spec, build, trace, sah):
        return {
            "mesh": mesh, "section": "builders", "spec": spec, "build": [build], "trace": [trace],
            "lines": 500_000, "sah": sah,
        }  # fmt: skip

    rows = [
        row("a", first, 1.0, 1.0, 10.0), row("a", other, 2.0, 0.5, 40.0),
        row("b", first, 1.0, 4.0, 10.0), row("b", other, 8.0, 5.0, 10.0),
    ]  # fmt: skip

    def mean(figure):
        return hierarchies.mean_relative(rows, "builders", figure)

    assert hierarchies.million(rows[1]) == 3.0
    assert mean("build") == pytest.approx({first: 1.0, other: 4.0})
    assert mean("trace") == pytest.approx({first: 1.0, other: 0.625**0.5})
    assert mean("sah") == pytest.approx({first: 1.0, other: 2.0})
    assert mean("million") == pytest.approx({first: 1.0, other: 2.0**0.5})


def test_every_section_says_all_of_its_settings_that_may_become_another_default():
    for section, specs in hierarchies.SECTIONS.items():
        named = [spec for spec in specs if (section, spec) != ("default", "bvh")]
        assert all("builder=" in spec and "optimise=" in spec for spec in named)
        assert len(set(specs)) == len(specs)


def test_rays_that_end_are_not_for_embreex():
    origins, directions = np.zeros((1, 3)), np.ones((1, 3))
    embree.as_float32(Rays.from_arrays(origins, directions))
    with pytest.raises(ValueError, match="end"):
        embree.as_float32(Rays.from_arrays(origins, directions, t_max=np.array([1.0])))
