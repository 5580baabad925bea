"""The lecture's slide "SAH decision" with a slider: a plane, both halves, and what they cost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.settings import setting
from ..drawing import overlay

if TYPE_CHECKING:  # importing it for real would import the structures, and Numba with them
    from ...core.progress import Progress
    from ...core.sah.split_plane import SortedAxis, SplitPlane
    from ...core.scene import Scene

AXES = {"x": "Across x", "y": "Across y", "z": "Across z"}


@dataclass(frozen=True)
class SplitPlaneSettings:
    """Where the plane is, and the constants of the cost."""

    axis: str = setting("x", "Axis", "Across which axis the plane lies", choices=AXES)
    position: float = setting(
        0.5,
        "Position",
        "Place of the plane, as a share of the scene's extent along the axis",
        minimum=0.0,
        maximum=1.0,
    )
    t_tra: float = setting(
        3.0,
        "t_tra",
        "Cost of one traversal step, in the unit of t_tri",
        minimum=0.0,
        maximum=1e9,
    )
    t_tri: float = setting(
        1.0,
        "t_tri",
        "Cost of one ray-triangle test, in the unit of t_tra",
        minimum=0.0,
        maximum=1e9,
    )


class SplitView:
    """A plane through a scene.

    The triangles are sorted once along each axis that is asked for, which takes a moment
    (:meth:`make`); then every plane is a matter of a look-up.

    Attributes
    ----------
    axes : dict of str to SortedAxis
        Those that the triangles have been sorted along.
    plane : SplitPlane or None
        Figures of the plane that is drawn.
    rows : list of (str, str)
        The same in words: labels and texts.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.axes: dict[str, SortedAxis] = {}
        self.plane: SplitPlane | None = None
        self.rows: list[tuple[str, str]] = []

    def wanted(self, group: Any) -> str | None:
        """Return the axis that the settings ask for; None if no plane is to be shown.

        Parameters
        ----------
        group : bpy.types.PropertyGroup
            ``scene.accelscope.split_plane``.
        """
        return group.axis if group.show else None

    def make(self, axis: str, progress: Progress) -> SortedAxis:
        """Sort the items along an axis; of a million that takes a third of a second."""
        from ...core.sah.split_plane import sort_along

        return sort_along(self.scene.boxes(), list(AXES).index(axis), progress)

    def draw(self, settings: SplitPlaneSettings | None) -> bool:
        """Draw the plane of some settings, or none; say whether that was possible.

        It is not while the triangles have still to be sorted: then what is drawn stays.
        """
        if settings is None:
            self.plane, self.rows = None, []
            overlay.set_lines(overlay.PLANE, None)
            return True
        along = self.axes.get(settings.axis)
        if along is None:
            return False
        from ...core.lessons.split_plane import frame_of_plane
        from ...core.sah.split_plane import evaluate_plane

        box = np.concatenate([self.scene.lower, self.scene.upper])
        low, high = box[along.axis], box[3 + along.axis]
        position = float(low + settings.position * (high - low))
        costs = settings.t_tra, settings.t_tri
        self.plane = plane = evaluate_plane(along, box, position, *costs)
        frame = frame_of_plane(self.scene, along, box, position, *costs)
        overlay.set_lines(overlay.PLANE, frame.segments, frame.colours)
        self.rows = [
            (settings.axis, f"{position:.5g}"),
            ("N_L", str(plane.N_L)),
            ("N_R", str(plane.N_R)),
            ("p_L", f"{plane.p_L:.2f}"),
            ("p_R", f"{plane.p_R:.2f}"),
            ("Cost(V -> {L, R})", f"{plane.cost:.1f}"),
            ("Cost(V)", f"{settings.t_tri * len(self.scene):.1f}"),
        ]
        return True
