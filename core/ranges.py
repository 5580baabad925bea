"""Runs of numbers in one array: what lists stored one behind the other are picked with."""

from __future__ import annotations

import numpy as np


def ranges(begins: np.ndarray | int, sizes: np.ndarray) -> np.ndarray:
    """Return ``begin, ..., begin + size - 1`` of all ranges, one behind the other.

    Parameters
    ----------
    begins : (n,) int, or int
        One for all gives the rank of each number in its own range.
    sizes : (n,) int
        0 is a range of nothing.

    Returns
    -------
    (sum of sizes,) int64
    """
    ends = np.cumsum(sizes, dtype=np.int64)
    total = ends[-1] if len(ends) else 0
    return np.arange(total, dtype=np.int64) + np.repeat(begins - (ends - sizes), sizes)


def longer(array: np.ndarray, length: int) -> np.ndarray:
    """Return a copy of an array with room for `length` rows; those that are new are zero."""
    new = np.zeros((length, *array.shape[1:]), array.dtype)
    new[: len(array)] = array
    return new
