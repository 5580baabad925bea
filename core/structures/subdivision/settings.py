"""Settings that the trees of this folder's family share."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...memory import MOST_NUMBERS
from ...settings import setting

ADVICE = "lower max_depth, raise max_leaf_size or set a budget or duplication"
"""What helps where a tree gets too large."""

WALK_TEXTS = {
    "march": "From the root, for every leaf (Glassner)",
    "segments": "One pass cuts the ray into segments by leaf, which are then processed",
    "neighbours": "From leaf to leaf through the face by which the ray leaves (Samet)",
    "recursive": "Depth-first with a stack, near children first",
    "heap": "Depth-first with a priority queue of cells",
}


def walk_setting(without: tuple[str, ...] = ()) -> Any:
    """Declare the walk; a tree may be `without` some of them."""
    return setting(
        "recursive",
        "Walk",
        "How the next leaf along a ray is found",
        choices={name: text for name, text in WALK_TEXTS.items() if name not in without},
    )


def links_setting() -> Any:
    """Declare how the walk `neighbours` finds the neighbour."""
    return setting(
        "found",
        "Links",
        "How a walk through neighbours gets to the one behind a leaf's face",
        choices={
            "found": "Up to the nearest common ancestor, then down: nothing is stored",
            "stored": "By ropes: every leaf has a pointer to the neighbour behind each face",
        },
        only_for={"walk": ("neighbours",)},
    )


def padding_setting(default: float = 0.001) -> Any:
    """Declare the enlargement of the root's cell."""
    return setting(
        default,
        "Padding",
        "Enlargement of the scene's box on each side, as a share of its size",
        minimum=0.0,
        maximum=10.0,
    )


def depth_setting() -> Any:
    """Declare the depth of a binary tree, which may follow from the number of triangles."""
    return setting(
        -1,
        "Max Depth",
        "Level K at which subdivision ends, the root has level 0; -1 for 8 + 1.3 log2 N of N "
        "triangles",
        unit="levels",
        minimum=-1,
        maximum=60,
        unset="auto",
    )


def depth_limit(max_depth: int, count: int) -> int:
    """Return the depth at which splitting ends in a scene of `count` triangles (pbrt's rule)."""
    return max_depth if max_depth >= 0 else round(8 + 1.3 * np.log2(count))


def duplication_setting(automatic: int, exception: str = "") -> Any:
    """Declare the limit of references per triangle (see :mod:`.frontier`).

    Parameters
    ----------
    automatic : int
        The limit that :func:`most_references` is given where none is set.
    exception : str, optional
        Where more is allowed, after the number.
    """
    return setting(
        -1.0,
        "Duplication",
        "Most references per triangle: a cell whose children would exceed its share is not cut; "
        f"0 sets no limit, -1 sets {automatic}{exception} where Max Depth is left open and none "
        "where it is given",
        minimum=-1.0,
        maximum=1e9,
        unset="auto",
    )


def most_references(duplication: float, max_depth: int, count: int, automatic: int) -> float:
    """Return how many references a tree over `count` triangles may have, inf for any number.

    Who gives a depth wants to see it, and without a limit gets it, whatever it costs.
    """
    if duplication < 0.0:
        duplication = automatic if max_depth < 0 else 0.0
    return duplication * count if duplication > 0.0 else np.inf


def leaf_size_setting(default: int) -> Any:
    """Declare M, the number of triangles that may stay together."""
    return setting(
        default,
        "Max Leaf Size",
        "A cell with at most these M triangles is not cut",
        unit="triangles",
        minimum=0,
        maximum=MOST_NUMBERS,
    )


def empty_bonus_setting(default: float, planes: tuple[str, ...]) -> Any:
    """Declare the bonus for cutting off empty space, of `planes` that go by cost."""
    return setting(
        default,
        "Empty Bonus",
        "Share of the cost that a plane with an empty side is let off",
        minimum=0.0,
        maximum=1.0,
        only_for={"planes": planes},
    )


def mailbox_setting() -> Any:
    """Declare the mailbox."""
    return setting(False, "Mailbox", "Test a triangle at most once per ray")
