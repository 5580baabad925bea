"""Images of ours as Blender's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

if TYPE_CHECKING:  # its package brings Numba in
    from ...core.lessons.picture import Image


def image_of(image: Image) -> bpy.types.Image:
    """Return an image as one of Blender's, which is packed into the file."""
    height, width = image.pixels.shape[:2]
    made = bpy.data.images.new(image.name, width, height)
    texels = np.ones((height, width, 4), dtype=np.float32)
    texels[..., :3] = image.pixels[::-1]
    made.pixels.foreach_set(texels.ravel())
    made.pack()
    return made
