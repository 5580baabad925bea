"""Numbers of the panel that end where their content ends: a frame, an event, a depth.

Limits of a Blender property are fixed when it is registered; how many events a ray has is known
much later. So such a number is three properties: the one that scripts and the panel use, which
shows and takes nothing beyond the end; a slider from 0 to 100%, which goes through all of the
content from one of its ends to the other, however much that is; and the number that is kept, which
may lie beyond the end: it is there again when the content grows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bpy.props import FloatProperty, IntProperty

MOST = 2**31 - 1

End = Callable[[Any], int | None]
"""Gets the group of a property and returns the last number there is, or None without content."""


def range_properties(
    name: str, end: End, *, label: str, default: int = 0, open_end: bool = False, **options: Any
) -> dict[str, Any]:
    """Return the three properties of a number by their names; its least value is 0.

    Parameters
    ----------
    name : str
        Of the number; the slider's is :func:`share_of` it.
    end : callable
        See End.
    label : str
        Name in the panel.
    open_end : bool
        At the last number it means "up to the end", also when the content grows.
    **options
        What else Blender is to know of number and slider, such as ``description``, ``update``.
    """
    kept = f"{name}_kept"

    def get(group: Any) -> int:
        last = end(group)
        return getattr(group, kept) if last is None else min(getattr(group, kept), last)

    def set_number(group: Any, number: int) -> None:
        last = end(group)
        if last is not None and number >= last:
            number = MOST if open_end else last
        setattr(group, kept, number)

    def get_share(group: Any) -> float:
        return 100.0 * get(group) / (end(group) or 1) if end(group) else 0.0

    def set_share(group: Any, share: float) -> None:
        set_number(group, round(share / 100.0 * (end(group) or 0)))

    return {
        # Not drawn on the screen: what it is, the number shows.
        kept: IntProperty(name=f"{label} Kept", default=default, min=0, options={"HIDDEN"}),
        name: IntProperty(
            name=label, min=0, soft_max=32, default=default, get=get, set=set_number, **options
        ),
        share_of(name): FloatProperty(
            name=label, subtype="PERCENTAGE", min=0.0, max=100.0, precision=0,
            get=get_share, set=set_share, **options,
        ),
    }  # fmt: skip


def share_of(name: str) -> str:
    """Return the name of the slider that belongs to a number."""
    return f"{name}_share"
