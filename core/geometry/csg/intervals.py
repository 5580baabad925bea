"""Where a ray is inside: the crossings of two operands, merged by a sweep along the ray.

What a line is inside of is a list of *crossings*, each t larger than the one before; the first
leads inside, the next outside, and so on. Two numbers stand for each: its t, and the primitive
whose surface is crossed. The lists of the operands that are known lie on a stack, one after the
other.

Crossings of both operands at the same t are one step of the sweep. So faces in the same plane leave
no sliver between them, and of what only touches nothing is left.
"""

from __future__ import annotations

import numpy as np

from ...kernels import inner, whole
from .trees import DIFFERENCE, UNION


@inner
def combined(operation, inside_left, inside_right):
    """Say whether a point is in a node, from whether it is in its operands."""
    if operation == UNION:
        return inside_left or inside_right
    if operation == DIFFERENCE:
        return inside_left and not inside_right
    return inside_left and inside_right


@inner
def merge(operation, stack, base, n_left, n_right):
    """Replace two lists on the stack by that of a set operation; return its number of crossings.

    Parameters
    ----------
    stack : (2 n,) float64
        t and primitive of every crossing; behind both lists there is room for as many once more.
    base : int
        Crossing with which the left list begins; the right one follows it.
    """
    left, right = whole(base), whole(base + n_left)
    end_left, end_right = right, whole(right + n_right)
    out, inside = end_right, False
    inside_left, inside_right = False, False
    while left < end_left or right < end_right:
        t_left = stack[2 * left] if left < end_left else np.inf
        t_right = stack[2 * right] if right < end_right else np.inf
        takes_left = left < end_left and (t_left <= t_right or right >= end_right)
        takes_right = right < end_right and (t_right <= t_left or left >= end_left)
        # Of both, that of the left is named: its primitives have the lower numbers.
        t, primitive = t_left, 0.0
        if takes_right:
            t, primitive = t_right, stack[2 * right + 1]
            inside_right = not inside_right
            right += 1
        if takes_left:
            t, primitive = t_left, stack[2 * left + 1]
            inside_left = not inside_left
            left += 1
        is_inside = combined(operation, inside_left, inside_right)
        if is_inside != inside:
            inside = is_inside
            stack[2 * out], stack[2 * out + 1] = t, primitive
            out += 1
    count = out - end_right
    for i in range(2 * count):
        stack[2 * base + i] = stack[2 * end_right + i]
    return count


@inner
def put_in_order(stack, base, count):
    """Sort crossings of a surface by t, and leave one of an odd number at the same t, else none.

    Returns
    -------
    int
        How many are left: an even number.
    """
    for i in range(base + 1, base + count):
        t, primitive, place = stack[2 * i], stack[2 * i + 1], i
        while place > base and (
            stack[2 * place - 2] > t
            or (stack[2 * place - 2] == t and stack[2 * place - 1] > primitive)
        ):
            stack[2 * place], stack[2 * place + 1] = stack[2 * place - 2], stack[2 * place - 1]
            place -= 1
        stack[2 * place], stack[2 * place + 1] = t, primitive
    kept, i = base, base
    while i < base + count:
        last = i
        while last + 1 < base + count and stack[2 * (last + 1)] == stack[2 * i]:
            last += 1
        if (last - i) % 2 == 0:
            stack[2 * kept], stack[2 * kept + 1] = stack[2 * i], stack[2 * i + 1]
            kept += 1
        i = last + 1
    return kept - base


@inner
def first_crossing(stack, base, count, t_min, thin):
    """Return the t and the primitive of the first crossing from t_min on; inf where there is none.

    Parameters
    ----------
    thin : float
        Crossings nearer to each other than this are rounding apart: an even number of them is none,
        an odd number is one. So what is left of two faces that were meant to be the same is no hit.
    """
    i = base
    while i < base + count:
        last = i
        while last + 1 < base + count and stack[2 * last + 2] - stack[2 * last] <= thin:
            last += 1
        if (last - i) % 2 == 0 and t_min <= stack[2 * i] < np.inf:
            return stack[2 * i], whole(stack[2 * i + 1])
        i = last + 1
    return np.inf, whole(-1)
