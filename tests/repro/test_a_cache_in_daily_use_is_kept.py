"""Kernels of a version that is used every day are kept, however long ago they were compiled.

Every start removes what no version has used for a month. Reading makes a directory no younger, so
one of two versions that were used in turn threw away what the other had compiled.
"""

import os
import time

import pytest
from accelscope.core import kernel_cache

MONTH = 31 * 86400.0
"""Seconds, a little more than what is thought forgotten."""


@pytest.fixture
def start(monkeypatch, tmp_path):
    """Pretend that a process of some version starts, and return where its kernels are."""
    numba = pytest.importorskip("numba")
    monkeypatch.setattr(numba.config, "CACHE_DIR", numba.config.CACHE_DIR)
    monkeypatch.setattr(kernel_cache, "_root", tmp_path)

    def start_one(version):
        monkeypatch.setattr(kernel_cache, "_fingerprint", lambda: version)
        monkeypatch.setattr(kernel_cache, "_is_prepared", False)
        assert kernel_cache._prepare()
        return tmp_path / version

    return start_one


def let_a_month_pass(*folders):
    for folder in folders:
        then = folder.stat().st_mtime - MONTH
        os.utime(folder, (then, then))


def test_two_versions_used_in_turn_keep_each_other(start):
    ours, other = start("ours"), start("other")
    for folder in (ours, other):
        (folder / "kernel.nbc").write_bytes(b"compiled long ago, only read since")
    for _ in range(3):
        let_a_month_pass(ours)
        start("ours")
        let_a_month_pass(other)
        start("other")
        assert (ours / "kernel.nbc").exists()
        assert (other / "kernel.nbc").exists()
    assert time.time() - other.stat().st_mtime < 3600.0


def test_one_that_is_not_used_any_more_goes(start):
    ours, forgotten = start("ours"), start("forgotten")
    start("ours")
    assert forgotten.exists()
    let_a_month_pass(forgotten)
    start("ours")
    assert ours.exists()
    assert not forgotten.exists()
