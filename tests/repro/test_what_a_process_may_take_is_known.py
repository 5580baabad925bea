"""Memory that the machine has and the process may not take is none that can be had."""

import subprocess
import sys

import pytest
from accelscope.core import memory

ASK = """
import resource, sys
limit = int(sys.argv[1])
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
from accelscope.core.memory import available_bytes
print(available_bytes())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="limits as Linux has them")
def test_a_limit_of_the_process():
    limit = 1 << 30
    command = [sys.executable, "-c", ASK, str(limit)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert 0 < int(done.stdout) < limit


FIRST = {"": "max", "a": 5000, "a/b": "max"}, {"a": 3500, "a/b": 1000}
"""Limits of groups, and what is taken."""


@pytest.mark.parametrize("version", [1, 2])
def test_a_limit_of_a_container(tmp_path, monkeypatch, version):
    """Of what is taken, 500 bytes are those of files that were read, and can be given back."""
    root = tmp_path / "memory" if version == 1 else tmp_path
    names = {
        1: ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
        2: ("memory.max", "memory.current", "inactive_file"),
    }[version]
    for group, limit in FIRST[0].items():
        folder = root / group
        folder.mkdir(exist_ok=True, parents=True)
        (folder / names[0]).write_text(f"{limit if limit != 'max' or version == 2 else 1 << 62}\n")
        (folder / names[1]).write_text(f"{FIRST[1].get(group, 10_000)}\n")
        (folder / "memory.stat").write_text(f"cache 7\n{names[2]} 500\n")
    line = "4:cpu,memory:/a/b\n0::/\n" if version == 1 else "0::/a/b\n"
    (tmp_path / "groups").write_text(line)
    monkeypatch.setattr(memory, "OWN_GROUPS", tmp_path / "groups")
    monkeypatch.setattr(memory, "CONTROL_GROUPS", tmp_path)
    assert memory.available_bytes() == 5000 - 3500 + 500
    (root / "a" / names[0]).write_text("1000\n")
    assert memory.available_bytes() == 0
    (tmp_path / "groups").write_text("")
    assert memory.available_bytes() > 1 << 20
