"""The probe ``beam``: one for the whole picture, and those that go on from mirrors and glass."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...contract.structure import Structure
from ...errors import InputError
from ...kernels import announcing
from ...probes.beam import EYE, MIRRORED, REFRACTED, Beam, camera_beam
from ...probes.beam_picture import picture_of_tree, share_of
from ...probes.beam_tree import beam_tree, depth_setting
from ...probes.polygonal import in_convex_parts, polygonal
from ...probes.visible import MISS
from ...progress import SILENT, Progress
from ...scene import Scene
from ...scene.camera_rays import window_of
from ...scene.whitted import lights_for
from ..pages.beam_drawing import drawing_of
from ..rays.camera import camera_of
from .probe import Cast, Probe, ProbeSettings, refuse_impossible, shares_of_objects


@dataclass(frozen=True)
class BeamSettings(ProbeSettings):
    """Settings of beams."""

    depth: int = depth_setting()


class BeamProbe(Probe):
    """Beams over scenes of flat polygons: what is seen as polygons, with their exact areas."""

    name = "beam"
    label = "Beam"
    summary = "One beam for the whole picture, clipped at polygons from front to back"
    Settings = BeamSettings
    structure = "bsp:planes=autopartition,max_leaf_size=1,max_depth=60"
    draws = True

    @classmethod
    def cast(
        cls,
        scene: Scene,
        structure: type[Structure],
        structure_settings: Any,
        settings: BeamSettings,
        progress: Progress = SILENT,
    ) -> Cast:
        """Build the tree, and trace the beam tree."""
        if structure.name != "bsp":
            raise InputError(
                f"beams need the order of a BSP tree; choose --structure bsp, not {structure.name}"
            )
        refuse_impossible(settings)
        scene = scene.flat()
        camera, size = camera_of(scene, settings), (settings.width, settings.height)
        first = camera_beam(camera, *size)
        convex, _ = in_convex_parts(scene)
        structure.refuse_too_large(convex, structure_settings)
        with announcing(progress, "beams"):  # a beam that sees next to nothing compiles them
            beam_tree(polygonal(scene, structure_settings, progress), narrowed(first), 1, progress)
        start = time.perf_counter()
        prepared = polygonal(scene, structure_settings, progress)
        built = time.perf_counter()
        nodes = beam_tree(prepared, first, settings.depth, progress)
        seconds = time.perf_counter() - built
        window, pieces = window_of(camera, *size), nodes[0].pieces
        lights = lights_for(scene, camera)
        picture = picture_of_tree(prepared, nodes, lights, window, *size)
        seen = np.unique(pieces.items[pieces.items != MISS])
        shares = {
            item: float(pieces.areas[pieces.items == item].sum()) / first.area
            for item in seen.tolist()
        }
        kinds = [node.kind for node in nodes]
        figures = {
            "beams": len(nodes),
            "by_kind": {kind: kinds.count(kind) for kind in (EYE, MIRRORED, REFRACTED)},
            "deepest": max(node.depth for node in nodes),
            "polygons": len(prepared.convex.items),
            "parts": len(prepared.convex.offsets) - 1,
            "seen": len(seen),
            "pieces": sum(len(node.pieces.items) for node in nodes),
            "pieces_of_the_first": len(pieces.items),
            "area": first.area,
            "area_error": max(
                abs(float(node.pieces.areas.sum()) / node.beam.area - 1.0) for node in nodes
            ),
            "missed": float(pieces.areas[pieces.items == MISS].sum()) / first.area,
        }
        return Cast(
            prepared.tree, built - start, seconds, figures, picture,
            share_of(pieces, seen, window, *size), shares_of_objects(scene, shares),
            drawing_of(prepared, nodes, lights, window, *size),
        )  # fmt: skip


def narrowed(beam: Beam) -> Beam:
    """Return a beam in the middle of another, a millionth as wide."""
    (window,) = beam.windows
    middle = window.mean(axis=0)
    return Beam(beam.matrix, (middle + 1e-6 * (window - middle),))
