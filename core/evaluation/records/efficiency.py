"""Efficiency of a bounding volume for an object: the lecture's B + p I < I, measured.

I is the time of a ray's test of the original object, here of all its triangles one by one; B that
of its test of the volume; p the share of rays that hit the volume, which then have to test the
object as well. Both times are measured on this machine, in nanoseconds per ray. The volume pays
while p is below the break-even 1 - B / I, and makes testing I / (B + p I) times as fast.

p belongs to the rays, not to the volume alone: through the volume's own box it is 1. So the lines
are drawn through a ball `spread` times as large as the one around the object's box. They are
isotropic and uniform, which is why p is S / S_ball for a convex volume; it is measured as well.

How tight a volume is, does not depend on the ball: the share of the lines through the volume that
hit the object, the slide's pA / pB. p_SA is the ratio of surface areas, of the object's convex hull
and the volume, which is that share for a convex object; p_measured is counted. For one direction
the share is a ratio of projected areas.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...geometry.combined import is_polyhedral
from ...geometry.hull import hull_area
from ...geometry.sphere import Spheres
from ...kernels import announcing
from ...progress import SILENT, Progress
from ...sah.line_sample import Ball, parallel_lines_through, random_lines_through, sample_of
from ...sah.timing import time_of_object, time_of_volume, verdict
from ...sah.volume_around import volume_around
from ...scene import Scene
from ...settings import to_json
from ...structures.bvh import BVH
from .efficiency_settings import EfficiencySettings
from .environment import environment
from .experiment import describe_scene, refuse_not_finite
from .report import Record, aligned, failure, show_number

DIRECTIONS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class Measurement:
    """Volumes around all of a scene as one object; what is the same for all is done once.

    Parameters
    ----------
    directions : mapping of str to (3,), optional
        For which projected areas are compared, by name; x, y and z by default.

    Raises
    ------
    Cancelled
        From `progress`.
    """

    def __init__(
        self,
        scene: Scene,
        settings: EfficiencySettings,
        directions: Mapping[str, Sequence[float]] | None = None,
        progress: Progress = SILENT,
    ) -> None:
        scene = scene.flat()
        self.scene, self.settings, self.progress = scene, settings, progress
        self.ball = ball = Ball.around(scene.lower, scene.upper, settings.spread)
        self.hull = hull_area(scene.triangles.reshape(-1, 3), progress)
        self.structure = BVH.build(scene, BVH.Settings(), progress)
        self.triangles = scene.items()
        self.rays = random_lines_through(ball, settings.lines, settings.seed)
        self.views = {
            name: parallel_lines_through(ball, np.asarray(direction, float), settings.lines)
            for name, direction in (directions or DIRECTIONS).items()
        }
        self.I = time_of_object(self.triangles, self.rays.arrays(), progress)

    def what(self, kind: str) -> Record:
        """Return the part of a record that says what is measured, and where."""
        return {
            "scene": describe_scene(self.scene),
            "volume": kind,
            "settings": to_json(self.settings),
            "environment": environment(1),
        }

    def of(self, kind: str) -> Record:
        """Return the record of a kind of volume.

        ``p_SA``, ``p_measured`` and ``projected`` say how tight it is, ``p_hit`` is the p of the
        inequality, ``p_hit_measured`` the same, counted.

        Parameters
        ----------
        kind : str
            As :mod:`...geometry.kinds` names it, combined ones too.

        Raises
        ------
        InputError
            If a figure is no number.
        Cancelled
            From the progress.
        """
        scene, rays, progress, I = self.scene, self.rays, self.progress, self.I  # noqa: E741
        progress.report(0, 1, f"Measuring {kind}")
        with announcing(progress, f"the test of {kind}"):
            volumes = volume_around(scene, kind, progress)
            area, content = float(volumes.areas(progress)[0]), float(volumes.contents()[0])
            sample = sample_of(rays, self.structure, volumes, progress)
            hit = int(sample.hits_volume.sum())
            tightness = sample.ratio
            measured = hit / len(rays)
            # The area of other shapes is itself counted, by fewer lines.
            is_exact = isinstance(volumes, Spheres) or is_polyhedral(volumes)
            p = area / self.ball.area() if is_exact else measured
            B = time_of_volume(volumes, rays.arrays(), self.triangles.reach, progress)
        record = {
            **self.what(kind),
            "surface_area": area,
            "content": content,
            "hull_area": self.hull,
            "p_SA": self.hull / area if area > 0.0 else 1.0,
            "p_measured": tightness,
            "p_measured_error": standard_error(tightness, hit),
            "projected": {
                name: sample_of(view, self.structure, volumes, progress).ratio
                for name, view in self.views.items()
            },
            "p_hit": p,
            "p_hit_from": "area" if is_exact else "lines",
            "p_hit_measured": measured,
            "p_hit_error": standard_error(measured, len(rays)),
            "B_ns": B,
            "I_ns": I,
            **verdict(B, I, p),
        }
        refuse_not_finite(record)
        return record


def standard_error(share: float, count: int) -> float:
    """Return the standard error of a share that was counted among `count`."""
    return float(np.sqrt(share * (1.0 - share) / max(count, 1)))


COLUMNS: tuple[tuple[str, Callable[[Record], str]], ...] = (
    ("volume", lambda r: r["volume"]),
    ("area", lambda r: show_number(r["surface_area"])),
    ("p_SA", lambda r: f"{r['p_SA']:.3f}"),
    ("p_measured", lambda r: f"{r['p_measured']:.3f} ± {r['p_measured_error']:.3f}"),
    ("p hit", lambda r: f"{r['p_hit']:.3f}"),
    ("counted", lambda r: f"{r['p_hit_measured']:.3f} ± {r['p_hit_error']:.3f}"),
    ("B", lambda r: f"{r['B_ns']:.1f} ns"),
    ("I", lambda r: f"{r['I_ns']:.1f} ns"),
    ("B + p I", lambda r: f"{r['time_with']:.1f} ns"),
    ("pays", lambda r: "yes" if r["pays"] else "no"),
    ("break-even p", lambda r: f"{r['break_even']:.4f}"),
    ("speed-up", lambda r: f"{r['speed_up']:.2f}"),
)


def table(records: Sequence[Record]) -> str:
    """Return the records as an aligned table, with the projected ratios behind."""
    names = next((list(record["projected"]) for record in records if "error" not in record), [])
    rows = [[title for title, _ in COLUMNS] + [f"pA/pB {name}" for name in names]]
    for record in records:
        if "error" in record:
            rows.append([record["volume"], failure(record)])
            continue
        projected = [f"{record['projected'][name]:.2f}" for name in names]
        rows.append([show(record) for _, show in COLUMNS] + projected)
    return aligned(rows)
