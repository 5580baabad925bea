"""Selection: the value of a rank without sorting (C. A. R. Hoare, CACM 4(7), 1961)."""

from __future__ import annotations

from ...kernels import inner


@inner
def select(values, first, last, rank):
    """Return the value at place `rank` if ``values[first:last + 1]`` were sorted (Hoare)."""
    while first < last:
        pivot = values[(first + last) // 2]
        i, j = first, last
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if rank <= j:
            last = j
        elif rank >= i:
            first = i
        else:
            break
    return values[rank]
