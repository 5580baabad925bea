"""A bar wider than the terminal would be written in a new line every tenth of a second."""

import os
import sys

import pytest
from accelscope.core.progress import TerminalProgress

fcntl = pytest.importorskip("fcntl", reason="terminals of other systems")
struct = pytest.importorskip("struct")
termios = pytest.importorskip("termios")


@pytest.mark.parametrize(("columns", "room"), [(1, 0), (6, 5), (20, 19), (78, 45), (200, 78)])
def test_of_any_width(monkeypatch, columns, room):
    control, terminal = os.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    with os.fdopen(terminal, "w") as stream, os.fdopen(control, "rb", 0) as reader:
        monkeypatch.setattr(sys, "stderr", stream)
        progress = TerminalProgress()
        monkeypatch.setattr(progress, "DELAY", 0.0)
        progress.report(42, 100, "Building something with a name of some length")
        shown = reader.read(1000).decode()
        assert shown.startswith("\r")
        assert len(shown) == 1 + room
        assert ("42%" in shown) == (columns >= 6)
        assert ("###" in shown) == (columns >= 200)
        progress.report(100, 100, "Building something with a name of some length")
        assert set(reader.read(1000).decode()) <= {"\r", " "}
