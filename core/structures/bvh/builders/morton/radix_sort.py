"""Radix sort, as graphics cards do it: by one digit after the other, from the lowest.

A pass sorts by one digit and leaves equal digits in the order in which they were, so after the pass
over the highest digit everything is sorted. Many threads take part, each with a block of the codes:

1. each counts how often every digit occurs in its block, a *histogram*;
2. an *exclusive prefix sum* over all histograms, digit by digit and for each block by block, turns
   counts into places: so many codes come before the first with this digit from this block;
3. each thread *scatters* its codes to their places.

With digits of one bit this is the lecture's parallel radix-2 sort, made of :func:`split`.

N. Satish, M. Harris, M. Garland: Designing Efficient Sorting Algorithms for Manycore GPUs, IPDPS
2009. G. E. Blelloch: Prefix Sums and Their Applications, 1990 (the split primitive).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .....kernels import call, kernel
from .....parallel import BLOCK, Team

DIGIT = 11
"""Bits of a digit: few passes, and places of all digits that still fit into the nearest cache."""


@kernel
def count_digits(codes, shift, counts, first, last):
    """Count in `counts`, (digits,), how often each digit occurs in a block."""
    for i in range(first, last):
        counts[codes[i] >> shift & len(counts) - 1] += 1


@kernel
def scatter(codes, order, shift, places, codes_out, order_out, first, last):
    """Move a block's codes to their places; `places`, (digits,), is where the next one goes."""
    for i in range(first, last):
        digit = codes[i] >> shift & len(places) - 1
        place = places[digit]
        places[digit] = place + 1
        codes_out[place], order_out[place] = codes[i], order[i]


def passes(codes: np.ndarray, bits: int, team: Team) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield codes, (n,) int64, and their order, (n,) int32, after each pass.

    The arrays change in the pass after the next. `codes` is used up.

    Parameters
    ----------
    codes : (n,) int64
        Not negative.
    bits : int
        Length of the codes.
    """
    now = codes, np.arange(len(codes), dtype=np.int32)
    out = np.empty_like(codes), np.empty(len(codes), np.int32)
    for shift in range(0, bits, DIGIT):
        sort_by_digit(*now, shift, *out, team)
        now, out = out, now
        yield now


def sort_by_digit(
    codes: np.ndarray,
    order: np.ndarray,
    shift: int,
    codes_out: np.ndarray,
    order_out: np.ndarray,
    team: Team,
) -> None:
    """Make one pass, over the digit that begins at bit `shift`."""
    counts = np.zeros((-(-len(codes) // BLOCK), 1 << DIGIT), np.int64)

    def count_block(first: int, last: int) -> None:
        call(count_digits, codes, shift, counts[first // BLOCK], first, last)

    team.run(count_block, len(codes))
    # Digit by digit, and for each block by block.
    before = np.cumsum(counts.T) - counts.T.ravel()
    places = np.ascontiguousarray(before.reshape(-1, len(counts)).T)

    def scatter_block(first: int, last: int) -> None:
        place = places[first // BLOCK]
        call(scatter, codes, order, shift, place, codes_out, order_out, first, last)

    team.run(scatter_block, len(codes))


def radix_sort(codes: np.ndarray, bits: int, team: Team) -> tuple[np.ndarray, np.ndarray]:
    """Sort codes; equal ones stay in order. `codes` is used up.

    Parameters
    ----------
    codes : (n,) int64
        Not negative.
    bits : int
        Length of the codes.

    Returns
    -------
    codes : (n,) int64
    order : (n,) int32
        Where each code was.

    Raises
    ------
    Cancelled
        From the team's progress.
    """
    *_, result = passes(codes, bits, team)
    return result


def split(codes: np.ndarray, bit: int) -> np.ndarray:
    """Return where every code goes in the pass over one bit: zeros first, then ones, in order.

    Every code finds its place on its own, from a prefix sum: a zero goes behind the zeros before
    it, a one behind all zeros and the ones before it.

    Parameters
    ----------
    codes : (n,) int64
    bit : int
        Number of the bit, 0 is the lowest.

    Returns
    -------
    (n,) int64
    """
    is_zero = 1 - (codes >> bit & 1)
    zeros_before = np.cumsum(is_zero) - is_zero
    ones_before = np.arange(len(codes)) - zeros_before
    return np.where(is_zero, zeros_before, is_zero.sum() + ones_before)
