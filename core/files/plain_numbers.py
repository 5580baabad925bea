"""Numbers written in ASCII, read by kernels: what is not plain is left to Python.

A number is read here only if it comes out as Python would read it, to the last bit. A whole number
of 53 bits times or divided by a power of ten up to 22 does: both are exact in float64, and their
product or quotient is rounded once (W. D. Clinger: How to Read Floating Point Numbers Accurately,
1990). So are those with up to 15 digits.

The text is an array of bytes whose last one is a line feed: nothing reads beyond that.
"""

from __future__ import annotations

from ..kernels import inner

TAB, LINE_FEED, SPACE, PLUS, MINUS, POINT, SLASH = (ord(each) for each in "\t\n +-./")
FORM_FEED = 12
ZERO, LARGE_E, SMALL_E = ord("0"), ord("E"), ord("e")

LARGEST = 1 << 53
"""Up to here, all whole numbers are exact in float64."""

MOST_DIGITS = 18
"""So many digits are a number of 64 bits."""

POWERS = tuple(10.0**power for power in range(23))
"""Those powers of ten that are exact in float64."""


@inner
def is_blank(byte):
    """Say whether a byte is white space within a line."""
    return byte == SPACE or (TAB <= byte <= FORM_FEED and byte != LINE_FEED)


@inner
def after_blanks(data, at):
    """Return the next place without white space; that may be the end of the line."""
    while is_blank(data[at]):
        at += 1
    return at


@inner
def digits_at(data, at, number):
    """Return where the digits that begin at a place end, and `number` with them written behind."""
    digit = int(data[at]) - ZERO
    while 0 <= digit <= 9:
        number = 10 * number + digit
        at += 1
        digit = int(data[at]) - ZERO
    return at, number


@inner
def integer_at(data, at):
    """Return where the whole number that begins at a place ends, and it; -1 and 0 without one."""
    is_negative = data[at] == MINUS
    if is_negative or data[at] == PLUS:
        at += 1
    end, number = digits_at(data, at, 0)
    if end == at or end - at > MOST_DIGITS:
        return -1, 0
    return end, -number if is_negative else number


@inner
def float_at(data, at):
    """Return where the number that begins at a place ends, and it; -1 and 0.0 if it is not plain.

    Behind it has to be white space or the end of the line.
    """
    is_negative = data[at] == MINUS
    if is_negative or data[at] == PLUS:
        at += 1
    end, number = digits_at(data, at, 0)
    count, power = end - at, 0
    if data[end] == POINT:
        at = end + 1
        end, number = digits_at(data, at, number)
        power = at - end
        count -= power
    if not 0 < count <= MOST_DIGITS or number > LARGEST:
        return -1, 0.0
    if data[end] == SMALL_E or data[end] == LARGE_E:
        end, exponent = integer_at(data, end + 1)
        power += exponent
    if end < 0 or not (is_blank(data[end]) or data[end] == LINE_FEED):
        return -1, 0.0
    if not -len(POWERS) < power < len(POWERS):
        return -1, 0.0
    value = number * POWERS[power] if power >= 0 else number / POWERS[-power]
    return end, -value if is_negative else value
