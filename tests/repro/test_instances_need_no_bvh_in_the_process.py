"""Over instances every structure was refused as a defect, if nothing had imported the bvh before.

The command line imports the structures that are named, and their meshes' hierarchies are a bvh's.
"""

import subprocess
import sys

import pytest

PROGRAM = """
import sys
from accelscope.core.structures import structure_named
from accelscope.sample_scenes import make_sample
kind = structure_named(sys.argv[1])
structure = kind.build(make_sample(sys.argv[2]), kind.Settings())
print(type(structure.geometry).__name__)
"""


@pytest.mark.parametrize(
    ("sample", "geometry"), [("overlapping:spheres=3", "Instances"), ("csg_classic", "CsgTrees")]
)
@pytest.mark.parametrize("name", ["naive", "ray_classification"])
def test_a_structure_alone(name, sample, geometry):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, name, sample], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [geometry]
