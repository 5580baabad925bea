"""A build begun as plain Python ends well when kernels are to be compiled meanwhile.

Its next inner kernel was called compiled then, from Python, and ended the process.
"""

import subprocess
import sys

import pytest
from accelscope.core.kernels import has_numba

CODE = """
import threading, time
from accelscope.core import kernels
from accelscope.core.structures import structure_named
from accelscope.sample_scenes import make_sample

scene, kind = make_sample("suzanne:subdivisions=0"), structure_named("bvh")
kernels.run_plain(True)
built = []
work = threading.Thread(target=lambda: built.append(kind.build(scene, kind.Settings())))
work.start()
time.sleep(0.1)
kernels.run_plain(False)
work.join()
assert built[0].validate() == []
print("whole")
"""


@pytest.mark.skipif(not has_numba(), reason="all is plain")
def test_it_ends_well():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "whole\n"), done.stderr
