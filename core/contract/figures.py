"""Figures: what can be said of a built structure, and how that is called and shown.

A structure declares its own in ``Structure.FIGURES``, beside those that many have; its statistics
hold the values. Records, tables, the panel, pages and documents take names, labels and units from
there, and show no row that the structure does not have.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple


class Figure(NamedTuple):
    """One figure of a structure.

    Attributes
    ----------
    key : str
        Its name in the statistics; dots lead into mappings.
    meaning : str
        One sentence without a full stop.
    label : str
        Of its row; a figure without one is in records only.
    unit : str
        How a value is shown: ``""`` for a plain number, ``"count"``, ``"bytes"``.
    section : str
        Title over the row.
    column : str
        Title of its column in tables; without one it has none.
    """

    key: str
    meaning: str
    label: str = ""
    unit: str = ""
    section: str = "Structure"
    column: str = ""

    @property
    def path(self) -> list[str]:
        """Where its value stands in the statistics."""
        return self.key.split(".")


N_IN = Figure("N_IN", "inner nodes", "N_IN inner nodes", "count")
N_V = Figure("N_V", "leaves or elementary cells", "N_V leaves", "count", column="N_V")
N_EV = Figure("N_EV", "empty ones among those", "N_EV empty leaves", "count")
N_OIV = Figure(
    "N_OIV", "references to triangles in all leaves", "N_OIV references", "count", column="N_OIV"
)
MAX_DEPTH = Figure("max_depth", "depth of the deepest leaf; the root has 0", "Max depth", "count")
MEAN_LEAF_SIZE = Figure("mean_leaf_size", "N_OIV / N_V", "Mean leaf size")
SAH = Figure(
    "sah",
    "(C_trav x area of inner nodes + C_isect x area of leaves x triangles in them) / area of the "
    "root",
    "SAH cost",
    column="SAH",
)
C_TRAV = Figure("sah_constants.C_trav", "constant of `sah`", "C_trav")
C_ISECT = Figure("sah_constants.C_isect", "constant of `sah`", "C_isect")
EXPECTED_INNER = Figure(
    "expected_inner", "inner nodes that an endless random line through the root meets on average"
)
EXPECTED_LEAVES = Figure("expected_leaves", "leaves that such a line meets")
EXPECTED_TESTS = Figure("expected_tests", "triangles in the leaves that such a line meets")
EXPECTED_VOLUME_TESTS = Figure("expected_volume_tests", "volumes that are tested for such a line")
LEAF_SIZES = Figure("leaf_sizes", "number of leaves by their size")
DEPTHS = Figure("depths", "number of leaves by their depth")
LIST_SHARE = Figure("list_share", "mean_list / number of items", "Mean list / N", section="Lists")
REFERENCES_KEPT = Figure(
    "references_kept", "references that are stored: cells may share lists", "References stored",
    "count", section="Lists",
)  # fmt: skip

OF_CELLS = N_V, N_EV, N_OIV, MEAN_LEAF_SIZE
"""Of what has cells, and no inner nodes."""

OF_TREE = N_IN, N_V, N_EV, N_OIV, MAX_DEPTH, MEAN_LEAF_SIZE
"""Of what has inner nodes, too."""

COST_OF_CELLS = SAH, C_ISECT, EXPECTED_LEAVES, EXPECTED_TESTS, LEAF_SIZES

COST_OF_TREE = (
    SAH, C_TRAV, C_ISECT, EXPECTED_INNER, EXPECTED_LEAVES, EXPECTED_TESTS, LEAF_SIZES, DEPTHS
)  # fmt: skip


def look_up(values: Mapping[str, Any], path: Sequence[str]) -> Any:
    """Return the value at a path of keys, None where there is no such part."""
    value: Any = values
    for name in path:
        value = value.get(name) if isinstance(value, Mapping) else None
    return value


def of_keys(values: Mapping[str, Any], figures: tuple[Figure, ...]) -> dict[str, Any]:
    """Return those of some values that figures are declared of, nested as they were.

    What a structure has under some of its settings only may be missing.
    """
    chosen: dict[str, Any] = {}
    for figure in figures:
        *outer, last = path = figure.path
        value = look_up(values, path)
        if value is not None:
            place = chosen
            for name in outer:
                place = place.setdefault(name, {})
            place[last] = value
    return chosen
