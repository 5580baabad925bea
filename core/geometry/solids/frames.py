"""Half-axes: how what lives in unit space gets there.

A sphere, cone, box or disc is described by a centre and three half-axes: where the origin and the
unit vectors of unit space lie. A matrix that it is seen through moves them along. The matrix into
unit space is the inverse; its rows are found from half-axes of unit length, so that it is as good
for a needle as for a ball. If half-axes are linearly dependent, or zero, there is none: it is made
zero, and the item is never hit, as a triangle of zero area is.
"""

from __future__ import annotations

import numpy as np

from .description import Box, Cone, Disc, Sphere
from .mixed import BOX, CAPPED, CENTRE, CONE, DISC, MATRIX, SHAPE, SPHERE, Mixed
from .reading import Part

EPS = np.finfo(np.float64).eps

DEPENDENT = 8 * EPS
"""Half-axes whose unit vectors span less volume than this are linearly dependent, but for what is
rounded."""

OUTWARD = 16 * EPS
"""By how much, relatively, a box grows whose size is rounded; four products and sums, with room."""


def sphere_frames(mixed: Mixed, part: Part) -> tuple[np.ndarray, np.ndarray]:
    """Return centres and half-axes, (k, 3) and (k, 3, 3); half-axes are columns."""
    centres, radii = part.read("the centre", (3,), "centre"), part.read("the radius", (), "radius")
    part.refuse(radii < 0.0, "a radius must not be negative")
    mixed.kinds[part.numbers] = SPHERE
    return centres, np.eye(3) * radii[:, None, None]


def cone_frames(mixed: Mixed, part: Part) -> tuple[np.ndarray, np.ndarray]:
    """Return centres and half-axes; write the radii, in units of the power of 2 above them."""
    ends = part.read("an end of the axis", (3,), "base", "apex")
    radii = part.read("a radius", (), "base_radius", "apex_radius")
    part.refuse((radii < 0.0).any(axis=1), "a radius must not be negative")
    half = 0.5 * (ends[:, 1] - ends[:, 0])
    part.refuse(
        ~half.any(axis=1), "the axis of a cone is zero; make base and apex differ, or use a disc"
    )
    unit = power_of_two(radii.max(axis=1))
    mixed.kinds[part.numbers] = CONE
    mixed.rows[part.numbers, SHAPE, :2] = radii / np.where(unit > 0.0, unit, 1.0)[:, None]
    mixed.rows[part.numbers, CAPPED, 0] = [bool(cone.is_capped) for cone in part.items]
    u, v = across(units_of(half)[0])
    half_axes = np.stack([u * unit[:, None], v * unit[:, None], half], axis=2)
    return 0.5 * ends[:, 0] + 0.5 * ends[:, 1], half_axes


def box_frames(mixed: Mixed, part: Part) -> tuple[np.ndarray, np.ndarray]:
    """Return centres and half-axes."""
    bounds = part.read("a corner of the box", (3,), "lower", "upper")
    part.refuse(
        (bounds[:, 0] > bounds[:, 1]).any(axis=1),
        "the lower corner of a box must not be above the upper one; exchange them",
    )
    half = 0.5 * bounds[:, 1] - 0.5 * bounds[:, 0]
    mixed.kinds[part.numbers] = BOX
    return 0.5 * bounds[:, 0] + 0.5 * bounds[:, 1], half[:, None, :] * np.eye(3)


def disc_frames(mixed: Mixed, part: Part) -> tuple[np.ndarray, np.ndarray]:
    """Return centres and half-axes; of the last, along the normal, only the direction counts."""
    placed = part.read("centre and normal", (3,), "centre", "normal")
    radii = part.read("the radius", (), "radius")
    part.refuse(radii < 0.0, "a radius must not be negative")
    part.refuse(~placed[:, 1].any(axis=1), "the normal of a disc is zero; give it a direction")
    mixed.kinds[part.numbers] = DISC
    u, v = across(units_of(placed[:, 1])[0])
    half_axes = np.stack([u * radii[:, None], v * radii[:, None], np.zeros_like(u)], axis=2)
    return placed[:, 0], half_axes


def units_of(vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the unit vectors and the lengths of vectors, (n, 3), of any size.

    One along an axis is exact; of the zero vector both are zero.
    """
    scale = np.abs(vectors).max(axis=1)
    scaled = vectors / np.where(scale > 0.0, scale, 1.0)[:, None]
    lengths = np.sqrt((scaled * scaled).sum(axis=1))
    return scaled / np.where(lengths > 0.0, lengths, 1.0)[:, None], scale * lengths


def across(units: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors each at right angles to unit vectors, (n, 3), and to each other."""
    least = np.eye(3)[np.abs(units).argmin(axis=1)]
    u = units_of(np.cross(units, least))[0]
    return u, np.cross(units, u)


def place(mixed: Mixed, part: Part, kind: type, matrices: np.ndarray | None) -> np.ndarray:
    """Write matrices, centres, widths and boxes of items of one kind.

    Parameters
    ----------
    kind : type
        A key of FRAMES.
    matrices : (k, 3, 4) float64, optional
        What the items are seen through.

    Returns
    -------
    (3 k, 3) float64
        Three half-axes of each item.
    """
    centres, half_axes = FRAMES[kind](mixed, part)
    if matrices is not None:
        linear = matrices[:, :, :3]
        centres = (linear @ centres[:, :, None])[:, :, 0] + matrices[:, :, 3]
        half_axes = linear @ half_axes
        if kind in (Sphere, Disc):
            half_axes = at_right_angles(half_axes)
    number = int(mixed.kinds[part.numbers[0]])
    if matrices is None and kind is Box:
        # Centre and half-axes may be rounded, but what is said of it is not.
        boxes = part.read("a corner of the box", (3,), "lower", "upper").reshape(-1, 6)
    else:
        boxes = boxes_of_frames(mixed, part.numbers, number, centres, half_axes)
    inverse, widths = into_unit_space(half_axes, number)
    mixed.boxes[part.numbers] = boxes
    mixed.rows[part.numbers, CENTRE] = centres
    mixed.rows[part.numbers, MATRIX:CENTRE] = inverse
    if kind is Cone:
        mixed.rows[part.numbers, SHAPE, 2] = widths[:, 2]
    else:
        mixed.rows[part.numbers, SHAPE] = widths
    return np.ascontiguousarray(half_axes.transpose(0, 2, 1)).reshape(-1, 3)


def at_right_angles(half_axes: np.ndarray) -> np.ndarray:
    """Return half-axes of the same ellipsoids or ellipses that are at right angles.

    A sheared ball is an ellipsoid like any other, and rounding does less harm to a matrix whose
    rows are at right angles.
    """
    is_diagonal = (half_axes * (1.0 - np.eye(3)) == 0.0).all(axis=(1, 2))
    result = half_axes.copy()
    if not is_diagonal.all():
        u, sizes, _ = np.linalg.svd(half_axes[~is_diagonal])
        # What is left of a flat one's thickness is rounding.
        sizes[sizes <= DEPENDENT * sizes[:, :1]] = 0.0
        result[~is_diagonal] = u * sizes[:, None, :]
    return result


def power_of_two(lengths: np.ndarray) -> np.ndarray:
    """Return the powers of two not below some lengths; 0 for 0."""
    fractions, exponents = np.frexp(lengths)
    return np.where(fractions == 0.5, lengths, np.ldexp(np.sign(lengths), exponents))


def into_unit_space(half_axes: np.ndarray, kind: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrices into unit space, (k, 3, 3), and the half-widths there, (k, 3).

    Half-axes are measured in powers of two, so that nothing is rounded that need not be, and have
    widths from 1/2 to 1 there; but a circle must be one, so those of an ellipse or an ellipsoid are
    measured as they are. Their matrix has the half-axes as columns; the rows of the inverse are
    cross products of two of them over the determinant. Flat boxes and discs get a third half-axis
    at right angles.
    """
    units, lengths = units_of(np.ascontiguousarray(half_axes.transpose(0, 2, 1)).reshape(-1, 3))
    units, lengths = units.reshape(-1, 3, 3), lengths.reshape(-1, 3)
    scales = power_of_two(lengths)
    if kind in (SPHERE, CONE, DISC):
        n_round = 3 if kind == SPHERE else 2
        # What a cone's radii are measured in are powers of two, up to rounding, unless placed.
        is_oval = (lengths[:, :n_round] != lengths[:, :1]).any(axis=1) | (kind == CONE)
        scales[is_oval, :n_round] = lengths[is_oval, :n_round]
    widths = lengths / np.where(scales > 0.0, scales, 1.0)
    if kind in (BOX, DISC):
        flat = (lengths == 0.0).sum(axis=1) == 1
        for axis in range(3):
            which = flat & (lengths[:, axis] == 0.0)
            normals = np.cross(units[which, (axis + 1) % 3], units[which, (axis + 2) % 3])
            units[which, axis] = units_of(normals)[0]
            scales[which, axis] = scales[which].max(axis=1)
    products = np.cross(units[:, [1, 2, 0]], units[:, [2, 0, 1]])
    volumes = (units[:, 0] * products[:, 0]).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse = products / volumes[:, None, None] / scales[:, :, None]
    is_usable = (np.abs(volumes) > DEPENDENT) & np.isfinite(inverse).all(axis=(1, 2))
    inverse[~is_usable] = 0.0
    return inverse, widths


def boxes_of_frames(
    mixed: Mixed, numbers: np.ndarray, kind: int, centres: np.ndarray, half_axes: np.ndarray
) -> np.ndarray:
    """Return the boxes of what has half-axes, (k, 6), rounded outward where they are rounded."""
    if kind == BOX:
        u, v, w = np.abs(half_axes).transpose(2, 0, 1)
        is_exact = is_sum_exact(u, v, u + v) & is_sum_exact(u + v, w, u + v + w)
        return around(centres, u + v + w, is_exact)
    if kind == CONE:
        extent, is_exact = root_of_squares(half_axes[:, :, :2])
        axis, ends = half_axes[:, :, 2], []
        for end in range(2):
            middle = centres - axis if end == 0 else centres + axis
            is_sure = is_exact & is_sum_exact(centres, -axis if end == 0 else axis, middle)
            rounding = np.where(is_sure, 0.0, OUTWARD * (np.abs(centres) + np.abs(axis)))
            radii = mixed.rows[numbers, SHAPE, end][:, None]
            ends.append(around(middle, radii * extent + rounding, is_sure))
        lower = np.minimum(ends[0][:, :3], ends[1][:, :3])
        return np.hstack([lower, np.maximum(ends[0][:, 3:], ends[1][:, 3:])])
    extent, is_exact = root_of_squares(half_axes)
    return around(centres, extent, is_exact)


def root_of_squares(half_axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the root of the sum of squares of each row, (k, 3), and whether it is exact."""
    largest = np.abs(half_axes).max(axis=2)
    scaled = half_axes / np.where(largest > 0.0, largest, 1.0)[:, :, None]
    root = largest * np.sqrt((scaled * scaled).sum(axis=2))
    return root, (half_axes != 0.0).sum(axis=2) < 2


def is_sum_exact(a: np.ndarray, b: np.ndarray, total: np.ndarray) -> np.ndarray:
    """Say whether ``total = a + b`` is not rounded (D. Knuth's error of a sum)."""
    rest = total - a
    return (a - (total - rest)) + (b - rest) == 0.0


def around(centres: np.ndarray, extents: np.ndarray, is_exact: np.ndarray) -> np.ndarray:
    """Return boxes, (k, 6), outward to the next number where a plane is rounded.

    Planes at round numbers stay there: cells of a grid end at the same ones.
    """
    extents = np.where(is_exact, extents, extents * (1.0 + OUTWARD))
    lower, upper = centres - extents, centres + extents
    is_low = is_exact & is_sum_exact(centres, -extents, lower)
    is_high = is_exact & is_sum_exact(centres, extents, upper)
    return np.hstack(
        [
            np.where(is_low, lower, np.nextafter(lower, -np.inf)),
            np.where(is_high, upper, np.nextafter(upper, np.inf)),
        ]
    )


FRAMES = {Sphere: sphere_frames, Cone: cone_frames, Box: box_frames, Disc: disc_frames}
"""What tells the half-axes, per kind of description that may be placed by a matrix."""
