# SPDX-License-Identifier: GPL-3.0-or-later
"""The scripts that set a machine up, on pretended machines: fake programs first on PATH."""

import importlib.util
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


def test_a_source_that_cannot_be_reached_does_not_keep_packages_from_being_installed(
    tmp_path: Path,
) -> None:
    asked = tmp_path / "asked"
    program(tmp_path / "id", "echo 0")
    program(tmp_path / "apt-get", f'echo "$@" >> {asked}', 'case "$*" in *update) exit 100;; esac')
    done = run("apt.sh", "debootstrap", programs=tmp_path)
    assert done.returncode == 0, done.stderr
    update, install = asked.read_text(encoding="utf-8").splitlines()
    assert update.endswith("update")
    assert " debootstrap" in install
    assert "install --yes" in install


def test_root_gets_the_debootstrap_it_has_not(tmp_path: Path) -> None:
    """On a fresh machine it is installed; where that fails, the line says what to run."""
    asked = tmp_path / "asked"
    program(tmp_path / "id", "echo 0")
    program(tmp_path / "unshare", "exit 0")
    for name in ("bash", "cat", "cut", "dirname", "flock", "head", "mkdir", "sed", "sh"):
        (tmp_path / name).symlink_to(f"/bin/{name}")
    program(tmp_path / "apt-get", f'echo "$@" >> {asked}', 'echo "E: no network" >&2', "exit 100")
    # The script looks into the system's own folders, too, where this machine may have it.
    here = ROOT / ".ci"
    text = (here / "blender_root.sh").read_text(encoding="utf-8")
    assert text.count("PATH=$PATH:/usr/sbin:/sbin") == 1
    script = program(tmp_path / "here" / "blender_root.sh")
    script.write_text(text.replace("PATH=$PATH:/usr/sbin:/sbin", f"PATH={tmp_path}"))
    (tmp_path / "here" / "apt.sh").symlink_to(here / "apt.sh")
    done = subprocess.run(
        [script],
        env={"PATH": str(tmp_path), "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 3, done.stderr
    assert "debootstrap" in asked.read_text(encoding="utf-8")
    *_, reason, line = done.stderr.splitlines()
    assert reason == "E: no network"
    assert line.endswith(
        "debootstrap is missing: run apt-get update && apt-get install debootstrap"
    )


@pytest.mark.parametrize(("ci", "outcome"), [("", "skip"), ("false", "skip"), ("true", "fail")])
def test_continuous_integration_fails_without_a_window(
    monkeypatch: pytest.MonkeyPatch, ci: str, outcome: str
) -> None:
    spec = importlib.util.spec_from_file_location("window", ROOT / "tests/window/test_window.py")
    assert spec is not None
    assert spec.loader is not None
    window = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(window)
    monkeypatch.setenv("CI", ci)
    done = subprocess.CompletedProcess([], window.CANNOT, "", "first\nthis machine may not\n")
    expected = {"skip": pytest.skip.Exception, "fail": pytest.fail.Exception}[outcome]
    with pytest.raises(expected, match="this machine may not"):
        window.skip_if_impossible(done)


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


def blender_checkout(folder: Path) -> Path:
    """Make a checkout whose environments are made at once and whose tests pass."""
    script = program(folder / ".ci" / "test_blender_all.sh")
    script.write_text((ROOT / ".ci" / script.name).read_text(encoding="utf-8"), encoding="utf-8")
    program(folder / ".ci" / "find_python.sh", '[ "$1" != "$MISSING" ]')
    program(
        folder / ".ci" / "venv.sh",
        'mkdir -p "$1/bin"',
        'printf "#!/bin/sh\\n[ $1 != .venv-blender-$FAILING ]\\n" > "$1/bin/pytest"',
        'chmod +x "$1/bin/pytest"',
    )
    return script


@pytest.mark.parametrize(
    ("missing", "failing", "code", "said"),
    [
        ("", "", 0, "left out: none"),
        ("3.11", "", 1, "left out: 4.5 5.0"),
        ("3.13", "", 1, "left out: 5.1 5.2"),
        ("", "5.1", 1, "failed:   5.1"),
        ("3.11", "5.2", 1, "failed:   5.2"),
    ],
)
def test_a_blender_that_was_not_tested_is_a_failure(
    tmp_path: Path, missing: str, failing: str, code: int, said: str
) -> None:
    script = blender_checkout(tmp_path)
    environment = {"PATH": "/usr/bin:/bin", "MISSING": missing, "FAILING": failing}
    done = subprocess.run(
        [script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (code, "")
    assert f"Blender versions {said}\n" in done.stdout
