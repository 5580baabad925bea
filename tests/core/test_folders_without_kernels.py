"""An edit of a lesson or of a workload must not cost anybody a compilation: neither has kernels."""

from __future__ import annotations

import ast
from pathlib import Path

import accelscope.core as core
import pytest
from accelscope.core.kernel_cache import WITHOUT_KERNELS

DECLARING = {"kernel", "inner", "inlined", "dispatched", "implements"}

COMPILING = {"njit", "jit", "vectorize", "guvectorize", "overload"}

CORE = Path(core.__file__).parent
FILES = sorted(path for folder in WITHOUT_KERNELS for path in (CORE / folder).rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(CORE)))
def test_a_file_declares_no_kernel(path):
    """The hash that names the cache of kernels leaves these folders out."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").endswith("kernels"):
            assert not DECLARING & {name.name for name in node.names}
        # A record may ask Numba for its version.
        if isinstance(node, ast.Attribute):
            assert node.attr not in COMPILING
