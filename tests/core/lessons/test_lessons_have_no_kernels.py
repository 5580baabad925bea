"""An edit of a lesson must not cost anybody a compilation: lessons have no kernels of their own."""

from __future__ import annotations

import ast
from pathlib import Path

import accelscope.core.lessons as lessons
import pytest

DECLARING = {"kernel", "inner", "inlined", "dispatched", "implements"}

FILES = sorted(Path(lessons.__file__).parent.rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_lesson_declares_no_kernel(path):
    """The hash that names the cache of kernels leaves the folder out."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").endswith("kernels"):
            assert not DECLARING & {name.name for name in node.names}
        if isinstance(node, ast.Import):
            assert not any(name.name.startswith("numba") for name in node.names)
