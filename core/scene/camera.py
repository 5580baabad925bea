"""The camera: what the rays of a picture start from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

PERSPECTIVE = "perspective"
ORTHOGRAPHIC = "orthographic"


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
