"""Images of ours as Blender's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import bpy
import numpy as np

from .editors import new_area

if TYPE_CHECKING:  # its package brings Numba in
    from ...core.lessons.picture import Image


def image_of(image: Image) -> bpy.types.Image:
    """Return an image as one of Blender's, which is packed into the file."""
    height, width = image.pixels.shape[:2]
    made = bpy.data.images.new(image.name, width, height)
    texels = np.ones((height, width, 4), dtype=np.float32)
    texels[..., :3] = np.clip(image.pixels[::-1], 0.0, 1.0)
    made.pixels.foreach_set(texels.ravel())
    made.pack()
    return made


def keep_images(context: bpy.types.Context, images: Sequence[Image]) -> str:
    """Put images into the file, the first of them into image editors; return their names."""
    kept = [image_of(image) for image in images]
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "IMAGE_EDITOR":
                area.spaces.active.image = kept[0]
    return ", ".join(image.name for image in kept)


def open_image(context: bpy.types.Context, image: Image) -> str:
    """Put an image into the file and show it: in image editors that are open, or in a new window.

    Returns
    -------
    str
        What it is called.
    """
    name = keep_images(context, [image])
    is_seen = any(
        area.type == "IMAGE_EDITOR"
        for window in context.window_manager.windows
        for area in window.screen.areas
    )
    if not is_seen and (area := new_area("IMAGE_EDITOR")) is not None:
        area.spaces.active.image = bpy.data.images[name]
    return name
