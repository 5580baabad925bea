# SPDX-License-Identifier: GPL-3.0-or-later
"""Write LESSONS.md: every slide with its lessons, and what their tests assert.

    python .ci/write_lessons.py

What a test asserts is told by the first sentence of its file, behind the name of the lesson. The
file is called like the module of the lesson, or that sentence names it. A test
holds the file against what this writes.
"""

from __future__ import annotations

import ast
import importlib
import pkgutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from accelscope.core.lessons.lesson import Lesson

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "LESSONS.md"
TESTS = ROOT / "tests" / "core" / "lessons"

HEAD = """# The lessons, slide by slide

Written by `make lessons` from the lessons themselves and from their tests. Each is taught in
Blender (AccelScope, Lessons, Teach) and played by `accelscope lesson NAME`; its test is in
`tests/core/lessons`. What every lesson has to keep is asserted of all of them: its words are there,
every knob changes the picture, pictures do not depend on those before, playing can be cancelled.

| Slide | Lesson | Name | What its test asserts |
|---|---|---|---|
"""


def modules_of_lessons() -> dict[str, str]:
    """Return the module of every lesson, by name."""
    from accelscope.core import lessons

    found = {}
    for module in pkgutil.iter_modules(lessons.__path__):
        loaded = importlib.import_module(f"{lessons.__name__}.{module.name}")
        found |= {lesson.name: module.name for lesson in getattr(loaded, "LESSONS", ())}
    return found


def claim_of(lesson: Lesson, module: str) -> str:
    """Return what the test of a lesson asserts.

    Raises
    ------
    LookupError
        If there is no test of it.
    """
    own = TESTS / f"test_{module}.py"
    paths = [own] if own.is_file() else sorted(TESTS.glob("test_*.py"))
    for path in paths:
        told = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or ""
        if path == own or f'"{lesson.name}"' in told:
            sentence = " ".join(told.partition("\n\n")[0].split())
            _, _, claim = sentence.partition(": ")
            return (claim or sentence).removesuffix(".")
    raise LookupError(f"no test of the lesson {lesson.name}")


def text() -> str:
    """Return what LESSONS.md has to hold."""
    from accelscope.core.lessons import lessons

    modules = modules_of_lessons()
    rows = [
        f"| {lesson.slide} | {lesson.label} | `{lesson.name}` | "
        f"{claim_of(lesson, modules[lesson.name])} |\n"
        for lesson in lessons().values()
    ]
    return HEAD + "".join(rows)


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
    sys.stdout.write(f"{PAGE.name} written\n")
