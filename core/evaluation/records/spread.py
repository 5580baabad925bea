"""The spread of a counter over rays: mean, minimum, median, 99th percentile, maximum.

Of a million rays no two hundred have different counts, so how often each count occurs tells all of
it, and is found without sorting the rays.
"""

from __future__ import annotations

import numpy as np


def spread(counts: np.ndarray) -> dict[str, float]:
    """Return what is said of a counter over rays.

    Parameters
    ----------
    counts : (n,) int64
        Of each ray, not negative; n > 0.

    Returns
    -------
    dict
        ``mean``, ``minimum``, ``median``, ``p99``, ``maximum``. A percentile between two counts
        lies on the line between them, as in :func:`numpy.percentile`.
    """
    n = len(counts)
    different, times = occurrences(counts)
    ends = np.cumsum(times)

    def percentile(share: float) -> float:
        place = share * (n - 1)
        below = int(place)
        ranks = np.array([below, min(below + 1, n - 1)])
        low, high = different[np.searchsorted(ends, ranks, side="right")].tolist()
        return float(np.quantile([low, high], place - below))

    return {
        "mean": int((different * times).sum()) / n,
        "minimum": float(different[0]),
        "median": percentile(0.5),
        "p99": percentile(0.99),
        "maximum": float(different[-1]),
    }


def occurrences(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the different numbers among `counts`, ascending, and how often each occurs."""
    if counts.max() > 4 * len(counts):  # a table of all numbers would be mostly empty
        return np.unique(counts, return_counts=True)
    table = np.bincount(counts)
    different = np.flatnonzero(table)
    return different, table[different]
