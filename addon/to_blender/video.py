"""Films: pictures encoded as a video by Blender's sequencer."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy

from ...core.errors import InputError


def encode(folder: Path, names: Sequence[str], video: Path, per_second: int) -> None:
    """Encode pictures of one size, in order, as MPEG-4 (H.264).

    Parameters
    ----------
    folder : Path
        Where the pictures are.
    names : sequence of str
        Their files.
    video : Path
        The file to write.
    per_second : int
        Pictures per second.

    Raises
    ------
    InputError
        If this Blender encodes no videos, or did not write this one.
    """
    if not bpy.app.ffmpeg.supported:
        raise InputError("this Blender encodes no videos; make one of the pictures otherwise")
    missing = [name for name in names if not (folder / name).is_file()]
    if missing:
        raise InputError(f"there is no picture {folder / missing[0]}")
    image = bpy.data.images.load(str(folder / names[0]))
    size = tuple(image.size)
    bpy.data.images.remove(image)
    scene = bpy.data.scenes.new("AccelScope Film")
    try:
        editor = scene.sequence_editor_create()
        strips = editor.strips if hasattr(editor, "strips") else editor.sequences
        strip = strips.new_image("film", str(folder / names[0]), 1, 1)
        for name in names[1:]:
            strip.elements.append(name)
        render = scene.render
        # The codec takes even numbers of pixels alone.
        render.resolution_x, render.resolution_y = (length - length % 2 for length in size)
        render.resolution_percentage, render.fps = 100, per_second
        scene.frame_start, scene.frame_end = 1, len(names)
        if not hasattr(strip, "duration"):  # before Blender 5.2 it does not follow its pictures
            strip.frame_final_duration = len(names)
        scene.view_settings.view_transform = "Standard"
        settings = render.image_settings
        if hasattr(settings, "media_type"):  # since Blender 5.0
            settings.media_type = "VIDEO"
        settings.file_format = "FFMPEG"
        render.ffmpeg.format, render.ffmpeg.codec = "MPEG4", "H264"
        render.ffmpeg.constant_rate_factor = "HIGH"
        render.use_file_extension = False
        render.filepath = str(video.resolve())
        bpy.ops.render.render(animation=True, scene=scene.name)
    finally:
        bpy.data.scenes.remove(scene)
    if not video.is_file():
        raise InputError(f"Blender did not write {video}")
