"""The scene: triangles in world space, with what is known about where they came from."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .errors import InputError


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Attributes
    ----------
    position, target, up : (3,) float64
        Where it stands, what it looks at, which way is up; in scene units.
    fov : float
        Full angle of view in degrees, of the larger side of the picture.
    """

    position: np.ndarray
    target: np.ndarray
    up: np.ndarray
    fov: float


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
    lights : (m, 3) float64
        Positions of point lights.
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
    lights: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
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
        lights: np.ndarray | None = None,
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
            raise InputError(f"{name} has no triangles; choose a mesh with faces")
        if len(triangles) >= 2**31:
            raise InputError(
                f"{name} has {len(triangles)} triangles; at most 2147483647 are handled"
            )
        # A float32 file may hold values up to 3e38; beyond 1e100 products of three coordinates
        # overflow float64, so such vertices are treated like infinite ones.
        usable = (np.abs(triangles) < 1e100).all(axis=(1, 2))
        kept = np.flatnonzero(usable).astype(np.int32)
        dropped = len(triangles) - len(kept)
        if len(kept) == 0:
            raise InputError(f"every vertex of {name} is NaN or infinite; repair the mesh")
        if dropped:
            triangles = np.ascontiguousarray(triangles[kept])
        if object_ids is None:
            object_ids, object_names = np.zeros(len(kept), dtype=np.int32), object_names or (name,)
        else:
            object_ids = np.ascontiguousarray(object_ids[kept], dtype=np.int32)
        lower, upper = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
        _refuse_if_all_degenerate(triangles, lower, upper, name)
        return cls(
            name, source or name, triangles, kept, dropped, object_ids, tuple(object_names),
            lower, upper, camera, np.zeros((0, 3)) if lights is None else np.asarray(lights, float),
            tuple(notes),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.triangles)

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the box around the scene."""
        return float(np.linalg.norm(self.upper - self.lower))


def _refuse_if_all_degenerate(
    triangles: np.ndarray, lower: np.ndarray, upper: np.ndarray, name: str
) -> None:
    """Raise InputError if every triangle has zero area: there is nothing to hit or to divide."""
    # Scaled to the unit box first: at 1e-200 the cross product would underflow to zero.
    scale = float((upper - lower).max())
    if 0.0 < scale < 1e-100:
        raise InputError(f"{name} is {scale:.1g} units large, too small to compute with; scale it")
    if scale > 0.0:
        unit = (triangles - lower) / scale
        if np.cross(unit[:, 1] - unit[:, 0], unit[:, 2] - unit[:, 0]).any():
            return
    count = (
        "its only triangle has" if len(triangles) == 1 else f"all {len(triangles)} triangles have"
    )
    raise InputError(f"{name}: {count} zero area, so no ray can hit; check the object's scale")
