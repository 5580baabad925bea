# SPDX-License-Identifier: GPL-3.0-or-later
"""The scripts that set a machine up, on pretended machines: fake programs first on PATH."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the scripts are for Debian")


def run(script: str, *arguments: str, programs: Path) -> subprocess.CompletedProcess[str]:
    """Run a script of .ci with a folder of programs before those of the system."""
    environment = {
        "PATH": f"{programs}:/usr/bin:/bin",
        "HOME": str(programs / "home"),
        "PYENV_ROOT": str(programs / "pyenv"),
    }
    return subprocess.run(
        [ROOT / ".ci" / script, *arguments],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )


def program(path: Path, *lines: str) -> Path:
    """Write a shell script that can be run."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(["#!/bin/sh", *lines, ""]), encoding="utf-8")
    path.chmod(0o755)
    return path


def python(path: Path, version: str) -> Path:
    """Write a program that says, when asked, that it is the Python of that version."""
    return program(path, f'echo "{version} {path}"')


def test_python_that_does_not_run_is_passed_over(tmp_path: Path) -> None:
    program(tmp_path / "python9.13", "echo 'pyenv: python9.13: command not found' >&2", "exit 127")
    expected = python(tmp_path / "python9.11", "9.11")
    done = run("find_python.sh", "9.13", "9.11", programs=tmp_path)
    assert done.stdout.strip() == str(expected)
    assert done.returncode == 0


def test_python_that_pyenv_keeps_off_the_path_is_found(tmp_path: Path) -> None:
    program(tmp_path / "python9.13", "exit 127")
    python(tmp_path / "python9.11", "9.11")
    hidden = python(tmp_path / "pyenv" / "versions" / "9.13.0" / "bin" / "python9.13", "9.13")
    done = run("find_python.sh", "9.13", "9.11", programs=tmp_path)
    assert done.stdout.strip() == str(hidden)


def test_no_python_is_one_clear_line(tmp_path: Path) -> None:
    done = run("venv.sh", str(tmp_path / "venv"), "9.13 9.11", "nothing", programs=tmp_path)
    assert done.returncode == 1
    assert done.stderr == "No Python found that runs: looked for version 9.13 and 9.11.\n"
    assert not (tmp_path / "venv").exists()


def test_without_root_the_one_command_to_run_is_printed(tmp_path: Path) -> None:
    program(tmp_path / "id", "echo 1000")
    program(tmp_path / "sudo", "exit 1")
    program(tmp_path / "apt-get", "exit 0")
    done = run("apt.sh", "libegl1", "libgl1", programs=tmp_path)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith("Please run this once: sudo apt-get update && sudo apt-get install")
    assert line.endswith(" libegl1 libgl1")


def test_missing_system_libraries_are_those_that_ldconfig_does_not_know(tmp_path: Path) -> None:
    asked = tmp_path / "asked"
    program(tmp_path / "id", "echo 0")
    program(tmp_path / "apt-get", f'echo "$@" >> {asked}')
    program(tmp_path / "dpkg-query", "echo 'install ok installed'")
    known = ["libGL", "libXi", "libXxf86vm", "libXfixes", "libXrender", "libxkbcommon", "libICE"]
    number = {"libXi": 6, "libICE": 6, "libxkbcommon": 0, "libXfixes": 3}
    program(
        tmp_path / "ldconfig",
        *(f"echo '\t{name}.so.{number.get(name, 1)} (libc6,x86-64) => /lib'" for name in known),
    )
    done = run("system_libraries.sh", programs=tmp_path)
    assert done.returncode == 0, done.stderr
    install = asked.read_text(encoding="utf-8").splitlines()[-1]
    assert [word for word in install.split() if word.startswith("lib")] == ["libegl1", "libsm6"]
