"""Kernels that run as plain Python until they are compiled: the same bits, and nothing compiled."""

import contextlib

import numpy as np
import pytest
from accelscope.core import kernels
from accelscope.core.evaluation.rays.workloads import random_lines, workload_named
from accelscope.core.evaluation.records.experiment import build as build_and_measure
from accelscope.core.evaluation.records.experiment import make_record, trace
from accelscope.core.geometry.rays import Rays
from accelscope.core.structures import structures
from accelscope.core.structures.bvh import BVH

pytestmark = pytest.mark.skipif(not kernels.has_numba(), reason="there is nothing to compile with")


@pytest.fixture
def plain():
    kernels.run_plain(True)
    yield
    kernels.run_plain(False)


@pytest.mark.parametrize("name", ["bvh", "grid", "kdtree", "sorted_volumes"])
def test_plain_and_compiled_are_the_same_bits(name, lab, plain):
    from numba.core import event

    class Heard(event.Listener):
        def on_start(self, event):
            raise AssertionError("plain Python compiles nothing")

        def on_end(self, event):
            pass

    scene = lab.small_scene("one" if name == "sorted_volumes" else "mess")
    rays = Rays.from_arrays(*random_lines(scene.lower, scene.upper, 40, 1))
    found = []
    for is_plain in (True, False):
        kernels.run_plain(is_plain)
        heard = event.install_listener("numba:compile", Heard())
        with heard if is_plain else contextlib.nullcontext():
            structure = structures()[name].build(scene, structures()[name].Settings())
            hits, counts = structure.trace(rays)
            found.append((hits, counts, structure.record(rays, 3)))
    (hits, counts, steps), (compiled_hits, compiled_counts, compiled_steps) = found
    np.testing.assert_array_equal(hits.t, compiled_hits.t)
    np.testing.assert_array_equal(hits.primitive, compiled_hits.primitive)
    np.testing.assert_array_equal(counts.values, compiled_counts.values)
    assert steps.tally() == compiled_steps.tally()


def test_records_say_that_plain_python_has_built(lab, plain):
    """Also those of rays that were traced by compiled kernels afterwards."""
    scene = lab.small_scene("one")
    built = build_and_measure(scene, BVH, BVH.Settings())
    assert built.is_plain
    kernels.run_plain(False)
    workload = workload_named("random_lines")
    traced = trace(built, workload, workload.Settings(count=10))
    assert make_record(built, traced)["environment"]["numba"] is None
    compiled = build_and_measure(scene, BVH, BVH.Settings())
    assert make_record(compiled, None)["environment"]["numba"]


def test_an_inner_kernel_that_python_calls_runs_plain(plain):
    @kernels.inner
    def twice(number):
        return 2 * number

    assert kernels.call(twice, 3) == 6
    kernels.run_plain(False)
    # A kernel that was begun plain goes on so, whatever is asked for meanwhile.
    assert twice(3) == 6
    with pytest.raises(TypeError, match="only kernels call it"):
        kernels.call(twice, 3)


def test_plain_ends_with_the_block():
    def fail():
        with kernels.plain(True):
            assert kernels.is_plain()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert not kernels.is_plain()
