"""Neither a new process nor other numbers compile anything, and so nothing is said."""

import pytest
from accelscope.core.evaluation.records.experiment import build, warm_up
from accelscope.core.kernels import announcing, has_numba
from accelscope.core.progress import Progress
from accelscope.core.structures import general_structures, structures
from accelscope.core.structures.bvh import BVH
from accelscope.sample_scenes import make_sample


class Listening(Progress):
    def __init__(self):
        self.said = []

    def announce(self, text):
        self.said.append(text)


@pytest.mark.parametrize("name", general_structures())
def test_the_second_time(name):
    kind = structures()[name]
    warm_up(kind, kind.Settings())
    progress = Listening()
    warm_up(kind, kind.Settings(), progress)
    build(make_sample("soup:count=50"), kind, kind.Settings(), progress)
    assert progress.said == []


def test_other_numbers():
    progress = Listening()
    warm_up(BVH, BVH.Settings())
    warm_up(BVH, BVH.Settings(max_leaf_size=1, C_trav=3.0), progress)
    assert progress.said == []


@pytest.mark.skipif(not has_numba(), reason="without Numba nothing is compiled")
def test_a_kernel_that_is_new():
    import numba

    progress = Listening()
    with announcing(progress, "that"):
        assert progress.said == []
        assert numba.njit(lambda x: x + 1)(1) == 2
        assert numba.njit(lambda x: x + 2)(1) == 3
    assert progress.said == ["compiling that, once after installation, some ten seconds"]
    assert numba.njit(lambda x: x + 3)(1) == 4
    assert len(progress.said) == 1
