"""Films as videos: Blender's sequencer encodes the pictures, each one frame, whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.pages.png import write_png


def test_a_video_has_every_picture(bpy: Any, tmp_path: Path) -> None:
    from accelscope.addon.to_blender.video import encode

    names = []
    for number in range(5):
        names.append(f"film-{number:02}.png")
        image = np.zeros((61, 96, 3))
        image[..., number % 3] = 0.8
        write_png(tmp_path / names[-1], image)
    before = set(bpy.data.scenes.keys()), set(bpy.data.images.keys())
    encode(tmp_path, names, tmp_path / "film.mp4", 4)
    # Nothing of it stays in the user's file, but where every render ends.
    left = set(bpy.data.images.keys()) - {"Render Result"}
    assert (set(bpy.data.scenes.keys()), left) == before
    clip = bpy.data.movieclips.load(str(tmp_path / "film.mp4"))
    assert clip.frame_duration == 5
    assert tuple(clip.size) == (96, 60)
    assert clip.fps == pytest.approx(4.0)
    bpy.data.movieclips.remove(clip)


def test_a_folder_that_is_not_there_is_said(bpy: Any, tmp_path: Path) -> None:
    from accelscope.addon.to_blender.video import encode

    with pytest.raises(InputError, match="there is no picture"):
        encode(tmp_path, ["none.png"], tmp_path / "film.mp4", 4)
    assert not (tmp_path / "film.mp4").exists()
