"""To say what there is nothing is compiled, so nobody waits for a compiler to be imported."""

import subprocess
import sys

HEAVY = "numba", "llvmlite", "embreex", "trimesh", "scipy"

LIST = f"""
import sys
from accelscope.addon.command.main import main
assert main(["list"]) == main(["list", "--json"]) == 0
sys.stderr.write(" ".join(sorted({set(HEAVY)} & set(sys.modules))))
"""


def test_list():
    done = subprocess.run(
        [sys.executable, "-c", LIST], capture_output=True, text=True, timeout=60, check=True
    )
    assert "bvh: " in done.stdout
    assert done.stderr == ""
