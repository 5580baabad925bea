"""OBJ: a kernel reads large files, Python small ones; both see the same, to the last bit.

Read by Python alone, 50 MB took five seconds.
"""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file, obj

NUMBERS = """0 -0 1 +2 -3.5 .5 5. 1e3 1E-3 -2.5e+2 1e22 1e23 1e-22 1e-23 123456789012345678 0.1
1e400 0.30000000000000004 9007199254740993 9007199254740992 4.35 -0.000001 1e- 1e 1e5.0 . - +-1 1_0
0x1 nan inf 1,5 00012 0.000000000000000000000000001 1.7976931348623157e308 7# 1#2 1d3"""
CORNERS = """1 2 3 4 -1 -2 -3 1/2 2//3 3/1/ 4/#7 +1 003 -0 0 9 1/x 2# 1_1 a 1.0 - /
99999999999999999999"""
OTHERS = (
    "", "   ", "# v 1 2 3", "#", "vn 0 0 1", "vt", "vp 1", "vx 1 2 3", "s off", "s", "sx", "o a b",
    "g", "usemtl m #1", "o", "l 1 2", "p 1", "f", "fo 1 2 3", "foo 1", "f 1 2 3 4 5", "v", "v 1 2",
    "v 1 2 #3", "v 1 2 3# c", "v 1 2 3 x y", "\tf\t1\t2\t3 ", "f#1 2 3", "v#", "end",
)  # fmt: skip


def seen(path):
    """Return all that is read of a file, or why it is refused."""
    try:
        scene = load_mesh_file(path)
    except InputError as error:
        return str(error)
    return scene.triangles.tobytes(), scene.object_ids.tobytes(), scene.object_names, scene.notes


def line(rng):
    """Return a line, most often a good one."""
    kind, numbers, corners = rng.random(), NUMBERS.split(), CORNERS.split()
    words = rng.choice(numbers[:8] if rng.random() < 0.95 else numbers, 3)
    if kind < 0.4:
        return "v " + " ".join(words)
    if kind < 0.8:
        corners = corners[:13] if rng.random() < 0.97 else corners
        return "f " + rng.choice([" ", "\t", " \v"]).join(rng.choice(corners, rng.integers(3, 6)))
    return str(rng.choice(OTHERS[:15] if rng.random() < 0.9 else OTHERS))


@pytest.mark.parametrize("seed", range(8))
def test_whatever_its_lines_are(tmp_path, monkeypatch, seed):
    rng, read = np.random.default_rng(seed), 0
    path = tmp_path / "m.obj"
    for _ in range(40):
        lines = ["v 0 0 1", "v 1 0 0", "v 0 1 0", "v 1 2 5"]
        lines += [line(rng) for _ in range(rng.integers(1, 12))]
        path.write_text("\n".join(lines) + "\n" * int(rng.integers(2)))
        by_python = seen(path)
        monkeypatch.setattr(obj, "LARGE", 0)
        assert seen(path) == by_python, lines
        monkeypatch.undo()
        read += not isinstance(by_python, str)
    assert read > 10


def test_numbers(tmp_path, monkeypatch):
    rng = np.random.default_rng(1)
    values = rng.normal(size=3000) * 10.0 ** rng.integers(-12, 13, 3000)
    forms = "%.6f", "%g", "%.17g", "%.9e", "%.15g", "%d", "%f"
    words = [forms[k % len(forms)] % value for k, value in enumerate(values)]
    path = tmp_path / "m.obj"
    rows = [f"v {' '.join(words[k : k + 3])}" for k in range(0, len(words), 3)]
    path.write_text("\n".join(rows) + "".join(f"\nf {k + 1} {k + 2} {k + 3}" for k in range(998)))
    monkeypatch.setattr(obj, "LARGE", 0)
    wanted = np.array(list(map(float, words))).reshape(-1, 3)
    corners = np.arange(998)[:, None] + np.arange(3)
    assert load_mesh_file(path).triangles.tobytes() == wanted[corners].tobytes()
