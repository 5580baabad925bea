"""Reading descriptions: their numbers as arrays, or what is wrong with them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import InputError

LARGEST = 1e100
"""As of scenes: products of three coordinates are in the range of float64."""


class Part:
    """Items of one kind on their way to the kernels.

    Attributes
    ----------
    items : list
    numbers : (k,) int64
        Their places among all items.
    """

    def __init__(self, items: list[Any], numbers: list[int]) -> None:
        self.items = items
        self.numbers = np.array(numbers)

    def read(self, what: str, shape: tuple[int, ...], *names: str) -> np.ndarray:
        """Return attributes of all items in one array, (k, *shape); of several, (k, names, *shape).

        Raises
        ------
        InputError
            If one is of another shape, not finite or too large.
        """
        columns = []
        for name in names:
            given = [getattr(item, name) for item in self.items]
            try:
                column = np.array(given, dtype=np.float64)
            except (TypeError, ValueError):
                column = np.empty(())
            if column.shape != (len(given), *shape):
                is_bad = np.array([not _has_shape(one, shape) for one in given])
                size = " x ".join(str(n) for n in shape)
                self.refuse(is_bad, f"{what} must be {size + ' numbers' if size else 'one number'}")
            columns.append(column)
        values = columns[0] if len(names) == 1 else np.stack(columns, axis=1)
        self.refuse(
            ~(np.abs(values) < LARGEST).reshape(len(values), -1).all(axis=1),
            f"{what} must be finite and below {LARGEST:g}; repair or scale it",
        )
        return values

    def refuse(self, is_bad: np.ndarray, why: str) -> None:
        """Raise InputError for the first item that is bad, (k,) bool."""
        if is_bad.any():
            raise InputError(f"item {self.numbers[is_bad.argmax()]}: {why}")


def _has_shape(values: Any, shape: tuple[int, ...]) -> bool:
    try:
        return np.array(values, dtype=np.float64).shape == shape
    except (TypeError, ValueError):
        return False
