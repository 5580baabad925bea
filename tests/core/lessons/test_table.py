"""LESSONS.md tells of every lesson there is, and what its test asserts."""

import importlib.util
from pathlib import Path

from accelscope.core.lessons import lessons

ROOT = Path(__file__).resolve().parents[3]


def test_the_table_is_that_of_the_lessons():
    spec = importlib.util.spec_from_file_location("write_lessons", ROOT / ".ci/write_lessons.py")
    writer = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(writer)
    written = (ROOT / "LESSONS.md").read_text(encoding="utf-8")
    assert written == writer.text(), "run: make lessons"
    assert all(f"`{name}`" in written for name in lessons())
