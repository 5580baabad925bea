"""The scene: triangles in world space, with what is known about where they came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .errors import InputError
from .memory import refuse_if_unnumbered

PERSPECTIVE = "perspective"
ORTHOGRAPHIC = "orthographic"

SMALLEST, LARGEST = 1e-100, 1e100
"""Sizes in between, products of three coordinates are in the range of float64."""

THINNEST = 1e-100
"""Share of the scene's longest side below which another one is taken as flat. A thin side's
products with others would lose their digits, and there is no cell between numbers near 1e-310."""


@dataclass(frozen=True)
class Camera:
    """A camera: what the rays of a picture start from.

    Attributes
    ----------
    position, target, up : (3,) float64
        Where it stands, what it looks at, which way is up; in scene units.
    fov : float
        Full angle of view in degrees, of the side of the picture that `fit` names; perspective
        cameras only.
    kind : str
        PERSPECTIVE, ORTHOGRAPHIC, or in words what else it is: no rays are made of such a camera.
    scale : float
        What that side spans in scene units; orthographic cameras only.
    fit : {"larger", "width", "height"}
        The side of the picture that `fov` or `scale` is that of.
    shift : (float, float)
        How far the middle of the picture lies to the right of the view direction and above it, in
        lengths of that side.
    pixel_aspect : float
        Width of a pixel over its height.
    right : (3,) float64 or None
        Where the rows of the picture run, and `up` where its columns do, exactly; they need not be
        at right angles, and a picture may be mirrored. None makes a picture of the usual kind.
    name : str
        What its source calls it.
    """

    position: np.ndarray
    target: np.ndarray
    up: np.ndarray
    fov: float
    kind: str = PERSPECTIVE
    scale: float = 1.0
    fit: str = "larger"
    shift: tuple[float, float] = (0.0, 0.0)
    pixel_aspect: float = 1.0
    right: np.ndarray | None = None
    name: str = ""

    @property
    def has_rays(self) -> bool:
        """Whether rays can be made of a camera of this kind."""
        return self.kind in (PERSPECTIVE, ORTHOGRAPHIC)

    def to_json(self) -> dict[str, Any]:
        """Return everything that says which rays it gives, as JSON takes it."""
        extent = {"fov": self.fov} if self.kind == PERSPECTIVE else {"scale": self.scale}
        return {
            "name": self.name,
            "kind": self.kind,
            "position": np.asarray(self.position, float).tolist(),
            "target": np.asarray(self.target, float).tolist(),
            "up": np.asarray(self.up, float).tolist(),
            "right": None if self.right is None else np.asarray(self.right, float).tolist(),
            **extent,
            "fit": self.fit,
            "shift": list(self.shift),
            "pixel_aspect": self.pixel_aspect,
        }


POINT = "point"
SUN = "sun"
SPOT = "spot"
AREA = "area"
LIGHT_KINDS = (POINT, SUN, SPOT, AREA)


@dataclass(frozen=True)
class Light:
    """A light, as far as shadow rays have to know it.

    Attributes
    ----------
    kind : {"point", "sun", "spot", "area"}
        A sun is infinitely far away; of an area light only its centre is known, where one shadow
        ray per hit goes to.
    position : (3,) float64
        Of all but a sun.
    direction : (3,) float64
        Where the light goes, a unit vector; of all but a point light.
    angle : float
        Full angle of the cone outside of which it is dark, in degrees: 360 of a point light, 180
        of an area light, which shines to its front.
    name : str
        What its source calls it.
    """

    kind: str
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    direction: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, -1.0]))
    angle: float = 360.0
    name: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return what shadow rays know of it, as JSON takes it."""
        values: dict[str, Any] = {"name": self.name, "kind": self.kind}
        if self.kind != SUN:
            values["position"] = np.asarray(self.position, float).tolist()
        if self.kind != POINT:
            values["direction"] = np.asarray(self.direction, float).tolist()
        if self.kind == SPOT:
            values["angle"] = self.angle
        return values


def point_lights(*positions: Sequence[float]) -> tuple[Light, ...]:
    """Return point lights at positions."""
    return tuple(Light(POINT, np.array(position, dtype=np.float64)) for position in positions)


@dataclass(frozen=True)
class Scene:
    """Triangles of all visible meshes, in world space.

    Make one with :meth:`from_triangles`, which checks and cleans the input.

    Attributes
    ----------
    name, source : str
        Short name, and where it came from (file, sample scene, Blender file).
    triangles : (n, 3, 3) float64
        Corner positions; C-contiguous, finite.
    primitive_ids : (n,) int32
        Index of each triangle in the order of its source. Ascending; it differs from
        ``arange(n)`` only where triangles were dropped.
    dropped : int
        Triangles left out because a coordinate was not a finite number.
    object_ids : (n,) int32
        Index into `object_names` of the object each triangle belongs to.
    object_names : tuple of str
    lower, upper : (3,) float64
        The box around all triangles.
    camera : Camera or None
        The scene's own camera, if it has one.
    lights : tuple of Light
    notes : tuple of str
        What the source has and was not read, or was read otherwise than it says; one sentence each,
        without a full stop. They are said once and stand in the record.
    """

    name: str
    source: str
    triangles: np.ndarray
    primitive_ids: np.ndarray
    dropped: int
    object_ids: np.ndarray
    object_names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    camera: Camera | None = None
    lights: tuple[Light, ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def from_triangles(
        cls,
        triangles: np.ndarray,
        name: str,
        source: str = "",
        *,
        object_ids: np.ndarray | None = None,
        object_names: tuple[str, ...] = (),
        camera: Camera | None = None,
        lights: Sequence[Light] = (),
        notes: tuple[str, ...] = (),
    ) -> Scene:
        """Check, clean and wrap triangles.

        Parameters
        ----------
        triangles : (n, 3, 3) array_like of float
            Corner positions in world space.

        Raises
        ------
        InputError
            When no triangle is left that a ray could hit.
        """
        triangles = np.array(triangles, dtype=np.float64, order="C").reshape(-1, 3, 3)
        if len(triangles) == 0:
            raise InputError(f"{name} has no triangles; choose a mesh with faces", name)
        refuse_if_unnumbered(len(triangles), f"triangles of {name}", "use a part of it")
        # A float32 file may hold values up to 3e38; what is larger than we can compute with is
        # treated like infinity.
        usable = (np.abs(triangles) < LARGEST).all(axis=(1, 2))
        kept = np.flatnonzero(usable).astype(np.int32)
        dropped = len(triangles) - len(kept)
        if len(kept) == 0:
            raise InputError(f"every vertex of {name} is NaN or infinite; repair the mesh", name)
        if dropped:
            triangles = np.ascontiguousarray(triangles[kept])
        if object_ids is None:
            object_ids, object_names = np.zeros(len(kept), dtype=np.int32), object_names or (name,)
        else:
            object_ids = np.ascontiguousarray(object_ids[kept], dtype=np.int32)
        lower, upper = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
        notes = (*notes, *_flatten(triangles, lower, upper))
        _refuse_if_all_degenerate(triangles, lower, upper, name)
        return cls(
            name, source or name, triangles, kept, dropped, object_ids, tuple(object_names),
            lower, upper, camera, tuple(lights), notes,
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.triangles)

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the box around the scene."""
        return float(np.linalg.norm(self.upper - self.lower))


def _flatten(triangles: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> list[str]:
    """Make axes exactly flat, in place, along which a scene is thinner than THINNEST.

    Returns
    -------
    list of str
        A note for each such axis.
    """
    sizes, notes = upper - lower, []
    for axis in np.flatnonzero((sizes > 0.0) & (sizes < THINNEST * sizes.max())):
        place = min(max(lower[axis], 0.0), upper[axis])
        triangles[:, :, axis] = lower[axis] = upper[axis] = place
        notes.append(
            f"it is {sizes[axis]:.1g} units thick along {'xyz'[axis]}, which is taken as flat: "
            f"that is less than {THINNEST:g} of its longest side"
        )
    return notes


def _refuse_if_all_degenerate(
    triangles: np.ndarray, lower: np.ndarray, upper: np.ndarray, name: str
) -> None:
    """Raise InputError if every triangle has zero area: there is nothing to hit or to divide."""
    # Scaled to the unit box first: at 1e-200 the cross product would underflow to zero.
    scale = float((upper - lower).max())
    if 0.0 < scale < SMALLEST:
        raise InputError(
            f"{name} is {scale:.1g} units large, too small to compute with; scale it", name
        )
    if scale > 0.0:
        unit = (triangles - lower) / scale
        if np.cross(unit[:, 1] - unit[:, 0], unit[:, 2] - unit[:, 0]).any():
            return
    count = (
        "its only triangle has" if len(triangles) == 1 else f"all {len(triangles)} triangles have"
    )
    raise InputError(
        f"{name}: {count} zero area, so no ray can hit; check the object's scale", name
    )
