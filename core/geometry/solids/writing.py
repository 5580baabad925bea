"""Descriptions of items as text, and read back: every number exactly.

A JSON list with a list for each item: the name of its kind, then its attributes in their order. So
what stands in a file for other programs can carry the items that it stands for.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import InputError
from .description import (
    Box,
    Cone,
    Disc,
    Item,
    MovingTriangle,
    Placed,
    Polygon,
    Sphere,
    Triangle,
)

KINDS: dict[str, type] = {
    kind.__name__: kind
    for kind in (Sphere, Cone, Box, Disc, Polygon, Triangle, MovingTriangle, Placed)
}


def to_json(items: Sequence[Item]) -> str:
    """Return descriptions as text."""
    return json.dumps([_listed(item) for item in items], separators=(",", ":"))


def _listed(item: Item) -> list[Any]:
    """Return the name and the attributes of an item as JSON takes them."""
    return [type(item).__name__, *(_plain(value) for value in item)]


def _plain(value: Any) -> Any:
    if type(value).__name__ in KINDS:
        return _listed(value)
    return value if isinstance(value, bool) else np.asarray(value, dtype=np.float64).tolist()


def from_json(text: str) -> list[Item]:
    """Return what :func:`to_json` has written.

    Whether there can be such items is found out where they are made, see :mod:`.making`.

    Raises
    ------
    InputError
        If the text is something else.
    """
    try:
        return [_described(each) for each in json.loads(text)]
    except (ValueError, TypeError, KeyError, IndexError, RecursionError) as error:
        raise InputError(f"a description of items is damaged ({error}); make it anew") from None


def _described(listed: list[Any]) -> Item:
    kind, values = KINDS[listed[0]], listed[1:]
    if kind is Placed:
        values[0] = _described(values[0])
    return kind(*values)
