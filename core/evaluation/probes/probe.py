"""What a kind of probe promises: pictures of a scene by generalized rays, and figures of them.

A kind is a class with ``Settings`` and ``cast``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ...contract.structure import Structure
from ...memory import refuse_if_too_large
from ...progress import SILENT, Progress
from ...scene import Scene
from ...settings import setting
from ..rays.camera import PictureSettings, refuse_no_view


@dataclass(frozen=True)
class ProbeSettings(PictureSettings):
    """Settings of the picture that probes are cast for."""

    rays: ClassVar[str] = "of a probe"

    width: int = setting(256, "Width", "Pixels in a row", unit="pixels", minimum=1, maximum=8192)
    height: int = setting(192, "Height", "Rows of pixels", unit="pixels", minimum=1, maximum=8192)


class Cast(NamedTuple):
    """What has come of casting probes.

    Attributes
    ----------
    structure : Structure
        That they went through.
    seconds_to_build, seconds : float
        Of the structure, and of the probes themselves.
    figures : dict
        Of the kind.
    picture : (height, width, 3) float64
        Red, green and blue; 1 is white.
    covered : (height, width) float64
        Share of each pixel in which something is seen.
    by_object : dict of str to float
        Share of the picture in which each object is seen, in the order of the scene.
    drawing : str
        What is seen as SVG; empty if this kind knows no outlines.
    """

    structure: Structure
    seconds_to_build: float
    seconds: float
    figures: dict[str, Any]
    picture: np.ndarray
    covered: np.ndarray
    by_object: dict[str, float]
    drawing: str = ""


class Probe(ABC):
    """A kind of probe.

    Attributes
    ----------
    name, label, summary : str
    Settings : type
        The settings dataclass; its pictures are those of a camera.
    structure : str
        The structure that they go through by default, as the command line names it.
    draws : bool
        Whether what is seen has outlines, to be drawn as SVG.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    summary: ClassVar[str]
    Settings: ClassVar[type]
    structure: ClassVar[str]
    draws: ClassVar[bool] = False

    @classmethod
    @abstractmethod
    def cast(
        cls,
        scene: Scene,
        structure: type[Structure],
        structure_settings: Any,
        settings: Any,
        progress: Progress = SILENT,
    ) -> Cast:
        """Build a structure, and cast the probes of a picture.

        Raises
        ------
        InputError
            If the scene or the structure is none for this kind, or the settings do not fit.
        Cancelled
            From `progress`.
        """


def refuse_impossible(settings: ProbeSettings) -> None:
    """Refuse a picture that does not fit into memory, and a camera that cannot be."""
    count = settings.width * settings.height
    refuse_if_too_large(count * 100, f"a picture of {count} pixels", "lower width and height")
    refuse_no_view(settings)


def shares_of_objects(scene: Scene, shares: Mapping[int, float]) -> dict[str, float]:
    """Return the shares of items, by number, summed up by object, in the order of the scene."""
    totals = dict.fromkeys(scene.object_names, 0.0)
    for item, share in shares.items():
        totals[scene.object_of(item)[0]] += share
    return {name: share for name, share in totals.items() if share > 0.0}
