"""The film of a picture: its samples, where they lie, and what was seen there.

Each pixel has side x side places for samples. A fixed number of samples takes all of them. Adaptive
ones begin with one for each pixel. Where cells beside each other differ, in the object that they
see or in its colour, both are divided into four, of which one keeps the sample, until a cell is one
place (T. Whitted, CACM 23(6), 1980, divides where the corners of a square differ). So samples are
among those of the fixed number, and where all cells are divided they are the same.
"""

from __future__ import annotations

import numpy as np

ROUNDING = 1e-12
"""Sums in another order differ by less."""

NOTHING = -1
"""The object that is seen where nothing is hit."""


class Film:
    """Samples of a picture.

    Attributes
    ----------
    colours : (n, 3) float64
        What each sample has seen so far.
    """

    def __init__(self, width: int, height: int, side: int, is_adaptive: bool) -> None:
        self.width, self.height, self.side = width, height, side
        self.size = side if is_adaptive else 1  # of the largest cell, in places
        x = np.arange(0, width * side, self.size, dtype=np.int32)
        y = np.arange(0, height * side, self.size, dtype=np.int32)
        self._x, self._y = np.tile(x, len(y)), np.repeat(y, len(x))
        self._sizes = np.full(len(self._x), self.size, dtype=np.int32)
        self.colours = np.zeros((len(self._x), 3))
        self._objects = np.full(len(self._x), NOTHING, dtype=np.int64)
        self._is_adaptive = is_adaptive

    def __len__(self) -> int:
        return len(self.colours)

    def places(self, first: int = 0) -> np.ndarray:
        """Return the places of the samples from a number on, counted row by row over the film."""
        return self._y[first:].astype(np.int64) * (self.width * self.side) + self._x[first:]

    def pixels(self, first: int = 0) -> np.ndarray:
        """Return the pixels of the samples from a number on, counted row by row."""
        rows = (self._y[first:] // self.side).astype(np.int64)
        return rows * self.width + self._x[first:] // self.side

    def see(self, samples: np.ndarray, objects: np.ndarray) -> None:
        """Take the objects, NOTHING for none, that samples see."""
        self._objects[samples] = objects

    def add(self, samples: np.ndarray, amounts: np.ndarray) -> None:
        """Add amounts, (n, 3), to samples, one after the other; some may be named often."""
        for channel in range(3):
            self.colours[:, channel] += np.bincount(samples, amounts[:, channel], len(self))

    def divide(self, contrast: float) -> bool:
        """Divide the cells that differ from a neighbour; say whether there are new samples.

        Parameters
        ----------
        contrast : float
            How much one of the three colours, up to 1, must differ.
        """
        if not self._is_adaptive or self.size == 1:
            return False
        self.size //= 2  # a cell that differs only now may be divided as often as there is left
        chosen = np.flatnonzero(self._differing(contrast) & (self._sizes > 1))
        half = self._sizes[chosen] // 2
        self._sizes[chosen] = half
        x, y = self._x[chosen], self._y[chosen]
        # Those of one cell beside each other: right, below, and both.
        self._x = np.concatenate([self._x, np.stack([x + half, x, x + half], axis=1).ravel()])
        self._y = np.concatenate([self._y, np.stack([y, y + half, y + half], axis=1).ravel()])
        self._sizes = np.concatenate([self._sizes, np.repeat(half, 3)])
        count = 3 * len(chosen)
        self.colours = np.concatenate([self.colours, np.zeros((count, 3))])
        self._objects = np.concatenate([self._objects, np.full(count, NOTHING)])
        return count > 0

    def _differing(self, contrast: float) -> np.ndarray:
        """Say which samples differ from one beside them, (n,) bool."""
        owners = self._owners()
        shown = np.minimum(self.colours, 1.0)
        differs = np.zeros(len(self), dtype=bool)
        for one, other in ((owners[:, :-1], owners[:, 1:]), (owners[:-1], owners[1:])):
            between = one != other
            a, b = one[between], other[between]
            is_edge = self._objects[a] != self._objects[b]
            is_edge |= (np.abs(shown[a] - shown[b]) > contrast).any(axis=1)
            differs[a[is_edge]] = differs[b[is_edge]] = True
        return differs

    def _owners(self) -> np.ndarray:
        """Return the number of the sample whose cell each place lies in, (rows, columns) int32."""
        owners = np.empty((self.height * self.side, self.width * self.side), dtype=np.int32)
        for size in np.unique(self._sizes):
            of_size = np.flatnonzero(self._sizes == size).astype(np.int32)
            within = np.arange(size)
            rows = self._y[of_size, None, None] + within[:, None]
            columns = self._x[of_size, None, None] + within
            owners[rows, columns] = of_size[:, None, None]
        return owners

    def picture(self) -> np.ndarray:
        """Return the mean of each pixel's cells, (height, width, 3) float64."""
        shares = (self._sizes / self.side) ** 2
        pixels, count = self.pixels(), self.width * self.height
        channels = [np.bincount(pixels, shares * each, count) for each in self.colours.T]
        return np.stack(channels, axis=1).reshape(self.height, self.width, 3)

    def samples(self) -> np.ndarray:
        """Return how many samples each pixel has, (height, width) int64."""
        count = self.width * self.height
        return np.bincount(self.pixels(), minlength=count).reshape(self.height, self.width)


def error_of(picture: np.ndarray, right: np.ndarray) -> tuple[float, float]:
    """Return by how much a picture is off, as shown: root of the mean square, and the maximum."""
    off = np.abs(np.minimum(picture, 1.0) - np.minimum(right, 1.0))
    off[off < ROUNDING] = 0.0
    return float(np.sqrt(np.square(off).mean())), float(off.max())
