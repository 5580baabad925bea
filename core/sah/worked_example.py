"""The lecture's worked example of the surface area heuristic: planes I, II, III, X and III+X.

76 triangles in a volume V, t_tra = 3, t_tri = 1. Planes I, II and III cut V across the same axis;
X cuts the right half of III across another one ("One more level"). The slides print the numbers:

    case     N_L, N_R    p_L, p_R      Cost printed   from the printed p
    V              76                          76.0               76.000
    I          8,  68    0.28, 0.91            67.1               67.120
    II        12,  64    0.52, 0.67            52.1               52.120
    III       12,  64    0.90, 0.29            32.4               32.360
    X          4,  60    0.78, 0.40            30.0               30.120
    III+X                                      22.5               22.535

X alone would be printed as 30.1; the slide's p must have been rounded. A plane that halves a space
has p_L + p_R - 1 = 2 A_cut / SA(V). That is 0.19 for I, II and III, as it must be for parallel
planes, and 0.18 for X. There is a box with exactly these shares, up to its size: BOX. In it the
planes lie at 1/9, 11/27 and 71/81 of the length, and X at 30/41 of the height.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..progress import SILENT, Progress
from .split_plane import SplitPlane, evaluate_plane, sort_along

T_TRA, T_TRI = 3.0, 1.0

LENGTH = 81.0
"""Extent of V across the planes I, II and III: with 81 units they lie at whole numbers."""

HEIGHT = 10.0 * 0.19 / (0.18 * 0.29)
"""Extent across X. The right half of III is 10 long and has the area 0.29 SA(V): so 0.18 of it is
twice the cut by X, where 0.19 of SA(V) is twice the cut by III."""

DEPTH = 19.0 * HEIGHT / (HEIGHT - 19.0)
"""Extent along all planes, from 0.19 SA(V) = 2 DEPTH HEIGHT."""

BOX = np.array([0.0, 0.0, 0.0, LENGTH, DEPTH, HEIGHT])

PLANES = {"I": (0, 9.0), "II": (0, 33.0), "III": (0, 71.0), "X": (2, HEIGHT * 30.0 / 41.0)}
"""Axis and position of each plane in BOX."""

PRINTED = {"V": 76.0, "I": 67.1, "II": 52.1, "III": 32.4, "X": 30.0, "III+X": 22.5}
"""Costs as the slides print them."""

N = 76


@dataclass(frozen=True)
class Case:
    """One case of the example, computed.

    Attributes
    ----------
    name : str
    box : (6,) float64
        What is divided.
    planes : tuple of SplitPlane
        None of them for V, two for III+X.
    cost : float
    formula : str
        How the cost comes about, with its numbers.
    """

    name: str
    box: np.ndarray
    planes: tuple[SplitPlane, ...]
    cost: float
    formula: str


def is_worked_example(count: int, box: np.ndarray) -> bool:
    """Say whether triangles are those of the example, of any size and at any place.

    They come from a Blender scene as well, in single precision: what counts is the number of
    triangles and the shape of the box.
    """
    size = box[3:] - box[:3]
    shape = BOX[3:] * (size[0] / LENGTH)
    return count == N and bool(np.allclose(size, shape, rtol=1e-5, atol=0.0))


def cases_of(boxes: np.ndarray, box: np.ndarray, progress: Progress = SILENT) -> list[Case]:
    """Return the six cases for the triangles of the example, or for others.

    Of others, the planes lie at the same shares of their box, across its longest side, and X across
    the longer other side of what III leaves on the right.

    Parameters
    ----------
    boxes : (n, 6) float64
        Boxes of the triangles.
    box : (6,) float64
        V.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    count = len(boxes)
    first, second = PLANES["III"][0], PLANES["X"][0]
    if not is_worked_example(count, box):
        size = box[3:] - box[:3]
        first = int(np.argmax(size))
        second = max({0, 1, 2} - {first}, key=lambda axis: size[axis])

    def plane_of(name: str, inside: np.ndarray, among: np.ndarray) -> SplitPlane:
        of_example, position = PLANES[name]
        axis = first if name != "X" else second
        extent = box[3 + axis] - box[axis]
        position = box[axis] + position / BOX[3 + of_example] * extent
        return evaluate_plane(sort_along(among, axis, progress), inside, position, T_TRA, T_TRI)

    found = [Case("V", box, (), T_TRI * count, f"{T_TRI:g} × {count}")]
    for name in ("I", "II", "III"):
        plane = plane_of(name, box, boxes)
        found.append(Case(name, box, (plane,), plane.cost, formula_of(plane)))
    third = found[-1].planes[0]
    right = box.copy()
    right[third.axis] = third.position
    in_right = boxes[:, third.axis] + boxes[:, 3 + third.axis] >= 2.0 * third.position
    x = plane_of("X", right, boxes[in_right])
    found.append(Case("X", right, (x,), x.cost, formula_of(x)))
    both = T_TRA + third.p_L * T_TRI * third.N_L + third.p_R * x.cost
    text = f"{T_TRA:g} + {third.p_L:.2f} × {third.N_L} + {third.p_R:.2f} × {x.cost:.2f}"
    found.append(Case("III+X", box, (third, x), both, text))
    return found


def formula_of(plane: SplitPlane) -> str:
    """Return the cost of a plane as the slide's formula with its numbers."""
    return (
        f"{T_TRA:g} + {T_TRI:g} × ({plane.p_L:.2f} × {plane.N_L} + {plane.p_R:.2f} × {plane.N_R})"
    )
