"""An output with an empty name, as a shell's variable that is not set gives it, is refused."""

import pytest

FRAMES = ["sample:tetra:size=1"] * 2
COMMANDS = {
    "evaluate": ["evaluate", *FRAMES[:1]],
    "animate": ["animate", *FRAMES],
    "efficiency": ["efficiency", *FRAMES[:1]],
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", ["--json", "--csv", "--pictures"])
def test_empty_names(refused, command, option):
    assert "folder" in refused(*COMMANDS[command], option, "")


def test_hits(refused):
    assert "folder" in refused(*COMMANDS["evaluate"], "--hits", "")
