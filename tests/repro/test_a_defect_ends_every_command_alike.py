"""A defect shows its traceback; the last line and the exit code are those of any failure."""

import pytest
from accelscope.addon.command import main as command_main
from accelscope.core.evaluation.records import animation

LINE = "accelscope: error: a defect of AccelScope: ZeroDivisionError: a defect"


@pytest.fixture
def defective(monkeypatch):
    """Let a function of a module raise what nobody expects."""

    def at(module, name):
        def raising(*_):
            raise ZeroDivisionError("a\ndefect")

        monkeypatch.setattr(module, name, raising)

    return at


def check(outcome):
    lines = outcome.err.splitlines()
    assert (outcome.code, outcome.out) == (2, "")
    assert lines[0] == "Traceback (most recent call last):"
    assert lines[-1] == LINE
    assert outcome.err.count("Traceback") == outcome.err.count(LINE) == 1


def test_in_the_first_frame(run, defective, tmp_path):
    defective(animation, "build")
    frames = ["sample:tetra:size=1"] * 2
    check(run("animate", *frames, "--json", tmp_path / "a.json"))
    assert not (tmp_path / "a.json").exists()


def test_in_a_list(run, defective):
    defective(command_main, "list_text")
    check(run("list"))
