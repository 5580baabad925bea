"""Lesson "beam_clipping": what is blue adds up to what the caption says, and hides what is grey."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.beam_clipping import Settings
from accelscope.core.lessons.beams import PAPER
from accelscope.core.lessons.lesson import Subject, build
from accelscope.core.probes.visible import MISS
from accelscope.core.progress import SILENT
from accelscope.core.scene.camera_rays import camera_rays
from accelscope.sample_scenes import make_sample


@functools.cache
def played(spec="room:open=true"):
    return lesson_named("beam_clipping").play(Subject(make_sample(spec)), Settings(), SILENT)


def test_the_areas_in_the_rows_are_those_of_the_pieces_and_add_up():
    play = played()
    pieces, area = play.node.pieces, play.node.beam.area
    assert (pieces.items[: play.taken] != MISS).all()
    assert (pieces.items[play.taken :] == MISS).all()
    for n in (0, 1, play.taken // 2, play.taken):
        rows = {row.label: row.text for row in play.picture(Settings(n)).rows}
        assert rows["Taken"] == f"{pieces.areas[:n].sum() / area:.4%}"
        assert abs(float(rows["Sum"]) - 1.0) < 1e-12
        assert rows["Pieces"] == f"{n} of {play.taken}"


def test_a_piece_never_hides_one_that_was_taken_before():
    """Rays to points of two pieces of one region of space: the earlier one is not behind."""
    play = played()
    node, tree = play.node, build(play.scene, "naive")
    rays = camera_rays(play.camera, 40, 30)
    hits, _ = tree.trace(rays)
    # Whatever a ray hits is what its piece sees, though nothing behind it was ever asked for.
    seen = set(node.pieces.items.tolist())
    assert set(hits.primitive.tolist()) <= seen


def test_the_picture_is_paper_where_nothing_is_taken_yet():
    play = played()
    (image,) = play.picture(Settings(0)).images
    np.testing.assert_allclose(image.pixels, PAPER, atol=1e-9)
    for n in (1, play.taken // 2):
        (image,) = play.picture(Settings(n)).images
        paper = (np.abs(image.pixels - PAPER) < 1e-9).all(axis=2).mean()
        free = play.node.pieces.areas[n:].sum() / play.node.beam.area
        assert abs(paper - free) < 0.05


def test_too_large_a_scene_is_refused():
    with pytest.raises(InputError, match="takes at most 3000 polygons, and suzanne has 15744"):
        played("suzanne:subdivisions=2")
