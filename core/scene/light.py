"""Lights: where shadow rays go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

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
        A sun is infinitely far away. Shadow rays go to the centre of an area light, or to points
        on it where that is asked for.
    position : (3,) float64
        Of all but a sun.
    direction : (3,) float64
        Where the light goes, a unit vector; of all but a point light.
    angle : float
        Full angle of the cone outside of which it is dark, in degrees: 360 of a point light, 180
        of an area light, which shines to its front.
    name : str
        What its source calls it.
    half_axes : (2, 3) float64 or None
        Of an area light: from its centre to the middles of two sides. Without them it is a point.
    is_round : bool
        Whether an area light is an ellipse, not a rectangle.
    """

    kind: str
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    direction: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, -1.0]))
    angle: float = 360.0
    name: str = ""
    half_axes: np.ndarray | None = None
    is_round: bool = False

    def to_json(self) -> dict[str, Any]:
        """Return what shadow rays know of it, as JSON takes it."""
        values: dict[str, Any] = {"name": self.name, "kind": self.kind}
        if self.kind != SUN:
            values["position"] = np.asarray(self.position, float).tolist()
        if self.kind != POINT:
            values["direction"] = np.asarray(self.direction, float).tolist()
        if self.kind == SPOT:
            values["angle"] = self.angle
        if self.half_axes is not None:
            values["half_axes"] = np.asarray(self.half_axes, float).tolist()
            values["is_round"] = self.is_round
        return values


def point_lights(*positions: Sequence[float]) -> tuple[Light, ...]:
    """Return point lights at positions."""
    return tuple(Light(POINT, np.array(position, dtype=np.float64)) for position in positions)
