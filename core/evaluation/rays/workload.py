"""What a set of rays promises: the contract of workloads.

A workload is a class with ``Settings``, ``make(scene, settings) -> Rays`` and, if there are rays
that come of those, ``generations``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Generator
from typing import Any, ClassVar, Protocol

import numpy as np

from ...contract.figures import Figure
from ...contract.ray_order import AUTOMATIC, CHOICES
from ...contract.structure import Hits
from ...geometry.rays import Rays
from ...progress import SILENT, Progress
from ...scene import Scene
from ...settings import setting


class Outcome(Protocol):
    """What has come of a workload's rays beside their hits."""

    @property
    def picture(self) -> np.ndarray:
        """What they have seen, (height, width, 3) float64: red, green, blue; 1 is white."""

    @property
    def samples(self) -> np.ndarray:
        """How many primary rays each pixel has, (height, width) int64."""

    def to_json(self) -> dict[str, Any]:
        """Return the workload's figures by their keys."""

    def against(self, whole: Any) -> Any:
        """Return this outcome with figures of how it differs from that of all rays."""


Generations = Generator[Rays, Hits, Outcome | None]
"""Batches of rays; after each, the generator is sent its hits. In the end it returns the outcome,
if it has one."""


class Workload(ABC):
    """A named set of rays: a first batch, and perhaps others that start where it has hit.

    Attributes
    ----------
    name, label, summary : str
    Settings : type
        The settings dataclass; one of them is ``order``, see :func:`ray_order`.
    FIGURES : tuple of Figure
        What the outcome of its rays holds, in reading order; without any, there is no outcome.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    summary: ClassVar[str]
    Settings: ClassVar[type]
    FIGURES: ClassVar[tuple[Figure, ...]] = ()

    @staticmethod
    @abstractmethod
    def refuse_impossible(settings: Any) -> None:
        """Raise InputError for settings that fit no scene whatever."""

    @staticmethod
    @abstractmethod
    def make(scene: Scene, settings: Any) -> Rays:
        """Return the first rays for a scene.

        Raises
        ------
        InputError
            When the settings do not fit the scene.
        """

    @staticmethod
    def generations(
        scene: Scene, settings: Any, first: Rays, progress: Progress = SILENT
    ) -> Generations:
        """Yield a batch of rays after the other, and be sent what each has hit.

        Who traces them is not the workload's affair: the structure that is measured does. Its hits
        are those of any other structure, bit for bit, so the batches are, too.

        Parameters
        ----------
        first : Rays
            What :meth:`make` has returned.

        Raises
        ------
        InputError
            If there would be more rays than fit into memory.
        Cancelled
            From `progress`.
        """
        yield first
        return None

    @staticmethod
    def unsparing(settings: Any) -> Any:
        """Return settings under which the rays are traced that these save, to compare outcomes.

        Returns
        -------
        settings or None
            None if none is saved, or nothing is to be compared.
        """
        return None

    @staticmethod
    def used(scene: Scene, settings: Any) -> dict[str, Any]:
        """Return what of the scene the rays start from, as JSON takes it, for the record."""
        return {}


def ray_order() -> Any:
    """Declare in which order the rays of a batch are traced."""
    return setting(
        AUTOMATIC,
        "Order",
        "In which order rays are traced; what they hit and count is the same",
        choices=CHOICES,
    )
