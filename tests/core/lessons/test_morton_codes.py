"""Lesson "morton_codes": cells and codes against counting, and order by refining."""

import numpy as np
import pytest
from accelscope.core.geometry.box_shape import box_segments
from accelscope.core.lessons.drawing import ORANGE


def interleaved(x, y, z, bits):
    """The bits of x, y and z in turn, as text."""
    digits = (f"{number:0{bits}b}" for number in (x, y, z))
    return " ".join("".join(triple) for triple in zip(*digits, strict=True))


@pytest.mark.parametrize("name", ["suzanne", "flat", "mess", "one"])
def test_codes_are_those_of_cells(lab, play_lesson, name):
    scene = lab.small_scene(name)
    played = play_lesson("morton_codes", scene)
    play, n = played.play, len(scene)
    boxes = scene.boxes()
    centroids = 0.5 * (boxes[:, :3] + boxes[:, 3:])
    low, size = centroids.min(axis=0), np.ptp(centroids, axis=0)
    slack = 1e-9 * np.abs(centroids).max()
    for k in (1, 2, 5, 10):
        codes = play.codes_at(k)
        assert (np.diff(codes) >= 0).all()
        # The order by more bits refines it.
        assert np.array_equal(codes >> 3, play.codes_at(k - 1))
        cells = play.cells(codes, k)
        assert (play.centroids >= cells[:, :3] - slack).all()
        assert (play.centroids <= cells[:, 3:] + slack).all()
        assert len(set(codes.tolist())) == int(played.row("Occupied", bits=k))
        for triangle in {0, n // 2, n - 1}:
            picture = played.picture(bits=k, triangle=triangle)
            texts = [mark.text for mark in picture.marks]
            numbers = [int(texts[axis].split(" = ")[1]) for axis in range(3)]
            for axis, number in enumerate(numbers):
                share = (play.centroids[triangle, axis] - low[axis]) / (size[axis] or 1.0)
                assert abs(number + 0.5 - share * 2**k) <= 0.5 + 1e-6
            code = interleaved(numbers[0], numbers[1], numbers[2], k)
            assert texts[3] == f"code = {code}"
            assert picture.caption.endswith(f"code {code}") or "drawn" in picture.caption
            orange = picture.segments[(picture.colours == ORANGE).all(axis=1)]
            assert np.array_equal(orange[:12], box_segments(cells[triangle : triangle + 1]))


def test_neighbours_have_their_codes_beside_them(play_lesson):
    played = play_lesson("morton_codes")
    first = [mark.text for mark in played.picture(bits=1).marks[4:]]
    assert first == [f"{code:03b}" for code in range(8)]
    second = [mark.text for mark in played.picture(bits=2).marks[4:]]
    assert second == sorted(second)
    assert {text[:3] for text in second} == {"000"}
    assert len(played.picture(bits=4).marks) == 4
