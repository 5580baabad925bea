"""What a structure was built from, and for which rays: asked before it is used.

A structure over triangles answers every ray, wherever lights and camera are. A directional one may
be built from the lights, and answer shadow rays alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np

from ..errors import InputError
from ..geometry.rays import Rays
from ..scene import Camera, Light

GEOMETRY, LIGHTS, CAMERA, TIME = "geometry", "lights", "camera", "time"
"""What a structure may be built from."""

EVERY_CLASS: tuple[str, ...] | None = None
"""As `answers`: rays of any class."""


def in_words(names: Sequence[str]) -> str:
    """Return names as a sentence has them: ``"shadow, reflected and ambient"``."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def refuse_other_classes(name: str, answers: tuple[str, ...] | None, rays: Rays) -> None:
    """Refuse rays of a class that a structure is not for.

    Raises
    ------
    InputError
        Naming the class, and those that there are answers for.
    """
    if answers is None:
        return
    present = np.bincount(rays.classes, minlength=len(rays.class_names)) > 0
    for asked, is_there in zip(rays.class_names, present, strict=True):
        if is_there and asked not in answers:
            raise InputError(
                f"{name} answers {in_words(answers)} rays only, not {asked} ones; choose other "
                "rays, or the structure 'routed', which has one for each class"
            )


class Seen(Protocol):
    """What has a camera and lights: a scene, or what is known of one before its triangles are."""

    @property
    def camera(self) -> Camera | None:
        """Its camera, if it has one."""

    @property
    def lights(self) -> Sequence[Light]:
        """Its lights."""


def moved(needs: frozenset[str], before: Seen, now: Seen) -> str:
    """Say what of its needs, beside triangles, is not as it was when a structure was built.

    What lights and cameras are called does not matter.

    Returns
    -------
    str
        ``"the lights were changed"``; empty if all is as it was.
    """
    if LIGHTS in needs and _as_said(before.lights) != _as_said(now.lights):
        return "the lights were changed"
    if CAMERA in needs and _as_said([before.camera]) != _as_said([now.camera]):
        return "the camera was moved"
    return ""


def _as_said(parts: Iterable[Camera | Light | None]) -> list[Any]:
    """Return what can be compared."""
    words = [{} if part is None else part.to_json() for part in parts]
    return [{key: value for key, value in each.items() if key != "name"} for each in words]
