"""What every sample scene tells about itself."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.geometry.solids.description import Item
from ..core.memory import refuse_if_too_large
from ..core.scene import Scene
from ..core.scene.material import Material
from ..core.settings import check, to_json
from .csg import Part

BYTES_PER_TRIANGLE = 550
"""At the peak of generating, measured; the scene keeps 80."""

BYTES_PER_ITEM = 1700
"""The same of an item that is described: of polygons of many corners; others take up to 1350."""


@dataclass(frozen=True)
class Sample:
    """A sample scene that can be generated.

    Attributes
    ----------
    name : str
        The name on the command line: ``sample:NAME``.
    label, summary : str
        The name in the panel, and one sentence about what the scene is good for.
    Settings : type
        The settings dataclass.
    count : callable
        Settings to the number of items, known before anything is generated.
    generator : callable
        Settings to scene; use :meth:`generate`, which checks the settings first.
    described : callable, optional
        Settings to the descriptions of the same items in the same order, each with its material;
        None for scenes of triangles alone.
    parts : callable, optional
        Settings to trees with their materials; None for scenes without trees.
    """

    name: str
    label: str
    summary: str
    Settings: type
    count: Callable[[Any], int]
    generator: Callable[[Any], Scene]
    described: Callable[[Any], Iterator[tuple[Item, Material]]] | None = None
    parts: Callable[[Any], list[Part]] | None = None

    def generate(self, settings: Any) -> Scene:
        """Return the scene, with ``sample:NAME[:key=value,...]`` as its source.

        Raises
        ------
        InputError
            For a setting outside its limits, or a scene that does not fit into memory.
        """
        check(settings, f"sample scene {self.name}")
        count = self.count(settings)
        refuse_if_too_large(
            count * (BYTES_PER_TRIANGLE if self.described is None else BYTES_PER_ITEM),
            f"sample scene {self.name} with {count} items",
            "lower its settings",
        )
        return dataclasses.replace(self.generator(settings), source=self.spec(settings))

    def items(self, settings: Any) -> list[Any] | None:
        """Return the descriptions of the scene's items, or its parts; None for triangles alone.

        The settings are those of a scene that has been generated.
        """
        if self.parts is not None:
            return list(self.parts(settings))
        return None if self.described is None else [item for item, _ in self.described(settings)]

    def spec(self, settings: Any) -> str:
        """Return the text that means this sample with these settings, defaults left out."""
        defaults = to_json(self.Settings())
        changed = [
            f"{key}={value}" for key, value in to_json(settings).items() if value != defaults[key]
        ]
        return ":".join(["sample", self.name] + ([",".join(changed)] if changed else []))


def load_data(name: str) -> dict[str, np.ndarray]:
    """Return the arrays of a file in ``data/``; its README states where they come from."""
    with np.load(Path(__file__).parent / "data" / name) as archive:
        return dict(archive)
