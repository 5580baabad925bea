"""One bit that has changed on the disk is noticed before the machine does what it says."""

import subprocess
import sys

import pytest

pytest.importorskip("numba")

TOY = """
from accelscope.core.kernels import kernel

@kernel
def sum_of_squares(values):
    total = 0.0
    for i in range(len(values)):
        total += values[i] * values[i]
    return total
"""

RUN = """
import importlib, sys
from pathlib import Path
from accelscope.core import kernel_cache, kernels
folder = Path(sys.argv[1])
kernel_cache.set_cache_root(folder / "kernels")
sys.path.insert(0, str(folder))
sys.dont_write_bytecode = True
import numpy as np
from accelscope.core.progress import Progress
import toy

compiled = []

class Listening(Progress):
    def announce(self, text):
        compiled.append(text)

def run(label):
    compiled.clear()
    importlib.reload(toy)
    with kernels.announcing(Listening(), "toy"):
        values = [kernels.call(toy.sum_of_squares, np.arange(4, dtype=kind)) for kind in KINDS]
    print(label, values, len(compiled))

KINDS = "f8", "i8"
run("fresh")
run("kept")
files = sorted(path for path in (folder / "kernels").rglob("*") if path.is_file())
for path in files:
    whole = path.read_bytes()
    for share in SHARES:
        damaged = bytearray(whole)
        damaged[int(share * (len(whole) - 1))] ^= 4
        path.write_bytes(damaged)
        run(f"{path.suffix} {share}")
        run("mended")
# As a disk may leave it, too.
first, second = (path for path in files if path.suffix == ".nbc")
kept = first.read_bytes(), second.read_bytes()
first.write_bytes(kept[1]), second.write_bytes(kept[0])
run("exchanged")
"""


def test_a_bit_anywhere(tmp_path):
    (tmp_path / "toy.py").write_text(TOY)
    code = f"SHARES = 0.3, 0.6, 0.9\n{RUN}"
    done = subprocess.run(
        [sys.executable, "-B", "-c", code, str(tmp_path)],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    lines = [line.rsplit(" ", 1) for line in done.stdout.splitlines()]
    counts = {}
    for said, count in lines:
        label, _, values = said.partition(" [")
        assert values == "14.0, 14.0]", said
        counts.setdefault(label, []).append(int(count))
    assert counts.pop("fresh") == [1]
    assert counts.pop("kept") == [0]
    assert set(counts.pop("mended")) == {0}
    # An index may have bits of no importance, machine code has none.
    kernels = {label: count for label, count in counts.items() if not label.startswith(".nbi")}
    assert len(kernels) == 3 + 1
    assert {tuple(set(count)) for count in kernels.values()} == {(1,)}
