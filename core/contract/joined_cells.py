"""The cells of several structures as those of one, to be drawn and exported together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..geometry.box_shape import corners_of, surface_area
from ..geometry.polygons import Polygons, merged, sides_of
from .cells import Cells, reowned
from .outlines import by_shape


def join_cells(parts: Sequence[Cells], numbers: Sequence[np.ndarray]) -> Cells:
    """Return the cells of several structures in one space, sorted by depth.

    ``part`` tells of each which structure it is of: 0, 1, ... An attribute that some parts lack is
    0 there, and NaN if it may be a fraction. Where some cells are drawn by their faces, boxes are
    given their six sides.

    Parameters
    ----------
    numbers : sequence of (n,) int
        For the cells of each part by their numbers, the numbers they shall have.
    """
    sizes = [len(part) for part in parts]
    starts = np.cumsum([0, *sizes])
    depth = np.concatenate([part.depth for part in parts])
    order = np.argsort(depth, kind="stable")
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    extra = {"part": np.repeat(np.arange(len(parts), dtype=np.int32), sizes)}
    for name in dict.fromkeys(name for part in parts for name in part.extra):
        extra[name] = np.concatenate([_values(part, name, parts) for part in parts])
    has_faces = any(part.faces is not None for part in parts)
    has_areas = any(part.areas is not None for part in parts)
    faces = [_all_faces(part) if has_faces else None for part in parts]
    areas = [surface_area(part.boxes) if part.areas is None else part.areas for part in parts]
    new = [new[part.numbers] for part, new in zip(parts, numbers, strict=True)]
    parents = [
        np.where(part.parents < 0, -1, new[part.parents])
        for part, new in zip(parts, numbers, strict=True)
    ]
    return Cells(
        np.concatenate([part.boxes for part in parts])[order],
        np.concatenate(new)[order].astype(np.int32), depth[order],
        np.concatenate([part.is_leaf for part in parts])[order],
        np.concatenate([part.count for part in parts])[order],
        {name: values[order] for name, values in extra.items()},
        faces=_joined(faces, starts, place),
        planes=_joined([part.planes for part in parts], starts, place),
        areas=np.concatenate(areas)[order] if has_areas else None,
        parent=np.concatenate(parents)[order].astype(np.int32),
        space=parts[0].space,
    )  # fmt: skip


def _values(part: Cells, name: str, parts: Sequence[Cells]) -> np.ndarray:
    """Return an attribute of a part's cells, also if only others have it."""
    if name in part.extra:
        return part.extra[name]
    kind = next(other.extra[name].dtype for other in parts if name in other.extra)
    return np.full(len(part), np.nan if kind.kind == "f" else 0, kind)


def _all_faces(part: Cells) -> Polygons:
    """Return the faces of cells, six sides of those that are drawn as boxes."""
    _, boxes = by_shape(part, np.arange(len(part)))
    sides = sides_of(corners_of(part.boxes[boxes]))
    sides = sides._replace(owners=boxes[sides.owners])
    return sides if part.faces is None else merged(part.faces, sides)


def _joined(
    polygons: Sequence[Polygons | None], starts: np.ndarray, place: np.ndarray
) -> Polygons | None:
    """Return the polygons of all parts, whose cells begin at `starts` and are moved to `place`."""
    found: Polygons | None = None
    for each, start in zip(polygons, starts[:-1], strict=True):
        if each is not None:
            each = each._replace(owners=each.owners + start)
            found = each if found is None else merged(found, each)
    return None if found is None else reowned(found, place)
