"""/dev/null keeps nothing: any number of results may go there, whatever standard output is."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="devices of other systems")

NOWHERE = ("--json", "/dev/null", "--csv", "/dev/null")
SMALL = ("evaluate", "sample:tetra:size=1", "--rays", "random_lines:count=10")


def test_two_results(run):
    outcome = run(*SMALL, *NOWHERE, "--quiet")
    assert (outcome.code, outcome.err) == (0, "")


def test_two_files_by_one_name_are_refused(refused, tmp_path):
    line = refused(*SMALL, "--json", tmp_path / "a", "--csv", tmp_path / "a")
    assert "would overwrite" in line


@pytest.mark.parametrize(
    ("outputs", "code"),
    [
        pytest.param(NOWHERE, 0, marks=pytest.mark.exhaustive),
        (("--json", "/dev/stdout", "--csv", "/dev/null"), 0),
        (("--json", "-", "--csv", "-"), 2),
    ],
)
def test_standard_output_goes_there_too(tmp_path, outputs, code):
    with open("/dev/null", "wb") as nowhere, (tmp_path / "err").open("wb") as errors:
        done = subprocess.run(
            [sys.executable, "-m", "accelscope", *SMALL, *outputs],
            stdout=nowhere, stderr=errors, timeout=60, check=False,
        )  # fmt: skip
    assert done.returncode == code
    # Nothing of the results has found its way to where errors go.
    lines = (tmp_path / "err").read_text().splitlines()
    assert len(lines) == (code != 0), lines
