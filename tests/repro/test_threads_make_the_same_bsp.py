"""A BSP tree is built on all cores, and it is the same tree on any number of them."""

import dataclasses
import threading

import numpy as np
import pytest
from accelscope.core.progress import SILENT, Cancelled, Progress
from accelscope.core.structures import bsp, structures
from accelscope.core.structures.bsp.build import grow_tree
from accelscope.sample_scenes import make_sample

STRUCTURE = structures()["bsp"]
PLANES = list(STRUCTURE.Settings.__dataclass_fields__["planes"].metadata["choices"])


def built(monkeypatch, scene, settings, subtree, threads):
    """Return the tree with subtrees of at most so many references, each built by one thread."""
    names = set()

    def grow_with(*arguments):
        return grow_tree(*arguments, threads=threads)

    def run(builder, reports=False):
        names.add(threading.current_thread().name)
        return original(builder, reports)

    original = bsp.build.Builder.run
    with monkeypatch.context() as patch:
        patch.setattr(bsp.build, "SUBTREE", subtree)
        patch.setattr(bsp, "grow_tree", grow_with)
        patch.setattr(bsp.build.Builder, "run", run)
        tree = STRUCTURE.build(scene, settings)
    return tree, names


@pytest.mark.parametrize("order", ["fifo", "depth_first"])
@pytest.mark.parametrize("planes", PLANES)
def test_the_same_tree(monkeypatch, planes, order):
    scene = make_sample("suzanne:subdivisions=2")
    settings = STRUCTURE.Settings(planes=planes, order=order)
    whole, alone = built(monkeypatch, scene, settings, 10**9, 1)
    assert len(alone) == 1
    assert whole.validate() == []
    for threads in (1, 3):
        pieces, names = built(monkeypatch, scene, settings, 3000, threads)
        assert len(names) > 1
        for one, other in zip(whole.grown, pieces.grown, strict=True):
            assert np.array_equal(one, other)
            assert one.dtype == other.dtype


@pytest.mark.parametrize("order", ["fifo", "depth_first"])
def test_the_same_as_in_one_frontier(monkeypatch, order):
    """A budget that is never used up makes one builder follow the order step by step."""
    scene = make_sample("suzanne:subdivisions=1")
    settings = STRUCTURE.Settings(order=order)
    pieces, _ = built(monkeypatch, scene, settings, 2000, 2)
    followed = STRUCTURE.build(scene, dataclasses.replace(settings, budget=10**8))
    for one, other in zip(followed.grown, pieces.grown, strict=True):
        assert np.array_equal(one, other)


def test_a_stop_reaches_all_threads(monkeypatch):
    class Stop(Progress):
        left = 8

        def report(self, done, total, text):
            self.left -= 1
            if self.left == 0:
                raise Cancelled

    before = set(threading.enumerate())
    scene = make_sample("suzanne:subdivisions=4")
    with pytest.raises(Cancelled):
        STRUCTURE.build(scene, STRUCTURE.Settings(), Stop())
    assert set(threading.enumerate()) <= before
    assert STRUCTURE.build(make_sample("tetra:size=2"), STRUCTURE.Settings(), SILENT)
